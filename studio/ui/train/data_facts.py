"""What there is to train on, counted, with what is wrong about it in words. Pure: no Qt widgets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QCoreApplication

from studio.dataset.balance import ALL_TRAIN, shares_for
from studio.dataset.dataset import Dataset, Selection
from studio.take import Take
from studio.ui.widgets.timeline.time_view import minutes

LITTLE_SECONDS = 120.0


@dataclass(frozen=True)
class SplitFacts:
    """Takes and seconds of one use."""

    takes: int
    seconds: float


@dataclass(frozen=True)
class DataWarning:
    """Something that will make the result worse, or impossible.

    Args:
        text: one sentence.
        stops: training cannot begin.
        repair: "val" where one click can set a take aside for validation, else "".
    """

    text: str
    stops: bool = False
    repair: str = ""


@dataclass(frozen=True)
class DataFacts:
    """The data card.

    Args:
        train, val, test: what is used how.
        performers: how many are named.
        shapes, bones: channels found in the training takes.
        warnings: the gravest first.
    """

    train: SplitFacts
    val: SplitFacts
    test: SplitFacts
    performers: int
    shapes: int
    bones: int
    warnings: tuple[DataWarning, ...]

    @property
    def takes(self) -> int:
        """Takes used for anything."""
        return self.train.takes + self.val.takes + self.test.takes

    @property
    def seconds(self) -> float:
        """Their length together."""
        return self.train.seconds + self.val.seconds + self.test.seconds

    @property
    def can_train(self) -> bool:
        """Whether nothing stands in the way."""
        return not any(warning.stops for warning in self.warnings)


def data_facts(dataset: Dataset, takes: Sequence[Take]) -> DataFacts:
    """Count the selections by use and look for what a person should know before training."""
    by_id = {take.id: take for take in takes}
    used = [(s, by_id[s.take]) for s in dataset.selections if s.split and s.take in by_id]
    whole = [(s, take) for s, take in used if take.motion_path and take.audio_path]

    def of(split: str) -> SplitFacts:
        mine = [s.seconds(take.info.duration) for s, take in whole if s.split == split]
        return SplitFacts(len(mine), sum(mine))

    training = [take for s, take in whole if s.split == "train"]
    warnings = _warnings(used, of("train"), of("val"), training)
    if takes and not used and not any(take.motion_path and take.audio_path for take in takes):
        text = _tr("No take has both sound and motion, which training needs: record or import some.")
        warnings = [DataWarning(text, stops=True)]
    shapes = {name for take in training for name in take.info.shape_names}
    bones = {name for take in training for name in take.info.bone_names}
    return DataFacts(
        of("train"),
        of("val"),
        of("test"),
        len({s.performer for s, _ in used if s.performer}),
        len(shapes),
        len(bones),
        tuple(warnings),
    )


def one_for_validation(dataset: Dataset, takes: Sequence[Take]) -> str | None:
    """The selection best set aside for validation: unlocked, not the longest, near a sixth of the whole."""
    by_id = {take.id: take for take in takes}
    train = [s for s in dataset.of_split("train") if s.take in by_id and not s.locked]
    if len(train) < 2:
        return None
    lengths = {s.id: s.seconds(by_id[s.take].info.duration) for s in train}
    aim = sum(lengths.values()) / 6
    return min(lengths, key=lambda selection: abs(lengths[selection] - aim))


def _warnings(
    used: list[tuple[Selection, Take]], train: SplitFacts, val: SplitFacts, training: list[Take]
) -> list[DataWarning]:
    found = []
    if not used:
        return [DataWarning(_tr("No take is chosen yet: record or import some."), stops=True)]
    if not train.takes:
        found.append(DataWarning(_tr("No take is marked for training: mark some in Curate."), stops=True))
    for text, missing in (
        (_tr("Left out, without motion: {0}."), [t.id for _, t in used if not t.motion_path]),
        (_tr("Left out, without sound: {0}."), [t.id for _, t in used if not t.audio_path]),
    ):
        if missing:
            found.append(DataWarning(text.format(_listed(missing))))
    # Of little, training holds back the end of the longest take, and no take is spared.
    lengths = {take.id: 0.0 for take in training}
    for selection, take in used:
        if selection.split == "train" and take.id in lengths:
            lengths[take.id] += selection.seconds(take.info.duration)
    if train.takes and not val.takes and shares_for(lengths.values()) is not ALL_TRAIN:
        text = _tr("No validation take: the studio cannot tell which version is best.")
        found.append(DataWarning(text, repair="val"))
    if train.takes and train.seconds < LITTLE_SECONDS:
        text = _tr("Only {0} to learn from: two minutes or more give a livelier result.")
        found.append(DataWarning(text.format(minutes(train.seconds))))
    if len({(t.info.shape_names, t.info.bone_names) for t in training}) > 1:
        found.append(
            DataWarning(_tr("The takes differ in what was tracked: keep those of one tracker in Curate."))
        )
    return found


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:3])
    return shown if len(names) <= 3 else _tr("{0} and {1} more").format(shown, len(names) - 3)


def _tr(text: str) -> str:
    return QCoreApplication.translate("DataFacts", text)
