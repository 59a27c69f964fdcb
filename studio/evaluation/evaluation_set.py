"""What a run is measured on, the takes of a split or those that somebody named, and how it is measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from studio.dataset.material import TrainingMaterial
from studio.errors import RequestError
from studio.metrics import scores
from studio.metrics.comparison import all_figures, pair_on_frames
from studio.metrics.scores import Figures, Pair
from studio.motion import Motion
from studio.motion.lag import speech_level
from studio.project import Project

Predict = Callable[[TrainingMaterial], Motion]

_TO_VAL = "No take is marked as test; measured on the validation takes, which chose the best epoch."


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
        return f"{', '.join(self.takes)} ({self.split}), {frames} frames"


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
                raise RequestError(f"{name} is not selected for anything.", "Add it to the dataset first.")
        splits = {s.split for s, _ in named}
        label = splits.pop() if len(splits) == 1 else "mixed"
    else:
        named, label = list(project.selected(split)), split
        if not named and split == "test":
            named, label = list(project.selected("val")), "val"
            if named:
                note(_TO_VAL)
    material, notes = load_usable(named, AudioSpec())
    for found in notes:
        note(found)
    if not material:
        where = f"the split {split}" if not takes else "the takes named"
        raise RequestError(
            f"There is no take with sound and motion in {where}.",
            "Mark takes as test in Curate, or name some with --takes.",
        )
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
