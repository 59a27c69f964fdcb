"""What a training does before its first epoch and after its last one is seen: it looked stuck, or done."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QLabel

from studio.ipc.events import (
    CleaningEvent,
    EpochEvent,
    ListeningEvent,
    LookAheadsEvent,
    StartedEvent,
    TrainDone,
)
from studio.ui import messages
from studio.ui.session import Session
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.task import TrainingProgress, TrainRequest, run_text, training_text
from studio.ui.train.view import TrainView
from tests.fakes import FakeChildTask


@pytest.fixture
def child() -> FakeChildTask:
    return FakeChildTask()


def test_measuring_the_look_aheads_is_said() -> None:
    progress = TrainingProgress()
    progress.update(EpochEvent(4, 4, 0.1, seconds=1.0))
    progress.update(LookAheadsEvent(0, 1, 4, 0.25))
    assert training_text(progress) == "measuring how good it is: 25 %"
    assert run_text(progress.facts).startswith("epoch 4 of 4")


def test_measuring_is_skipped_with_the_button_that_stopped_the_learning(
    tab: tuple[TrainView, TrainPresenter], child: FakeChildTask
) -> None:
    view, presenter = tab
    button = view.progress.stop
    presenter.model.start(TrainRequest("quick"))
    button.click()
    assert (button.text(), button.isEnabled()) == ("Stopping after this epoch", False)
    for done in (0, 1):
        child.say(LookAheadsEvent(0, done, 4, done / 4))
        assert (button.text(), button.isEnabled()) == ("Skip measuring", True)
    button.click()
    child.say(LookAheadsEvent(0, 2, 4, 0.5))
    assert (button.text(), button.isEnabled()) == ("Skipping", False)
    assert child.stops == 2
    child.end(TrainDone("quick_001"))
    assert (button.text(), button.isHidden()) == ("Stop, keep best", True)


def test_an_empty_plot_does_not_ask_to_start_what_runs(tab: tuple[TrainView, TrainPresenter]) -> None:
    view, presenter = tab
    hint = view.findChild(QLabel, "curves_hint")
    assert hint is not None
    assert hint.text().startswith("Press Start training")
    presenter.model.start(TrainRequest("quick"))
    assert hint.text().startswith("The curves begin with the first epoch.")


def test_listening_to_the_takes_is_said_before_the_first_epoch() -> None:
    progress = TrainingProgress()
    assert training_text(progress) == "reading the takes; the first epoch follows"
    progress.update(CleaningEvent("Hello_001", 0.5))
    assert training_text(progress) == "cleaning the sound of Hello_001: 50 %"
    progress.update(ListeningEvent("Hello_002", 2, 5))
    assert training_text(progress) == "listening to Hello_002, take 2 of 5; kept for the next training"
    assert progress.fraction == 0.2
    progress.update(StartedEvent("quick_001"))
    assert training_text(progress) == "reading the takes; the first epoch follows"
    assert progress.fraction == -1.0


def trained(view: TrainView, presenter: TrainPresenter, child: FakeChildTask) -> messages.Toast:
    """The message after a training that made quick_001."""
    presenter.model.start(TrainRequest("quick"))
    child.end(TrainDone("quick_001"))
    toast = messages.toast_of(view.window())
    assert toast is not None
    return toast


def test_the_message_that_a_run_is_ready_goes_when_it_is_seen(
    tab: tuple[TrainView, TrainPresenter], child: FakeChildTask, session: Session
) -> None:
    view, presenter = tab
    toast = trained(view, presenter, child)
    assert (toast.isVisible(), toast.text.text()) == (True, "quick_001 is ready.")
    session.run_shown.emit("quick_000")
    assert toast.isVisible(), "another one is seen"
    session.run_shown.emit("quick_001")
    assert not toast.isVisible()
    presenter.model.start(TrainRequest("quick"))
    child.end(TrainDone("quick_002"))
    messages.show_failure(view, "The disk is full.", "Make room.")
    session.run_shown.emit("quick_002")
    assert toast.isVisible(), "errors stay"


def test_what_a_message_offers_may_be_done_elsewhere_and_later(
    tab: tuple[TrainView, TrainPresenter], child: FakeChildTask, session: Session
) -> None:
    view, presenter = tab
    toast = trained(view, presenter, child)
    presenter.model.start(TrainRequest("quick"))
    assert toast.isVisible()
    session.watch_requested.emit("quick_001")
    assert not toast.isVisible(), "watched by another button, while the next one is trained"
    child.end(TrainDone("quick_002"))
    assert toast.isVisible()
    session.project_opened.emit()
    assert not toast.isVisible(), "there is no such run in another project"
