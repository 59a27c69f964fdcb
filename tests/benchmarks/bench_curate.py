"""How fast the Curate room is: 1,000 takes in the library, and a two-hour take on the timeline."""

from __future__ import annotations

import shutil
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import soundfile
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from studio.dataset import edits
from studio.motion import Motion
from studio.project import Project
from studio.sound.peaks import Peaks, peaks
from studio.sound.spectrogram import spectrogram
from studio.take import TakeInfo
from studio.ui import theme
from studio.ui.curate.take_table import COLUMNS, TakeRow, rows_of
from studio.ui.widgets.timeline.timeline import Timeline

TAKES, HOURS, RATE = 1_000, 2, 16_000


def run() -> dict[str, Any]:
    """Milliseconds, medians; the timeline is 1,900 pixels wide."""
    existing = QApplication.instance()
    app = existing if isinstance(existing, QApplication) else QApplication([])
    theme.apply(app)
    with tempfile.TemporaryDirectory() as folder:
        return {**library(app, Path(folder)), **timeline(app, Path(folder)), **reading(Path(folder))}


def library(app: QApplication, folder: Path) -> dict[str, Any]:
    """Opening a project of 1,000 takes, and what people do to its table."""
    from studio.ui.curate.library_view import Library

    path = _many_takes(folder)
    open_ms = _median(lambda: Project.open(path, read_only=True), 5)
    project = Project.open(path, read_only=True)
    takes = {take.id: take for take in project.takes}
    rows = rows_of(project.dataset, takes, {})
    shown = Library()
    shown.resize(900, 500)
    shown.show()
    first_ms = _milliseconds(lambda: (shown.show_rows(rows), app.processEvents()))
    bar, viewport = shown.table.verticalScrollBar(), shown.table.viewport()
    places = iter(np.linspace(0, bar.maximum(), 60).astype(int).tolist())
    length = COLUMNS.index("length")
    orders = iter([Qt.SortOrder.AscendingOrder, Qt.SortOrder.DescendingOrder] * 4)
    searches = iter(f"take_{i}" for i in range(8))
    changed = _one_changed(project, takes)
    result = {
        "open_1000_takes_ms": open_ms,
        "show_1000_rows_ms": first_ms,
        "scroll_frame_ms": _median(lambda: (bar.setValue(next(places)), viewport.repaint()), 60),
        "sort_1000_rows_ms": _median(lambda: shown.table.sortByColumn(length, next(orders)), 8),
        "search_1000_rows_ms": _median(lambda: shown.filter.set_filter((), False, next(searches)), 8),
        "change_one_row_ms": _median(lambda: shown.show_rows(next(changed)), 8),
    }
    shown.close()
    return result


def timeline(app: QApplication, folder: Path) -> dict[str, Any]:
    """Two hours of sound: the first look, every later one, and frames while zooming, panning, playing."""
    sound = _two_hours(folder / "long.flac")
    first_s = _milliseconds(lambda: peaks(sound)) / 1000
    again_ms = _median(lambda: peaks(sound), 5)
    duration = HOURS * 3600.0
    shown = Timeline()
    shown.resize(1992, 300)
    shown.set_duration(duration)
    found: Peaks = peaks(sound)
    shown.set_sound(found)
    times = np.arange(0, duration, 1 / 60)
    shown.set_curves({f"curve {i}": (times, np.sin(times * (i + 1)) ** 2, i + 1) for i in range(3)})
    shown.show()
    app.processEvents()
    whole_ms = _median(lambda: (shown._repaint_all(), shown.repaint()), 10)
    zoom = _median(lambda: (shown.zoom(0.75), shown.repaint()), 50)
    shown.fit()
    shown.show_span(3000.0, 3060.0)
    pan = _median(lambda: (shown.show_span(shown.view.start + 1, shown.view.end + 1), shown.repaint()), 60)
    moments = iter(np.arange(3000.0, 3060.0, 1 / 60).tolist())

    def play() -> None:
        t = next(moments)
        shown.set_playhead(t)
        shown.repaint(shown._playhead_strip(t))

    playing = _median(play, 300)
    pitches = _spectrum(shown, sound)
    shown.close()
    return {
        **pitches,
        "two_hours_first_look_s": first_s,
        "two_hours_later_look_ms": again_ms,
        "two_hours_whole_frame_ms": whole_ms,
        "zoom_frame_ms": zoom,
        "pan_frame_ms": pan,
        "playhead_frame_ms": playing,
    }


def _spectrum(shown: Timeline, sound: Path) -> dict[str, float]:
    """The same two hours as a spectrogram: measured once, then frames while zooming and panning."""
    first_s = _milliseconds(lambda: spectrogram(sound)) / 1000
    again_ms = _median(lambda: spectrogram(sound), 5)
    found = spectrogram(sound)
    shown.set_spectrum(found)
    shown.fit()
    shown.repaint()
    whole = _median(lambda: (shown._repaint_all(), shown.repaint()), 10)
    zoom = _median(lambda: (shown.zoom(0.75), shown.repaint()), 50)
    shown.show_span(3000.0, 3060.0)
    pan = _median(lambda: (shown.show_span(shown.view.start + 1, shown.view.end + 1), shown.repaint()), 60)
    for index in found.part(3000.0, 3010.0, 1900).finer:
        found.measure_tile(index)
    shown.show_span(3000.0, 3005.0)
    close = _median(
        lambda: (shown.show_span(shown.view.start + 0.05, shown.view.end + 0.05), shown.repaint()), 60
    )
    return {
        "spectrogram_first_look_s": first_s,
        "spectrogram_later_look_ms": again_ms,
        "spectrogram_whole_frame_ms": whole,
        "spectrogram_zoom_frame_ms": zoom,
        "spectrogram_pan_frame_ms": pan,
        "spectrogram_close_pan_frame_ms": close,
    }


def reading(folder: Path) -> dict[str, Any]:
    """A table of a million rows, as an import reads it."""
    from studio.formats import saia_csv

    path = folder / "million.csv"
    with path.open("w", encoding="utf-8") as file:
        file.write("Time,A,Blink,Joy\n")
        file.writelines(f"{i / 60:.6f},{i % 7 / 7:.3f},{i % 5 / 5:.3f},0.5\n" for i in range(1_000_000))
    found: list[Any] = []
    seconds = _milliseconds(lambda: found.append(saia_csv.read(path))) / 1000
    return {"read_million_rows_s": round(seconds, 2), "million_rows_read": len(found[0].motion)}


def _many_takes(folder: Path) -> Path:
    """A project of 1,000 small takes, the files of one copied."""
    path = folder / "many"
    project = Project.create(path)
    times = np.arange(60) / 30
    sound = folder / "short.wav"
    soundfile.write(sound, np.zeros(32_000, np.float32), 16_000)
    motion = Motion.build(times, ("A",), np.sin(times)[:, None] ** 2)
    project.add_take("take_0000", TakeInfo("take", 0), motion, sound)
    for i in range(1, TAKES):
        shutil.copytree(path / "takes" / "take_0000", path / "takes" / f"take_{i:04d}")
    project.refresh()
    project.close()
    return path


def _one_changed(project: Project, takes: dict[str, Any]) -> Iterator[tuple[TakeRow, ...]]:
    stars = 0
    while True:
        stars = stars % 5 + 1
        yield rows_of(edits.set_stars(project.dataset, ["take_0007"], stars), takes, {})


def _two_hours(path: Path) -> Path:
    minute = (np.random.default_rng(1).normal(size=RATE * 60) * 0.1).astype(np.float32)
    with soundfile.SoundFile(path, "w", RATE, 1, compression_level=0.0) as file:
        for _ in range(HOURS * 60):
            file.write(minute)
    return path


def _milliseconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return (time.perf_counter() - start) * 1000


def _median(work: Callable[[], object], times: int) -> float:
    return round(statistics.median(_milliseconds(work) for _ in range(times)), 3)
