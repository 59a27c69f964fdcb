"""The verdict on a run in the tab, and the learning curve behind its button."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from studio.dataset import edits
from studio.ipc.events import CurveDone, CurveProgressEvent
from studio.project import Project
from studio.ui.messages import toast_of
from studio.ui.session import Session
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.runs_view import ERROR, VERDICT
from studio.ui.train.verdict_presenter import VerdictPresenter
from studio.ui.train.verdict_view import VerdictRow
from studio.ui.train.view import TrainView
from tests.fakes import FakeChildTask

Tab = tuple[TrainView, TrainPresenter]
MakeRun = Callable[..., str]


@pytest.fixture
def make_run(toy_project: Project) -> MakeRun:
    """Makes a run that looks like a trained one."""

    def make(**figures: Any) -> str:
        folder = toy_project.new_run_folder("quick")
        (folder / "best.safetensors").write_bytes(b"no weights at all")
        report = {"status": "done", "minutes": 4.0, "best_val": figures, "val": ["toy_003"]}
        (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
        return folder.name

    return make


def test_the_chosen_run_is_judged_in_words_and_figures_wait_behind_details(
    qtbot: QtBot, make_run: MakeRun, tab: Tab, toy_project: Project
) -> None:
    view, presenter = tab
    good = make_run(rmse=0.05, pearson_mouth=0.46, motion_ratio=0.7)
    still = make_run(rmse=0.04, pearson_mouth=0.02, motion_ratio=0.1)
    presenter.model.runs_changed.emit()
    table = view.runs.table

    def words() -> dict[str, str]:
        return {table.item(y, 0).text(): table.item(y, VERDICT).text() for y in range(2)}

    assert words() == {good: "", still: ""}, "no file is read while the window waits"
    qtbot.waitUntil(lambda: words() == {good: "good", still: "barely moves"})
    table.choose(good)
    assert view.runs.verdict.text.text().startswith(
        "Follows your mouth well, moves a little less than you. Four more minutes would probably help most."
    )
    table.choose(still)
    assert view.runs.verdict.text.text().startswith("Barely moves: 10% as much as you do.")
    # Measured anew, by Compare or from a terminal.
    report = {"status": "done", "best_val": {"rmse": 0.05, "pearson_mouth": 0.46, "motion_ratio": 0.95}}
    (toy_project.run(still).folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    presenter.model.runs_changed.emit()
    assert view.runs.verdict.text.text().startswith("Barely moves"), "what was read last stays until then"
    qtbot.waitUntil(lambda: view.runs.verdict.text.text().startswith("Follows your mouth well"))
    assert table.isColumnHidden(ERROR)
    details = view.findChild(QPushButton, "run_details")
    assert details is not None
    qtbot.mouseClick(details, Qt.MouseButton.LeftButton)
    assert not table.isColumnHidden(ERROR)


@pytest.mark.usefixtures("enough_takes")
def test_start_stands_still_when_there_is_a_warning(tab: Tab, session: Session, qtbot: QtBot) -> None:
    view, _ = tab
    view.resize(1024, 588)
    before = view.recipe.start.mapTo(view, QPoint())
    assert session.project is not None
    everything = ["toy_001", "toy_002", "toy_003"]
    session.edit("all", edits.set_split(session.project.dataset, everything, "train"))
    qtbot.waitUntil(lambda: view.findChild(QPushButton, "set_validation") is not None)
    view.grab()
    assert view.recipe.start.mapTo(view, QPoint()) == before


def test_the_learning_curve_is_measured_by_a_child_that_can_be_cancelled(
    qtbot: QtBot, tab: Tab, session: Session
) -> None:
    _, presenter = tab
    row, child = VerdictRow(), FakeChildTask()
    qtbot.addWidget(row)
    row.show()
    mine = VerdictPresenter(row, presenter.model, session, child)
    presenter.model.runs_changed.emit()
    assert session.project is not None
    qtbot.mouseClick(row.measure, Qt.MouseButton.LeftButton)
    assert child.started == [["curve", str(session.project.folder)]]
    child.say(CurveProgressEvent(0.5, number=2, of=3))
    assert row.cancel.isVisible()
    qtbot.mouseClick(row.cancel, Qt.MouseButton.LeftButton)
    assert child.cancels == 1
    child.end(None)
    assert row.measure.isVisible()
    qtbot.mouseClick(row.measure, Qt.MouseButton.LeftButton)
    child.end(CurveDone("More takes would help."))
    toast = toast_of(row)
    assert toast is not None
    assert toast.text.text() == "More takes would help."
    mine.close()


def test_without_takes_kept_back_it_says_why_it_cannot_be_measured(tab: Tab, session: Session) -> None:
    view, _ = tab
    assert session.project is not None
    assert view.runs.verdict.measure.isEnabled()
    session.edit("all", edits.set_split(session.project.dataset, ["toy_003"], "train"))
    assert not view.runs.verdict.measure.isEnabled()
    assert view.runs.verdict.measure.toolTip().startswith("Keep a take for validation or test first")
