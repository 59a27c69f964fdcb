"""The library as a Qt model: a row is a selection with its take and grade; a filter stands in front of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QSortFilterProxyModel,
    Qt,
    Signal,
)

from studio.dataset.dataset import Dataset, Selection
from studio.take.take import Take
from studio.ui.language import native, sentences
from studio.ui.widgets.timeline.time_view import clock

if TYPE_CHECKING:
    from studio.take.check import Report

GRADES = ("A", "B", "C", "D")
COLUMNS = ("take", "length", "stars", "split", "grade", "performer", "emotion", "tags", "note")

Index = QModelIndex | QPersistentModelIndex
ROW_ROLE = Qt.ItemDataRole.UserRole + 1
MISSING_ROLE = Qt.ItemDataRole.UserRole + 2
"""Whether a file of the take, or all of it, is missing."""
EDITABLE = frozenset({"performer", "emotion", "tags", "note"})
_NOWHERE = QModelIndex()


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
        return native(self.report.reason) if self.report and self.report.grade != "A" else ""

    @property
    def troubled(self) -> bool:
        """Whether it needs attention: the take is missing, or its check found something that matters."""
        return self.take is None or self.grade in ("C", "D")

    def text(self) -> str:
        """Everything a search looks through, in lower case."""
        s = self.selection
        labels = " ".join(label.text for label in s.labels)
        words = (
            s.id,
            s.performer,
            s.emotion,
            *s.tags,
            s.note,
            labels,
            s.split,
            native(self.reason),
            self._origin,
        )
        return " ".join(words).lower()

    @property
    def _origin(self) -> str:
        """What the take itself tells: its slate, where it comes from, and what was noticed then."""
        info = self.take.info if self.take else None
        return " ".join((info.slate, info.source, *info.notes)) if info else ""

    def sort_key(self, column: str) -> tuple[float, str]:
        """Sorts rows by a column; equal ones by name."""
        s = self.selection
        number = {
            "length": self.seconds,
            # The most stars first: whoever sorts by them looks for the best.
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


class TakeTable(QAbstractTableModel):
    """Rows of the library; only rows that changed are repainted.

    Signals:
        text_edited: (selection id, column, text) typed into a cell.
    """

    text_edited = Signal(str, str, str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._rows: tuple[TakeRow, ...] = ()
        self._places: dict[str, int] = {}
        self._missing: Mapping[str, tuple[str, ...]] = {}

    def set_rows(self, rows: Sequence[TakeRow]) -> bool:
        """Show these rows; whether the whole table was renewed (selections in views are lost then)."""
        new = tuple(rows)
        if [row.id for row in new] == [row.id for row in self._rows]:
            changed = [i for i, (a, b) in enumerate(zip(self._rows, new, strict=True)) if a != b]
            self._rows = new
            for i in changed:
                self.dataChanged.emit(self.index(i, 0), self.index(i, len(COLUMNS) - 1))
            return False
        self.beginResetModel()
        self._rows = new
        self._places = {row.id: i for i, row in enumerate(new)}
        self.endResetModel()
        return True

    def set_missing(self, missing: Mapping[str, tuple[str, ...]]) -> None:
        """Names of missing files by take id; a name is empty where the take's folder is missing."""
        if missing != self._missing:
            self._missing = missing
            if self._rows:
                self.dataChanged.emit(self.index(0, 0), self.index(len(self._rows) - 1, len(COLUMNS) - 1))

    def is_missing(self, row: TakeRow) -> bool:
        """Whether anything of a row's take is not there."""
        return row.take is None or row.selection.take in self._missing

    @property
    def rows(self) -> tuple[TakeRow, ...]:
        """All rows in the dataset's order."""
        return self._rows

    def index_of(self, selection_id: str) -> QModelIndex:
        """The first cell of a selection's row; invalid where there is none."""
        place = self._places.get(selection_id)
        return QModelIndex() if place is None else self.index(place, 0)

    def rowCount(self, parent: Index = _NOWHERE) -> int:
        """How many selections there are."""
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: Index = _NOWHERE) -> int:
        """How many columns there are."""
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """The columns' titles."""
        if orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.DisplayRole:
            return self._titles()[section]
        if orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.ToolTipRole:
            return self._told()[COLUMNS[section]]
        if role == Qt.ItemDataRole.TextAlignmentRole:
            right = COLUMNS[section] == "length" and orientation == Qt.Orientation.Horizontal
            side = Qt.AlignmentFlag.AlignRight if right else Qt.AlignmentFlag.AlignLeft
            return side | Qt.AlignmentFlag.AlignVCenter
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Texts, tips and the whole row (ROW_ROLE) for the delegate."""
        row, column = self._rows[index.row()], COLUMNS[index.column()]
        if role == ROW_ROLE:
            return row
        if role == MISSING_ROLE:
            return self.is_missing(row)
        if role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.EditRole):
            return self._text(row, column)
        if role == Qt.ItemDataRole.AccessibleTextRole:
            return f"{self._titles()[index.column()]}: {self._text(row, column)}"
        if role == Qt.ItemDataRole.ToolTipRole:
            return self._tip(row, column)
        if role == Qt.ItemDataRole.TextAlignmentRole and column == "length":
            return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        return None

    def flags(self, index: Index) -> Qt.ItemFlag:
        """Words can be typed over."""
        flags = super().flags(index)
        if index.isValid() and COLUMNS[index.column()] in EDITABLE:
            flags |= Qt.ItemFlag.ItemIsEditable
        return flags

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Report what was typed; the row changes when the choice was made."""
        row, column = self._rows[index.row()], COLUMNS[index.column()]
        if role != Qt.ItemDataRole.EditRole or str(value) == self._text(row, column):
            return False
        self.text_edited.emit(row.id, column, str(value))
        return True

    def _titles(self) -> tuple[str, ...]:
        return (
            self.tr("Take"), self.tr("Length"), self.tr("Stars"), self.tr("Split"), self.tr("Grade"),
            self.tr("Performer"), self.tr("Emotion"), self.tr("Tags"), self.tr("Note"),
        )  # fmt: skip

    def _told(self) -> dict[str, str]:
        """What each column means, in plain words."""
        return {
            "take": self.tr("The take's name; the picture shows its sound"),
            "length": self.tr("How much of the take is in use (minutes:seconds)"),
            "stars": self.tr("Your rating, 1 to 5; click a star"),
            "split": self.tr(
                "What the take is for:\ntrain: to learn from\n"
                "val: to notice when more practice stops helping\ntest: to judge by at the end"
            ),
            "grade": self.tr(
                "How clean the recording is, and what would improve it:\n"
                "A: clean. B: minor issues. C: needs a look. D: barely usable."
            ),
            "performer": self.tr("Who performs; a run can learn the style of each performer"),
            "emotion": self.tr("The mood of the whole take"),
            "tags": self.tr("Your own words for finding takes"),
            "note": self.tr("Your notes"),
        }

    def _text(self, row: TakeRow, column: str) -> str:
        s = row.selection
        if column == "length":
            return clock(row.seconds)
        if column == "stars":
            return "★" * s.stars
        if column == "split":
            return split_title(s.split)
        if column == "grade":
            return f"{row.grade}  {row.reason}".strip()
        if column == "take" and self.is_missing(row):
            return self.tr("{0} (missing)").format(s.id)
        words = {"take": s.id, "performer": s.performer, "emotion": s.emotion, "note": s.note}
        return ", ".join(s.tags) if column == "tags" else words[column]

    def _tip(self, row: TakeRow, column: str) -> str:
        if column == "grade" and row.report:
            found = "\n".join(f"• {sentences(f.what, f.remedy)}" for f in row.report.findings)
            return found or self.tr("No problems found in this take.")
        if column == "take" and row.take is None:
            return self.tr("This take's folder is missing. Use Find missing files; your edits are kept.")
        if column == "take" and self.is_missing(row):
            names = ", ".join(self._missing[row.selection.take])
            return self.tr(
                "{0} is missing from this take. Use Find missing files; your edits are kept."
            ).format(names)
        return self._text(row, column)


class TakeFilter(QSortFilterProxyModel):
    """Rows that match the chips and the search, sorted by a column."""

    def __init__(self, table: TakeTable, parent: QObject | None = None) -> None:
        super().__init__(parent)
        # Not asked back by sourceModel(): PySide 6.11 makes the model it gives a child of this proxy, and
        # collecting the two crashes where the proxy is a child of the model. Try again after 6.11.
        self._table = table
        self._ranks: tuple[tuple[TakeRow, ...], int, list[tuple[float, str]]] | None = None
        """(rows, column, sort key of each row): a sort compares each row ten times."""
        self.setSourceModel(table)
        self._splits: frozenset[str] = frozenset()
        self._troubled = False
        self._words: tuple[str, ...] = ()

    def set_filter(self, splits: Iterable[str], troubled: bool, search: str) -> None:
        """Show rows of these splits (all where none is named), with problems only, holding all words."""
        self.beginFilterChange()
        self._splits, self._troubled = frozenset(splits), troubled
        self._words = tuple(search.lower().split())
        self.endFilterChange(QSortFilterProxyModel.Direction.Rows)

    @property
    def filtering(self) -> bool:
        """Whether rows may be hidden."""
        return bool(self._splits or self._troubled or self._words)

    def filterAcceptsRow(self, source_row: int, source_parent: Index) -> bool:
        """Whether a row matches."""
        row = self._table.rows[source_row]
        if self._splits and row.selection.split not in self._splits:
            return False
        if self._troubled and not row.troubled and not self._table.is_missing(row):
            return False
        if not self._words:
            return True
        text = row.text()
        return all(word in text for word in self._words)

    def lessThan(self, left: Index, right: Index) -> bool:
        """By the column's value, equal ones by name."""
        rows, column = self._table.rows, left.column()
        if self._ranks is None or self._ranks[0] is not rows or self._ranks[1] != column:
            self._ranks = rows, column, [row.sort_key(COLUMNS[column]) for row in rows]
        keys = self._ranks[2]
        return keys[left.row()] < keys[right.row()]


def split_title(split: str) -> str:
    """A split as people read it."""
    from PySide6.QtCore import QCoreApplication

    words = {
        "train": QCoreApplication.translate("Split", "train"),
        "val": QCoreApplication.translate("Split", "val"),
        "test": QCoreApplication.translate("Split", "test"),
        "": QCoreApplication.translate("Split", "not used"),
    }
    return words[split]
