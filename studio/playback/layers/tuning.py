"""Tuning: settings of the layers over a motion, with their limits."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

from studio.playback.layers.regions import REGIONS

EVERYTHING = frozenset(REGIONS)
FACE_ONLY = frozenset({"mouth", "brows", "eyes", "face"})
UPPER_BODY = EVERYTHING - {"legs"}
MOUTH_ONLY = frozenset({"mouth"})

LIMITS: dict[str, tuple[float, float]] = {
    **dict.fromkeys(("expressiveness", *REGIONS), (0.0, 2.0)),
    "smoothing": (0.0, 0.3),
    "offset_ms": (-300.0, 300.0),
    "blinks": (0.0, 40.0),
    "darts": (0.0, 2.0),
    "breath": (0.0, 2.0),
    "sway": (0.0, 2.0),
    "seed": (0, 99),
}
"""Lowest and highest value of each number."""
GAIN_LIMITS, LIFT_LIMITS = (0.0, 4.0), (-1.0, 1.0)


@dataclass(frozen=True)
class ShapeTuning:
    """What is done to one blend shape: value x gain + lift, kept in 0..1.

    Args:
        name: the blend shape's, in any case.
        gain: 0 to 4.
        lift: -1 to 1.
    """

    name: str
    gain: float = 1.0
    lift: float = 0.0

    @property
    def neutral(self) -> bool:
        """Whether it changes nothing."""
        return self.gain == 1.0 and self.lift == 0.0


@dataclass(frozen=True)
class Tuning:
    """All layers over a motion; a new one changes nothing.

    Args:
        expressiveness: one dial for all strengths, 0 to 2.
        mouth, brows, eyes, face: strength of blend shapes by region, 0 to 2; blinks stay whole.
        head, torso, arms, hands, legs: how far bones swing about their mean, 0 to 2.
        smoothing: standard deviation of the smoothing in seconds, 0 to 0.3; closures stay sharp.
        offset_ms: how much later the motion comes against the sound, -300 to 300.
        shapes: gain and lift of single blend shapes.
        top_vowels: show no more than the two strongest vowels at a time.
        blinks: blinks added each minute, 0 to 40; 0 adds none.
        darts, breath, sway: size of eye darts, breath and idle sway, 0 to 2; 1 is life size.
        seed: which draw of blinks, darts and sway.
        moves: the regions that move; others are held still.
        left_out: the other regions are left out of the motion, for a program that moves them itself.
        lock_root: the avatar stays where it is.
        plant_feet: the feet stay where they are; the legs bend for it.
    """

    expressiveness: float = 1.0
    mouth: float = 1.0
    brows: float = 1.0
    eyes: float = 1.0
    face: float = 1.0
    head: float = 1.0
    torso: float = 1.0
    arms: float = 1.0
    hands: float = 1.0
    legs: float = 1.0
    smoothing: float = 0.0
    offset_ms: float = 0.0
    shapes: tuple[ShapeTuning, ...] = ()
    top_vowels: bool = False
    blinks: float = 0.0
    darts: float = 0.0
    breath: float = 0.0
    sway: float = 0.0
    seed: int = 0
    moves: frozenset[str] = EVERYTHING
    left_out: bool = False
    lock_root: bool = False
    plant_feet: bool = False

    @property
    def neutral(self) -> bool:
        """Whether it changes nothing; a seed or a way of leaving out alone does not."""
        return all(
            getattr(self, f.name) == f.default
            for f in fields(self)
            if f.name not in ("seed", "left_out", "shapes")
        ) and all(shape.neutral for shape in self.shapes)

    def changed(self, **values: Any) -> Tuning:
        """With other values."""
        return replace(self, **values)

    def strength(self, region: str) -> float:
        """The factor of a region, expressiveness included."""
        # One dial moves the regions by different shares: a mouth that is twice as strong cannot be read any
        # more.
        share = EXPRESSIVE[region]
        return float(getattr(self, region)) * (1.0 + share * (self.expressiveness - 1.0))

    def shape(self, name: str) -> ShapeTuning:
        """What is done to one blend shape."""
        low = name.lower()
        return next((one for one in self.shapes if one.name.lower() == low), ShapeTuning(name))

    def with_shape(self, shape: ShapeTuning) -> tuple[ShapeTuning, ...]:
        """The single shapes with one of them changed; one that changes nothing is not kept."""
        low = shape.name.lower()
        others = tuple(one for one in self.shapes if one.name.lower() != low)
        return others if shape.neutral else (*others, shape)


EXPRESSIVE: dict[str, float] = {
    "mouth": 0.5, "brows": 1.0, "eyes": 0.0, "face": 1.0,
    "head": 1.0, "torso": 1.0, "arms": 1.0, "hands": 0.5, "legs": 0.5,
}  # fmt: skip
"""How much of the expressiveness each region takes: speech stays readable, and eyes on the viewer."""
