"""Presenter of the list of sources: the microphones there are, the one chosen, a sound file instead."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.settings import NO_MICROPHONE
from studio.sound.sound_file import SoundInfo, sound_info
from studio.ui import messages, tasks
from studio.ui.live.model import LiveModel
from studio.ui.live.source_view import LiveSourceCard
from studio.ui.session import MicrophoneRequest, Session

if TYPE_CHECKING:
    from studio.capture.microphone import AudioDevice


class MicrophonePresenter(QObject):
    """Fills the list of sources, and opens the file that is offered."""

    def __init__(self, card: LiveSourceCard, model: LiveModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        self._devices: tuple[AudioDevice, ...] | None = None
        self._opening = tasks.LatestTask(self)
        card.refresh_requested.connect(self._on_refresh)
        card.file_requested.connect(self._on_file)
        card.source_chosen.connect(self._on_chosen)
        session.microphones_listed.connect(lambda: self.refresh())
        session.performance_dropped.connect(self._on_dropped)
        model.about_to_start.connect(self.save)
        model.ready_changed.connect(self._on_ready)
        self._show()

    def save(self) -> None:
        """Remember the microphone: Record may choose another one later."""
        if self._card.file is None:
            self._session.change_settings(live_device=(self._card.device,))

    def explained(self, error: BaseException) -> BaseException:
        """A failure with what to do about it: where Record holds the same microphone, that is likely why."""
        if not isinstance(error, StudioError) or error.code != "device_unavailable":
            return error
        if self._card.file is not None or self._session.settings.audio_device != self._card.device:
            return error
        remedy = self.tr(
            "Record holds it, and it serves one at a time: choose No microphone in Record, then go live."
        )
        return StudioError(error.what, remedy, code=error.code)

    def _on_ready(self) -> None:
        """Say where a microphone is heard that is not the one chosen."""
        card, ready = self._card, self._model.ready
        if ready is None or card.file is not None or not card.device or ready.source == card.device:
            return
        what = self.tr("{0} is not there: {1} is heard instead.").format(card.device, ready.source)
        messages.show_warning(card, what, self.tr("Stop, and choose the microphone you mean."))

    def refresh(self, anew: bool = False) -> None:
        """List the microphones; anew, where something was plugged in since, which takes a moment."""
        from studio.capture.microphone import input_devices

        tasks.run(
            lambda: input_devices(anew),
            self.show_devices,
            lambda _: self.show_devices(()),  # Record says what is wrong with the sound system
            owner=self,
        )

    def _on_refresh(self) -> None:
        """List them anew: Record does it where it has one open, which it closes for that moment."""
        request = MicrophoneRequest()
        self._session.microphones_requested.emit(request)
        if not request.accepted:
            self.refresh(anew=True)

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

        self._model.show_checking(True)
        self._card.show_opening(path)
        self._opening.run(lambda: sound_info(path), good, bad)

    def _on_chosen(self) -> None:
        """Somebody chose from the list: a file that is still being opened is not chosen any more."""
        self._opening.drop()
        self.save()
        self._model.use_file(self._card.file)

    def _choose(self, path: Path | None) -> None:
        if path is not None:
            messages.dismiss_error(self._card)  # of a file offered before
        self._card.show_file(path)
        self._model.use_file(self._card.file)

    def show_devices(self, devices: tuple[AudioDevice, ...]) -> None:
        """List these microphones."""
        self._devices = devices
        self._show()

    def _show(self) -> None:
        names = [device.name for device in self._devices or ()]
        self._card.show_devices(names, self._chosen, known=self._devices is not None)

    @property
    def _chosen(self) -> str:
        """The microphone chosen here, else the one that Record uses."""
        settings = self._session.settings
        chosen = settings.live_device[0] if settings.live_device else settings.audio_device
        return "" if chosen == NO_MICROPHONE else chosen

    def _on_dropped(self, paths: Sequence[Path]) -> None:
        """Sounds were dropped: the first is performed next, when Go live is pressed."""
        path = paths[0]
        if self._model.task.running:
            messages.show_note(self._card, self.tr("Stop first, then drop {0} again.").format(path.name))
        elif self._model.run is None:
            messages.show_note(
                self._card, self.tr("Train a run first: it can perform {0}.").format(path.name)
            )
        else:
            self.offer(path)
            if len(paths) > 1:
                one = self.tr("One sound is performed at a time: {0} is chosen.")
                messages.show_note(self._card, one.format(path.name))

    def _on_file(self) -> None:
        kinds = self.tr("Sound (*.wav *.mp3 *.flac *.ogg *.m4a *.mp4 *.mov);;All files (*)")
        before = self._card.file
        start = str(before.parent if before is not None else Path.home())
        chosen, _ = QFileDialog.getOpenFileName(self._card, self.tr("Perform a file"), start, kinds)
        if chosen:
            self.offer(Path(chosen))
        else:
            self._card.show_file(None)  # the list goes back to what was chosen before
