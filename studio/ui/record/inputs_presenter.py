"""Presenter of the inputs card: devices and ports opened off the GUI thread, one after another."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, QTimer

from studio.capture.device_names import PERFORMER_TITLE, line_port, listed, performer_device, title_of
from studio.capture.health import dismissed
from studio.capture.snapshot import RecorderState, Snapshot
from studio.capture.trackers import EVERYWHERE, KNOWN_PORTS, free_ports
from studio.errors import StudioError
from studio.settings import NO_MICROPHONE
from studio.ui import messages
from studio.ui.language import native, sentences
from studio.ui.messages import counted
from studio.ui.record.inputs_view import InputsCard
from studio.ui.record.model import RecordModel
from studio.ui.record.phone_link import PhoneLink
from studio.ui.session import MicrophoneRequest, Session

if TYPE_CHECKING:
    from studio.capture.microphone import AudioDevice
    from studio.capture.recorder import Recorder


RETRY_MS = 3_000
"""What could not be opened is tried again this often: a port that another program frees, a microphone."""


class InputsPresenter(QObject):
    """Keeps the recorder's inputs as the person chose them, and remembers the choice.

    Args:
        card: the layout.
        model: of the tab.
        session: the settings, and other tabs' requests.
        list_devices: gives the microphones, anew where True; tests give one of their own.
    """

    def __init__(
        self,
        card: InputsCard,
        model: RecordModel,
        session: Session,
        list_devices: Callable[[bool], tuple[AudioDevice, ...]] | None = None,
    ) -> None:
        super().__init__(card)
        self._input_devices = list_devices or _input_devices
        self._card, self._model, self._session = card, model, session
        self._devices: tuple[AudioDevice, ...] = ()
        self._opening: set[str] = set()
        # Device and sample rate of what was opened last, or tried to be.
        self._sound_opened = "", 0
        self._retry = QTimer(self)
        self._retry.setInterval(RETRY_MS)
        self._retry.timeout.connect(self.retry)
        self._retry.start()
        self.phone = PhoneLink(self)
        self._show_motion_choices()
        card.phone.address.setText(session.settings.phone)
        self._show_devices()
        session.settings_changed.connect(self._on_settings)
        card.port_chosen.connect(lambda port: session.change_settings(vmc_port=port))
        card.more_ports_chosen.connect(
            lambda ports: session.change_settings(more_ports=tuple(str(port) for port in ports))
        )
        card.phone_chosen.connect(self._on_phone)
        model.phone_requested.connect(self._on_phone)
        model.phone_tried.connect(self.phone.connect_to)
        card.host_chosen.connect(lambda host: session.change_settings(vmc_host=host))
        card.device_chosen.connect(self._on_device)
        card.refresh_requested.connect(self.refresh)
        card.practice_toggled.connect(model.set_practising)
        model.practice_moved.connect(self._on_practice_moved)
        card.trackers_requested.connect(model.trackers_requested)
        card.webcam_stop_requested.connect(model.webcam_stop_requested)
        model.webcam_changed.connect(card.webcam.setVisible)
        card.clip_reset_requested.connect(model.clear_clip)
        session.microphones_requested.connect(self._on_requested)
        model.recorder_changed.connect(self._on_recorder)
        model.practice_changed.connect(self._on_practice)
        model.practice_changed.connect(self._follow_voice)
        model.finding_changed.connect(self._on_finding)
        # What was chosen while a take rolled is opened after it.
        for ended in (model.saved, model.failed):
            ended.connect(lambda _: self._open_motion())
            ended.connect(lambda _: self._follow_voice())
        model.polled.connect(self.follow_phone)
        # The performer may end by itself; a take that rolls goes on with its line, which is silent then.
        model.polled.connect(lambda _: self._follow_voice())
        model.text_due.connect(self._show_text)
        model.frame_due.connect(self._show_level)

    def retry_every(self, interval_ms: int) -> None:
        """Try what could not be opened again this often."""
        self._retry.setInterval(interval_ms)

    def close(self) -> None:
        """The window closes: open nothing any more."""
        self._retry.stop()
        self.phone.close()

    # -- showing ---------------------------------------------------------------------------------

    def _show_level(self, snap: Snapshot) -> None:
        if snap.device is not None and snap.audio_alive:
            self._card.meter.show_level(snap.peak_dbfs, snap.rms_dbfs, snap.hold_dbfs, snap.clipped)
        else:
            self._card.meter.clear()

    def _show_text(self, snap: Snapshot) -> None:
        card, model = self._card, self._model
        card.show_motion(*motion_text(snap))
        card.motion_text.setToolTip(" ".join((snap.avatar, *snap.senders)).strip())
        card.show_sources(*source_texts(snap))
        card.show_sound(sound_health(snap, model.problems))
        card.lock(self._session.rolling or bool(model.busy) or model.countdown.running)
        self._show_practice()

    def _follow_voice(self) -> None:
        """Record the performer's voice while it performs, and the person's microphone again after that."""
        if self._session.rolling or self._model.busy:
            return  # what it is recorded with stays in the list; it is asked again after the take
        if self._sound_opened != (self._model.sound_device, self._session.settings.sample_rate):
            self._show_devices()
            self._open_sound()

    def _on_device(self, name: str) -> None:
        self._model.practice_voice = line_port(name) is not None
        if not self._model.practice_voice:
            self._session.change_settings(audio_device=name)
        self._follow_voice()

    def _on_practice(self) -> None:
        self._show_practice()
        if self._session.rolling and not self._model.practice.on:
            recorder = self._model.recorder
            voice = recorder is not None and recorder.snapshot().device == PERFORMER_TITLE
            what, remedy = dismissed(voice)
            messages.show_note(self._card, native(what), native(remedy))

    def _show_practice(self) -> None:
        self._card.show_practice(self._model.practice.on, self._model.practice.busy)

    # -- a phone ---------------------------------------------------------------------------------

    def follow_phone(self, snap: Snapshot) -> None:
        """Ask the phone for its face while it is listened to, and show whether it sends."""
        self.phone.listen(snap.ports)
        listens = self.phone.listens
        if listens and not self.phone.address and self._session.settings.phone and not self.phone.problem:
            self.phone.connect_to(self._session.settings.phone)
        elif not listens and self.phone.address:
            self.phone.connect_to("")
        self.phone.follow(snap)
        problem = self.phone.problem
        words = self.phone.status if problem is None else sentences(*problem)
        self._model.phone_status = self.phone.address, words, problem is not None
        self._card.phone.show_phone(*self._model.phone_status)
        if problem is not None:
            self._model.problems["phone"] = problem
        else:
            self._model.problems.pop("phone", None)

    def _on_finding(self) -> None:
        """A phone that was only tried is asked no more, and the one that was chosen is asked again."""
        if not self._model.finding:
            self.phone.connect_to(self._session.settings.phone)
        self._open_motion()

    def _on_phone(self, address: str) -> None:
        self.phone.connect_to(address)
        choice: dict[str, object] = {"phone": self.phone.address}
        # A phone is in the network and not this computer: it could not send where only that may.
        if self.phone.address and self._session.settings.vmc_host != EVERYWHERE:
            choice["vmc_host"] = EVERYWHERE
        self._session.change_settings(**choice)

    # -- microphones -----------------------------------------------------------------------------

    def refresh(self) -> None:
        """Look for microphones again; the open one is closed for that moment."""
        recorder = self._model.recorder
        if recorder is not None and not self._session.rolling:
            # PortAudio lists devices anew only while no stream is open.
            self._model.in_order(recorder.close_audio, lambda _: self._list_devices(refresh=True))

    def _on_requested(self, request: MicrophoneRequest) -> None:
        """Another tab looks for microphones; a recording is not interrupted for that."""
        request.accepted = True
        if self._session.rolling:
            self._list_devices(refresh=False, asked=True)
            why = self.tr("What was plugged in just now cannot be found while a take is recorded.")
            messages.show_note(self._card, why, self.tr("Look again after the take."))
        elif self._model.recorder is None:
            self._list_devices(refresh=True)
        else:
            self.refresh()

    # -- opening ---------------------------------------------------------------------------------

    def _on_recorder(self, recorder: Recorder | None) -> None:
        """Open the chosen inputs of a new recorder."""
        if recorder is not None:
            recorder.sound_watch.may_refresh = lambda: self._model.may_refresh
            self._open_motion()
            self._open_sound()
            self._list_devices(refresh=False)

    def retry(self) -> None:
        """Try once more what could not be opened, while nothing is recorded."""
        if self._model.recorder is None or self._session.rolling:
            return
        if "motion" in self._model.problems and "motion" not in self._opening:
            self._open_motion(again=True)
        if "sound" in self._model.problems and "sound" not in self._opening:
            self._open_sound(again=True)

    def _list_devices(self, refresh: bool, asked: bool = False) -> None:
        def done(devices: tuple[AudioDevice, ...]) -> None:
            self._devices = devices
            self._show_devices()
            if refresh:
                self._open_sound()
            if refresh or asked:
                self._session.microphones_listed.emit()

        def failed(error: BaseException) -> None:
            self._note("sound", error)
            if refresh or asked:
                # Who waits for the list goes on with what it has.
                self._session.microphones_listed.emit()

        self._model.in_order(lambda: self._input_devices(refresh), done, failed)

    def _show_devices(self) -> None:
        default = next((device.name for device in self._devices if device.default), "")
        self._card.device.setToolTip(self.tr("The system's own is {0}.").format(default) if default else "")
        own, chosen = self.tr("Default microphone"), self._model.sound_device
        names = [("", own)]
        known = [device.name for device in self._devices]
        names += [(name, title_of(name, own)) for name in listed(known, chosen)]
        practice = self._model.practice
        if practice.on:
            names.append((performer_device(practice.voice_port), self.tr("Practice performer")))
        names.append((NO_MICROPHONE, self.tr("No microphone")))
        self._card.show_devices(names, chosen)

    def _show_motion_choices(self) -> None:
        settings = self._session.settings
        self._card.show_choices(settings.vmc_port, settings.vmc_host)
        self._card.show_more_ports([int(text) for text in settings.more_ports if text.isdigit()])

    def _on_practice_moved(self, taken: int, used: int) -> None:
        what = self.tr("Another program uses port {0}, so motion is received on port {1} now.")
        remedy = self.tr("Choose {0} again under Motion when you record with your own tracker.")
        messages.show_note(self._card, what.format(taken, used), remedy.format(taken))

    def _on_settings(self, changed: frozenset[str]) -> None:
        """Chosen here or in the dialog: what is listened to follows."""
        if changed & {"vmc_port", "vmc_host", "more_ports"}:
            self._show_motion_choices()
            self._open_motion()
        if changed & {"audio_device", "sample_rate"}:
            self._show_devices()
            self._open_sound()
        if "phone" in changed and self._session.settings.phone:
            self._card.phone.address.setText(self._session.settings.phone)
        if "vmc_port" in changed:
            self._model.redirect_practice(self._session.settings.vmc_port)

    def _open_motion(self, again: bool = False) -> None:
        recorder = self._model.recorder
        if recorder is None:
            return
        chosen = self._session.settings
        port, host = chosen.vmc_port, chosen.vmc_host
        also = [int(text) for text in chosen.more_ports if text.isdigit()]
        finding = self._model.finding

        def work() -> None:
            if recorder.snapshot().state == RecorderState.ROLLING:
                return  # a take never loses its motion to other ports
            try:
                if finding:
                    # Let go of what is open, or it would be taken for another program's.
                    recorder.close_motion()
                    free = free_ports((port, *also, *KNOWN_PORTS), EVERYWHERE)
                    # Where all are taken, the port chosen says by its error what to do.
                    recorder.open_motion(free[0] if free else port, EVERYWHERE, also=free[1:])
                else:
                    recorder.open_motion(port, host, also=also)
            except StudioError:
                # Not the one before: the card names the port that was asked for.
                recorder.close_motion()
                raise

        self._open("motion", work, again)

    def _open_sound(self, again: bool = False) -> None:
        recorder = self._model.recorder
        if recorder is None or self._session.rolling or self._model.busy:
            # A take never loses its sound to another microphone: that is opened after it.
            return
        device, rate = self._model.sound_device, self._session.settings.sample_rate
        refresh = again and self._model.may_refresh
        self._sound_opened = device, rate

        def work() -> None:
            recorder.close_audio()
            if device == NO_MICROPHONE:
                return
            if refresh:
                self._input_devices(True)
            recorder.open_audio(device or None, sample_rate=rate)

        self._open("sound", work, again)

    def _open(self, which: str, work: Callable[[], None], again: bool) -> None:
        """Open an input; the sentence of one that is tried again stays until it is open."""
        if not again:
            self._model.problems.pop(which, None)
        self._opening.add(which)

        def done(_result: object) -> None:
            self._opening.discard(which)
            had = self._model.problems.pop(which, None)
            if again and had is not None and which == "sound":
                self._list_devices(refresh=False)

        def failed(error: BaseException) -> None:
            self._opening.discard(which)
            self._note(which, error)

        self._model.in_order(work, done, failed)

    def _note(self, which: str, error: BaseException) -> None:
        """Keep a problem on the health card; only what is unexpected pops up."""
        if isinstance(error, StudioError):
            self._model.problems[which] = (error.what, error.in_window)
        else:
            messages.show_error(self._card, error)


def motion_text(snap: Snapshot) -> tuple[str, str]:
    """Who sends what, and its health."""
    if not snap.motion_alive:
        return (_tr("waiting"), "") if snap.port else (_tr("not open"), "warn")
    return _tr("{0} bones  {1} shapes").format(len(snap.bone_names), len(snap.shape_names)), "good"


def source_texts(snap: Snapshot) -> tuple[list[str], str]:
    """Where several senders are heard: a line for each of what it gives, and all of its channels."""
    if len(snap.sources) < 2:
        return [], ""
    lines, details = [], []
    for source in sorted(snap.sources, key=lambda one: -len(one.bones)):
        parts = [counted(len(source.bones), _tr("1 bone"), _tr("{0} bones"))] if source.bones else []
        parts += [counted(len(source.shapes), _tr("1 shape"), _tr("{0} shapes"))] if source.shapes else []
        lines.append(_tr("{0} from {1}").format(", ".join(parts), source.title))
        details.append(f"{source.title}: {', '.join((*source.bones, *source.shapes))}")
    return lines, "\n\n".join(details)


def sound_health(snap: Snapshot, problems: dict[str, tuple[str, str]]) -> str:
    """Health of the microphone: "good", "warn", or "" where none is chosen."""
    if "sound" in problems or (snap.device is not None and not snap.audio_alive):
        return "warn"
    if snap.device is None:
        return ""
    return "warn" if snap.clipped or "silent" in snap.troubled else "good"


def _input_devices(refresh: bool) -> tuple[AudioDevice, ...]:
    """The microphones there are. Runs on a pool thread."""
    # Not at the top: it loads the sound library, which takes a tenth of a second of the window's start.
    from studio.capture.microphone import input_devices

    return input_devices(refresh)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Inputs", text)
