"""The child that performs always ends: by itself, at once while it gets ready, by force where it hangs."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import soundfile
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui.live.task import Phase
from studio.ui.messages import Toast
from tests.formats.avatars import Maker
from tests.inference.live.runs import add_run
from tests.inference.live.test_steps import speech
from tests.ui.live.children import Room


@pytest.fixture
def live(room: Callable[..., Room], toy_project: Project, tmp_path: Path, qtbot: QtBot) -> Room:
    """A file to perform, heard by nobody: no sound device is needed."""
    add_run(toy_project)
    built = room(toy_project, audio_output="none")
    soundfile.write(tmp_path / "voice.wav", speech(60.0), 16_000)
    built[1].microphones.offer(tmp_path / "voice.wav")
    qtbot.waitUntil(built[0].source.start.isEnabled)
    return built


@pytest.mark.slow
def test_what_gets_ready_is_left_at_once(live: Room, qtbot: QtBot) -> None:
    view, presenter, _ = live
    view.source.start.click()
    assert view.source.start.text() == "Starting…"
    assert view.source.start.isEnabled()
    view.source.start.click()
    assert view.source.start.text() == "Ending…"
    assert not view.source.start.isEnabled()
    qtbot.waitUntil(lambda: not presenter.model.task.running)
    assert view.source.start.text() == "Go live"
    assert not view.findChildren(Toast)  # that is no failure


@pytest.mark.slow
def test_that_nobody_hears_a_file_is_said_for_as_long_as_it_is_so(live: Room, qtbot: QtBot) -> None:
    view, presenter, session = live
    session.change_settings(audio_output="No such loudspeaker")
    view.source.start.click()
    qtbot.waitUntil(lambda: presenter.model.task.phase == Phase.LIVE)
    said: list[str] = []
    presenter.model.noticed.connect(said.append)
    gone = "Live: voice.wav is performed, but you can't hear it."
    # First as a notice with what to do, which goes; then for good.
    qtbot.waitUntil(lambda: view.status.text().startswith(gone))
    assert presenter.model.state is not None
    assert presenter.model.state.unheard
    assert view.status.text() == f"{gone} {presenter.model.state.unheard}"
    view.source.start.click()
    qtbot.waitUntil(lambda: not presenter.model.task.running)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a process is not stopped by a signal there")
def test_an_avatar_performs_a_file_and_one_that_hangs_is_ended(
    live: Room, tmp_path: Path, qtbot: QtBot
) -> None:
    view, presenter, _ = live
    view.stage.avatar.wanted.emit(Maker(1).write(tmp_path / "me.vrm"))
    view.source.start.click()
    qtbot.waitUntil(lambda: presenter.model.task.phase == Phase.LIVE)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    qtbot.waitUntil(lambda: bool(view.meters.shown_names))
    qtbot.waitUntil(lambda: presenter.model.state is not None)
    known = "A file is read ahead, so voice and lips are in sync."
    qtbot.waitUntil(lambda: view.latency.words.text() == known)
    os.kill(presenter.model.task.pid, signal.SIGSTOP)
    view.source.start.click()
    presenter.model.task.force()
    qtbot.waitUntil(lambda: not presenter.model.task.running)
    said = [(toast.text.text(), toast.remedy.text()) for toast in view.findChildren(Toast)]
    ended = "Live stopped responding and was ended."
    assert (ended, "Nothing is lost: you can go live again.") in said
    assert view.source.start.text() == "Go live"
    assert view.source.start.isEnabled()
    assert view.meters.shown_names == ()
