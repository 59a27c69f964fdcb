"""A real training through the tab, in its child process."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton
from pytestqt.qtbot import QtBot

from studio.dataset import edits
from studio.ipc.events import StartedEvent
from studio.project import Project
from studio.settings import Settings
from studio.training.devices import devices
from studio.ui.session import Session
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.runs_view import EPOCHS, NOTE
from studio.ui.train.task import TrainRequest
from studio.ui.train.view import TrainView
from tests.fakes import FakeChildTask

MINUTE = 60_000


def _start(qtbot: QtBot, view: TrainView, epochs: int) -> None:
    button = view.findChild(QPushButton, "preset_quick_look")
    assert button is not None
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    view.recipe.advanced.setChecked(True)
    view.recipe.drawer.epochs.setValue(epochs)
    qtbot.mouseClick(view.recipe.start, Qt.MouseButton.LeftButton)


def _text(view: TrainView, name: str) -> str:
    found = view.findChild(QLabel, name)
    assert found is not None
    return found.text()


def test_the_data_card_counts_the_takes(tab: tuple[TrainView, TrainPresenter]) -> None:
    view, _ = tab
    assert _text(view, "data_total") == "3 takes  0:18"
    assert _text(view, "data_train") == "2  (0:12)"
    assert view.recipe.start.isEnabled()


def test_only_what_there_is_to_compute_on_is_offered(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter]
) -> None:
    view, _ = tab
    found = devices()
    view.recipe.advanced.click()
    qtbot.waitUntil(lambda: _text(view, "device_note") == found.reason, timeout=MINUTE)
    names = [view.recipe.drawer.device.itemData(i) for i in range(view.recipe.drawer.device.count())]
    assert names == ["auto", *found.names]


def test_the_recipe_of_the_last_time_is_chosen(qtbot: QtBot, session: Session) -> None:
    session.change_settings(recipe="saia")
    view = TrainView()
    qtbot.addWidget(view)
    presenter = TrainPresenter(view, session)
    assert view.recipe.recipe.currentData() == "saia"
    presenter.close()
    session.change_settings(recipe="one that is gone")
    again = TrainView()
    qtbot.addWidget(again)
    presenter = TrainPresenter(again, session)
    assert again.recipe.recipe.currentData() == "balanced"
    presenter.close()


@pytest.mark.parametrize(
    ("names", "told"),
    [(["Mia"], "3 takes  0:18  1 performer"), (["Mia", "友"], "3 takes  0:18  2 performers")],
)
def test_performers_are_counted_in_words(
    tab: tuple[TrainView, TrainPresenter], session: Session, names: list[str], told: str
) -> None:
    view, _ = tab
    assert session.project is not None
    for take, name in zip(("toy_001", "toy_002", "toy_003"), (*names, names[0], names[0]), strict=False):
        session.edit("who", edits.set_performer(session.project.dataset, [take], name))
    assert _text(view, "data_total") == told


def test_the_list_of_runs_follows_what_a_training_in_a_terminal_writes(
    tab: tuple[TrainView, TrainPresenter], session: Session
) -> None:
    view, _ = tab
    assert session.project is not None
    metrics = session.project.new_run_folder("quick") / "metrics.jsonl"
    for epochs in (1, 2):
        lines = [f'{{"event": "epoch", "epoch": {n + 1}, "of": 9, "val_loss": 1.0}}' for n in range(epochs)]
        metrics.write_text("\n".join(lines) + "\n", encoding="utf-8")
        session.runs_changed.emit()
        cell = view.runs.table.item(0, EPOCHS)
        assert cell is not None
        assert cell.text() == f"{epochs} / 9"


@pytest.mark.slow
def test_a_training_draws_its_curves_and_becomes_a_run(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session
) -> None:
    view, presenter = tab
    _start(qtbot, view, 2)
    assert not view.recipe.start.isEnabled()
    qtbot.waitUntil(lambda: not presenter.model.training.running, timeout=3 * MINUTE)
    assert session.project is not None
    (run,) = session.project.runs
    assert run.has_weights
    assert len(run.epochs()) == 2
    assert session.settings.recipe == "quick", "the next training starts with it"
    qtbot.waitUntil(lambda: view.progress.preview.predicted.moving, timeout=MINUTE)
    assert (run.folder / "card.html").is_file()
    assert view.runs.table.rowCount() == 1
    assert view.runs.table.chosen == run.id
    assert (run.folder / "evaluation.json").is_file()
    qtbot.waitUntil(lambda: "Measured on toy_003" in view.runs.verdict.text.text())
    assert _text(view, "run_verdict").split()[0] in ("Follows", "Hardly", "Barely")
    assert _text(view, "run_line").startswith("epoch 2 of 2")
    assert view.recipe.start.isEnabled()
    qtbot.waitUntil(lambda: len(view.progress.loss_plot.points.get("train_loss", ([], []))[0]) == 2)
    compare = view.findChild(QPushButton, "compare_runs")
    assert compare is not None
    qtbot.mouseClick(compare, Qt.MouseButton.LeftButton)
    dialog = presenter.compare.dialog
    assert dialog is not None
    qtbot.waitUntil(lambda: dialog.table.rowCount() > 4, timeout=2 * MINUTE)
    heads = [dialog.table.horizontalHeaderItem(x).text() for x in range(dialog.table.columnCount())]
    assert heads == [run.id, "Simple guess", "Mean pose", "Rest pose", "Captured"]


@pytest.mark.slow
def test_stop_keeps_the_best_epoch(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session
) -> None:
    view, presenter = tab
    _start(qtbot, view, 500)
    qtbot.waitUntil(lambda: _text(view, "run_line").startswith("epoch"), timeout=4 * MINUTE)
    qtbot.mouseClick(view.progress.stop, Qt.MouseButton.LeftButton)
    assert view.progress.stop.text() == "Stopping after this epoch"
    qtbot.waitUntil(lambda: not presenter.model.training.running, timeout=3 * MINUTE)
    assert session.project is not None
    (run,) = session.project.runs
    assert run.has_weights
    assert len(run.epochs()) < 500


@pytest.mark.slow
def test_cancel_removes_the_run(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session
) -> None:
    view, presenter = tab
    _start(qtbot, view, 500)
    qtbot.waitUntil(lambda: _text(view, "run_line").startswith("epoch"), timeout=4 * MINUTE)
    presenter.model.training.cancel()
    qtbot.waitUntil(lambda: not presenter.model.training.running, timeout=3 * MINUTE)
    assert session.project is not None
    assert session.project.runs == ()
    assert view.runs.table.rowCount() == 0


def test_notes_are_kept_beside_the_run(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session
) -> None:
    view, _ = tab
    assert session.project is not None
    folder = session.project.new_run_folder("quick")
    session.runs_changed.emit()
    item = view.runs.table.item(0, NOTE)
    assert item is not None
    item.setText("窓を閉めて")
    assert (folder / "note.txt").read_text(encoding="utf-8") == "窓を閉めて"
    session.runs_changed.emit()
    again = view.runs.table.item(0, NOTE)
    assert again is not None
    assert again.text() == "窓を閉めて"


@pytest.mark.usefixtures("enough_takes")
def test_setting_one_take_aside_is_one_click(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session
) -> None:
    view, _ = tab
    project = session.project
    assert project is not None
    session.edit("all", edits.set_split(project.dataset, ["toy_003"], "train"))
    button = view.findChild(QPushButton, "set_validation")
    assert button is not None
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert len(project.dataset.of_split("val")) == 1
    assert project.undo_name.startswith("Set toy_")


def test_without_takes_the_room_says_what_goes_there(qtbot: QtBot, tmp_path: Path) -> None:
    session = Session(Settings())
    session.project = Project.create(tmp_path / "empty")
    view = TrainView()
    presenter = TrainPresenter(view, session)
    qtbot.addWidget(view)
    view.show()
    assert view.empty.isVisible()
    with qtbot.waitSignal(session.tab_requested) as asked:
        assert view.empty.button is not None
        qtbot.mouseClick(view.empty.button, Qt.MouseButton.LeftButton)
    assert asked.args == ["record"]
    presenter.close()


def test_a_training_of_a_project_that_was_left_is_none_of_the_next(
    qtbot: QtBot, session: Session, tmp_path: Path
) -> None:
    view, child = TrainView(), FakeChildTask()
    qtbot.addWidget(view)
    presenter = TrainPresenter(view, session, child)
    left = session.project
    assert left is not None
    presenter.model.start(TrainRequest("quick"))
    for project in (left, Project.create(tmp_path / "Other")):
        (project.runs_folder / "quick_001").mkdir(parents=True)
    child.say(StartedEvent("quick_001"))
    assert presenter.model.live_run == "quick_001"
    session.open_project(tmp_path / "Other")
    assert presenter.model.live_run is None
    child.end(None)
    assert not (left.runs_folder / "quick_001").exists()
    assert (tmp_path / "Other" / "runs" / "quick_001").exists()
    presenter.close()


def test_a_project_only_to_look_at_says_why_nothing_starts(qtbot: QtBot, toy_project: Project) -> None:
    session = Session(Settings())
    session.project = Project.open(toy_project.folder, read_only=True)
    view = TrainView()
    presenter = TrainPresenter(view, session)
    qtbot.addWidget(view, before_close_func=lambda _: presenter.close())
    assert session.locked_reason.endswith("was opened for looking only.")
    for name in ("start_training", "import_run", "train_import_run", "resume_run", "delete_run"):
        button = view.findChild(QPushButton, name)
        assert button is not None
        assert not button.isEnabled(), name
        assert button.toolTip() == session.locked_reason, name
    assert view.runs.table.editTriggers() == view.runs.table.EditTrigger.NoEditTriggers
    session.project = toy_project
    session.project_opened.emit()
    assert view.recipe.start.isEnabled()
    assert view.recipe.start.toolTip() == "Train a network on the takes marked train"
    assert view.runs.table.editTriggers() != view.runs.table.EditTrigger.NoEditTriggers
