"""The one theme: colours, spacing, type, icons and style sheet of the whole window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QSize
from PySide6.QtGui import QAction, QColor, QFont, QFontDatabase, QIcon, QPalette
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from studio.paths import resource
from studio.render import palette
from studio.render.palette import Palette

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
            drawn = target.property(_ICON)
            if isinstance(drawn, str) and isinstance(target, QAbstractButton | QAction):
                name, token, active = drawn.split(" ")
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
    record, quiet, step, danger, chip. Changing the role later restyles the widget.
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


TEMPLATE = """
* { outline: 0; }
QWidget { color: @text; selection-background-color: @accent_soft; selection-color: @text; }
QMainWindow, QDialog, QWidget#page { background: @ground; }
QToolTip { background: @raised; color: @text; border: 1px solid @line; padding: 4px 8px; }

QLabel { background: transparent; }
QLabel:disabled { color: @disabled; }
QLabel[role="display"] { font-size: 26px; font-weight: 600; }
QLabel[role="title"] { font-size: 16px; font-weight: 600; }
QLabel[role="heading"] { font-size: 11px; font-weight: 600; color: @muted; }
QLabel[role="muted"] { color: @muted; }
QLabel[role="caption"] { font-size: 11px; color: @muted; }
QLabel[role="good"] { color: @good; }
QLabel[role="warn"] { color: @warn; }
QLabel[role="bad"] { color: @bad; }

QFrame[role="card"] { background: @surface; border: 1px solid @line; border-radius: 6px; }
QFrame[role="bar"] { background: @surface; border: 0; border-bottom: 1px solid @line; }
QFrame[role="hairline"] { background: @line; border: 0; max-height: 1px; min-height: 1px; }
QFrame[role="toast"] { background: @raised; border: 1px solid @line; border-radius: 6px; }
QFrame[role="toast_bad"] { background: @raised; border: 1px solid @bad; border-radius: 6px; }

QPushButton, QToolButton {
    background: @raised; border: 1px solid @line; border-radius: 6px; padding: 5px 12px; min-height: 18px;
}
QToolButton { padding: 5px 8px; }
QPushButton:hover, QToolButton:hover { border-color: @disabled; }
QPushButton:pressed, QToolButton:pressed { background: @surface; }
QPushButton:checked, QToolButton:checked { background: @accent_soft; border-color: @accent; }
QPushButton:focus, QToolButton:focus { border-color: @accent; }
QPushButton:disabled, QToolButton:disabled { color: @disabled; background: @surface; border-color: @line; }
QToolButton[popupMode="1"] { padding-right: 26px; }
QToolButton::menu-button { border: 0; border-left: 1px solid @line; width: 20px; margin: 3px 0; }
QToolButton::menu-arrow { image: url("@icons/chevron-down.svg"); width: 10px; height: 10px; }
QToolButton::menu-indicator, QPushButton::menu-indicator { image: none; width: 0; }
QPushButton[role="primary"], QToolButton[role="primary"] {
    background: @accent; color: @on_accent; border-color: @accent; font-weight: 600; padding: 6px 16px;
}
QPushButton[role="primary"]:hover, QToolButton[role="primary"]:hover { border-color: @text; }
QPushButton[role="primary"]:focus, QToolButton[role="primary"]:focus { border-color: @text; }
QPushButton[role="primary"]:disabled { background: @raised; color: @disabled; border-color: @line; }
QPushButton[role="danger"] { color: @bad; }
QPushButton[role="record"] {
    background: @raised; border: 2px solid @record; color: @text; font-size: 16px; font-weight: 600;
    border-radius: 22px; min-height: 40px; padding: 0 24px;
}
QPushButton[role="record"]:hover, QPushButton[role="record"]:focus { border-color: @text; }
QPushButton[role="record"]:checked { background: @record; color: @on_record; }
QPushButton[role="record"]:disabled { border-color: @line; color: @disabled; }
QPushButton[role="quiet"], QToolButton[role="quiet"] {
    background: transparent; border-color: transparent; color: @muted; padding: 4px 8px;
}
QPushButton[role="quiet"]:hover, QToolButton[role="quiet"]:hover { background: @raised; color: @text; }
QPushButton[role="quiet"]:focus, QToolButton[role="quiet"]:focus { border-color: @accent; }
QPushButton[role="quiet"]:checked, QToolButton[role="quiet"]:checked { background: @accent_soft; color: @text; }
QPushButton[role="quiet"]:disabled, QToolButton[role="quiet"]:disabled { color: @disabled; }
QPushButton[role="step"] {
    background: @accent_soft; border-color: @accent_soft; color: @text; padding: 4px 10px;
}
QPushButton[role="step"]:hover, QPushButton[role="step"]:focus { border-color: @accent; }
QPushButton[role="fold"] {
    background: transparent; border-color: transparent; padding: 5px 2px; text-align: left;
}
QPushButton[role="fold"]:hover, QPushButton[role="fold"]:checked:hover { background: @raised; }
QPushButton[role="fold"]:checked { background: transparent; border-color: transparent; }
QPushButton[role="fold"]:focus { border-color: @accent; }
QPushButton[role="chip"], QToolButton[role="chip"] { border-radius: 12px; padding: 2px 10px; font-size: 11px; }
QPushButton[role="big"] { text-align: left; padding: 10px 14px; background: @surface; }
QPushButton[role="big"]:hover { background: @raised; }

QLineEdit, QPlainTextEdit, QTextEdit, QSpinBox, QDoubleSpinBox, QComboBox {
    background: @raised; border: 1px solid @line; border-radius: 6px; padding: 4px 8px; min-height: 20px;
}
QLineEdit QToolButton { background: transparent; border: 0; padding: 0; min-height: 0; }
QLineEdit:hover, QSpinBox:hover, QDoubleSpinBox:hover, QComboBox:hover { border-color: @disabled; }
QLineEdit:focus, QPlainTextEdit:focus, QTextEdit:focus, QSpinBox:focus, QDoubleSpinBox:focus,
QComboBox:focus { border-color: @accent; }
QLineEdit:disabled, QSpinBox:disabled, QDoubleSpinBox:disabled, QComboBox:disabled {
    color: @disabled; background: @surface;
}
QComboBox { padding-right: 4px; }
QComboBox::drop-down { border: 0; width: 22px; }
QComboBox::down-arrow { image: url("@icons/chevron-down.svg"); width: 12px; height: 12px; }
QComboBox QAbstractItemView { background: @raised; border: 1px solid @line; padding: 4px; }
QComboBox QAbstractItemView::item { min-height: 24px; padding: 0 6px; border-radius: 4px; }
QSpinBox, QDoubleSpinBox { padding-right: 20px; }
QSpinBox::up-button, QDoubleSpinBox::up-button {
    subcontrol-origin: border; subcontrol-position: top right; width: 18px; border: 0;
}
QSpinBox::down-button, QDoubleSpinBox::down-button {
    subcontrol-origin: border; subcontrol-position: bottom right; width: 18px; border: 0;
}
QSpinBox::up-arrow, QDoubleSpinBox::up-arrow { image: url("@icons/chevron-up.svg"); width: 10px; height: 10px; }
QSpinBox::down-arrow, QDoubleSpinBox::down-arrow {
    image: url("@icons/chevron-down.svg"); width: 10px; height: 10px;
}

QCheckBox, QRadioButton { spacing: 8px; background: transparent; }
QCheckBox::indicator, QRadioButton::indicator {
    width: 14px; height: 14px; border: 1px solid @disabled; background: @raised; border-radius: 4px;
}
QRadioButton::indicator { border-radius: 8px; }
QCheckBox::indicator:hover, QRadioButton::indicator:hover { border-color: @text; }
QCheckBox:focus, QRadioButton:focus { color: @accent; }
QCheckBox::indicator:checked {
    background: @accent; border-color: @accent; image: url("@icons/check-@name.svg");
}
QRadioButton::indicator:checked { background: @accent; border: 4px solid @raised; width: 8px; height: 8px; }

QSlider::groove:horizontal { height: 4px; background: @line; border-radius: 2px; }
QSlider::sub-page:horizontal { background: @accent; border-radius: 2px; }
QSlider::handle:horizontal {
    background: @text; width: 12px; height: 12px; margin: -4px 0; border-radius: 6px;
}
QSlider::handle:horizontal:focus { background: @accent; }
QSlider::sub-page:horizontal:disabled, QSlider::handle:horizontal:disabled { background: @disabled; }

QProgressBar {
    background: @raised; border: 0; border-radius: 3px; text-align: center; max-height: 6px; min-height: 6px;
    color: transparent;
}
QProgressBar::chunk { background: @accent; border-radius: 3px; }

QScrollArea, QScrollArea > QWidget > QWidget#scrolled { background: transparent; border: 0; }
QScrollBar:vertical { background: transparent; width: 10px; margin: 2px; }
QScrollBar:horizontal { background: transparent; height: 10px; margin: 2px; }
QScrollBar::handle { background: @line; border-radius: 3px; min-height: 32px; min-width: 32px; }
QScrollBar::handle:hover { background: @disabled; }
QScrollBar::add-line, QScrollBar::sub-line { width: 0; height: 0; }
QScrollBar::add-page, QScrollBar::sub-page { background: transparent; }

QListView, QTableView, QTreeView, QListWidget, QTableWidget, QTreeWidget {
    background: @surface; alternate-background-color: @surface; border: 0; gridline-color: @line;
}
QAbstractItemView::item { padding: 4px 6px; }
QAbstractItemView::item:hover { background: @raised; }
QAbstractItemView::item:selected { background: @accent_soft; color: @text; }
QHeaderView { background: @surface; border: 0; }
QHeaderView::section {
    background: @surface; color: @muted; border: 0; border-bottom: 1px solid @line; padding: 6px;
    font-size: 11px;
}
QTableCornerButton::section { background: @surface; border: 0; }

QMenuBar { background: @surface; border-bottom: 1px solid @line; }
QMenuBar::item { background: transparent; padding: 5px 10px; border-radius: 4px; }
QMenuBar::item:selected { background: @raised; }
QMenu { background: @raised; border: 1px solid @line; border-radius: 6px; padding: 6px; }
QMenu::item { padding: 6px 28px 6px 12px; border-radius: 4px; }
QMenu::item:selected { background: @accent_soft; }
QMenu::item:disabled { color: @disabled; }
QMenu::separator { height: 1px; background: @line; margin: 6px 4px; }
QMenu::icon { padding-left: 8px; }

QTabBar#rooms { background: transparent; }
QTabBar#rooms::tab {
    background: transparent; color: @muted; padding: 0 18px; margin: 0; min-height: 46px; border: 0;
    border-bottom: 2px solid transparent; border-top: 2px solid transparent;
}
QTabBar#rooms::tab:hover { color: @text; }
QTabBar#rooms::tab:selected { color: @text; border-bottom-color: @accent; }
QTabBar#rooms::tab:disabled { color: @disabled; }
QTabBar#rooms:focus { text-decoration: underline; }
QTabWidget::pane { border: 0; }
QTabBar::tab {
    background: transparent; color: @muted; padding: 6px 12px; border: 0; border-bottom: 2px solid transparent;
}
QTabBar::tab:hover { color: @text; }
QTabBar::tab:selected { color: @text; border-bottom-color: @accent; }

QSplitter::handle { background: @ground; }
QSplitter::handle:horizontal:hover { background: @accent_soft; margin: 0 4px; border-radius: 2px; }
QSplitter::handle:vertical:hover { background: @accent_soft; margin: 4px 0; border-radius: 2px; }
QGroupBox { border: 0; margin-top: 18px; }
QGroupBox::title { subcontrol-origin: margin; color: @muted; font-size: 11px; }
"""
