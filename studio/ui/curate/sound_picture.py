"""Which picture of the sound the bench shows: the waveform, or a spectrogram measured off the GUI thread."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QThreadPool, Signal

from studio.take.spectrogram import Part, Spectrogram, Stopped, spectrogram
from studio.ui import background
from studio.ui.curate.bench import Bench
from studio.ui.session import Session
from studio.ui.widgets.timeline_content import PeakSource

WAVEFORM, SPECTROGRAM = "waveform", "spectrogram"


class Tiles(QObject):
    """A spectrogram that is measured finer wherever somebody looks closely.

    Signals:
        finer: what is in view can be drawn finer now.
    """

    finer = Signal()

    def __init__(self, found: Spectrogram, pool: QThreadPool, parent: QObject) -> None:
        super().__init__(parent)
        self._found, self._pool = found, pool
        self._asked: dict[int, background.Task] = {}
        self.top_db: float = found.top_db
        self.pitches_hz: NDArray[np.float64] = found.pitches_hz

    def part(self, start: float, end: float, count: int) -> Part:
        """What can be drawn now of start..end seconds; what is missing is being measured from here on."""
        part = self._found.part(start, end, count)
        for index in set(self._asked) - set(part.finer):
            self._asked.pop(index).forget()  # nobody looks there any more
        for index in part.finer:
            if index not in self._asked:
                done = partial(self._on_tile, index)
                self._asked[index] = background.run(
                    partial(self._measure, index), done, None, self, self._pool
                )
        return part

    def _measure(self, index: int) -> None:
        """Runs on a thread of the pool, maybe after whoever asked has scrolled on."""
        if index in self._asked:
            self._found.measure_tile(index)

    def _on_tile(self, index: int, _nothing: None) -> None:
        self._asked.pop(index, None)
        if not self._asked:
            self.finer.emit()


class SoundPicture(QObject):
    """Draws the sound of the take shown in the way that was chosen last.

    Signals:
        measured: how much of a spectrogram is done, 0..1. Sent from the thread that measures.
    """

    measured = Signal(float)

    def __init__(self, bench: Bench, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._bench, self._session = bench, session
        self._pool = QThreadPool(self)
        self._pool.setMaxThreadCount(1)  # whoever opens a project of long takes keeps a core for playing
        self._sound: Path | None = None
        self._task: background.Task | None = None
        self._tiles: Tiles | None = None
        self._stop = threading.Event()
        bench.picture.setChecked(session.settings.sound_picture == SPECTROGRAM)
        bench.picture.toggled.connect(self._on_toggled)
        self.measured.connect(self._on_measured)

    def show(self, loudness: PeakSource | None, sound: Path | None) -> None:
        """Draw a sound by its peaks and its file; None where there is none."""
        self.leave()
        self._bench.timeline.set_sound(loudness)
        self._sound = sound if loudness is not None else None
        self._draw()

    def leave(self) -> None:
        """Another take comes: what is being measured for this one ends."""
        self._stop.set()
        if self._task is not None:
            self._task.forget()
            self._task = None
        if self._tiles is not None:
            self._tiles.deleteLater()
            self._tiles = None
        self._sound = None
        self._bench.show_measuring(None)

    def close(self) -> None:
        """The window closes."""
        self.leave()
        self._pool.clear()
        self._pool.waitForDone(5_000)

    def _on_toggled(self, on: bool) -> None:
        self._session.change_settings(sound_picture=SPECTROGRAM if on else WAVEFORM)
        self._draw()

    def _draw(self) -> None:
        timeline = self._bench.timeline
        if not self._bench.picture.isChecked():
            timeline.set_spectrum(None)
        elif self._tiles is not None:
            timeline.set_spectrum(self._tiles)
        elif self._sound is not None and self._task is None:
            self._stop = threading.Event()
            work = partial(_measure, self._sound, self._stop, self.measured.emit)
            self._task = background.run(work, self._on_found, self._on_failed, self, self._pool)

    def _on_measured(self, fraction: float) -> None:
        if self._task is not None and self._bench.picture.isChecked():
            self._bench.show_measuring(fraction)

    def _on_found(self, found: Spectrogram | None) -> None:
        self._task = None
        self._bench.show_measuring(None)
        if found is not None:
            self._tiles = Tiles(found, self._pool, self)
            self._tiles.finer.connect(self._draw)
            self._draw()

    def _on_failed(self, _error: BaseException) -> None:
        # What is wrong with the file was said when the take was read; the waveform stays.
        self._task = None
        self._bench.show_measuring(None)


def _measure(sound: Path, stop: threading.Event, told: Callable[[float], None]) -> Spectrogram | None:
    """Runs on a thread of the pool."""

    def on_progress(fraction: float) -> bool:
        if not stop.is_set():
            told(fraction)
        return not stop.is_set()

    try:
        return spectrogram(sound, on_progress)
    except Stopped:
        return None
