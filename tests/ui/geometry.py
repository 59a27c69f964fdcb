"""What a window does wrong at its size: controls that are cut, covered or outside, by geometry alone."""

from __future__ import annotations

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QScrollBar,
    QSizeGrip,
    QTabBar,
    QToolButton,
    QWidget,
)

from studio.ui.messages import Toast
from studio.ui.widgets.card import CutLabel

SEEN = (
    QAbstractButton, QAbstractSlider, QAbstractSpinBox, QComboBox, QLabel, QLineEdit, QAbstractItemView,
    QTabBar,
)  # fmt: skip
NAMED = ("microphone", "review_run", "review_style", "live_", "inspector_performer")
"""Choosers of names that people or devices gave, of any length: the beginning is enough."""
SLACK_PX = 1
"""Rounding of a hint; a letter cut by more is seen."""


def faults(window: QWidget) -> list[str]:
    """A sentence for every control or text of a window that cannot be read or reached as it stands."""
    found: list[str] = []
    for widget in _seen(window):
        name = f"{_path(widget)} {_words(widget)!r}"
        shown, cut = _shown(widget, window)
        if cut:
            found.append(f"{name} is cut by {cut}")
        elif _cut_words(widget):
            found.append(f"{name} has no room for its words: {_cut_words(widget)}")
        elif not shown.isEmpty():
            over = _covering(widget, shown, window)
            if over is not None:
                found.append(f"{name} is covered by {_path(over)}")
    return found


def _seen(window: QWidget) -> list[QWidget]:
    """What a person sees and uses, without the parts that other controls are made of."""
    made_of = QAbstractItemView | QAbstractSpinBox | QComboBox | QLineEdit | QScrollBar
    found = [one for one in window.findChildren(QWidget) if isinstance(one, SEEN) and one.isVisible()]
    return [
        one
        for one in found
        if not isinstance(one, QScrollBar | QSizeGrip)
        and not isinstance(one.parent(), made_of)
        and not one.objectName().startswith("qt_")
        and not (isinstance(one, QLabel) and not one.text() and one.pixmap().isNull())
        and not _within(one, Toast)
        and one.window() is window
    ]


def _shown(widget: QWidget, window: QWidget) -> tuple[QRect, str]:
    """The part of a widget that is seen, in the window's coordinates, and what cuts it for good."""
    whole = QRect(widget.mapTo(window, QPoint()), widget.size())
    shown, inside = QRect(whole), widget.parentWidget()
    while inside is not None:
        room = QRect(inside.mapTo(window, QPoint()), inside.size())
        area = inside.parentWidget()
        scrolls = isinstance(area, QScrollArea) and area.viewport() is inside
        wide = scrolls and area.horizontalScrollBar().maximum() > 0
        high = scrolls and area.verticalScrollBar().maximum() > 0
        if not wide and (room.left() - shown.left() > SLACK_PX or shown.right() - room.right() > SLACK_PX):
            return shown, _path(inside)
        if not high and (room.top() - shown.top() > SLACK_PX or shown.bottom() - room.bottom() > SLACK_PX):
            return shown, _path(inside)
        shown &= room
        if inside is window or shown.isEmpty():
            break
        inside = inside.parentWidget()
    return shown, ""


def _cut_words(widget: QWidget) -> str:
    """How much room a widget's words have and need; "" where they fit."""
    has, needs = widget.size(), QSize(0, 0)
    if isinstance(widget, CutLabel):
        return ""  # says itself that there is more
    if isinstance(widget, QLabel):
        if not widget.pixmap().isNull():
            needs = widget.pixmap().deviceIndependentSize().toSize()
        elif widget.wordWrap():
            needs = QSize(0, widget.heightForWidth(widget.width()))
        else:
            needs = widget.sizeHint()
            needs.setHeight(widget.fontMetrics().height())
    elif isinstance(widget, QPushButton | QToolButton):
        if widget.text() and not _iconic(widget):
            needs = _button_need(widget)
    elif isinstance(widget, QTabBar):
        needs = widget.minimumSizeHint() if widget.usesScrollButtons() else widget.sizeHint()
    elif isinstance(widget, QComboBox):
        room = widget.width() - 36 - (widget.iconSize().width() if not widget.itemIcon(0).isNull() else 0)
        needs.setWidth(widget.fontMetrics().horizontalAdvance(widget.currentText()))
        has = QSize(room, widget.height())
        if widget.objectName().startswith(NAMED):
            needs.setWidth(min(needs.width(), widget.fontMetrics().horizontalAdvance("x" * 8)))
    elif isinstance(widget, QAbstractSpinBox):
        text = widget.text()
        needs.setWidth(widget.fontMetrics().horizontalAdvance(text) + 30)
    elif isinstance(widget, QAbstractItemView):
        needs = QSize(60, 40)
    if needs.width() - has.width() > SLACK_PX or needs.height() - has.height() > SLACK_PX:
        return f"{has.width()}x{has.height()}, needs {needs.width()}x{needs.height()}"
    return ""


def _button_need(button: QAbstractButton) -> QSize:
    """The room a button's words and symbol take up without any air around them."""
    words = button.fontMetrics().size(Qt.TextFlag.TextShowMnemonic, button.text())
    symbol = 0 if button.icon().isNull() else button.iconSize().width() + 4
    return QSize(words.width() + symbol, words.height())


def _iconic(button: QAbstractButton) -> bool:
    style = Qt.ToolButtonStyle.ToolButtonIconOnly
    return (
        isinstance(button, QToolButton) and not button.icon().isNull() and button.toolButtonStyle() == style
    )


def _covering(widget: QWidget, shown: QRect, window: QWidget) -> QWidget | None:
    """What lies over a widget's middle or its ends; None where nothing does."""
    inset = shown.adjusted(3, 3, -3, -3)
    for point in (shown.center(), inset.topLeft(), inset.bottomRight()):
        if not shown.contains(point):
            continue
        top = window.childAt(point)
        if top is None or top is widget or widget.isAncestorOf(top) or top.isAncestorOf(widget):
            continue
        if _within(top, Toast) or isinstance(top, QScrollBar):
            continue
        return top
    return None


def _within(widget: QWidget, kind: type[QWidget]) -> bool:
    one: QWidget | None = widget
    while one is not None and not isinstance(one, kind):
        one = one.parentWidget()
    return one is not None


def _words(widget: QWidget) -> str:
    text = getattr(widget, "text", None) or getattr(widget, "currentText", None)
    return str(text())[:50] if callable(text) else widget.accessibleName()


def _path(widget: QWidget) -> str:
    parts: list[str] = []
    one: QWidget | None = widget
    while one is not None and len(parts) < 3:
        parts.append(one.objectName() or type(one).__name__)
        one = one.parentWidget()
    return "/".join(reversed(parts))
