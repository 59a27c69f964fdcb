"""Presenter of the health card, and of what the status strip says of motion and sound."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication, QObject

from studio.capture.device_names import DEFAULT, PERFORMER_TITLE, line_port
from studio.capture.health import is_quiet
from studio.capture.snapshot import Snapshot
from studio.settings import NO_MICROPHONE
from studio.ui.language import native
from studio.ui.record.health_view import HealthCard
from studio.ui.record.model import RecordModel
from studio.ui.session import Session

Finding = tuple[str, str, str]
"""Sentence, remedy, health ("good", "warn" or "")."""


class HealthPresenter(QObject):
    """Puts a look at the recorder into words."""

    def __init__(self, card: HealthCard, model: RecordModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        model.polled.connect(self._show_strip)
        model.text_due.connect(self._show_card)

    def _show_strip(self, snap: Snapshot) -> None:
        # In the other tabs nobody waits for a tracker or a microphone, unless a take is being recorded.
        wanted = (self._model.active or self._session.rolling) and not self._model.settling
        self._session.status_changed.emit("motion", *(strip_motion(snap) if wanted else ("", "")))
        self._session.status_changed.emit("sound", *(strip_sound(snap) if wanted else ("", "")))

    def _show_card(self, snap: Snapshot) -> None:
        problems, device = dict(self._model.problems), self._model.sound_device
        if self._model.practice.problem:
            remedy = self.tr("Check your audio output and restart the performer, or record without sound.")
            if line_port(device) is not None:
                remedy = self.tr("Its voice is recorded all the same.")
            problems["practice"] = (self._model.practice.problem, remedy)
        practice = self._model.practice
        rows = findings(
            snap, problems, device != NO_MICROPHONE, self._session.rolling, practice.on, practice.busy
        )
        if self._model.settling and not self._session.rolling:
            rows = [(self.tr("Checking the inputs…"), "", "")]
        self._card.show_findings(rows)
        self._card.show_numbers(
            packets=f"{snap.packets_per_s:.0f}",
            frames=f"{snap.frames_per_s:.1f}",
            jitter=f"{snap.jitter_ms:.1f} ms",
            late=str(snap.late),
            lost=str(snap.frames_lost + snap.packets_lost),
            bad=str(snap.packets_bad),
        )


def findings(
    snap: Snapshot,
    problems: dict[str, tuple[str, str]],
    microphone: bool,
    rolling: bool = False,
    practising: bool = False,
    awaited: bool = False,
) -> list[Finding]:
    """Rows of the health card, the worst first.

    Args:
        snap: the capture now.
        problems: inputs that could not be opened, by "motion" and "sound".
        microphone: whether one is to be recorded.
        rolling: whether a take is being recorded.
        practising: whether the practice performer performs or gets ready. awaited: whether it gets ready.
    """
    performs = snap.device == PERFORMER_TITLE
    rows: list[Finding] = [(native(what), native(remedy), "warn") for what, remedy in problems.values()]
    rows += [
        (_named(native(what), snap.device), native(remedy), "warn")
        for what, remedy in snap.problems
        # The recorder may tell of the same.
        if (what, remedy) not in problems.values()
    ]
    if snap.motion_alive and "motion" not in problems and "motion" not in snap.troubled:
        rows.append((_tr("Motion looks good."), "", "good"))
    elif awaited and not snap.motion_alive:
        rows.append((_tr("The practice performer is getting ready."), _tr("Give it a moment."), ""))
    elif not rows and rolling:
        remedy = _tr("Start your tracking app; its motion is recorded from then on.")
        rows.append((_tr("No motion signal. This take has sound only so far."), remedy, "warn"))
    elif not rows:
        rows.append((_tr("No motion signal yet."), "", ""))
    if not microphone:
        rows.append((_tr("Recording without sound."), "", ""))
    elif performs and (awaited or not practising):
        pass  # its line is silent, as it has to be
    elif snap.audio_alive and is_quiet(snap.hold_dbfs) and "sound" not in snap.troubled:
        own = _tr("The practice performer says nothing yet.")
        rows.append(
            (own if performs else _tr("No voice yet. Say something to check the microphone."), "", "")
        )
    elif snap.audio_alive and "sound" not in problems and "sound" not in snap.troubled:
        rows.append((_tr("Sound looks good."), "", "good"))
    return rows


def strip_motion(snap: Snapshot) -> tuple[str, str]:
    """The motion's fact in the status strip."""
    if snap.motion_alive:
        return _tr("VMC {0}/s").format(f"{snap.frames_per_s:.1f}"), "good"
    return (_tr("no motion"), "") if snap.port else (_tr("motion port in use"), "warn")


def strip_sound(snap: Snapshot) -> tuple[str, str]:
    """The sound's fact in the status strip."""
    if snap.device is None:
        return "", ""
    if not snap.audio_alive:
        return _tr("no sound"), "warn"
    if is_quiet(snap.hold_dbfs):
        return _tr("Mic silent"), "warn" if "silent" in snap.troubled else ""
    text = _tr("Mic {0} dBFS").format(f"{snap.hold_dbfs:.0f}")
    return text, "warn" if snap.clipped else "good"


def _named(what: str, device: str | None) -> str:
    """A sentence about a device that has no name of its own, in the words of the list of microphones."""
    # The sound system's word for it says nothing to a performer; the list of microphones has this one.
    return what.replace(device, _tr("the default microphone")) if device in DEFAULT else what


def _tr(text: str) -> str:
    return QCoreApplication.translate("Findings", text)
