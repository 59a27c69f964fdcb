"""Where crops are cut: chance that follows from the seed and the epoch alone (no torch)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from studio.features.examples import Example
from studio.training.recipe import TrainingSettings

Pick = tuple[int, int]
"""An example's index and the first frame of the crop."""


def steps_per_epoch(settings: TrainingSettings, examples: Sequence[Example]) -> int:
    """Optimiser steps in an epoch; one pass over all frames where the recipe says 0."""
    if settings.steps:
        return settings.steps
    pieces = sum(math.ceil(e.frames / settings.crop_frames) for e in examples)
    return max(1, math.ceil(pieces / settings.crops))


def picks(
    settings: TrainingSettings, examples: Sequence[Example], rng: np.random.Generator
) -> list[list[Pick]]:
    """The crops of each step of an epoch."""
    steps = steps_per_epoch(settings, examples)
    if settings.steps:
        return _anywhere(settings, examples, steps, rng)
    return _one_pass(settings, examples, steps, rng)


def _anywhere(
    settings: TrainingSettings, examples: Sequence[Example], steps: int, rng: np.random.Generator
) -> list[list[Pick]]:
    """Crops from anywhere, long takes more often."""
    frames = np.array([example.frames for example in examples], dtype=np.float64)
    takes = rng.choice(len(frames), size=(steps, settings.crops), p=frames / frames.sum())
    spans = np.maximum(frames[takes] - settings.crop_frames + 1, 1)
    firsts = (rng.random(takes.shape) * spans).astype(int)
    both = np.stack([takes, firsts], axis=-1).tolist()
    return [[(take, first) for take, first in step] for step in both]


def _one_pass(
    settings: TrainingSettings, examples: Sequence[Example], steps: int, rng: np.random.Generator
) -> list[list[Pick]]:
    """Every frame once, cut at a different place every epoch; a last odd step is filled up."""
    length, crops = settings.crop_frames, settings.crops
    places = [
        (i, first)
        for i, example in enumerate(examples)
        for first in range(-int(rng.integers(0, length)), example.frames, length)
    ]
    shuffled = [places[i] for i in rng.permutation(len(places))]
    shuffled += shuffled[: max(0, steps * crops - len(shuffled))]
    return [shuffled[step * crops : (step + 1) * crops] or shuffled[:crops] for step in range(steps)]
