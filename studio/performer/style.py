"""How one performer moves: the numbers that differ from person to person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Style:
    """A performer's own way; made from a number, so the same number is the same person.

    Args:
        seed: the number.
        mouth_gain: how far each of A, I, U, E, O opens, against the average (5).
        coarticulation: seconds over which a sound colours its neighbours.
        lag: seconds by which the face follows the sound; below zero, since lips take up a vowel before it is
            at its loudest. With these, mouth and voice of a take measure as aligned (motion.lag, to 15 ms).
        nod, tilt, turn: how much the head follows beats, melody and glances.
        beat: how much the arms follow beats.
        hands: chances of gesturing with none, the left, the right, or both in a sentence (4).
        sway: how much the body shifts when idle.
        lean: degrees the upper body leans forward.
        blink_interval: median seconds between blinks.
        blink_skew: seconds by which the left lid is later.
        expressiveness: how strongly moods show.
        head_roll: degrees the head is usually tilted.
    """

    seed: int
    mouth_gain: tuple[float, float, float, float, float]
    coarticulation: float
    lag: float
    nod: float
    tilt: float
    turn: float
    beat: float
    hands: tuple[float, float, float, float]
    sway: float
    lean: float
    blink_interval: float
    blink_skew: float
    expressiveness: float
    head_roll: float

    @classmethod
    def of(cls, performer: int) -> Style:
        """The style of a performer, by number."""
        rng = np.random.default_rng((performer, 301))
        gain = rng.uniform(0.85, 1.12, 5)
        handed = rng.uniform(0.55, 0.85)
        one = 0.5 * rng.uniform(0.8, 1.1)
        none = 0.12 * rng.uniform(0.5, 1.5)
        return cls(
            seed=performer,
            mouth_gain=(float(gain[0]), float(gain[1]), float(gain[2]), float(gain[3]), float(gain[4])),
            coarticulation=float(rng.uniform(0.038, 0.055)),
            lag=float(rng.uniform(-0.02, -0.01)),
            nod=float(rng.uniform(0.8, 1.3)),
            tilt=float(rng.uniform(0.7, 1.3)),
            turn=float(rng.uniform(0.7, 1.3)),
            beat=float(rng.uniform(0.8, 1.25)),
            hands=(none, one * (1 - handed), one * handed, 1 - none - one),
            sway=float(rng.uniform(0.8, 1.3)),
            lean=float(rng.uniform(0.0, 2.5)),
            blink_interval=float(rng.uniform(2.2, 3.2)),
            blink_skew=float(rng.uniform(-0.012, 0.012)),
            expressiveness=float(rng.uniform(0.8, 1.15)),
            head_roll=float(rng.uniform(-2.5, 2.5)),
        )
