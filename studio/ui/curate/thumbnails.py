"""A small picture of each take's sound, made on the thread pool for the rows one looks at, and kept."""

from __future__ import annotations

from collections import OrderedDict
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from studio.take.take import Take
from studio.ui import background

COLUMNS = 48
MOST_WAITING = 40
"""What was asked for longer ago has been scrolled away."""
TELL_MS = 150

Levels = NDArray[np.float32]


class Thumbnails(QObject):
    """Loudness of takes, 0 to 1 in COLUMNS parts.

    Signals:
        made: pictures were added; sent a few times a second at most.
    """

    made = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._kept: dict[Path, Levels | None] = {}
        self._waiting: OrderedDict[Path, float] = OrderedDict()
        self._task: background.Task | None = None
        self._tell = QTimer(self)
        self._tell.setSingleShot(True)
        self._tell.setInterval(TELL_MS)
        self._tell.timeout.connect(self.made)

    def levels(self, take: Take) -> Levels | None:
        """Loudness of a take's sound (COLUMNS,); None where there is none, or not yet: `made` follows."""
        path = take.audio_path
        if path is None:
            return None
        if path not in self._kept:
            self._waiting[path] = take.info.audio_seconds
            self._waiting.move_to_end(path)
            while len(self._waiting) > MOST_WAITING:
                self._waiting.popitem(last=False)
            self._next()
            return None
        return self._kept[path]

    def forget_missing(self) -> None:
        """Look again for sounds that could not be read."""
        self._kept = {path: levels for path, levels in self._kept.items() if levels is not None}

    def _next(self) -> None:
        if self._task is None and self._waiting:
            path, seconds = self._waiting.popitem()
            self._task = background.run(
                partial(_levels, path, seconds),
                partial(self._on_made, path),
                lambda _: self._on_made(path, None),
                self,
            )

    def _on_made(self, path: Path, levels: Levels | None) -> None:
        self._task = None
        self._kept[path] = levels
        if not self._tell.isActive():
            self._tell.start()
        self._next()


def _levels(path: Path, seconds: float) -> Levels:
    """Runs on the thread pool."""
    from studio.take.peaks import peaks

    low, high = peaks(path).columns(0.0, max(seconds, 0.1), COLUMNS)
    levels: Levels = np.maximum(np.abs(low), np.abs(high)).astype(np.float32)
    # As loud as the take itself is, so that a quiet one shows its shape too.
    return levels / max(float(levels.max(initial=0.0)), 0.05)
