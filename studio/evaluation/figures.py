"""Evaluation of predictions on takes: figures for each take and for all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from studio.dataset.material import TrainingMaterial
from studio.features.examples import learnt_rate, on_grid
from studio.metrics import scores
from studio.metrics.body import place_figures
from studio.metrics.face import face_figures
from studio.metrics.scores import Figures, Pair
from studio.metrics.spread import spread_figures
from studio.motion import Motion
from studio.sound.sound_file import Sound

MOST_FPS = 30.0

Predict = Callable[[TrainingMaterial], Motion]


@dataclass(frozen=True)
class Evaluation:
    """Figures over all takes, for each of them, and the geodesic error of each bone in degrees."""

    metrics: Figures
    per_take: dict[str, Figures]
    per_bone: dict[str, float] = field(default_factory=dict)
    frames: int = 0


def evaluate(predict: Predict, takes: Sequence[TrainingMaterial]) -> Evaluation:
    """Hold what `predict` gives for the sound of each take against its captured motion.

    Both are compared on even frames at the captured frame rate, or a whole fraction of it not above
    MOST_FPS: so runs learnt at different rates are compared alike, and jerk is not that of interpolation.

    Args:
        predict: material to Motion, times from its in point.
        takes: with sound and motion.
    """
    pairs = {material.selection.id: pair(predict(material), material) for material in takes}
    everything = list(pairs.values())
    return Evaluation(
        full(everything),
        {take: full([one]) for take, one in pairs.items()},
        scores.geodesic_by_bone(everything),
        sum(len(one.truth) for one in everything),
    )


def full(pairs: Sequence[Pair]) -> Figures:
    """Every figure there is over some takes; None where one does not apply."""
    return scores.score(pairs) | face_figures(pairs) | place_figures(pairs) | spread_figures(pairs)


def pair(predicted: Motion, material: TrainingMaterial) -> Pair:
    """A prediction and its captured motion on the same frames."""
    fps = learnt_rate(material.motion.fps, MOST_FPS)
    grid = on_grid(material.motion, len(material.samples) / material.sample_rate, fps, material.excluded)
    sound = Sound(material.samples[:, None], material.sample_rate)
    return Pair(grid.motion, predicted.at(grid.motion.times), grid.valid, sound)
