"""What ends a training, and the ways back: closing the window, removing a run, memory that ran out."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QLabel, QMainWindow, QMessageBox, QPushButton
from pytestqt.qtbot import QtBot

from studio.dataset import edits
from studio.errors import StudioError
from studio.ipc.events import EpochEvent, OutOfMemoryEvent, StartedEvent, StepEvent, TrainDone
from studio.project import Project
from studio.ui import messages
from studio.ui.session import Session
from studio.ui.train.card_view import CardDialog
from studio.ui.train.data_facts import data_facts
from studio.ui.train.data_view import DataCard
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.task import TrainingProgress, TrainRequest, smaller_batch_args
from studio.ui.train.view import TrainView
from tests.fakes import FakeChildTask

LONG = 30_000


@pytest.fixture
def child() -> FakeChildTask:
    return FakeChildTask()


@pytest.fixture
def tab(qtbot: QtBot, session: Session, child: FakeChildTask) -> Iterator[tuple[TrainView, TrainPresenter]]:
    window = QMainWindow()
    view = TrainView()
    window.setCentralWidget(view)
    presenter = TrainPresenter(view, session, child)
    qtbot.addWidget(window)
    window.resize(1280, 800)
    window.show()
    presenter.activate()
    yield view, presenter
    presenter.close()


def answer(view: TrainView, words: str) -> None:
    """Press a button of the question that is about to be asked."""

    def press() -> None:
        boxes = view.findChildren(QMessageBox, "question")
        box = next((one for one in boxes if one.isVisible()), None)  # those answered before go later
        if box is None:
            QTimer.singleShot(20, view, press)
            return
        next(button for button in box.buttons() if button.text() == words).click()

    QTimer.singleShot(0, view, press)


def under_way(
    presenter: TrainPresenter, session: Session, child: FakeChildTask, resumed: bool = False
) -> None:
    """A training with a run that has weights; its child is never started."""
    assert session.project is not None
    folder = session.project.new_run_folder("quick")
    (folder / "best.safetensors").write_bytes(b"weights")
    if resumed:
        presenter.model.resume(folder.name)
        return
    presenter.model.start(TrainRequest("quick"))
    child.say(StartedEvent(folder.name, folder=str(folder)))


def test_the_window_closes_freely_while_nothing_trains(tab: tuple[TrainView, TrainPresenter]) -> None:
    assert tab[1].may_close()


def test_a_training_keeps_the_window_open_until_somebody_says_so(
    tab: tuple[TrainView, TrainPresenter], session: Session, child: FakeChildTask
) -> None:
    view, presenter = tab
    under_way(presenter, session, child)
    answer(view, "Cancel")
    assert not presenter.may_close()
    assert presenter.model.training.running


def test_stop_and_keep_closes_the_window_once_the_training_has_ended(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session, child: FakeChildTask
) -> None:
    view, presenter = tab
    under_way(presenter, session, child)
    answer(view, "Stop and keep the best")
    assert not presenter.may_close()
    assert view.window().isVisible()
    assert child.stops == 1
    child.end(TrainDone("quick_001"))
    qtbot.waitUntil(lambda: not view.window().isVisible(), timeout=LONG)
    assert session.project is not None
    assert [run.id for run in session.project.runs] == ["quick_001"]


def test_discard_puts_the_run_into_the_trash(
    tab: tuple[TrainView, TrainPresenter], session: Session, child: FakeChildTask
) -> None:
    view, presenter = tab
    under_way(presenter, session, child)
    answer(view, "Discard")
    assert presenter.may_close()
    assert session.project is not None
    assert session.project.runs == ()
    assert (session.project.folder / ".trash" / "runs" / "quick_001" / "best.safetensors").is_file()


@pytest.mark.parametrize("resumed", [False, True])
def test_a_cancelled_training_is_removed_though_its_child_was_done(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session, child: FakeChildTask, resumed: bool
) -> None:
    view, presenter = tab
    under_way(presenter, session, child, resumed)
    presenter.model.training.cancel()
    # It measured look-aheads, which end well when told to end.
    child.end(TrainDone("quick_001"))
    assert not presenter.model.training.running
    assert session.project is not None
    assert [run.id for run in session.project.runs] == (["quick_001"] if resumed else [])
    told = "quick_001 is ready." if resumed else "The training was cancelled."
    qtbot.waitUntil(lambda: messages.toast_of(view.window()) is not None)
    said = [toast.text.text() for toast in view.window().findChildren(messages.Toast)]
    assert said == [told]


def test_a_removed_run_comes_back_with_one_click(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session
) -> None:
    view, _ = tab
    assert session.project is not None
    session.project.new_run_folder("quick")
    session.runs_changed.emit()
    view.runs.table.choose("quick_001")
    delete = view.findChild(QPushButton, "delete_run")
    assert delete is not None
    answer(view, "Cancel")
    qtbot.mouseClick(delete, Qt.MouseButton.LeftButton)
    assert [run.id for run in session.project.runs] == ["quick_001"], "asked, and stayed"
    answer(view, "Delete run")
    qtbot.mouseClick(delete, Qt.MouseButton.LeftButton)
    assert session.project.runs == ()
    assert view.runs.table.rowCount() == 0
    toast = view.window().findChild(messages.Toast)
    assert toast is not None
    assert (toast.text.text(), toast.action.text()) == ("Removed quick_001.", "Undo")
    assert toast.remedy.text() == "Moved to the project's trash (.trash/runs), which keeps the last 10 runs."
    qtbot.mouseClick(toast.action, Qt.MouseButton.LeftButton)
    assert [run.id for run in session.project.runs] == ["quick_001"]
    assert view.runs.table.chosen == "quick_001"


def test_memory_that_ran_out_offers_a_smaller_batch_that_goes_on(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], session: Session, child: FakeChildTask
) -> None:
    view, presenter = tab
    under_way(presenter, session, child)
    child.say(OutOfMemoryEvent("quick_001", "training.crops=4"))
    what = "The memory of this machine was not enough for the training."
    child.end(StudioError(what, "Type this."))
    assert not presenter.model.training.running
    offer = view.findChild(QPushButton, "take_offer")
    told = view.findChild(QLabel, "offer_text")
    assert offer is not None
    assert told is not None
    assert offer.isVisible()
    assert offer.text() == "Train with a smaller batch (crops=4)"
    assert told.text() == (
        "The memory of this machine was not enough for the training. What was learnt is kept; a smaller "
        "batch may fit."
    )
    qtbot.mouseClick(offer, Qt.MouseButton.LeftButton)
    assert presenter.model.training.running
    assert session.project is not None
    folder = str(session.project.folder)
    assert child.started[-1] == ["train", folder, "--resume", "quick_001", "--set", "training.crops=4"]
    assert not offer.isVisible()
    presenter.model.training.cancel()
    assert child.cancels == 1
    child.end(None)
    assert not presenter.model.training.running
    assert [run.id for run in session.project.runs] == ["quick_001"], "a resumed run stays"


def test_the_command_with_a_smaller_batch_keeps_what_was_asked_for() -> None:
    words = ["train", "P", "--recipe", "best", "--set", "training.epochs=3"]
    assert smaller_batch_args(words, "", "training.crops=4") == [*words, "--set", "training.crops=4"]
    again = ["train", "P", "--resume", "best_002", "--set", "training.crops=4"]
    assert smaller_batch_args(words, "best_002", "training.crops=4") == again
    assert smaller_batch_args(again, "best_002", "training.crops=2") == [*again, "--set", "training.crops=2"]


def test_steps_move_the_bar_between_epochs() -> None:
    progress = TrainingProgress()
    assert progress.fraction == -1.0
    told = (
        StepEvent(1, 4, 5, 10, eta_s=70.0),
        EpochEvent(1, 4, eta_s=60.0),
        StepEvent(2, 4, 1, 10, eta_s=55.0),
    )
    seen = []
    for event in told:
        progress.update(event)
        seen.append((progress.fraction, progress.eta))
    assert seen == [(0.125, 70.0), (0.25, 60.0), (0.275, 55.0)]


@pytest.mark.usefixtures("enough_takes")
def test_a_project_only_to_look_at_sets_no_take_aside_and_keeps_its_notes(
    qtbot: QtBot, toy_project: Project
) -> None:
    toy_project.edit("all", edits.set_split(toy_project.dataset, ["toy_003"], "train"))
    card = DataCard()
    qtbot.addWidget(card)
    card.show_locked("It was opened for looking only.")
    card.show_facts(data_facts(toy_project.dataset, toy_project.takes))
    button = card.findChild(QPushButton, "set_validation")
    assert button is not None
    assert not button.isEnabled()
    assert button.toolTip() == "It was opened for looking only."
    card.show_locked("")
    assert button.isEnabled()
    dialog = CardDialog("quick_001")
    qtbot.addWidget(dialog)
    dialog.show_card("<p>card</p>", "mine")
    dialog.show_locked("It was opened for looking only.")
    assert dialog.licence.isReadOnly()
    assert not dialog.save.isEnabled()
    assert dialog.save.toolTip() == "It was opened for looking only."
