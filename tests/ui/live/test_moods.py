"""Moods by key in Live: chips with their keys, and a real child that is told."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from studio.ipc.commands import Command
from studio.project import Project
from tests.inference.live.runs import add_run
from tests.inference.live.test_steps import speech
from tests.ui.live.children import FakeChild, Room, ready, state


def test_keys_choose_the_moods_of_the_run_and_0_none(
    room: Callable[..., Room], toy_project: Project, child: FakeChild, qtbot: QtBot
) -> None:
    add_run(toy_project, moods=("happy", "sad"))
    view, _, _ = room(toy_project, child)
    chips = view.controls.moods.chips
    assert [chip.text() for chip in chips.values()] == ["0  none", "1  happy", "2  sad"]
    assert not chips["mood_1"].isEnabled()
    view.source.start.click()
    child.told.emit(ready(("A",), ()))
    view.activateWindow()
    qtbot.waitUntil(view.isActiveWindow)
    # Also where a list has the keyboard, which would else look for an entry that begins so.
    for where, key, said in ((view, "1", "happy"), (view.source.tuning, "2", "sad"), (view, "0", "")):
        qtbot.keyClick(where, getattr(Qt.Key, f"Key_{key}"))
        assert child.commands[-1] == Command("mood", said)
    before = len(child.commands)
    qtbot.keyClick(view.send.rows[0].port, Qt.Key.Key_1)
    assert len(child.commands) == before, "a digit of a port is no mood"
    child.told.emit(state(mood="happy"))  # written before the child heard of the last key
    assert chips["mood_0"].isChecked()
    child.end()
    assert chips["mood_0"].isChecked()
    assert not chips["mood_1"].isEnabled()


def test_a_run_without_moods_has_no_chips(room: Callable[..., Room], toy_project: Project) -> None:
    add_run(toy_project)
    view, _, _ = room(toy_project)
    assert not view.controls.moods.isVisible()


@pytest.mark.slow
def test_the_performance_plays_the_mood_of_the_key(
    room: Callable[..., Room], toy_project: Project, tmp_path: Path, qtbot: QtBot
) -> None:
    sound = tmp_path / "speech.wav"
    soundfile.write(sound, np.tile(speech(4.0), 10), 16_000)
    add_run(toy_project, moods=("happy",))
    view, presenter, _ = room(toy_project)
    view.source.show_file(sound)
    presenter.model.use_file(sound)
    view.source.start.click()
    qtbot.waitUntil(lambda: presenter.model.state is not None, timeout=60_000)
    view.activateWindow()
    qtbot.waitUntil(view.isActiveWindow)
    qtbot.keyClick(view, Qt.Key.Key_1)
    qtbot.waitUntil(
        lambda: presenter.model.state is not None and presenter.model.state.mood == "happy", timeout=60_000
    )
    assert view.controls.moods.chips["mood_1"].isChecked()
    view.source.start.click()
    qtbot.waitUntil(lambda: not presenter.model.task.running, timeout=60_000)
