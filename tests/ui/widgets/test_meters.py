"""Meters: what is shown is what came in."""

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor

from studio.motion.channels import ARKIT_SHAPES, VRM0_SHAPES
from studio.ui import theme
from studio.ui.widgets.meters import LevelMeterBar, ShapeMeters


@pytest.fixture
def level(qtbot, qapp) -> LevelMeterBar:
    theme.apply(qapp)
    made = LevelMeterBar()
    qtbot.addWidget(made)
    made.resize(300, 36)
    made.show()
    return made


def lit(meter: LevelMeterBar, token: str) -> bool:
    image = meter.grab().toImage()
    wanted = QColor(getattr(theme.DARK, token))
    return any(image.pixelColor(x, 9) == wanted for x in range(image.width() - 46))


def test_a_louder_voice_reaches_the_next_colour(level: LevelMeterBar) -> None:
    level.show_level(-20, -24, -20, False)
    assert lit(level, "good")
    assert not lit(level, "warn")
    level.show_level(-6, -8, -6, False)
    assert lit(level, "warn")
    assert not lit(level, "record")
    level.show_level(0, -1, 0, False)
    assert lit(level, "record")


def test_the_clip_lamp_stays_and_a_click_asks_to_put_it_out(level: LevelMeterBar, qtbot) -> None:
    level.show_level(-20, -24, -20, True)
    assert level.accessibleName() == "Microphone level, clipped"
    with qtbot.waitSignal(level.reset_requested):
        qtbot.mouseClick(level, Qt.MouseButton.LeftButton, pos=QPoint(290, 8))
    level.show_level(-20, -24, -20, False)
    assert level.accessibleName() == "Microphone level"


def test_a_click_on_the_bar_resets_nothing(level: LevelMeterBar, qtbot) -> None:
    with qtbot.assertNotEmitted(level.reset_requested):
        qtbot.mouseClick(level, Qt.MouseButton.LeftButton, pos=QPoint(100, 8))


@pytest.fixture
def shapes(qtbot, qapp) -> ShapeMeters:
    theme.apply(qapp)
    made = ShapeMeters()
    qtbot.addWidget(made)
    made.resize(300, 500)
    made.show()
    return made


def test_every_incoming_shape_is_listed_by_name(shapes: ShapeMeters) -> None:
    shapes.show_values(dict.fromkeys(VRM0_SHAPES, 0.0))
    shapes.show_values({"MyOwnShape": 0.5})
    assert shapes.shown_names == tuple(sorted((*VRM0_SHAPES, "MyOwnShape"), key=str.lower))


def test_search_leaves_what_matches(shapes: ShapeMeters, qtbot) -> None:
    shapes.show_values(dict.fromkeys(ARKIT_SHAPES, 0.0))
    qtbot.keyClicks(shapes.search, "jaw")
    assert shapes.shown_names == ("JawForward", "JawLeft", "JawOpen", "JawRight")


def test_sorted_by_activity_the_liveliest_comes_first(shapes: ShapeMeters) -> None:
    shapes.sort.setCurrentIndex(shapes.sort.findData("activity"))
    for step in range(10):
        shapes.show_values({"A": 0.1, "Blink": float(step % 2), "Joy": 0.9})
    shapes.search.setText(" ")  # any wish to order anew
    assert shapes.shown_names[0] == "Blink"


def test_a_bar_is_as_long_as_its_value(shapes: ShapeMeters) -> None:
    def length(value: float) -> int:
        shapes.show_values({"A": value})
        image = shapes.list.viewport().grab().toImage()
        return sum(image.pixelColor(x, 11) == theme.data_colour(0) for x in range(image.width()))

    half, full = length(0.5), length(1.0)
    assert half == pytest.approx(full / 2, abs=3)
    assert length(7.0) == full  # an avatar with other limits stays in its row


def test_values_that_are_no_numbers_do_no_harm(shapes: ShapeMeters) -> None:
    shapes.show_values({"A": float("nan"), "I": float("inf"), "U": -1e30})
    shapes.list.viewport().grab()
    assert shapes.shown_names == ("A", "I", "U")


def test_peaks_are_held(shapes: ShapeMeters) -> None:
    shapes.show_values({"A": 0.9})
    shapes.show_values({"A": 0.1})
    assert shapes.list.rows[0].peak == 0.9
    assert shapes.list.rows[0].value == 0.1
    assert 0.8 < shapes.list.rows[0].activity <= 0.9 + 0.8 + 1e-6  # the 0.9 fades as time goes by
