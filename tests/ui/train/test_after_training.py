"""What a training does before its first epoch and after its last one is seen: it looked stuck, or done."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QLabel

from studio.ipc.events import CleaningEvent, EpochEvent, ListeningEvent, LookAheadsEvent, StartedEvent
from studio.ui.tasks import Job
from studio.ui.train import words
from studio.ui.train.heard import TrainingProgress
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.view import TrainView


def test_measuring_the_look_aheads_is_said() -> None:
    heard = TrainingProgress()
    heard.take(EpochEvent(4, 4, 0.1, seconds=1.0))
    heard.take(LookAheadsEvent(0, 1, 4, 0.25))
    assert words.of_training(heard) == "measuring how well it does at each look-ahead: 25 %"
    assert words.of_run(heard.facts).startswith("epoch 4 of 4")


def test_measuring_is_skipped_with_the_button_that_stopped_the_learning(
    tab: tuple[TrainView, TrainPresenter], monkeypatch: pytest.MonkeyPatch
) -> None:
    view, presenter = tab
    button, told = view.progress.stop, list[str]()
    job = Job(presenter)
    monkeypatch.setattr(job, "stop", lambda: told.append("stop"))
    presenter._job, presenter._run_id, presenter._heard = job, "quick_001", TrainingProgress()
    view.show_running(True)
    button.click()
    assert (button.text(), button.isEnabled()) == ("Stopping after this epoch", False)
    for done in (0, 1):
        presenter._on_event(LookAheadsEvent(0, done, 4, done / 4))
        assert (button.text(), button.isEnabled()) == ("Skip measuring", True)
    button.click()
    presenter._on_event(LookAheadsEvent(0, 2, 4, 0.5))
    assert (button.text(), button.isEnabled()) == ("Skipping", False)
    assert told == ["stop", "stop"]
    presenter._on_ended()
    assert (button.text(), button.isHidden()) == ("Stop, keep best", True)


def test_an_empty_plot_does_not_ask_to_start_what_runs(tab: tuple[TrainView, TrainPresenter]) -> None:
    view, _ = tab
    hint = view.findChild(QLabel, "curves_hint")
    assert hint is not None
    assert hint.text().startswith("Press Start training")
    view.show_running(True)
    assert hint.text().startswith("The curves begin with the first epoch.")


def test_listening_to_the_takes_is_said_before_the_first_epoch() -> None:
    heard = TrainingProgress()
    assert words.of_training(heard) == "reading the takes; the first epoch follows"
    heard.take(CleaningEvent("Hello_001", 0.5))
    assert words.of_training(heard) == "cleaning the sound of Hello_001: 50 %"
    heard.take(ListeningEvent("Hello_002", 2, 5))
    assert words.of_training(heard) == "listening to Hello_002, take 2 of 5; kept for the next training"
    assert heard.fraction == 0.2
    heard.take(StartedEvent("quick_001"))
    assert words.of_training(heard) == "reading the takes; the first epoch follows"
    assert heard.fraction == -1.0
