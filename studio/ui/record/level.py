"""The level test beside the microphone: speak as loud as it will get, and know whether it is set well."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from PySide6.QtCore import QCoreApplication, QObject, QTimer

from studio.capture import input_tests
from studio.capture.snapshot import Snapshot
from studio.ui import messages
from studio.ui.record.inputs import InputsCard


class LevelTest(QObject):
    """Follows the level meter for some seconds and says what to do.

    Args:
        clear_clip: puts the clip lamp out, so that only what clips from now on counts.
    """

    def __init__(self, card: InputsCard, clear_clip: Callable[[], None], parent: QObject) -> None:
        super().__init__(parent)
        self._card = card
        self._clear_clip = clear_clip
        self._heard = input_tests.LevelStats()
        self._fresh = False
        self._end = 0.0
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._on_heard)
        card.level_test_requested.connect(self.start)

    @property
    def running(self) -> bool:
        """Whether the microphone is listened to."""
        return self._timer.isActive()

    def start(self) -> None:
        """Begin, or give up where it runs."""
        if self.running:
            self._timer.stop()
            return
        self._heard, self._fresh = input_tests.LevelStats(), True
        self._clear_clip()
        self._end = time.monotonic() + input_tests.LEVEL_SECONDS
        self._timer.start(int(input_tests.LEVEL_SECONDS * 1000))

    def follow(self, snap: Snapshot) -> None:
        """One look at the meter."""
        if not self.running or not snap.audio_alive:
            return
        if self._fresh:  # the lamp may still burn in this look
            self._fresh = snap.clipped
            return
        self._heard = self._heard.with_look(snap.peak_dbfs, snap.rms_dbfs, snap.clipped)

    def show(self, snap: Snapshot) -> None:
        """Show how it stands."""
        left = max(math.ceil(self._end - time.monotonic()), 0)
        rate = f"{snap.sample_rate / 1000:g} kHz" if snap.device is not None and snap.sample_rate else ""
        words = _tr("speak loudly… {0} s").format(left) if self.running else rate
        self._card.show_level_test(words, self.running, snap.audio_alive)

    def _on_heard(self) -> None:
        messages.show_note(self._card, *words_of(self._heard))


def words_of(heard: input_tests.LevelStats) -> tuple[str, str]:
    """What was heard, and what to do."""
    peak = f"{heard.peak_dbfs:.0f}"
    change = f"{abs(heard.change_db):.0f}"
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
                f"{heard.peak_dbfs - heard.floor_dbfs:.0f}"
            ),
            _tr("Come closer to the microphone, or switch off what hums."),
        ),
    }[heard.verdict]


def _tr(text: str) -> str:
    return QCoreApplication.translate("LevelTest", text)
