"""The choices made about takes: in and out points, offsets, labels, split. All values are frozen."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

SPLITS = ("train", "val", "test", "")
"""What a selection is used for; "" is not used."""


@dataclass(frozen=True)
class Label:
    """A marked span of a take.

    Args:
        t: seconds on the take's clock.
        duration: seconds; 0 marks a moment.
        tier: "sentence", "emotion", "gesture", "vowel", "problem" or any other.
        text: what it says.
    """

    t: float
    duration: float
    tier: str
    text: str


@dataclass(frozen=True)
class Selection:
    """What is used of one take, and how.

    Args:
        id: unique in the dataset; the take's id, or that and a part ("Hello_003.2") after a split.
        take: id of the take.
        in_point: seconds on the take's clock where the use begins.
        out_point: where it ends; None is the end of the take.
        offset: seconds by which motion is moved later against the sound.
        excluded: (start, end) spans left out, seconds.
        labels: marks, by time.
        split: one of SPLITS; a new take with both sound and motion trains, any other is not used. With no val
            take training/gather.py holds back an end.
        performer: who it is; also the style a model may learn.
        emotion: how the whole of it is played; a label of the tier "emotion" says it for a span.
        tags, stars, note: for finding it again.
        locked: a test take that stays a test take.
        clean: how its sound is cleaned before it is heard and learnt from: "" as recorded, "noise" with less
            noise, "voice" the voice alone; see take/cleaned.py.
    """

    id: str
    take: str
    in_point: float = 0.0
    out_point: float | None = None
    offset: float = 0.0
    excluded: tuple[tuple[float, float], ...] = ()
    labels: tuple[Label, ...] = ()
    split: str = "train"
    performer: str = ""
    emotion: str = ""
    tags: tuple[str, ...] = ()
    stars: int = 0
    note: str = ""
    locked: bool = False
    clean: str = ""

    def span(self, duration: float) -> tuple[float, float]:
        """In and out points in seconds inside a recording of this duration."""
        end = duration if self.out_point is None else min(self.out_point, duration)
        return min(max(self.in_point, 0.0), end), end

    def seconds(self, duration: float) -> float:
        """Seconds used of a recording of this duration: from in to out without what is excluded."""
        start, end = self.span(duration)
        return max(end - start - overlap(self.excluded, start, end), 0.0)


def overlap(spans: Iterable[tuple[float, float]], start: float, end: float) -> float:
    """Seconds of start..end that spans cover, which do not overlap one another."""
    return sum(max(min(b, end) - max(a, start), 0.0) for a, b in spans)


@dataclass(frozen=True)
class Dataset:
    """All choices of a project.

    Args:
        selections: in the order shown.
        found: files of takes that were missing and put back, as paths inside the project; undo takes them
            away again.
    """

    selections: tuple[Selection, ...] = ()
    found: tuple[str, ...] = ()

    def __getitem__(self, selection_id: str) -> Selection:
        """The selection with this id; KeyError where there is none."""
        for selection in self.selections:
            if selection.id == selection_id:
                return selection
        raise KeyError(selection_id)

    def __contains__(self, selection_id: object) -> bool:
        return any(selection.id == selection_id for selection in self.selections)

    def of_split(self, split: str) -> tuple[Selection, ...]:
        """The selections used as "train", "val" or "test"."""
        return tuple(selection for selection in self.selections if selection.split == split)
