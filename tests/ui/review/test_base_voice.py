"""Before the first take: Review offers the base voice, and shows what it makes of a sound."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.settings import Settings
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from tests.inference.live.runs import add_run

Tab = tuple[ReviewView, ReviewPresenter]


@pytest.fixture
def session(tmp_path: Path) -> Session:
    """An empty project is open."""
    session = Session(Settings())
    session.project = Project.create(tmp_path / "New")
    return session


def test_an_empty_review_asks_for_a_sound(opened: Tab) -> None:
    view, _ = opened
    assert view.empty.isVisible()
    assert view.empty.button is not None
    asked: list[bool] = []
    view.sources_card.add_requested.disconnect()  # else it would open the dialog of the system
    view.sources_card.add_requested.connect(lambda: asked.append(True))
    view.empty.button.click()
    assert asked == [True]


@pytest.mark.slow
def test_a_sound_in_an_empty_project_moves_the_avatar(qtbot: QtBot, opened: Tab, tmp_path: Path) -> None:
    view, presenter = opened
    chooser = view.bar.first.run
    assert [chooser.itemText(i) for i in range(chooser.count())] == ["Captured motion only", "Base voice"]
    sound = tmp_path / "voice.wav"
    soundfile.write(sound, np.random.default_rng(1).normal(0, 0.1, 3 * 16_000).astype(np.float32), 16_000)
    presenter.sources.add([sound])
    qtbot.waitUntil(lambda: presenter.model.complete, timeout=120_000)
    assert chooser.currentText() == "Base voice"
    assert view.stage.predicted.isVisible()
    assert presenter.model.name == "voice_base_voice"


def test_ones_own_runs_come_first_and_are_compared_with_it_last(opened: Tab, session: Session) -> None:
    view, presenter = opened
    train = view.findChild(QPushButton, "review_go_train")
    assert train is not None
    assert not train.isHidden(), "a run of one's own is still to be had"
    assert session.project is not None
    run = add_run(session.project)
    presenter.deactivate()
    presenter.activate()
    assert presenter.model.newest_run == run.id
    assert view.bar.first.run.currentData() == run.id
    assert train.isHidden()
    view.bar.two.click()
    assert view.bar.second.run.currentText() == "Base voice"
