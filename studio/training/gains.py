"""How lively each region comes out, matched to the capture on the validation takes (no torch).

A network that errs least stands too still where sound says little, and one that is told to be lively may
tremble where the body only sways. A gain about the mean pose for each region of the body mends both. The face
is left as it is: how far it moves is a matter of style, and one take's gain would be wrong for the next.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.features.audio import Floats
from studio.features.examples import Example
from studio.features.motion import FACE, Layout
from studio.training.metrics import REGIONS, in_region

CALMEST, LIVELIEST = 0.3, 2.5
"""No region's motion is scaled further than this: what is more wrong than that, a gain cannot mend."""
CALM = 0.95
"""Share of the captured motion aimed at: of two gains as far from the truth, the lower errs less."""
_TINY = 1e-12


def regions(layout: Layout) -> NDArray[np.str_]:
    """The region each column belongs to, (C,): "face", "head", "torso", "arms", "rest" or "hips"."""
    found = ["face"] * int((layout.groups == FACE).sum())
    for bone in layout.learnt_bones:
        name = layout.bone_names[bone]
        found += [next((r for r in REGIONS if in_region(name, r)), "rest")] * 6
    return np.array(found + ["hips"] * (layout.width - len(found)))


def region_gains(predicted: Sequence[Floats], examples: Sequence[Example], layout: Layout) -> Floats:
    """What each column's deviation from the mean pose is to be multiplied by, (C,).

    For each region of the body the gain that gives it CALM times the captured motion, mean |t_i - t_{i-1}|
    over mean |p_i - p_{i-1}| (lengths over a bone's columns, which is the angle it turns), but not more
    deviation than captured: a trembling tracker looks lively by motion alone. Within CALMEST and LIVELIEST;
    1 for the face and where the takes say nothing.

    Args:
        predicted: scaled poses (T, C) of each example, gains not applied.
        examples: takes not learnt from.
        layout: their columns.
    """
    pairs = list(zip(predicted, examples, strict=True))
    gains, of = np.ones(layout.width, dtype=np.float32), regions(layout)
    for region in sorted(set(of.tolist()) - {"face"}):
        chosen = np.flatnonzero(of == region)
        parts = chosen.reshape(-1, 3 if region == "hips" else 6)  # what moves as one
        motion, spread = np.sum([_liveliness(poses, example, parts) for poses, example in pairs], axis=0)
        moved, spreads = np.sum([_liveliness(e.values, e, parts) for _, e in pairs], axis=0)
        if min(motion, spread, moved, spreads) > _TINY:
            widest = max(1.0, float(np.sqrt(spreads / spread)))
            gains[chosen] = np.clip(min(CALM * moved / motion, widest), CALMEST, LIVELIEST)
    return gains


def _liveliness(poses: Floats, example: Example, parts: NDArray[np.int64]) -> NDArray[np.float64]:
    """How far the parts (P, columns) of a region move and how wide they are, sums over frames that count."""
    counts = (example.grid.valid[:, None] * example.mask[None])[:, parts]
    values = poses[:, parts].astype(np.float64) * counts
    change = np.diff(values, axis=0) * counts[1:] * counts[:-1]
    mean = values.sum(axis=0) / np.maximum(counts.sum(axis=0), 1)
    spread = np.square((values - mean) * counts).sum()
    return np.array([np.linalg.norm(change, axis=-1).sum(), spread])
