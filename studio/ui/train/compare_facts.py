"""What `saia compare` found, as rows to show: which figure, in whose favour. Pure: no Qt widgets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QT_TRANSLATE_NOOP, QCoreApplication

from studio.ipc.events import CompareDone

CAPTURED = "captured"
BASELINES = ("ridge", "train_mean", "zero")


@dataclass(frozen=True)
class Figure:
    """A figure: key in the metrics, title, decimals, one sentence about it, and its unit."""

    key: str
    title: str
    decimals: int
    tip: str
    unit: str = ""


_AS_MUCH = QT_TRANSLATE_NOOP("Compare", "1 moves as much as the performer")
FIGURES = tuple(
    Figure(*words)
    for words in (
        ("rmse", QT_TRANSLATE_NOOP("Compare", "Error"), 4,
         QT_TRANSLATE_NOOP("Compare", "Root mean square error of face and body together; smaller is nearer")),
        ("pearson", QT_TRANSLATE_NOOP("Compare", "Follows (r)"), 2,
         QT_TRANSLATE_NOOP("Compare", "How well the curves follow the captured ones; 1 is perfect")),
        ("pearson_mouth", QT_TRANSLATE_NOOP("Compare", "Mouth follows (r)"), 2,
         QT_TRANSLATE_NOOP("Compare", "The same for the shapes of the mouth")),
        ("pearson_jaw", QT_TRANSLATE_NOOP("Compare", "Jaw follows (r)"), 2,
         QT_TRANSLATE_NOOP("Compare", "The same for the shape that opens the jaw")),
        ("motion_ratio", QT_TRANSLATE_NOOP("Compare", "Motion"), 2,
         QT_TRANSLATE_NOOP("Compare", "How much it moves; 1 moves as much as the performer, 0 stands still")),
        ("std_ratio", QT_TRANSLATE_NOOP("Compare", "Reach"), 2,
         QT_TRANSLATE_NOOP("Compare", "How wide the poses are; 1 is as wide as the performer's")),
        ("jerk_ratio", QT_TRANSLATE_NOOP("Compare", "Jerk"), 2,
         QT_TRANSLATE_NOOP("Compare", "How much it trembles; 1 is as calm as the performer")),
        ("closure_recall", QT_TRANSLATE_NOOP("Compare", "Lips close"), 2,
         QT_TRANSLATE_NOOP("Compare", "Share of the closed mouths while speaking that are closed")),
        ("mouth_lag_ms", QT_TRANSLATE_NOOP("Compare", "Mouth after voice"), 0,
         QT_TRANSLATE_NOOP("Compare", "How late the mouth comes after the voice"), "ms"),
        ("blinks_per_minute", QT_TRANSLATE_NOOP("Compare", "Blinks a minute"), 1,
         QT_TRANSLATE_NOOP("Compare", "People blink 10 to 30 times a minute while they speak")),
        ("geodesic_deg", QT_TRANSLATE_NOOP("Compare", "Bones off"), 2,
         QT_TRANSLATE_NOOP("Compare", "Mean angle between predicted and captured bones"), "°"),
        ("wrist_cm", QT_TRANSLATE_NOOP("Compare", "Wrists off"), 1,
         QT_TRANSLATE_NOOP("Compare", "Mean distance of the wrists from where they were"), "cm"),
        ("motion_ratio_head", QT_TRANSLATE_NOOP("Compare", "Motion of the head"), 2, _AS_MUCH),
        ("motion_ratio_torso", QT_TRANSLATE_NOOP("Compare", "Motion of the torso"), 2, _AS_MUCH),
        ("motion_ratio_arms", QT_TRANSLATE_NOOP("Compare", "Motion of the arms"), 2, _AS_MUCH),
        ("frechet", QT_TRANSLATE_NOOP("Compare", "Strangeness"), 2,
         QT_TRANSLATE_NOOP("Compare", "Frechet distance of the motion: 0 is the same, 1 a frozen mean")),
    )
)  # fmt: skip


@dataclass(frozen=True)
class Cell:
    """A value, the length of its bar 0..1, and whether it is nearest to the captured motion's."""

    value: float | None
    bar: float = 0.0
    best: bool = False


@dataclass(frozen=True)
class FigureRow:
    """One figure of everything compared, in the order of the columns."""

    figure: Figure
    cells: tuple[Cell, ...]
    mark: float | None
    """Where the captured motion's own value lies on the bars, 0..1."""


@dataclass(frozen=True)
class Comparison:
    """The table.

    Args:
        columns: ids of the runs, then of the baselines, then "captured".
        runs: how many of the columns are runs.
        rows: the figures that apply to any.
        takes: ids of those measured on.
        split: what they are used for.
    """

    columns: tuple[str, ...]
    runs: int
    rows: tuple[FigureRow, ...]
    takes: tuple[str, ...]
    split: str


def compared(done: CompareDone) -> Comparison:
    """The table of the last line of `saia compare --json`."""
    runs, baselines = done.runs, done.baselines
    order = [name for name in BASELINES if name in baselines]
    columns = (*runs, *order, CAPTURED)
    found = [*runs.values(), *(baselines[name] for name in order), done.captured]
    rows = [_row(figure, [_number(one.get(figure.key)) for one in found], len(runs)) for figure in FIGURES]
    shown = tuple(row for row in rows if any(cell.value is not None for cell in row.cells[:-1]))
    return Comparison(columns, len(runs), shown, done.takes, done.split)


def title(column: str) -> str:
    """A column's heading."""
    words = {
        "ridge": _tr("Simple guess"),
        "train_mean": _tr("Mean pose"),
        "zero": _tr("Rest pose"),
        CAPTURED: _tr("Captured"),
    }
    return words.get(column, column)


def _row(figure: Figure, values: Sequence[float | None], runs: int) -> FigureRow:
    known = [abs(value) for value in values if value is not None]
    longest = max(known, default=0.0)
    nearest = _nearest(values[:runs], values[-1])
    cells = [
        Cell(value, abs(value) / longest if value is not None and longest > 0 else 0.0, i == nearest)
        for i, value in enumerate(values)
    ]
    ideal = values[-1]
    return FigureRow(
        figure, tuple(cells), abs(ideal) / longest if ideal is not None and longest > 0 else None
    )


def _nearest(values: Sequence[float | None], ideal: float | None) -> int | None:
    """Which value alone is nearest to the ideal; None where nothing can be said."""
    if ideal is None:
        return None
    known = sorted((abs(value - ideal), i) for i, value in enumerate(values) if value is not None)
    return known[0][1] if len(known) > 1 and known[0][0] < known[1][0] else None


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Compare", text)
