"""Thought behind the inputs card: devices and ports opened off the GUI thread, one after another."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QThreadPool, QTimer

from studio.capture.snapshot import Snapshot
from studio.errors import InputError, StudioError
from studio.settings import NO_MICROPHONE
from studio.ui import messages, tasks
from studio.ui.record.inputs import EVERYWHERE, InputsCard
from studio.ui.record.phone import PhoneLink
from studio.ui.session import Session
from studio.vmc.decode import IFACIALMOCAP_PORT

if TYPE_CHECKING:
    from studio.capture.microphone import AudioDevice
    from studio.capture.recorder import Recorder


RETRY_MS = 3_000
"""What could not be opened is tried again this often: a port that another program lets go, a microphone."""


class InputsPresenter(QObject):
    """Keeps the recorder's inputs as the person chose them, and remembers the choice."""

    def __init__(self, card: InputsCard, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._card = card
        self._session = session
        self._recorder: Recorder | None = None
        self._in_order = QThreadPool(self)
        self._in_order.setMaxThreadCount(1)
        self._devices: tuple[AudioDevice, ...] = ()
        self.problems: dict[str, tuple[str, str]] = {}
        """What could not be opened: "motion" or "sound" -> (sentence, remedy)."""
        self.may_refresh = True
        """Whether looking for microphones anew would cut off no sound that is being played."""
        self._trying: set[str] = set()
        self._retry = QTimer(self)
        self._retry.setInterval(RETRY_MS)
        self._retry.timeout.connect(self._on_retry)
        self._retry.start()
        settings = session.settings
        card.show_choices(settings.vmc_port, settings.vmc_host)
        self._show_devices()
        card.port_chosen.connect(lambda port: self._choose_motion(vmc_port=port))
        card.show_more_ports([int(text) for text in settings.more_ports if text.isdigit()])
        card.more_ports_chosen.connect(
            lambda ports: self._choose_motion(more_ports=tuple(str(port) for port in ports))
        )
        self.phone = PhoneLink(self)
        card.phone.address.setText(settings.phone)
        card.phone_chosen.connect(self._on_phone_chosen)
        card.host_chosen.connect(lambda host: self._choose_motion(vmc_host=host))
        card.device_chosen.connect(self._choose_device)
        card.refresh_requested.connect(self.refresh)
        session.microphones_wanted.connect(self._on_wanted)

    def attach(self, recorder: Recorder | None) -> None:
        """Open the chosen inputs of a new recorder."""
        self._recorder = recorder
        if recorder is not None:
            recorder.sound_watch.may_refresh = lambda: self.may_refresh
            self._open_motion()
            self._open_sound()
            self._list_devices(refresh=False)

    def close(self) -> None:
        """Wait until nothing is being opened any more."""
        self._retry.stop()
        self.phone.close()
        self._recorder = None
        self._in_order.waitForDone(5_000)

    def show(self, snap: Snapshot) -> None:
        """Follow a look at the recorder: whether the phone that was asked sends."""
        listens = IFACIALMOCAP_PORT in snap.ports
        if listens and not self.phone.address and self._session.settings.phone and not self.phone.problem:
            self.phone.connect_to(self._session.settings.phone)
        elif not listens and self.phone.address:
            self.phone.connect_to("")
        self.phone.follow(snap)
        self._card.phone.show_phone(self.phone.address, self.phone.words)
        if self.phone.problem is not None:
            self.problems["phone"] = self.phone.problem
        else:
            self.problems.pop("phone", None)

    def _on_phone_chosen(self, address: str) -> None:
        """Ask a phone, which is in the network and not this computer."""
        self.phone.connect_to(address)
        choice: dict[str, object] = {"phone": self.phone.address}
        if self.phone.address and self._session.settings.vmc_host != EVERYWHERE:
            choice["vmc_host"] = EVERYWHERE
            self._card.show_choices(self._session.settings.vmc_port, EVERYWHERE)
            self._choose_motion(**choice)
        else:
            self._session.change_settings(**choice)

    def refresh(self) -> None:
        """Look for microphones again; the open one is let go for that moment."""
        recorder = self._recorder
        if recorder is not None and not self._session.rolling:
            self.later(recorder.close_audio, lambda _r: self._list_devices(refresh=True))

    def _on_wanted(self) -> None:
        """Another room looks for microphones; a recording is not interrupted for that."""
        if self._session.rolling:
            self._list_devices(refresh=False, asked=True)
            why = self.tr("What was plugged in just now cannot be found while a take is recorded.")
            messages.show_note(self._card, why, self.tr("Look again after the take."))
        elif self._recorder is None:
            self._list_devices(refresh=True)
        else:
            self.refresh()

    def _on_retry(self) -> None:
        """Once more what could not be opened, while nothing is recorded."""
        if self._recorder is None or self._session.rolling:
            return
        if "motion" in self.problems and "motion" not in self._trying:
            self._open_motion(again=True)
        if "sound" in self.problems and "sound" not in self._trying:
            self._open_sound(again=True)

    def _list_devices(self, refresh: bool, asked: bool = False) -> None:
        from studio.capture.microphone import input_devices

        def done(devices: tuple[AudioDevice, ...]) -> None:
            self._devices = devices
            self._show_devices()
            if refresh:
                self._open_sound()
            if refresh or asked:
                self._session.microphones_listed.emit()

        def failed(error: BaseException) -> None:
            self._note("sound", error)
            if refresh or asked:  # who waits for the list goes on with what it has
                self._session.microphones_listed.emit()

        self.later(lambda: input_devices(refresh), done, failed)

    def _show_devices(self) -> None:
        default = next((device.name for device in self._devices if device.default), "")
        self._card.device.setToolTip(self.tr("The system's own is {0}.").format(default) if default else "")
        names = [("", self.tr("System's microphone"))]
        names += [(device.name, device.name) for device in self._devices]
        names.append((NO_MICROPHONE, self.tr("No microphone")))
        self._card.show_devices(names, self._session.settings.audio_device)

    def _choose_motion(self, **choice: object) -> None:
        self._session.change_settings(**choice)
        self._open_motion()

    def _choose_device(self, name: str) -> None:
        self._session.change_settings(audio_device=name)
        self._open_sound()

    def _open_motion(self, again: bool = False) -> None:
        recorder = self._recorder
        if recorder is None:
            return
        chosen = self._session.settings
        port, host = chosen.vmc_port, chosen.vmc_host
        also = [int(text) for text in chosen.more_ports if text.isdigit()]

        def work() -> None:
            try:
                recorder.open_motion(port, host, also=also)
            except StudioError:
                recorder.close_motion()  # not the one before: the card names the port that was asked for
                raise

        self._open("motion", work, again)

    def _open_sound(self, again: bool = False) -> None:
        recorder = self._recorder
        if recorder is None:
            return
        device, rate = self._session.settings.audio_device, self._session.settings.sample_rate
        refresh = again and self.may_refresh

        def work() -> None:
            from studio.capture.microphone import input_devices

            recorder.close_audio()
            if device == NO_MICROPHONE:
                return
            if refresh:
                input_devices(refresh=True)
            recorder.open_audio(device or None, sample_rate=rate)

        self._open("sound", work, again)

    def _open(self, which: str, work: Callable[[], None], again: bool) -> None:
        """Open an input; the sentence of one that is tried again stays until it is open."""
        if not again:
            self.problems.pop(which, None)
        self._trying.add(which)

        def done(_result: object) -> None:
            self._trying.discard(which)
            had = self.problems.pop(which, None)
            if again and had is not None and which == "sound":
                self._list_devices(refresh=False)

        def failed(error: BaseException) -> None:
            self._trying.discard(which)
            self._note(which, error)

        self.later(work, done, failed)

    def _note(self, which: str, error: BaseException) -> None:
        """Keep a problem on the health card; only what is unexpected pops up."""
        if isinstance(error, StudioError):
            remedy = error.in_window if isinstance(error, InputError) else error.remedy
            self.problems[which] = (error.what, remedy)
        else:
            messages.show_error(self._card, error)

    def later(
        self,
        work: Callable[[], object],
        on_done: Callable[..., None],
        on_error: Callable[[BaseException], None] | None = None,
    ) -> None:
        """Do something with the inputs after all that was asked before has been done."""
        tasks.run(work, on_done, on_error, owner=self, pool=self._in_order)
