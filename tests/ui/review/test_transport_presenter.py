"""Slow motion, loops and views, by the real buttons."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from pytestqt.qtbot import QtBot

from studio.training.styles import RunSelection
from studio.ui.review.model import A, B
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView

Tab = tuple[ReviewView, ReviewPresenter]


def _trigger(view: ReviewView, name: str) -> None:
    action = view.findChild(QAction, name)
    assert action is not None
    action.trigger()


def test_slow_motion_holds_for_the_next_recording_too(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    _trigger(view, "speed_0.5")
    first = presenter.model.player
    assert first is not None
    assert (view.speed.text(), first.speed) == ("0.5x", 0.5)
    view.play.click()
    qtbot.waitUntil(lambda: view.timeline.playhead > 0.2)
    assert presenter.model.player is first
    view.sources.setCurrentRow(0)
    qtbot.waitUntil(lambda: presenter.model.player not in (None, first))
    assert presenter.model.player is not None
    assert presenter.model.player.speed == 0.5


def test_what_is_selected_is_repeated(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    view.timeline.span_selected.emit((1.0, 1.4))
    view.loop.click()
    player = presenter.model.player
    assert player is not None
    assert player.loop == (1.0, 1.4)
    assert player.position == pytest.approx(1.0)
    view.play.click()
    qtbot.waitUntil(lambda: player.position > 1.2)
    qtbot.waitUntil(lambda: player.position < 1.15)
    assert player.playing


def test_the_other_run_is_seen_at_once_while_it_plays(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    model, truth = presenter.model, presenter.model.captured.motion
    assert truth is not None
    weak = replace(truth, shapes=(0.3 * truth.shapes).astype(np.float32))
    wanted = RunSelection("quick_001", "calm"), RunSelection("quick_001", "calm", seed=3)
    model.two = True
    view.bar.show_two(True)
    for side, motion in ((A, truth), (B, weak)):
        model.sides[side].selection, model.sides[side].requested = wanted[side], True
        presenter.runs.tasks[side].predicted.emit(motion)
    qtbot.waitUntil(lambda: model.both_ready)
    view.loop.click()
    view.play.click()
    qtbot.waitUntil(lambda: view.timeline.playhead > 0.1)
    player = model.player
    assert player is not None
    for front in (B, A, B):
        qtbot.keyClick(view, Qt.Key.Key_B)
        tuned = model.sides[front].tuned
        assert tuned is not None
        assert model.tuned is tuned.motion, "at once, not after it was made again"
        assert player.playing
    assert tuple(side.selection for side in model.sides) == wanted


def test_views_and_the_turntable_move_both_figures(qtbot: QtBot, tab: Tab) -> None:
    view, _ = tab
    figures = view.stage.predicted.figure, view.stage.captured.figure
    for name in ("view_front", "view_face"):
        _trigger(view, name)
    assert [(one.orbit.azimuth, one.orbit.zoom) for one in figures] == [(0.0, 0.25)] * 2
    view.camera.turntable.trigger()
    qtbot.waitUntil(lambda: figures[0].orbit.azimuth > 2.0)
    _trigger(view, "view_back")
    assert not view.camera.turntable.isChecked(), "a view that was chosen stays"
    assert abs(figures[1].orbit.azimuth) == 180.0
