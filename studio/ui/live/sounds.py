"""What is heard: the microphones there are, the one chosen, and a sound file in their place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.settings import NO_MICROPHONE
from studio.sound.sound_file import SoundInfo, sound_info
from studio.ui import messages, tasks
from studio.ui.live.source_card import LiveSourceCard
from studio.ui.session import MicrophoneRequest, Session

if TYPE_CHECKING:
    from studio.capture.microphone import AudioDevice


class MicrophonePresenter(QObject):
    """Thought of the source list.

    Signals:
        checked: the file that was offered is chosen, or is not: Start may be pressed again.
    """

    checked = Signal()

    def __init__(self, card: LiveSourceCard, session: Session) -> None:
        super().__init__(card)
        self._card, self._session = card, session
        self._devices: tuple[AudioDevice, ...] | None = None
        self._opening = tasks.LatestTask(self)  # the newest counts
        self.checking = False
        """Whether a file is being looked at."""
        card.refresh_requested.connect(self._look_anew)
        session.microphones_listed.connect(lambda: self.look(refresh=False))
        card.file_requested.connect(self._on_file)
        card.source_chosen.connect(self._on_chosen)
        self._show()

    @property
    def options(self) -> list[str]:
        """The words of `saia live` for what is chosen."""
        card, output = self._card, self._session.settings.audio_output
        if card.file is not None:
            return ["--file", str(card.file), *(["--output", output] if output else [])]
        return ["--device", card.device] if card.device else []

    def keep(self) -> None:
        """Remember the microphone: Record may choose another one later."""
        if self._card.file is None:
            self._session.change_settings(live_device=(self._card.device,))

    def remedy(self, what: str, remedy: str) -> str:
        """What to do about a failure: where Record holds the same microphone, that is likely why."""
        if self._card.file is not None or "could not be opened" not in what:
            return remedy
        if self._session.settings.audio_device != self._card.device:
            return remedy
        return self.tr(
            "Record holds it, and it serves one at a time: choose No microphone in Record, then go live."
        )

    def stands_in(self, heard: str) -> StudioError | None:
        """What to say where a microphone is heard that is not the one chosen."""
        card = self._card
        if card.file is not None or not card.device or heard == card.device:
            return None
        what = self.tr("{0} is not there: {1} is heard instead.").format(card.device, heard)
        return StudioError(what, self.tr("Stop, and choose the microphone you mean."))

    def look(self, refresh: bool) -> None:
        """List the microphones, anew where something was plugged in."""
        from studio.capture.microphone import input_devices

        tasks.run(
            lambda: input_devices(refresh),
            self._show,
            lambda _: self._show(()),  # Record says what is wrong with the sound system
            owner=self,
        )

    def _look_anew(self) -> None:
        """List them as they are now: by Record where it is there, for it has one open, and rests for that."""
        request = MicrophoneRequest()
        self._session.microphones_requested.emit(request)
        if not request.accepted:
            self.look(refresh=True)

    def offer(self, path: Path) -> None:
        """Choose a file, once it turns out to be a sound."""

        def good(info: SoundInfo) -> None:
            if info.duration > 0:
                self._choose(path)
            else:
                what = self.tr("{0} holds no sound.").format(path.name)
                bad(StudioError(what, self.tr("Choose another file.")))

        def bad(error: BaseException) -> None:
            self._choose(None)
            messages.show_error(self._card, error)

        self.checking = True
        self._card.show_opening(path)
        self._opening.run(lambda: sound_info(path), good, bad)

    def _on_chosen(self) -> None:
        """Somebody chose from the list: a file that is still being looked at is wanted no more."""
        self._opening.drop()
        self.keep()
        if self.checking:
            self.checking = False
            self.checked.emit()

    def _choose(self, path: Path | None) -> None:
        self.checking = False
        if path is not None:
            messages.dismiss_error(self._card)  # of a file offered before
        self._card.show_file(path)
        self.checked.emit()

    def _show(self, devices: tuple[AudioDevice, ...] | None = None) -> None:
        self._devices = devices if devices is not None else self._devices
        names = [device.name for device in self._devices or ()]
        self._card.show_devices(names, self._wanted, known=self._devices is not None)

    @property
    def _wanted(self) -> str:
        """The microphone chosen here, else the one that Record uses."""
        settings = self._session.settings
        wanted = settings.live_device[0] if settings.live_device else settings.audio_device
        return "" if wanted == NO_MICROPHONE else wanted

    def _on_file(self) -> None:
        kinds = self.tr("Sound (*.wav *.mp3 *.flac *.ogg *.m4a *.mp4 *.mov);;All files (*)")
        before = self._card.file
        start = str(before.parent if before is not None else Path.home())
        chosen, _ = QFileDialog.getOpenFileName(self._card, self.tr("Perform a file"), start, kinds)
        if chosen:
            self.offer(Path(chosen))
        else:
            self._card.show_file(None)
