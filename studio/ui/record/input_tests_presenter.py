"""Presenters of the two tests of the inputs: the microphone's level, and its sync with the motion."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, QTimer

from studio.capture import input_tests
from studio.capture.health import is_quiet
from studio.capture.snapshot import Snapshot
from studio.ui import messages, tasks
from studio.ui.record.inputs_view import InputsCard
from studio.ui.record.model import RecordModel
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.capture.recorder import Recorder


class SecondsTimer(QTimer):
    """Runs for some seconds, and knows how many are left."""

    def __init__(self, seconds: float, parent: QObject) -> None:
        super().__init__(parent)
        self._seconds, self._end = seconds, 0.0
        self.setSingleShot(True)

    @property
    def seconds_left(self) -> int:
        """Whole seconds, the one that runs included."""
        return max(math.ceil(self._end - time.monotonic()), 0)

    def begin(self) -> None:
        """Run from now on."""
        self._end = time.monotonic() + self._seconds
        self.start(int(self._seconds * 1000))


class LevelTestPresenter(QObject):
    """The level test: speak as loud as it will get, and know whether the microphone is set well."""

    def __init__(self, card: InputsCard, model: RecordModel) -> None:
        super().__init__(card)
        self._card, self._model = card, model
        self._stats = input_tests.LevelStats()
        self._fresh = False
        self._clock = SecondsTimer(input_tests.LEVEL_SECONDS, self)
        self._clock.timeout.connect(self.finish)
        card.level_test_requested.connect(self.toggle)
        model.frame_due.connect(self.follow)
        model.text_due.connect(self.show)

    @property
    def running(self) -> bool:
        """Whether the microphone is listened to."""
        return self._clock.isActive()

    def toggle(self) -> None:
        """Begin, or give up where it runs."""
        if self.running:
            self._clock.stop()
            return
        self._stats, self._fresh = input_tests.LevelStats(), True
        # Only what clips from now on counts.
        self._model.clear_clip()
        self._clock.begin()

    def follow(self, snap: Snapshot) -> None:
        """Count one reading of the meter."""
        if not self.running or not snap.audio_alive:
            return
        if self._fresh:
            # This snapshot may be older than the lamp that was put out.
            self._fresh = snap.clipped
            return
        self._stats = self._stats.with_look(snap.peak_dbfs, snap.rms_dbfs, snap.clipped)

    def show(self, snap: Snapshot) -> None:
        """Show the seconds left, or what is known of the microphone."""
        rate = f"{snap.sample_rate / 1000:g} kHz" if snap.device is not None and snap.sample_rate else ""
        countdown = _tr("speak loudly… {0} s").format(self._clock.seconds_left)
        self._card.show_level_test(countdown if self.running else rate, self.running, snap.audio_alive)

    def finish(self) -> None:
        """Stop listening, and say what was found."""
        self._clock.stop()
        messages.show_note(self._card, *words_of(self._stats))


class SyncTestPresenter(QObject):
    """The sync test: listens to claps or "pa", measures, and remembers the pair of inputs."""

    def __init__(self, card: InputsCard, model: RecordModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        self._clock = SecondsTimer(input_tests.LISTEN_S, self)
        self._clock.timeout.connect(self._on_time_up)
        card.sync_test_requested.connect(self.toggle)
        model.recorder_changed.connect(lambda _: self._clock.stop())
        model.text_due.connect(self.show)

    @property
    def running(self) -> bool:
        """Whether the performer is listened to."""
        return self._clock.isActive()

    def toggle(self) -> None:
        """Begin, or give up where it runs."""
        if self.running:
            self._clock.stop()
            return
        recorder = self._model.recorder
        snap = recorder.snapshot() if recorder is not None else Snapshot()
        if snap.motion_alive and snap.audio_alive:
            self._clock.begin()
        else:
            text = _tr("The sync test needs a microphone and motion.")
            messages.show_note(self._card, text, _tr("Choose a microphone and start your tracking program."))

    def show(self, snap: Snapshot) -> None:
        """Show the seconds left, what was measured for these inputs, or what the clocks alone tell."""
        card, ready = self._card, snap.motion_alive and snap.audio_alive
        card.show_testing(self.running, ready and not self._session.rolling)
        card.sync_text.setToolTip(drift_text(snap))
        known = self._model.sync_ms(snap)
        if self.running:
            card.show_sync(_tr("clap or say “pa”… {0} s").format(self._clock.seconds_left), "")
        elif known is not None and ready:
            words, health = verdict(known)
            card.show_sync(words, "" if is_quiet(snap.hold_dbfs) else health)
        else:
            card.show_sync(*sync_text(snap))

    def _on_time_up(self) -> None:
        recorder = self._model.recorder
        if recorder is None:
            return
        snap = recorder.snapshot()
        tasks.run(
            lambda: _measured(recorder),
            lambda found: self._on_measured(found, snap),
            lambda error: messages.show_error(self._card, error),
            owner=self,
        )

    def _on_measured(self, found: input_tests.Measured, snap: Snapshot) -> None:
        sender = self._model.sync_sender(snap)
        if found.ms is None or not snap.device or not sender:
            messages.show_note(self._card, *_why_not()[found.why_not or "unsure"])
            return
        before = self._session.settings.sync_offsets
        pairs = input_tests.with_pair(before, snap.device, sender, found.ms)
        self._session.change_settings(sync_offsets=pairs)
        what = _tr("mouth") if found.by == "mouth" else _tr("hands")
        side = _tr("after") if found.ms >= 0 else _tr("before")
        text = (
            _tr("The {0} move {1} ms {2} the sound.")
            if found.by == "hands"
            else _tr("The {0} moves {1} ms {2} the sound.")
        )
        text = text.format(what, f"{abs(found.ms):.0f}", side)
        remedy = _tr("New takes with {0} are moved by it.").format(sender)
        back = (_tr("Undo"), lambda: self._session.change_settings(sync_offsets=before))
        messages.show_note(self._card, text, remedy, back)


def sync_text(snap: Snapshot) -> tuple[str, str]:
    """How far sound and motion are apart as far as their clocks tell, and its health."""
    if snap.offset_ms is None or not snap.motion_alive:
        return _tr("needs sound and motion"), ""
    # Sound that is handed over late is late, as the sync test counts it.
    early = -snap.offset_ms
    if is_quiet(snap.hold_dbfs):
        # The clocks run all the same, but without a voice nobody can hear whether they agree.
        return _tr("needs your voice"), ""
    words = {"good": _tr("in sync"), "warn": _tr("corrected"), "bad": _tr("far off, corrected")}
    health = input_tests.grade(early)
    return f"{round(early):+d} ms  {words[health]}", health


def drift_text(snap: Snapshot) -> str:
    """How the clocks of sound and computer run against each other; "" without sound."""
    if snap.offset_ms is None:
        return ""
    text = _tr("The clocks of sound and computer drift apart by {0} ppm, which every take is corrected for.")
    return text.format(f"{snap.drift_ppm:+.0f}")


def words_of(stats: input_tests.LevelStats) -> tuple[str, str]:
    """What a level test found, and what to do."""
    peak = f"{stats.peak_dbfs:.0f}"
    change = f"{abs(stats.change_db):.0f}"
    return {
        "good": (_tr("The level is good: the loudest peak is {0} dBFS.").format(peak), ""),
        "loud": (
            _tr("The level is too high: the loudest peak is {0} dBFS.").format(peak),
            _tr("Turn the microphone down by about {0} dB.").format(change),
        ),
        "clipped": (
            _tr("The sound clipped."),
            _tr("Turn the microphone down until the loudest words stay in the yellow."),
        ),
        "quiet": (
            _tr("The level is low: the loudest peak is {0} dBFS.").format(peak),
            _tr("Come closer, or turn the microphone up by about {0} dB.").format(change),
        ),
        "silent": (
            _tr("The level test heard no voice."),
            _tr("Unmute the microphone, turn it up, or choose another one."),
        ),
        "noisy": (
            _tr("The room is loud: {0} dB between voice and noise.").format(
                f"{stats.peak_dbfs - stats.floor_dbfs:.0f}"
            ),
            _tr("Come closer to the microphone, or switch off what hums."),
        ),
    }[stats.verdict]


def verdict(ms: float) -> tuple[str, str]:
    """A measured offset in words, and its health."""
    words = {"good": _tr("in sync"), "warn": _tr("slightly off"), "bad": _tr("off")}
    health = input_tests.grade(ms)
    return f"{ms:+.0f} ms  {words[health]}", health


def _why_not() -> dict[str, tuple[str, str]]:
    return {
        "silent": (
            _tr("The sync test heard nothing."),
            _tr("Clap near the microphone, or say “pa” a few times, until the time is up."),
        ),
        "still": (
            _tr("The sync test saw neither mouth nor hands move."),
            _tr("Let the tracker see your face or your hands, and try again."),
        ),
        "unsure": (
            _tr("The sync test was inconclusive: sound and motion did not match."),
            _tr("Clap or say “pa” five times with pauses of different length."),
        ),
    }


def _measured(recorder: Recorder) -> input_tests.Measured:
    """What the last seconds tell. Runs on a pool thread."""
    recent = recorder.recent(input_tests.LISTEN_S)
    return input_tests.measure(*recent) if recent else input_tests.Measured(None, why_not="silent")


def _tr(text: str) -> str:
    return QCoreApplication.translate("InputTests", text)
