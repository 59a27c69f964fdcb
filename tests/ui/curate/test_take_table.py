from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from studio.dataset import Dataset, Label, Selection
from studio.take import Take, TakeInfo
from studio.take.check import Finding, Report
from studio.ui.curate.take_delegate import in_two_lines
from studio.ui.curate.take_table import COLUMNS, ROW_ROLE, TakeFilter, TakeRow, TakeTable, rows_of

Display = Qt.ItemDataRole.DisplayRole


class Metrics:
    """Letters of ten pixels."""

    def horizontalAdvance(self, text: str) -> int:  # noqa: N802
        return 10 * len(text)

    def elidedText(self, text: str, _mode: Qt.TextElideMode, width: int) -> str:  # noqa: N802
        return text if 10 * len(text) <= width else f"{text[: width // 10 - 1]}…"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("No sound.", "No sound."),
        ("Motion has a gap.", "Motion has\na gap."),
        ("Motion has a gap of 1.2 s.", "Motion has\na gap of …"),
        ("動きが途切れています。もう一度。", "動きが途切れてい…"),
        ("", ""),
    ],
)
def test_a_reason_has_two_lines(text: str, shown: str) -> None:
    assert in_two_lines(text, Metrics(), 100 if text.isascii() else 90) == shown  # type: ignore[arg-type]


def _rows() -> tuple[TakeRow, ...]:
    selections = (
        Selection("a", "a", split="train", stars=1, performer="Ren", tags=("calm",)),
        Selection("b", "b", split="val", stars=5, in_point=2.0, out_point=8.0, excluded=((3.0, 4.0),)),
        Selection("c", "c", split="test", note="windy", labels=(Label(1, 2, "emotion", "happy"),)),
        Selection("gone", "gone", split=""),
    )
    takes = {
        name: Take(name, Path(name), TakeInfo(name, duration=10.0 * i)) for i, name in enumerate("abc", 1)
    }
    gap = Finding("gap", "major", "Motion has a gap of 1.2 s.", "Exclude it.", 3.0, 4.2)
    reports = {"a": Report("A", "Nothing to mend was found.", ()), "c": Report("C", gap.what, (gap,))}
    return rows_of(Dataset(selections), takes, reports)


@pytest.fixture
def table() -> TakeTable:
    made = TakeTable()
    made.set_rows(_rows())
    return made


@pytest.fixture
def shown(table: TakeTable) -> TakeFilter:
    return TakeFilter(table)


def _ids(shown: TakeFilter) -> list[str]:
    return [shown.index(i, 0).data(ROW_ROLE).id for i in range(shown.rowCount())]


def _texts(table: TakeTable, row: int) -> dict[str, str]:
    return {name: table.index(row, i).data(Display) for i, name in enumerate(COLUMNS)}


def test_a_row_says_what_is_used_and_why_it_is_graded_so(table: TakeTable) -> None:
    assert _texts(table, 1)["length"] == "00:05.0", "trimmed to six seconds, one of them excluded"
    assert _texts(table, 2)["grade"] == "C  Motion has a gap of 1.2 s."
    assert _texts(table, 0)["grade"] == "A"
    assert _texts(table, 1)["grade"] == "", "not checked yet"
    assert _texts(table, 3)["take"] == "gone (missing)"
    assert _texts(table, 0)["tags"] == "calm"


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("length", ["gone", "b", "a", "c"]),
        ("stars", ["b", "a", "c", "gone"]),
        ("grade", ["a", "c", "b", "gone"]),
        ("split", ["a", "b", "c", "gone"]),
        ("performer", ["a", "b", "c", "gone"]),
        ("note", ["c", "a", "b", "gone"]),
    ],
)
def test_columns_sort_by_what_they_mean(shown: TakeFilter, column: str, expected: list[str]) -> None:
    shown.sort(COLUMNS.index(column), Qt.SortOrder.AscendingOrder)
    assert _ids(shown) == expected


@pytest.mark.parametrize(
    ("splits", "troubled", "search", "expected"),
    [
        ((), False, "", ["a", "b", "c", "gone"]),
        (("train", "test"), False, "", ["a", "c"]),
        (("",), False, "", ["gone"]),
        ((), True, "", ["c", "gone"]),
        ((), False, "HAPPY", ["c"]),
        ((), False, "ren calm", ["a"]),
        ((), False, "ren happy", []),
        (("val",), True, "", []),
    ],
)
def test_chips_and_search_narrow_the_rows(
    shown: TakeFilter, splits: tuple[str, ...], troubled: bool, search: str, expected: list[str]
) -> None:
    shown.set_filter(splits, troubled, search)
    assert _ids(shown) == expected


def test_only_rows_that_changed_are_told(qtbot: QtBot, table: TakeTable) -> None:
    rows = list(_rows())
    rows[2] = TakeRow(rows[2].selection, rows[2].take, None)
    told: list[tuple[int, int]] = []
    table.dataChanged.connect(lambda a, b: told.append((a.row(), b.row())))
    assert table.set_rows(rows) is False
    assert told == [(2, 2)]
    assert table.set_rows(rows[:2]) is True


def test_words_typed_over_a_cell_are_reported(qtbot: QtBot, table: TakeTable) -> None:
    place = table.index(0, COLUMNS.index("note"))
    assert table.flags(place) & Qt.ItemFlag.ItemIsEditable
    assert not table.flags(table.index(0, 0)) & Qt.ItemFlag.ItemIsEditable
    with qtbot.waitSignal(table.text_edited) as typed:
        assert table.setData(place, "good light")
    assert typed.args == ["a", "note", "good light"]
    assert not table.setData(place, ""), "what is there already is no edit"


def test_the_search_looks_through_emotions_and_what_the_take_itself_tells(qtbot: QtBot) -> None:
    notes = ("The turns of head and eyes were read as radians.",)
    take = Take("b", Path("b"), TakeInfo("Hello", notes=notes, source="imported (bvh)"))
    table = TakeTable()
    dataset = Dataset((Selection("a", "a", emotion="嬉しい"), Selection("b", "b")))
    table.set_rows(rows_of(dataset, {"b": take}, {}))
    shown = TakeFilter(table)
    for words, found in (("嬉しい", ["a"]), ("RADIANS bvh", ["b"]), ("hello", ["b"]), ("radians 嬉しい", [])):
        shown.set_filter((), False, words)
        assert _ids(shown) == found
