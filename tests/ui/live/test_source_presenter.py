"""What Live listens to: never another microphone unannounced, and no file that is none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import QCoreApplication
from pytestqt.qtbot import QtBot

from studio.capture.microphone import AudioDevice
from studio.errors import StudioError
from studio.project import Project
from studio.settings import NO_MICROPHONE, Settings
from studio.ui import tasks
from studio.ui.live.model import LiveModel
from studio.ui.live.presenter import LivePresenter
from studio.ui.live.source_presenter import LiveSourcePresenter, MicrophonePresenter
from studio.ui.live.source_view import LiveSourceCard
from studio.ui.live.view import LiveView
from studio.ui.messages import Toast
from studio.ui.session import Session
from tests.inference.live.runs import add_run
from tests.ui.live.children import FakeChild, Room, ready


def microphones(*names: str) -> tuple[AudioDevice, ...]:
    return tuple(AudioDevice(name, i, 1, 48_000, i == 0) for i, name in enumerate(names))


@pytest.fixture
def sounds(qtbot: QtBot) -> Callable[..., tuple[LiveSourceCard, MicrophonePresenter, Session]]:
    def build(**settings: object) -> tuple[LiveSourceCard, MicrophonePresenter, Session]:
        session, card = Session(Settings().changed(**settings)), LiveSourceCard()
        qtbot.addWidget(card)
        return card, MicrophonePresenter(card, LiveModel(session, card), session), session

    return build


def words(card: LiveSourceCard) -> list[str]:
    return [card.source.itemText(i) for i in range(card.source.count())]


def args_of(card: LiveSourceCard, session: Session) -> list[str]:
    return LiveSourcePresenter(card, LiveModel(session, card), session).args


def choose(card: LiveSourceCard, text: str) -> None:
    card.source.setCurrentIndex(card.source.findText(text))
    card.source.activated.emit(card.source.currentIndex())


def test_a_microphone_that_is_gone_stays_chosen_and_says_so(
    sounds: Callable[..., tuple[LiveSourceCard, MicrophonePresenter, Session]],
) -> None:
    card, made, session = sounds(audio_device="Studio mic")
    assert card.source.currentText() == "Studio mic"  # nobody has looked yet
    made.show_devices(microphones("Webcam"))
    assert words(card) == ["Default microphone", "Studio mic (not found)", "Webcam", "Perform a file…"]
    assert card.source.currentText() == "Studio mic (not found)"
    assert card.device == "Studio mic"
    assert args_of(card, session) == ["--device", "Studio mic"]
    assert card.gone.isVisibleTo(card)
    assert card.gone.text() == "Studio mic was not found. Plug it in and refresh, or choose another."
    made.show_devices(microphones("Webcam", "Studio mic"))
    assert card.source.currentText() == "Studio mic"
    assert not card.gone.isVisibleTo(card)


def test_the_systems_own_stays_chosen_where_it_was_chosen(
    sounds: Callable[..., tuple[LiveSourceCard, MicrophonePresenter, Session]],
) -> None:
    card, made, session = sounds(audio_device="Studio mic")
    made.show_devices(microphones("Webcam", "Studio mic"))
    choose(card, "Default microphone")
    made.show_devices(microphones("Webcam", "Studio mic"))
    assert card.source.currentText().startswith("Default microphone")
    assert args_of(card, session) == []
    assert session.settings.live_device == ("",)
    again, _, _ = sounds(audio_device="Studio mic", live_device=("",))
    assert again.device == ""


def test_live_listens_to_the_systems_own_where_record_has_no_microphone(
    sounds: Callable[..., tuple[LiveSourceCard, MicrophonePresenter, Session]],
) -> None:
    card, _, _ = sounds(audio_device=NO_MICROPHONE)
    assert card.source.currentText().startswith("Default microphone")
    card, _, _ = sounds(audio_device=NO_MICROPHONE, live_device=("Studio mic",))
    assert card.device == "Studio mic"


def test_the_remedy_names_record_where_it_holds_the_same_microphone(
    sounds: Callable[..., tuple[LiveSourceCard, MicrophonePresenter, Session]],
) -> None:
    card, made, session = sounds(audio_device="Studio mic")
    what, own = "Studio mic could not be opened (Device unavailable).", "Close other programs that use it."
    taken = StudioError(what, own, code="device_unavailable")
    explained = made.explained(taken)
    assert isinstance(explained, StudioError)
    assert explained.remedy == (
        "Record holds it, and it serves one at a time: choose No microphone in Record, then go live."
    )
    other = StudioError("The run has no weights.", own)
    assert made.explained(other) is other
    session.change_settings(audio_device=NO_MICROPHONE)
    assert made.explained(taken) is taken
    made.save()
    assert card.device == "Studio mic"


def toasts(view: LiveView) -> str:
    found = view.window().findChildren(Toast)
    return " ".join(f"{toast.text.text()} {toast.remedy.text()}" for toast in found)


@pytest.fixture
def live(room: Callable[..., Room], toy_project: Project, child: FakeChild) -> Room:
    add_run(toy_project)
    return room(toy_project, child, live_device=("Studio mic",))


def test_another_microphone_is_announced(live: Room, child: FakeChild) -> None:
    view, _, _ = live
    view.source.start.click()
    child.told.emit(ready(("A",), (), source="Studio mic"))
    assert "instead" not in toasts(view)
    child.told.emit(ready(("A",), (), source="Studio mic 2"))
    assert "Studio mic is not connected; using Studio mic 2 instead." in toasts(view)


def write(path: Path) -> Path:
    soundfile.write(path, np.zeros(800, np.float32), 16_000)
    return path


def offer(presenter: LivePresenter, path: Path, qtbot: QtBot) -> None:
    presenter.microphones.offer(path)
    qtbot.waitUntil(lambda: not presenter.model.checking)


def test_a_sound_file_is_performed_instead_of_a_microphone(live: Room, tmp_path: Path, qtbot: QtBot) -> None:
    view, presenter, _ = live
    file = write(tmp_path / "声.wav")
    offer(presenter, file, qtbot)
    assert view.source.source.currentText() == "File: 声.wav"
    assert presenter.source.args[:2] == ["--file", str(file)]
    assert view.source.start.isEnabled()
    choose(view.source, "Default microphone")
    assert view.source.file is None
    assert presenter.source.args == []


def test_a_file_that_is_no_sound_is_a_sentence_and_the_choice_stays(
    live: Room, tmp_path: Path, qtbot: QtBot
) -> None:
    view, presenter, _ = live
    offer(presenter, write(tmp_path / "good.wav"), qtbot)
    none, empty = tmp_path / "notes.wav", tmp_path / "empty.wav"
    none.write_text("milk, bread")
    soundfile.write(empty, np.zeros(0, np.float32), 16_000)
    for file in (none, empty, tmp_path / "gone.wav"):
        offer(presenter, file, qtbot)
        assert file.name in toasts(view)
        assert view.source.file == tmp_path / "good.wav"
        assert view.source.start.isEnabled()


def test_a_microphone_chosen_meanwhile_stays_chosen(live: Room, tmp_path: Path) -> None:
    view, presenter, session = live
    card = view.source
    presenter.microphones.offer(write(tmp_path / "a.wav"))
    assert not card.start.isEnabled()
    choose(card, "Default microphone")
    assert card.start.isEnabled()
    assert session.settings.live_device == ("",)
    tasks.wait()
    QCoreApplication.processEvents()  # only now the file turns out to be a sound
    assert card.file is None
    assert card.source.currentText().startswith("Default microphone")


def test_dropped_sounds_are_performed_next(live: Room, tmp_path: Path, qtbot: QtBot) -> None:
    view, _, session = live
    files = write(tmp_path / "a.wav"), write(tmp_path / "b.wav")
    session.performance_dropped.emit(files)
    assert not view.source.start.isEnabled()  # until it has been looked at
    qtbot.waitUntil(lambda: view.source.file == files[0])
    assert view.source.start.isEnabled()
    assert "Live performs one sound at a time: a.wav was chosen." in toasts(view)


def test_a_dropped_sound_needs_no_run_of_ones_own(
    room: Callable[..., Room], toy_project: Project, tmp_path: Path, qtbot: QtBot
) -> None:
    view, _, session = room(toy_project)
    session.performance_dropped.emit((write(tmp_path / "a.wav"),))
    qtbot.waitUntil(lambda: view.source.file == tmp_path / "a.wav")
    assert view.source.start.isEnabled()
