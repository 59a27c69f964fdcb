"""How lively each region comes out, matched to the capture on the validation takes (no torch).

A network that errs least stands too still where sound says little, and one that is told to be lively may
tremble where the body only sways. A gain about the mean pose for each region mends both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.features.audio import Floats
from studio.features.examples import Example
from studio.features.motion import FACE, Layout
from studio.training.metrics import REGIONS, in_region

CALMEST, LIVELIEST = 0.3, 1.6
"""No region's motion is scaled further than this: what is more wrong than that, a gain cannot mend."""
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

    For each region the gain that gives its columns the captured motion, mean |t_i - t_{i-1}| over mean
    |p_i - p_{i-1}|, but not more deviation than captured; within CALMEST and LIVELIEST, 1 where the takes
    say nothing of it. The deviation's word counts because a trembling tracker looks lively by motion alone.

    Args:
        predicted: scaled poses (T, C) of each example, gains not applied.
        examples: takes not learnt from.
        layout: their columns.
    """
    pairs = list(zip(predicted, examples, strict=True))
    own = np.array([_liveliness(poses, example) for poses, example in pairs]).sum(axis=0)
    captured = np.array([_liveliness(example.values, example) for _, example in pairs]).sum(axis=0)
    gains, of = np.ones(layout.width, dtype=np.float32), regions(layout)
    for region in np.unique(of):
        chosen = of == region
        (motion, spread), (moved, spreads) = own[:, chosen].sum(axis=1), captured[:, chosen].sum(axis=1)
        if min(motion, spread, moved, spreads) > _TINY:
            widest = max(1.0, float(np.sqrt(spreads / spread)))
            gains[chosen] = np.clip(min(moved / motion, widest), CALMEST, LIVELIEST)
    return gains


def _liveliness(poses: Floats, example: Example) -> NDArray[np.float64]:
    """Sums over the frames that count of |change| and of squared deviation, (2, C)."""
    counts = example.grid.valid[:, None] * example.mask[None]
    motion = (np.abs(np.diff(poses, axis=0)) * counts[1:] * counts[:-1]).sum(axis=0, dtype=np.float64)
    mean = (poses * counts).sum(axis=0) / np.maximum(counts.sum(axis=0), 1)
    spread = (np.square(poses - mean) * counts).sum(axis=0, dtype=np.float64)
    return np.stack([motion, spread])
