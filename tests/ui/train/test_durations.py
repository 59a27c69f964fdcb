"""How long each preset takes here, on its card: measured, and until then a guess that says so."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from studio.settings import settings_folder
from studio.training.duration import FILE, TrainingTime, TrainingTimes, kind_of
from studio.training.recipe import usual_recipe
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.view import TrainView
from tests.fakes import FakeChildTask


@pytest.fixture
def child() -> FakeChildTask:
    """Trains nothing."""
    (settings_folder() / FILE).unlink(missing_ok=True)
    return FakeChildTask()


def _card(view: TrainView, name: str) -> QPushButton:
    found = view.findChild(QPushButton, name)
    assert found is not None
    return found


def test_a_card_says_what_trainings_took_here_and_else_that_it_guesses(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter]
) -> None:
    view, presenter = tab
    quick = _card(view, "preset_quick_look")
    guess = "A guess until its first training on this computer; longer while it is busy"
    qtbot.waitUntil(lambda: quick.toolTip() == guess, timeout=60_000)
    assert not TrainingTimes(settings_folder()).needs_probe
    assert "about" not in quick.accessibleName(), "a guess is no such figure"
    measured = TrainingTime(
        kind_of(usual_recipe("quick")), "cpu", 0.0, 0.0, before_s=30.0, after_s=6.0, val_s=6.0, takes_s=3.6
    )
    TrainingTimes(settings_folder()).remember(measured)
    presenter.model.training.ended.emit("")
    # The toy project's takes are five times as long.
    assert quick.accessibleName() == "Quick look, about 3 minutes"
    assert quick.toolTip() == "As long as it took on this computer, for your takes"
    assert _card(view, "preset_best").toolTip() == guess
