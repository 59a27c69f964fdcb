"""What one row of the library says: a selection with its take and its grade. Pure: no Qt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from studio.dataset.dataset import Dataset, Selection
from studio.take.take import Take

if TYPE_CHECKING:
    from studio.take.check import Report

GRADES = ("A", "B", "C", "D")
COLUMNS = ("take", "length", "stars", "split", "grade", "performer", "emotion", "tags", "note")


@dataclass(frozen=True)
class TakeRow:
    """One selection as the library shows it.

    Args:
        selection: what is used of the take, and how.
        take: the recording; None where its folder is missing.
        report: its check; None until it was made.
    """

    selection: Selection
    take: Take | None
    report: Report | None = None

    @property
    def id(self) -> str:
        """The selection's id."""
        return self.selection.id

    @property
    def span(self) -> tuple[float, float]:
        """In and out points in seconds."""
        return self.selection.span(self.take.info.duration if self.take else 0.0)

    @property
    def seconds(self) -> float:
        """Seconds that are used: from in to out without what is excluded."""
        return self.selection.seconds(self.take.info.duration if self.take else 0.0)

    @property
    def grade(self) -> str:
        """ "A" to "D", or "" where it is not known yet."""
        return self.report.grade if self.report else ""

    @property
    def reason(self) -> str:
        """Why the grade is not better, in one sentence; "" where there is nothing to say."""
        return self.report.reason if self.report and self.report.grade != "A" else ""

    @property
    def troubled(self) -> bool:
        """Whether it wants a look: the take is missing, or its check found something that matters."""
        return self.take is None or self.grade in ("C", "D")

    def text(self) -> str:
        """Everything a search looks through, in lower case."""
        s = self.selection
        labels = " ".join(label.text for label in s.labels)
        words = (s.id, s.performer, s.emotion, *s.tags, s.note, labels, s.split, self.reason, self._heard_of)
        return " ".join(words).lower()

    @property
    def _heard_of(self) -> str:
        """What the take itself tells: its slate, where it comes from, and what was noticed then."""
        info = self.take.info if self.take else None
        return " ".join((info.slate, info.source, *info.notes)) if info else ""

    def sort_key(self, column: str) -> tuple[float, str]:
        """Sorts rows by a column; equal ones by name."""
        s = self.selection
        number = {
            "length": self.seconds,
            "stars": -float(s.stars),
            "split": float(("train", "val", "test", "").index(s.split)),
            "grade": float(GRADES.index(self.grade)) if self.grade in GRADES else 9.0,
        }.get(column, 0.0)
        words = {"performer": s.performer, "emotion": s.emotion, "tags": ", ".join(s.tags), "note": s.note}
        word = words.get(column, "")
        # Empty words go to the end: what is filled in is what one sorts for.
        return number, f"{word.lower() or '￿'}\0{s.id.lower()}"


def rows_of(
    dataset: Dataset, takes: Mapping[str, Take], reports: Mapping[str, Report]
) -> tuple[TakeRow, ...]:
    """All rows in the dataset's order.

    Args:
        takes: by take id.
        reports: checks by take id, those that were made.
    """
    return tuple(TakeRow(s, takes.get(s.take), reports.get(s.take)) for s in dataset.selections)
