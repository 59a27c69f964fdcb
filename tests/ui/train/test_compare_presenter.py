"""Runs side by side: what the table says of what `saia compare` found, and the whole way to it."""

from __future__ import annotations

import json

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QPushButton
from pytestqt.qtbot import QtBot

from studio.ipc.events import CompareDone, from_plain
from studio.project import Project
from studio.ui.session import Session
from studio.ui.train.compare_view import CompareDialog, compared, title
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.view import TrainView

DONE = from_plain(
    {
        "event": "done",
        "split": "test",
        "takes": ["Chat_002"],
        "runs": {
            "quick_001": {"rmse_face": 0.06, "motion_ratio": 0.5, "closure_recall": 0.2, "wrist_cm": None},
            "best_001": {
                "rmse_face": 0.05,
                "motion_ratio": 1.6,
                "closure_recall": 0.2,
                "wrist_cm": float("nan"),
            },
        },
        "baselines": {
            "zero": {"rmse_face": 0.2, "motion_ratio": 0.0},
            "ridge": {"rmse_face": 0.04, "motion_ratio": 0.8},
        },
        "captured": {"rmse_face": 0.0, "motion_ratio": 1.0, "closure_recall": 1.0},
    },
    "compare",
)


def test_bars_are_as_long_as_the_values_and_the_nearest_run_is_marked() -> None:
    found = compared(DONE)
    assert found.columns == ("quick_001", "best_001", "ridge", "zero", "captured")
    assert found.runs == 2
    assert [row.figure.key for row in found.rows] == ["error", "motion_ratio", "closure_recall"]
    error, motion, closes = found.rows
    assert [cell.bar for cell in error.cells] == pytest.approx([0.3, 0.25, 0.2, 1.0, 0.0])
    assert [cell.best for cell in error.cells] == [False, True, False, False, False], "a baseline is no run"
    assert [cell.best for cell in motion.cells[:2]] == [True, False], "0.5 is nearer to 1 than 1.6 is"
    assert motion.mark == pytest.approx(1.0 / 1.6)
    assert not any(cell.best for cell in closes.cells), "equals are not told apart"


def test_a_comparison_that_found_nothing_is_an_empty_table() -> None:
    assert compared(CompareDone()).rows == ()
    assert [title(name) for name in ("ridge", "captured", "best_001")] == [
        "Simple guess",
        "Captured",
        "best_001",
    ]


def test_the_table_shows_numbers_and_marks(qtbot: QtBot) -> None:
    dialog = CompareDialog(("quick_001", "best_001"))
    qtbot.addWidget(dialog)
    dialog.show_compared(compared(DONE), "Chat_002")
    dialog.show()
    table = dialog.table
    texts = [[table.item(y, x).text() for x in range(table.columnCount())] for y in range(table.rowCount())]
    assert texts[0] == ["0.0600", "✓ 0.0500", "0.0400", "0.2000", "0.0000"]
    assert texts[1] == ["✓ 0.50", "1.60", "0.80", "0.00", "1.00"]
    assert not dialog.grab().isNull()


@pytest.fixture
def session(session: Session, toy_project: Project) -> Session:
    for name in ("quick_001", "quick_002"):
        folder = toy_project.new_run_folder("quick")
        (folder / "best.safetensors").write_bytes(b"no weights at all")
        line = {"event": "epoch", "epoch": 1, "of": 1, "val": {"rmse": 0.05}}
        (folder / "metrics.jsonl").write_text(json.dumps(line) + "\n", encoding="utf-8")
        assert folder.name == name
    return session


def _button(view: TrainView, name: str) -> QPushButton:
    found = view.findChild(QPushButton, name)
    assert found is not None
    return found


def test_several_runs_are_selected_and_stay_so(tab: tuple[TrainView, TrainPresenter]) -> None:
    view, presenter = tab
    view.runs.table.selectAll()
    assert set(view.runs.table.all_chosen) == {"quick_001", "quick_002"}
    presenter.model.runs_changed.emit()
    assert set(view.runs.table.all_chosen) == {"quick_001", "quick_002"}, "the list is read anew all the time"
    # Ctrl is held: who comes by Ctrl+3 does so.
    QTest.keyPress(view, Qt.Key.Key_Control, Qt.KeyboardModifier.ControlModifier)
    view.runs.table.choose("quick_001")
    QTest.keyRelease(view, Qt.Key.Key_Control)
    assert view.runs.table.all_chosen == ("quick_001",)
    view.runs.table.clearSelection()
    assert not _button(view, "compare_runs").isEnabled()


@pytest.mark.slow
def test_what_cannot_be_measured_is_a_sentence_in_the_window_of_the_comparison(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter]
) -> None:
    view, presenter = tab
    view.runs.table.selectAll()
    qtbot.mouseClick(_button(view, "compare_runs"), Qt.MouseButton.LeftButton)
    dialog = presenter.compare.dialog
    assert dialog is not None
    state = dialog.findChild(QLabel, "compare_state")
    assert state is not None
    qtbot.waitUntil(lambda: "is damaged" in state.text(), timeout=60_000)
    assert "best.safetensors" in state.text()
    dialog.close()
    assert presenter.compare.dialog is None
