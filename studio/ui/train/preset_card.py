"""A preset to choose: its name, how long it takes, and what it is for."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.widgets.card import label


class PresetCard(QPushButton):
    """A checkable card.

    Args:
        name: its object name.
        title: "Quick look".
        duration: "about 2 min"; may be empty.
        summary: one sentence.
    """

    def __init__(
        self, name: str, title: str, duration: str, summary: str, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setCheckable(True)
        self.setAutoExclusive(True)
        self.setAccessibleName(f"{title}, {duration}" if duration else title)
        self.setAccessibleDescription(summary)
        theme.as_role(self, "big")
        self.title = label(title, "")
        self.title.setFont(theme.ui_font(theme.TEXT_PX, semibold=True))
        self.duration = label(duration, "caption")
        self.summary = label(summary, "caption")
        self.summary.setWordWrap(True)
        self.summary.setAlignment(Qt.AlignmentFlag.AlignTop)
        head = QHBoxLayout()
        head.addWidget(self.title)
        head.addStretch(1)
        head.addWidget(self.duration)
        column = QVBoxLayout(self)
        column.setContentsMargins(14, 10, 14, 8)
        column.setSpacing(theme.TIGHT)
        column.addLayout(head)
        column.addWidget(self.summary, 1)
        for child in (self.title, self.duration, self.summary):
            child.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def sizeHint(self) -> QSize:
        layout = self.layout()
        assert layout is not None
        return QSize(190, max(layout.sizeHint().height(), 96))

    def minimumSizeHint(self) -> QSize:
        return QSize(150, 96)
