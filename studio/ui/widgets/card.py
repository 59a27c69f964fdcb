"""Cards, headings and empty states: the furniture every tab shares."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QHelpEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QStyle,
    QStyleOptionComboBox,
    QStylePainter,
    QToolTip,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme


class Card(QFrame):
    """A surface with a heading; add content to `body`, small controls to `head`."""

    def __init__(self, title: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        theme.as_role(self, "card")
        outer = QVBoxLayout(self)
        outer.setContentsMargins(12, 10, 12, 12)
        outer.setSpacing(theme.INSIDE)
        self.head = QHBoxLayout()
        self.head.setSpacing(theme.INSIDE)
        self.title = heading(title)
        self.head.addWidget(self.title)
        self.head.addStretch(1)
        if title:
            outer.addLayout(self.head)
        self.body = QVBoxLayout()
        self.body.setSpacing(theme.INSIDE)
        outer.addLayout(self.body, 1)


def heading(text: str) -> QLabel:
    """A card's heading: small, muted, in capitals."""
    label = QLabel(text.upper())
    theme.as_role(label, "heading")
    return label


def label(text: str = "", role: str = "", name: str = "") -> QLabel:
    """A label with a role of the style sheet."""
    made = QLabel(text)
    made.setTextFormat(Qt.TextFormat.PlainText)  # names from senders and files are never markup
    if role:
        theme.as_role(made, role)
    if name:
        made.setObjectName(name)
    return made


class CutLabel(QLabel):
    """Words that are cut with an ellipsis where there is no room, rather than push their neighbours away.

    Args:
        role, name: of the style sheet; of the object.
        cut: where; names that differ at their end are cut in the middle.
    """

    def __init__(
        self, role: str = "", name: str = "", cut: Qt.TextElideMode = Qt.TextElideMode.ElideRight
    ) -> None:
        super().__init__()
        self._cut = cut
        self.short = ""
        """What stands there where the words have no room; "" for their beginning."""
        self.setTextFormat(Qt.TextFormat.PlainText)
        if role:
            theme.as_role(self, role)
        self.setObjectName(name)

    def minimumSizeHint(self) -> QSize:
        least = max(self.fontMetrics().horizontalAdvance(self.short), 24)
        return QSize(least if self.text() else 0, super().minimumSizeHint().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        words, room = self.text(), self.contentsRect()
        if self.fontMetrics().horizontalAdvance(words) <= room.width():
            super().paintEvent(event)
            return
        painter = QPainter(self)
        painter.setPen(self.palette().color(self.foregroundRole()))
        short = self.fontMetrics().elidedText(self.short or words, self._cut, room.width())
        painter.drawText(room, int(self.alignment()), short)


class CutComboBox(QComboBox):
    """A list whose choice is cut with an ellipsis where there is no room; its tip has it whole then."""

    @property
    def cut(self) -> bool:
        """Whether the choice has no room."""
        return self._shown() != self.currentText()

    def paintEvent(self, _event: QPaintEvent) -> None:
        option = QStyleOptionComboBox()
        self.initStyleOption(option)
        option.currentText = self._shown()
        painter = QStylePainter(self)
        painter.drawComplexControl(QStyle.ComplexControl.CC_ComboBox, option)
        painter.drawControl(QStyle.ControlElement.CE_ComboBoxLabel, option)

    def event(self, event: QEvent) -> bool:
        """Tell what is cut in the tip."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent) and self.cut:
            lines = (self.currentText(), self.toolTip())
            QToolTip.showText(event.globalPos(), "\n".join(line for line in lines if line), self)
            return True
        return super().event(event)

    def _shown(self) -> str:
        option = QStyleOptionComboBox()
        self.initStyleOption(option)
        field = QStyle.SubControl.SC_ComboBoxEditField
        room = self.style().subControlRect(QStyle.ComplexControl.CC_ComboBox, option, field, self).width()
        return self.fontMetrics().elidedText(self.currentText(), Qt.TextElideMode.ElideRight, room - 2)


class Picture(QLabel):
    """A large symbol that follows the theme."""

    def __init__(self, icon: str, side: int = 72, token: str = "disabled") -> None:
        super().__init__()
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._icon, self._side, self._token = icon, side, token
        self._draw()

    def set_icon(self, icon: str, token: str = "disabled") -> None:
        """Show another symbol."""
        if (icon, token) != (self._icon, self._token):
            self._icon, self._token = icon, token
            self._draw()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._draw()

    def _draw(self) -> None:
        self.setPixmap(theme.icon(self._icon, self._token).pixmap(self._side, self._side))


class EmptyState(QWidget):
    """One picture, one sentence, one button.

    Signals:
        clicked: the button.
    """

    clicked = Signal()

    def __init__(self, icon: str, sentence: str, button: str = "", name: str = "") -> None:
        super().__init__()
        self.picture = Picture(icon)
        self.sentence = QLabel(sentence)
        self.sentence.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.sentence.setWordWrap(True)
        theme.as_role(self.sentence, "muted")
        self.sentence.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        column = QVBoxLayout(self)
        column.setSpacing(theme.BETWEEN)
        column.addStretch(1)
        column.addWidget(self.picture)
        column.addWidget(self.sentence)
        self.button: QPushButton | None = None
        if button:
            self.button = QPushButton(button)
            self.button.setObjectName(name)
            theme.as_role(self.button, "primary")
            self.button.clicked.connect(self.clicked)
            column.addWidget(self.button, 0, Qt.AlignmentFlag.AlignHCenter)
        column.addStretch(1)


HANDLE_PX = 12

Part = tuple[QWidget, int, int]
"""A widget, its size at first in pixels, and its share of what room there is more."""


def columns(name: str, *parts: Part) -> QSplitter:
    """Parts side by side, from the left; the window remembers their sizes under the name."""
    return _splitter(Qt.Orientation.Horizontal, name, parts)


def rows(name: str, *parts: Part) -> QSplitter:
    """Parts one over the other, from the top."""
    return _splitter(Qt.Orientation.Vertical, name, parts)


def _splitter(way: Qt.Orientation, name: str, parts: tuple[Part, ...]) -> QSplitter:
    splitter = QSplitter(way)
    splitter.setObjectName(name)
    splitter.setHandleWidth(HANDLE_PX)
    splitter.setChildrenCollapsible(False)
    for index, (widget, _, share) in enumerate(parts):
        splitter.addWidget(widget)
        splitter.setStretchFactor(index, share)
    splitter.setSizes([size for _, size, _ in parts])
    return splitter
