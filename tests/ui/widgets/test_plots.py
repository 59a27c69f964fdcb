from __future__ import annotations

import math

import pytest
from PySide6.QtGui import QImage
from pytestqt.qtbot import QtBot

from studio.ui.widgets.figure.sketch import DrawnFace
from studio.ui.widgets.plots import LossPlot, epoch_step


def _plot(qtbot: QtBot) -> LossPlot:
    plot = LossPlot("Loss", (("train_loss", "training"), ("val_loss", "validation")))
    qtbot.addWidget(plot)
    plot.resize(500, 300)
    plot.show()
    return plot


def test_only_its_own_series_set_the_range(qtbot: QtBot) -> None:
    plot = _plot(qtbot)
    plot.show_points({"train_loss": [(1, 0.02), (2, 0.01)], "motion_ratio": [(1, 5.0)]}, best=2)
    qtbot.waitUntil(lambda: plot.value_range[1] < 0.03)
    assert plot.value_text("train_loss") == "0.0100"


def test_a_single_value_does_not_fill_the_axis_with_digits(qtbot: QtBot) -> None:
    plot = _plot(qtbot)
    plot.show_points({"val_loss": [(1, 0.07)]}, best=1)
    qtbot.waitUntil(lambda: plot.value_range[1] < 0.1)
    low, high = plot.value_range
    assert low < 0.07 < high
    assert high - low >= 0.0035


def test_values_that_are_no_numbers_leave_a_gap(qtbot: QtBot) -> None:
    plot = _plot(qtbot)
    plot.show_points({"val_loss": [(1, 0.5), (2, None), (3, math.nan), (4, math.inf), (5, 0.4)]}, best=5)
    assert plot.points["val_loss"] == ([1, 5], [0.5, 0.4])
    qtbot.waitUntil(lambda: plot.marks_best)


@pytest.mark.parametrize(
    ("span", "step"), [(0, 1), (4, 1), (16, 1), (17, 2), (40, 5), (100, 10), (1000, 100)]
)
def test_epochs_are_counted_in_whole_round_steps(span: int, step: int) -> None:
    assert epoch_step(span) == step


def test_many_epochs_are_one_redraw(qtbot: QtBot) -> None:
    plot = _plot(qtbot)
    for epoch in range(1, 200):
        plot.show_points({"train_loss": [(e, 1 / e) for e in range(1, epoch + 1)]}, best=None)
    assert plot.drawn["train_loss"] == 0
    qtbot.waitUntil(lambda: plot.drawn["train_loss"] == 199)


def _picture(face: DrawnFace) -> QImage:
    return face.grab().toImage()


def test_a_face_is_drawn_and_changes_with_its_shapes(qtbot: QtBot) -> None:
    face = DrawnFace()
    qtbot.addWidget(face)
    face.resize(160, 160)
    face.show_values(None)
    nothing = _picture(face)
    face.show_values({"A": 0.0})
    closed = _picture(face)
    face.show_values({"A": 1.0})
    assert nothing != closed
    assert _picture(face) != closed
