"""Gains that match the liveliness of each region to the capture on validation takes (no torch).

A network that errs least stands too still where sound says little, and one that is told to be lively may
tremble where the body only sways. A gain about the mean pose for each region of the body mends both. The face
is left as it is: how far it moves is a matter of style, and one take's gain would be wrong for the next.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.features.audio_spec import Floats
from studio.features.examples import Example
from studio.features.motion import FACE, Layout
from studio.metrics.scores import REGIONS, in_region
from studio.motion import rotation

CALMEST, LIVELIEST = 0.3, 3.0
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


def region_gains(
    predicted: Sequence[Floats],
    examples: Sequence[Example],
    layout: Layout,
    around: Sequence[Floats] | None = None,
) -> Floats:
    """What each column's deviation from the mean pose is to be multiplied by, (C,).

    For each region of the body the gain that gives it CALM times the captured motion (mean angle turned, or
    way of the hips, from frame to frame), but not more deviation than captured: a trembling tracker looks
    lively by motion alone. Within CALMEST and LIVELIEST; 1 for the face and where the takes say nothing.

    Args:
        predicted: scaled poses (T, C) of each example, gains not applied.
        examples: takes not learnt from.
        layout: their columns.
        around: expected poses (T, C), where the gain is of how far predicted ones are from them: what these
            move of themselves, and what chance adds to it, go together as squares.
    """
    gains, of = np.ones(layout.width, dtype=np.float32), regions(layout)
    for region in sorted(set(of.tolist()) - {"face"}):
        chosen = np.flatnonzero(of == region)
        found = _total(predicted, examples, layout, chosen)
        captured = _total([e.values for e in examples], examples, layout, chosen)
        target = captured * [CALM, 1.0]
        if around is not None:
            still = _total(around, examples, layout, chosen)
            found, target = _beside(found, still), _beside(target, still)
        if min(*found, *captured) > _TINY:
            widest = max(1.0, target[1] / found[1])
            gains[chosen] = np.clip(min(target[0] / found[0], widest), CALMEST, LIVELIEST)
    return gains


def _beside(whole: NDArray[np.float64], part: NDArray[np.float64]) -> NDArray[np.float64]:
    """What has to come beside a part to make a whole."""
    return np.sqrt(np.maximum(np.square(whole) - np.square(part), 0.0))


def _total(
    poses: Sequence[Floats], examples: Sequence[Example], layout: Layout, chosen: NDArray[np.int64]
) -> NDArray[np.float64]:
    """How far the columns of a region move and deviate over some takes, (2,)."""
    pairs = zip(poses, examples, strict=True)
    moved, squares = np.sum([_liveliness(p, e, layout, chosen) for p, e in pairs], axis=0)
    return np.array([moved, np.sqrt(squares)])


def _liveliness(
    poses: Floats, example: Example, layout: Layout, chosen: NDArray[np.int64]
) -> NDArray[np.float64]:
    """How far the columns of a region move and how wide they are, sums over the frames that count."""
    counts = (example.grid.valid[:, None] * example.mask[None])[:, chosen]
    values = layout.natural(poses)[:, chosen]
    both = counts[1:] * counts[:-1]
    if len(chosen) % 6:  # the hips' place
        moved = np.abs(np.diff(values, axis=0))
    else:
        turns = rotation.from_6d(values.reshape(len(values), -1, 6))
        moved, both = rotation.angle_between(turns[:-1], turns[1:]), both[:, ::6]
    mean = (values * counts).sum(axis=0) / np.maximum(counts.sum(axis=0), 1)
    return np.array([(moved * both).sum(), np.square((values - mean) * counts).sum()])
