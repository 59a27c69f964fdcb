"""What the timeline draws of a take: its sound as waveform or spectrogram, and curves of its motion."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QThreadPool, Signal

from studio.motion.curve_channels import CurveChannel, first_choice, values
from studio.sound.spectrogram import Part, Spectrogram, Stopped, spectrogram
from studio.ui import tasks
from studio.ui.curate.bench_view import Bench
from studio.ui.curate.model import CurateModel
from studio.ui.curate.playback import LoadedTake
from studio.ui.session import Session
from studio.ui.widgets.timeline.content import PeakSource

WAVEFORM, SPECTROGRAM = "waveform", "spectrogram"
COLOURS = (1, 2, 4, 5, 6, 7, 3)
"""Data colours of curves in turn: the first is the sound's, and yellow is hard to see on a light ground."""
FACE_OF_BODY = ("Head", "Neck", "Spine", "Chest", "UpperChest", "Hips")


class Tiles(QObject):
    """A spectrogram that is measured finer wherever somebody looks closely.

    Signals:
        finer: what is in view can be drawn finer now.
    """

    finer = Signal()

    def __init__(self, found: Spectrogram, pool: QThreadPool, parent: QObject) -> None:
        super().__init__(parent)
        self.found, self._pool = found, pool
        self._measuring: dict[int, tasks.Task] = {}
        self.top_db: float = found.top_db
        self.pitches_hz: NDArray[np.float64] = found.pitches_hz

    def part(self, start: float, end: float, count: int) -> Part:
        """What can be drawn now of start..end seconds; what is missing is being measured from here on."""
        part = self.found.part(start, end, count)
        for index in set(self._measuring) - set(part.finer):
            # Nobody looks there any more.
            self._measuring.pop(index).forget()
        for index in part.finer:
            if index not in self._measuring:
                done = partial(self._on_tile, index)
                self._measuring[index] = tasks.run(
                    partial(self._measure, index), done, None, self, self._pool
                )
        return part

    def _measure(self, index: int) -> None:
        """Runs on a thread of the pool, maybe after whoever asked has scrolled on."""
        if index in self._measuring:
            self.found.measure_tile(index)

    def _on_tile(self, index: int, _nothing: None) -> None:
        self._measuring.pop(index, None)
        if not self._measuring:
            self.finer.emit()


class SoundPicturePresenter(QObject):
    """Draws the sound of the take shown in the way that was chosen last.

    Signals:
        measured: how much of a spectrogram is done, 0..1. Sent from the thread that measures.
    """

    measured = Signal(float)

    def __init__(self, bench: Bench, model: CurateModel, session: Session) -> None:
        super().__init__(bench)
        self._bench, self._session = bench, session
        self._pool = QThreadPool(self)
        # Whoever opens a project of long takes keeps a core for playing.
        self._pool.setMaxThreadCount(1)
        self._sound: Path | None = None
        self._task: tasks.Task | None = None
        self._tiles: Tiles | None = None
        self._stop = threading.Event()
        bench.picture.setChecked(session.settings.sound_picture == SPECTROGRAM)
        bench.picture.toggled.connect(self._on_toggled)
        self.measured.connect(self._on_measured)
        model.shown_changed.connect(self._on_shown)
        model.loaded.connect(lambda loaded: self.show(loaded.peaks, loaded.take.audio_path))
        model.sound_changed.connect(self.show)

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

    def _on_shown(self) -> None:
        self.leave()
        self._bench.timeline.set_sound(None, self.tr("Reading…"))

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
            self._task = tasks.run(work, self._on_found, self._on_failed, self, self._pool)

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


class CurvesPresenter(QObject):
    """Fills the menu of curves and draws the chosen ones; the choice stays from take to take."""

    def __init__(self, bench: Bench, model: CurateModel, _session: Session) -> None:
        super().__init__(bench)
        self._bench = bench
        self._take: LoadedTake | None = None
        self._offset = 0.0
        self._chosen: tuple[str, ...] | None = None
        """None until somebody chose: then each take shows what is lively in it."""
        bench.curves_changed.connect(self._on_chosen)
        model.loaded.connect(self.show)
        model.offset_changed.connect(self.set_offset)

    def show(self, take: LoadedTake) -> None:
        """Offer this take's channels and draw those chosen before, where it has them."""
        self._take = take
        self._bench.show_channels(self._groups(take.channels), self._keys())
        self._draw()

    def set_offset(self, offset: float) -> None:
        """Draw motion this many seconds later."""
        if offset != self._offset:
            self._offset = offset
            self._draw()

    def _keys(self) -> tuple[str, ...]:
        assert self._take is not None
        there = {channel.key for channel in self._take.channels}
        if self._chosen is None:
            return first_choice(self._take.channels)
        return tuple(key for key in self._chosen if key in there)

    def _groups(self, found: tuple[CurveChannel, ...]) -> dict[str, list[tuple[str, str]]]:
        """(key, title) by group: what moves first, so that long lists stay short where it counts."""
        axes = {"nod": self.tr("nod"), "turn": self.tr("turn"), "tilt": self.tr("tilt")}
        groups: dict[str, list[tuple[str, str]]] = {}
        for channel in found:
            if not channel.axis:
                name = self.tr("Active face shapes") if channel.moves else self.tr("Inactive face shapes")
            elif not channel.moves:
                continue
            elif channel.name in FACE_OF_BODY:
                name = self.tr("Head and body")
            else:
                name = self.tr("Arms, hands, legs")
            title = f"{channel.name} {axes[channel.axis]}" if channel.axis else channel.name
            groups.setdefault(name, []).append((channel.key, title))
        order = (self.tr("Active face shapes"), self.tr("Head and body"), self.tr("Arms, hands, legs"))
        return {name: groups[name] for name in (*order, *(set(groups) - set(order))) if name in groups}

    def _on_chosen(self, keys: tuple[str, ...]) -> None:
        self._chosen = keys
        if self._take is not None:
            if not keys:
                self._bench.show_channels(self._groups(self._take.channels), ())
            self._draw()

    def _draw(self) -> None:
        motion = self._take.motion if self._take else None
        drawn: dict[str, tuple[np.ndarray, np.ndarray, int]] = {}
        if motion is not None and self._take is not None:
            times = motion.times + self._offset
            for number, key in enumerate(self._keys()):
                found = values(motion, key)
                if found is not None:
                    drawn[key] = (times, found, COLOURS[number % len(COLOURS)])
        self._bench.timeline.set_curves(drawn)


def _measure(sound: Path, stop: threading.Event, report: Callable[[float], None]) -> Spectrogram | None:
    """Runs on a thread of the pool."""

    def on_progress(fraction: float) -> bool:
        if not stop.is_set():
            report(fraction)
        return not stop.is_set()

    try:
        return spectrogram(sound, on_progress)
    except Stopped:
        return None
