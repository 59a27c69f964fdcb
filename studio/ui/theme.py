"""The one theme: colours, spacing, type and icons of the whole window.

Widgets that paint themselves read `colours()` while painting, and repaint on QEvent.PaletteChange,
so switching between dark and light needs no restart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QSize
from PySide6.QtGui import QAction, QColor, QFont, QFontDatabase, QIcon, QPalette
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from studio.paths import resource
from studio.render import palette
from studio.render.palette import Palette
from studio.ui.stylesheet import TEMPLATE

if TYPE_CHECKING:
    import pyqtgraph as pg

STEP = 4
"""All spacing is a multiple of this many pixels."""
TIGHT, INSIDE, BETWEEN, EDGE = 4, 8, 16, 24
"""Gap between a label and its control, inside a card, between cards, and at the window's edges."""
PAGE = 12
"""Around a room and between its cards: more would cost pictures their size at 1280 x 800."""
RADIUS = 6
TEXT_PX, CAPTION_PX, TITLE_PX = 13, 11, 16
ICON_PX, BIG_ICON_PX = 16, 20

DATA = ("#56B4E9", "#E69F00", "#009E73", "#F0E442", "#CC79A7", "#D55E00", "#0072B2", "#BBBBBB")
"""Curves and meters: Okabe and Ito's set, told apart by colour-blind people too."""
HEAT = "viridis"
"""The name of pyqtgraph's colour map for heat."""


@dataclass(frozen=True)
class Colours(Palette):
    """One set of values for the tokens, those of pictures among them; all but `name` are "#RRGGBB"."""

    ground: str
    surface: str
    raised: str
    text: str
    muted: str
    disabled: str
    accent: str
    accent_soft: str
    on_accent: str
    record: str
    on_record: str
    good: str
    warn: str
    bad: str


DARK = Colours(
    **vars(palette.DARK), ground="#14161A", surface="#1C1F25", raised="#262A32",
    text="#E8EAED", muted="#A3ABB8", disabled="#6B7280",
    accent="#5AB0FF", accent_soft="#1F3A57", on_accent="#0C1622", record="#FF4D4F",
    on_record="#FFFFFF",    good="#4CC38A", warn="#F5B83D", bad="#F2777A",
)  # fmt: skip
LIGHT = Colours(
    **vars(palette.LIGHT), ground="#EEF0F3", surface="#FFFFFF", raised="#F1F3F6",
    text="#1B1F27", muted="#566072", disabled="#98A1AF",
    accent="#0B6BCB", accent_soft="#D9EAFB", on_accent="#FFFFFF", record="#D92D30",
    on_record="#FFFFFF",    good="#17744A", warn="#855800", bad="#B3343A",
)  # fmt: skip
THEMES = {theme.name: theme for theme in (DARK, LIGHT)}

_current = DARK
_ICON = "themed_icon"
"""The property of a button or action that tells how to draw its symbol again."""


def colours() -> Colours:
    """The values of the tokens now in use."""
    return _current


def colour(token: str, alpha: int = 255) -> QColor:
    """A token's colour, e.g. colour("accent"); alpha is 0..255."""
    value = QColor(getattr(_current, token))
    value.setAlpha(alpha)
    return value


def data_colour(index: int) -> QColor:
    """The colour of the index-th curve, counted from 0 and starting over after eight."""
    return QColor(DATA[index % len(DATA)])


def apply(app: QApplication, name: str = "dark") -> None:
    """Dress the whole application; an unknown name means dark."""
    global _current
    _current = THEMES.get(name, DARK)
    app.setStyle("Fusion")
    app.setFont(ui_font())
    app.setPalette(_palette(_current))
    app.setStyleSheet(stylesheet(_current))
    for widget in app.allWidgets():
        for target in (widget, *widget.actions()):
            kept = target.property(_ICON)
            if isinstance(kept, str) and isinstance(target, QAbstractButton | QAction):
                name, token, active = kept.split(" ")
                target.setIcon(icon(name, token, active or None))


def stylesheet(c: Colours | None = None) -> str:
    """The style sheet of a set of colours; of those in use where None."""
    c = c or _current
    icons = resource("icons").as_posix()
    text = TEMPLATE.replace("@icons", icons)
    for token in sorted(c.__dataclass_fields__, key=len, reverse=True):  # accent_soft before accent
        text = text.replace(f"@{token}", getattr(c, token))
    return text


def ui_font(pixels: int = TEXT_PX, semibold: bool = False) -> QFont:
    """The system's interface font in pixels, with a Japanese fallback."""
    font = QFontDatabase.systemFont(QFontDatabase.SystemFont.GeneralFont)
    font.setFamilies([font.family(), "Noto Sans CJK JP"])
    font.setPixelSize(pixels)
    if semibold:
        font.setWeight(QFont.Weight.DemiBold)
    return font


def figures_font(pixels: int = TEXT_PX, semibold: bool = False) -> QFont:
    """The interface font with digits of equal width, for times and levels."""
    font = ui_font(pixels, semibold)
    font.setFeature(QFont.Tag("tnum"), 1)
    return font


def icon(name: str, token: str = "text", active: str | None = None) -> QIcon:
    """A symbol of the kept set, e.g. icon("mdi6.microphone", "muted").

    Args:
        name: qtawesome's name; Material Design Icons ("mdi6.") are the studio's set.
        token: its colour.
        active: its colour while checked or hovered, the same where None.
    """
    import qtawesome

    options = {"color": getattr(_current, token), "color_disabled": _current.disabled}
    if active:
        options |= {"color_active": getattr(_current, active), "color_on": getattr(_current, active)}
    made: QIcon = qtawesome.icon(name, **options)
    return made


def as_role(widget: QWidget, role: str) -> None:
    """Give a widget one of the style sheet's roles.

    Labels: title, heading, muted, caption, good, warn, bad. Frames: card, bar. Buttons: primary,
    record, quiet, danger, chip. Changing the role later restyles the widget.
    """
    if widget.property("role") == role:
        return
    widget.setProperty("role", role)
    widget.style().unpolish(widget)
    widget.style().polish(widget)


def set_icon(target: QAbstractButton | QAction, name: str, token: str = "text", active: str = "") -> None:
    """Give a button or a menu entry a symbol that follows the theme; `active` while hovered or checked."""
    target.setProperty(_ICON, f"{name} {token} {active}")
    target.setIcon(icon(name, token, active or None))


def icon_size(big: bool = False) -> QSize:
    """16 px, or 20 px where big."""
    side = BIG_ICON_PX if big else ICON_PX
    return QSize(side, side)


def style_plot(plot: pg.PlotWidget | pg.PlotItem) -> None:
    """Give a pyqtgraph plot the theme's ground, axes and grid; call again on PaletteChange."""
    if hasattr(plot, "setBackground"):
        plot.setBackground(_current.surface)
    item: Any = plot.getPlotItem() if hasattr(plot, "getPlotItem") else plot
    item.showGrid(x=True, y=True, alpha=0.12)
    for side in ("left", "bottom", "right", "top"):
        axis = item.getAxis(side)
        axis.setPen(_current.line)
        axis.setTextPen(_current.muted)
        axis.setTickFont(figures_font(CAPTION_PX))


def plot_pen(index: int, width: float = 1.6) -> Any:
    """A pyqtgraph pen in the index-th data colour."""
    import pyqtgraph as pg

    return pg.mkPen(DATA[index % len(DATA)], width=width)


def _palette(c: Colours) -> QPalette:
    role, group = QPalette.ColorRole, QPalette.ColorGroup
    palette = QPalette()
    pairs = {
        role.Window: c.ground, role.WindowText: c.text, role.Base: c.surface, role.AlternateBase: c.raised,
        role.Text: c.text, role.Button: c.raised, role.ButtonText: c.text, role.BrightText: c.record,
        role.ToolTipBase: c.raised, role.ToolTipText: c.text, role.PlaceholderText: c.muted,
        role.Highlight: c.accent_soft, role.HighlightedText: c.text, role.Link: c.accent,
        role.LinkVisited: c.accent, role.Mid: c.line, role.Dark: c.ground, role.Light: c.raised,
        role.Midlight: c.raised, role.Shadow: c.ground, role.Accent: c.accent,
    }  # fmt: skip
    for key, value in pairs.items():
        palette.setColor(key, QColor(value))
    for key in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(group.Disabled, key, QColor(c.disabled))
    return palette
