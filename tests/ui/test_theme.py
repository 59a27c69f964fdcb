"""The theme: every token is filled in, and text can be read on its surface."""

import re

import pytest
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QApplication, QPushButton

from studio.ui import theme


def luminance(value: str) -> float:
    def linear(c: float) -> float:
        return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4

    r, g, b, _ = QColor(value).getRgbF()
    return 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)


def contrast(a: str, b: str) -> float:
    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("name", ["dark", "light"])
@pytest.mark.parametrize("text", ["text", "muted", "good", "warn", "bad"])
@pytest.mark.parametrize("ground", ["ground", "surface", "raised"])
def test_text_stands_out_from_every_surface(name: str, text: str, ground: str) -> None:
    colours = theme.THEMES[name]
    assert contrast(getattr(colours, text), getattr(colours, ground)) >= 4.5


@pytest.mark.parametrize("name", ["dark", "light"])
def test_the_words_of_the_primary_button_can_be_read(name: str) -> None:
    colours = theme.THEMES[name]
    assert contrast(colours.on_accent, colours.accent) >= 4.5


@pytest.mark.parametrize("name", ["dark", "light"])
def test_the_style_sheet_has_no_token_left_over(name: str) -> None:
    sheet = theme.stylesheet(theme.THEMES[name])
    assert not re.findall(r"@\w+", sheet)
    for path in re.findall(r'url\("([^"]+)"\)', sheet):
        assert theme.resource(*path.split("/")[-2:]).is_file()


def test_switching_the_theme_changes_the_application(qapp: QApplication) -> None:
    theme.apply(qapp, "light")
    assert qapp.palette().window().color() == QColor(theme.LIGHT.ground)
    theme.apply(qapp, "no such theme")
    assert qapp.palette().window().color() == QColor(theme.DARK.ground)
    assert qapp.font().pixelSize() == theme.TEXT_PX


def test_a_role_restyles_a_widget(qtbot, qapp: QApplication) -> None:
    theme.apply(qapp)
    button = QPushButton("Start training")
    qtbot.addWidget(button)
    button.resize(120, 32)
    theme.as_role(button, "primary")
    colour = button.grab().toImage().pixelColor(12, 16)
    assert colour == QColor(theme.DARK.accent)


def test_data_colours_start_over_after_eight() -> None:
    assert theme.data_colour(8) == theme.data_colour(0) == QColor("#56B4E9")
