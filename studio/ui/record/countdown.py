"""The countdown before a take."""

from __future__ import annotations

import math
import time

from PySide6.QtCore import QObject, Qt, QTimer, Signal


class Countdown(QObject):
    """Counts down once.

    Signals:
        ended: it reached zero; not after a cancel.
        cancelled: it was given up.
    """

    ended = Signal()
    cancelled = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._end = 0.0
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self.ended)

    @property
    def running(self) -> bool:
        """Whether it counts."""
        return self._timer.isActive()

    @property
    def text(self) -> str:
        """The whole seconds left, "" when it does not count."""
        return str(max(1, math.ceil(self._end - time.monotonic()))) if self.running else ""

    def start(self, seconds: float) -> None:
        """Count from some seconds; 0 ends at once."""
        self._end = time.monotonic() + seconds
        if seconds <= 0:
            self.ended.emit()
        else:
            self._timer.start(int(seconds * 1000))

    def cancel(self) -> None:
        """Stop counting; no take begins."""
        if self.running:
            self._timer.stop()
            self.cancelled.emit()
