"""Presenter of the bar under the figure: the next take's name, its button, its clock, and the disk."""

from __future__ import annotations

from PySide6.QtCore import QObject

from studio.capture.snapshot import Snapshot
from studio.files.atomic import size_text
from studio.settings import NO_MICROPHONE
from studio.ui.record.model import RecordModel
from studio.ui.record.slate_view import SlateBar, choose_seconds
from studio.ui.session import Session

LOW_DISK_S = 30 * 60.0
LOW_DISK_BYTES = 1_000_000_000


class SlatePresenter(QObject):
    """Shows what the one button does now, and what a take begun now would lack."""

    def __init__(self, bar: SlateBar, model: RecordModel, session: Session) -> None:
        super().__init__(bar)
        self._bar, self._model, self._session = bar, model, session
        self._show_seconds()
        self._on_recorder()
        session.settings_changed.connect(self._on_settings)
        bar.slate_edited.connect(model.set_slate)
        bar.countdown_chosen.connect(lambda seconds: session.change_settings(countdown=seconds))
        bar.pre_roll_chosen.connect(lambda seconds: session.change_settings(pre_roll=seconds))
        model.recorder_changed.connect(self._on_recorder)
        model.slate_changed.connect(lambda: bar.show_take(model.slate, model.number))
        model.about_to_roll.connect(lambda: model.set_slate(bar.slate.text()))
        model.polled.connect(self._show_free)
        model.text_due.connect(self._show_text)
        model.frame_due.connect(self._show_frame)

    def _show_seconds(self) -> None:
        settings = self._session.settings
        choose_seconds(self._bar.countdown, settings.countdown, self.tr("Countdown {0} s"))
        choose_seconds(self._bar.pre_roll, settings.pre_roll, self.tr("Pre-roll {0} s"))

    def _on_settings(self, changed: frozenset[str]) -> None:
        if changed & {"countdown", "pre_roll"}:
            self._show_seconds()
        if "slate" in changed:
            self._model.set_slate(self._session.settings.slate)

    def _on_recorder(self) -> None:
        # A project that opens shows its button at once, and lets it be pressed with its first snapshot.
        self._bar.show_button(self.tr("Record  F1"), rolling=False, enabled=False)

    def _show_frame(self, snap: Snapshot) -> None:
        bar, model, rolling = self._bar, self._model, self._session.rolling
        bar.show_elapsed(snap.elapsed if rolling else 0.0, rolling)
        if model.busy == "saving":
            bar.show_button(self.tr("Saving…"), rolling=False, enabled=False)
        elif rolling:
            bar.show_button(self.tr("Stop  F1"), rolling=True)
        elif model.countdown.running:
            bar.show_button(self.tr("Cancel  Esc"), rolling=False)
        else:
            bar.show_button(self.tr("Record  F1"), rolling=False, enabled=not model.busy)

    def _show_free(self, snap: Snapshot) -> None:
        free = size_text(snap.disk_free_bytes) if snap.disk_free_bytes > 0 else ""
        self._session.status_changed.emit("disk", free, "warn" if is_low(snap) else "")

    def _show_text(self, snap: Snapshot) -> None:
        low = is_low(snap)
        self._bar.show_disk(self._time_left(snap) if low else "", low)
        if self._session.rolling:
            self._bar.show_missing(self._missing_now(snap), grave=True)
        elif self._model.busy or self._model.settling:
            self._bar.show_missing("")
        else:
            self._bar.show_missing(self._missing(snap))

    def _missing(self, snap: Snapshot) -> str:
        """What a take begun now would lack, in a sentence; "" where all that is chosen comes in."""
        microphone = self._model.sound_device != NO_MICROPHONE
        if self._model.practice.busy and not snap.motion_alive:
            return self.tr("The practice performer is getting ready. Record when it moves.")
        if not snap.motion_alive and not snap.audio_alive:
            return self.tr("No motion and no sound yet. Connect a tracker or a microphone.")
        if not snap.motion_alive:
            return self.tr("No motion signal. If you record now, you get sound only.")
        if microphone and not snap.audio_alive:
            return self.tr("No sound. If you record now, you get motion only.")
        return ""

    def _missing_now(self, snap: Snapshot) -> str:
        """What the take that rolls lacks so much that it is worth nothing; "" where something comes in."""
        if snap.motion_alive or (snap.audio_alive and "silent" not in snap.troubled):
            return ""
        if snap.audio_alive:
            return self.tr("This take is empty so far: no motion, and the microphone is silent.")
        return self.tr(
            "Nothing is being recorded: no motion and no sound. Check your tracker and microphone."
        )

    def _time_left(self, snap: Snapshot) -> str:
        """How long a disk that is nearly full lasts; how much is free where that is not known."""
        if snap.disk_free_bytes <= 0:
            return ""
        free, hours = self.tr("{0} free").format(size_text(snap.disk_free_bytes)), snap.seconds_left / 3600
        if hours <= 0 or hours >= 2:
            return free
        return self.tr("{0} min left").format(f"{snap.seconds_left / 60:.0f}")


def is_low(snap: Snapshot) -> bool:
    """Whether the disk holds less than half an hour at this rate, or less than a gigabyte."""
    if snap.disk_free_bytes <= 0:
        # Nobody has looked yet.
        return False
    return 0 < snap.seconds_left < LOW_DISK_S or snap.disk_free_bytes < LOW_DISK_BYTES
