"""What a run is measured on, the takes of a split or those named, how, and the baselines it must beat."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.dataset.material import TrainingMaterial
from studio.errors import RequestError, counted, say
from studio.features import motion as columns
from studio.features.audio_spec import AudioSpec, Floats
from studio.features.examples import Example, cached_rows, make_example
from studio.features.motion import Layout
from studio.metrics import scores
from studio.metrics.comparison import all_figures, pair_on_frames
from studio.metrics.scores import Figures, Pair
from studio.motion import Motion
from studio.motion.grid import Grid, on_grid
from studio.motion.lag import speech_level
from studio.project import Project

Predict = Callable[[TrainingMaterial], Motion]

_TO_VAL = "No take is marked as test; measured on the validation takes, which also chose the best epoch."


@dataclass(frozen=True)
class EvaluationSet:
    """What is measured on: material, its split, ids, and the ids that were trained on."""

    material: list[TrainingMaterial]
    split: str

    @property
    def takes(self) -> list[str]:
        """Ids of the selections."""
        return [material.selection.id for material in self.material]

    def words(self, frames: int) -> str:
        """What a table's title says of it."""
        return f"{', '.join(self.takes)} ({self.split}), {counted(frames, 'frame')}"


def choose_evaluation_set(
    project: Project, takes: list[str] | None, split: str, note: Callable[[str], None]
) -> EvaluationSet:
    """The takes to measure on; where the test split is empty, validation, and it is said.

    Args:
        project: the open project.
        takes: ids of takes or selections; all of the split where None.
        split: train, val or test.
        note: hears what a person should know of the choice.

    Raises:
        RequestError: a take is not known or not selected, or nothing can be measured on.
    """
    from studio.features.audio_spec import AudioSpec
    from studio.training.gather import load_usable

    if takes:
        named = [(s, t) for s, t in project.selected() if s.id in takes or s.take in takes]
        for name in takes:
            if not any(name in (s.id, s.take) for s, _ in named):
                project.take(name)
                raise RequestError(
                    say("{name} is not selected for anything.", name=name), "Add it to the dataset first."
                )
        # What was named may be of several splits; the table then says so instead of guessing.
        splits = {s.split for s, _ in named}
        label = splits.pop() if len(splits) == 1 else "mixed"
    else:
        named, label = list(project.selected(split)), split
        if not named and split == "test":
            named, label = list(project.selected("val")), "val"
            if named:
                note(_TO_VAL)
    # At the default rate: each model resamples for itself, so that one set serves all runs compared.
    material, notes = load_usable(named, AudioSpec())
    for found in notes:
        note(found)
    if not material:
        what = say("No take in the split {split} has both sound and motion.", split=split)
        if takes:
            what = say("No take in the takes named has both sound and motion.")
        raise RequestError(what, "Mark takes as test in Curate, or name some with --takes.")
    return EvaluationSet(material, label)


@dataclass(frozen=True)
class Evaluation:
    """Figures over all takes, for each of them, and the geodesic error of each bone in degrees."""

    metrics: Figures
    per_take: dict[str, Figures]
    per_bone: dict[str, float] = field(default_factory=dict)
    frames: int = 0


def evaluate(predict: Predict, takes: Sequence[TrainingMaterial]) -> Evaluation:
    """Hold what `predict` gives for the sound of each take against its captured motion.

    Args:
        predict: material to Motion, times from its in point.
        takes: with sound and motion.
    """
    pairs = {material.selection.id: pair(predict(material), material) for material in takes}
    everything = list(pairs.values())
    return Evaluation(
        all_figures(everything),
        {take: all_figures([one]) for take, one in pairs.items()},
        scores.geodesic_by_bone(everything),
        sum(len(one.truth) for one in everything),
    )


def pair(predicted: Motion, material: TrainingMaterial) -> Pair:
    """A prediction and its captured motion on the same frames."""
    duration = len(material.samples) / material.sample_rate
    voice = speech_level(material.samples, material.sample_rate)
    return pair_on_frames(predicted, material.motion, duration, material.excluded, voice)


REACH = 16
"""Frames of MFCC to either side that ridge regression sees."""
STRENGTHS = (1e-4, 1e-3, 1e-2, 1e-1)
"""Candidates for the ridge penalty as a share of the frames; chosen on the last fifth of the training."""
RIDGE_SOUND = AudioSpec(
    kind="mfcc", bands=64, coefficients=39, window_ms=40.0, steps_per_frame=1, window=2 * REACH + 1
)

Array = NDArray[np.floating]


class Baselines:
    """Baselines fitted to the same training takes as a model.

    Args:
        train: the material it was trained on.
        fps: the frame rate it was learnt at.
        cache: folder of kept features.
        on_take: told the id of each training take before it is read.
    """

    names = ("zero", "train_mean", "ridge")

    def __init__(
        self,
        train: Sequence[TrainingMaterial],
        fps: Fraction,
        cache: Path | None,
        on_take: Callable[[str], None] = lambda take: None,
    ) -> None:
        self.fps, self.cache = fps, cache
        grids = {m.selection.id: _grid(m, fps) for m in train}
        counting = [g.motion.at(g.motion.times[g.valid > 0]) for g in grids.values() if g.valid.any()]
        self.layout: Layout = columns.fit(counting, "group")
        self.examples: list[Example] = []
        for m in train:
            name = m.selection.id
            on_take(name)
            self.examples.append(
                make_example(name, m.samples, grids[name], self.layout, RIDGE_SOUND, fps, cache)
            )
        self.ridge = _Ridge(self.examples)

    def predict(self, name: str, material: TrainingMaterial) -> Motion:
        """The motion a baseline gives for some material, at the learnt frame rate.

        "zero" is shapes at 0 and bones at rest (T-pose), "train_mean" the mean pose of the training takes.
        """
        # One more, since the last frame may begin after the last whole one.
        frames = int(np.ceil(len(material.samples) / material.sample_rate * float(self.fps))) + 1
        times = np.arange(frames) * self.fps.denominator / self.fps.numerator
        if name == "zero":
            return Motion.build(times, self.layout.shape_names, None, self.layout.bone_names)
        if name == "train_mean":
            return self.layout.motion(np.tile(self.layout.scaled_mean, (frames, 1)), times)
        sound = cached_rows(material.samples, RIDGE_SOUND, self.fps, -REACH, frames + 2 * REACH, self.cache)
        return self.layout.motion(self.ridge.predict(_stacked(sound, frames)), times)


class _Ridge:
    """B = argmin |X B - Y|^2 + penalty |B|^2 on standardised X; columns some takes lack use the others.

    Source: Hoerl and Kennard 1970.
    """

    def __init__(self, examples: Sequence[Example]) -> None:
        x = [_stacked(e.rows(-REACH, e.frames + 2 * REACH), e.frames) for e in examples]
        everything = np.concatenate(x)
        self.mean, self.deviation = everything.mean(axis=0), np.maximum(everything.std(axis=0), 1e-6)
        width = len(examples[0].mask)
        self.weights = np.zeros((everything.shape[1], width))
        self.bias = np.zeros(width)
        masks = np.stack([e.mask for e in examples])
        for pattern in {tuple(column) for column in masks.T.tolist()}:
            chosen = np.flatnonzero((np.array(pattern) == masks.T).all(axis=1))
            having = [i for i, has in enumerate(pattern) if has]
            if not having:
                continue
            valid = [examples[i].grid.valid > 0 for i in having]
            rows = np.concatenate([x[i][v] for i, v in zip(having, valid, strict=True)])
            values = np.concatenate(
                [examples[i].values[v][:, chosen] for i, v in zip(having, valid, strict=True)]
            ).astype(np.float64)
            scaled = (rows - self.mean) / self.deviation
            self.bias[chosen] = values.mean(axis=0)
            self.weights[:, chosen] = _solve(scaled, values - self.bias[chosen])

    def predict(self, x: Floats) -> Array:
        return ((x - self.mean) / self.deviation) @ self.weights + self.bias


def _solve(x: Array, y: Array) -> Array:
    cut = max(1, int(0.8 * len(x)))
    head, tail = slice(0, cut), slice(cut, None)
    best = STRENGTHS[0]
    if len(x) - cut > 1:
        square, cross = x[head].T @ x[head], x[head].T @ y[head]
        errors = [
            float(np.square(x[tail] @ _ridge(square, cross, s * cut) - y[tail]).mean()) for s in STRENGTHS
        ]
        best = STRENGTHS[int(np.argmin(errors))]
    return _ridge(x.T @ x, x.T @ y, best * len(x))


def _ridge(square: Array, cross: Array, penalty: float) -> Array:
    return np.linalg.solve(square + penalty * np.eye(len(square)), cross)


def _stacked(sound: Floats, frames: int) -> Floats:
    """Rows (T + 2 REACH, F) as (T, (2 REACH + 1) F): each frame's with its neighbours'."""
    near = np.lib.stride_tricks.sliding_window_view(sound[: frames + 2 * REACH], 2 * REACH + 1, axis=0)
    return np.ascontiguousarray(near.transpose(0, 2, 1)).reshape(frames, -1)


def _grid(material: TrainingMaterial, fps: Fraction) -> Grid:
    return on_grid(material.motion, len(material.samples) / material.sample_rate, fps, material.excluded)
