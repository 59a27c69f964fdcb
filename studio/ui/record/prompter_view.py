"""The teleprompter: what to say, and a ring that fills up to twenty minutes."""

from __future__ import annotations

import math
from collections.abc import Mapping

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QActionGroup, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QHBoxLayout, QMenu, QPushButton, QToolButton, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.widgets.card import Card, CutLabel, label

RING_PX = 76


class GoalRing(QWidget):
    """Minutes recorded, of those that make an excellent model, with a mark at each milestone."""

    def __init__(self) -> None:
        super().__init__()
        self._seconds = 0.0
        self._marks: tuple[float, ...] = (1.0,)
        self.setFixedSize(RING_PX, RING_PX)

    def show_seconds(self, seconds: float, milestones: tuple[float, ...]) -> None:
        """Show how much is there, and where the milestones are; seconds."""
        self._seconds, self._marks = seconds, milestones
        self.setAccessibleName(self.tr("{0} of {1} minutes").format(self._text(), int(milestones[-1] / 60)))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QRectF(self.rect()).adjusted(6, 6, -6, -6)
        painter.setPen(QPen(theme.colour("line"), 6))
        painter.drawEllipse(box)
        done = self._seconds >= self._marks[-1]
        pen = QPen(theme.colour("good" if done else "accent"), 6)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        painter.setPen(pen)
        if self._seconds > 0:
            painter.drawArc(box, 90 * 16, -round(self._part(self._seconds) * 360 * 16))
        for mark in self._marks[:-1]:
            # Square roots: the first minutes matter most, and would be a sliver else.
            turn = math.radians(self._part(mark) * 360 - 90)
            way = QPointF(math.cos(turn), math.sin(turn))
            reached = self._seconds >= mark
            painter.setPen(QPen(theme.colour("text" if reached else "muted"), 2))
            painter.drawLine(
                box.center() + way * (box.width() / 2 - 4), box.center() + way * (box.width() / 2 + 4)
            )
        painter.setPen(theme.colour("text"))
        painter.setFont(theme.figures_font(14, semibold=True))
        painter.drawText(self.rect(), int(Qt.AlignmentFlag.AlignCenter), self._text())

    def _part(self, seconds: float) -> float:
        return min(math.sqrt(max(seconds, 0.0) / self._marks[-1]), 1.0)

    def _text(self) -> str:
        return f"{int(self._seconds) // 60}:{int(self._seconds) % 60:02d}"


class PrompterCard(Card):
    """What to say now; it can be hidden.

    Signals:
        next_requested, again_requested: said well, or once more; by key, pedal or button.
        language_chosen: its code.
        own_text_requested: write one's own text.
        pause_chosen: whether a long pause goes on to the next.
        shown_chosen: whether the teleprompter is shown.
    """

    next_requested = Signal()
    again_requested = Signal()
    language_chosen = Signal(str)
    own_text_requested = Signal()
    pause_chosen = Signal(bool)
    shown_chosen = Signal(bool)

    def __init__(self) -> None:
        super().__init__()
        self._page = QWidget()
        self.ring = GoalRing()
        self.kind = CutLabel("caption", "prompt_kind")
        self.text = label("", "", "prompt_text")
        self.text.setFont(theme.ui_font(18, semibold=True))
        self.text.setWordWrap(True)
        self.text.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        self.text.setMinimumHeight(50)
        self.missing = label("", "caption", "prompt_missing")
        self.missing.setWordWrap(True)
        self.next = QPushButton(name_of("prompt_next"))
        self.next.setObjectName("prompt_next")
        self.next.setToolTip(tip_of("prompt_next"))
        self.next.clicked.connect(self.next_requested)
        self.again = QPushButton(name_of("prompt_again"))
        self.again.setObjectName("prompt_again")
        self.again.setToolTip(tip_of("prompt_again"))
        self.again.clicked.connect(self.again_requested)
        self._menu = QMenu(self)
        self._languages = QActionGroup(self)
        self.more = self._tool("prompt_more", "mdi6.dots-horizontal", self.tr("Teleprompter options"))
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.more.setMenu(self._menu)
        self.toggle = self._tool("prompt_toggle", "mdi6.chevron-down", self.tr("Hide the teleprompter"))
        self.toggle.clicked.connect(lambda: self.shown_chosen.emit(self._page.isHidden()))
        self._title = label(self.tr("Teleprompter"), "muted")
        self._lay_out()

    def show_prompt(self, text: str, kind: str) -> None:
        """Show what to say, and what kind it is of; "" where there is nothing."""
        self.text.setText(text)
        self.kind.setText(kind)

    def show_coverage(self, seconds: float, milestones: tuple[float, ...], words: str, details: str) -> None:
        """Show how much is recorded, seconds, and what is missing."""
        self.ring.show_seconds(seconds, milestones)
        self.ring.setToolTip(details)
        self.missing.setText(words)
        self.missing.setToolTip(details)

    def show_choices(self, languages: Mapping[str, str], chosen: str, own: str, pause: bool) -> None:
        """Show the languages by code, the one in use, the words for own text, and the pause's choice."""
        self._menu.clear()
        for code, name in languages.items():
            action = self._menu.addAction(name)
            action.setCheckable(True)
            action.setChecked(code == chosen)
            action.setActionGroup(self._languages)
            action.triggered.connect(lambda _on=False, one=code: self.language_chosen.emit(one))
        self._menu.addAction(own).triggered.connect(lambda: self.own_text_requested.emit())
        self._menu.addSeparator()
        action = self._menu.addAction(self.tr("Next after a long pause"))
        action.setObjectName("prompt_pause")
        action.setCheckable(True)
        action.setChecked(pause)
        action.toggled.connect(self.pause_chosen)

    def show_shown(self, shown: bool) -> None:
        """Show all of it, or its name alone."""
        self._page.setVisible(shown)
        self._title.setVisible(not shown)
        theme.set_icon(self.toggle, "mdi6.chevron-down" if shown else "mdi6.chevron-up", "muted")
        words = self.tr("Hide the teleprompter") if shown else self.tr("Show the teleprompter")
        self.toggle.setToolTip(words)
        self.toggle.setAccessibleName(words)

    def show_brief(self, brief: bool) -> None:
        """Smaller, and with what is missing in the ring's tip alone, where the window is low."""
        self.text.setFont(theme.ui_font(15 if brief else 18, semibold=True))
        self.text.setMinimumHeight(40 if brief else 50)
        self.missing.setVisible(not brief)

    def _lay_out(self) -> None:
        words = QVBoxLayout()
        words.setSpacing(2)
        words.addWidget(self.kind)
        words.addWidget(self.text, 1)
        words.addWidget(self.missing)
        buttons = QVBoxLayout()
        buttons.setSpacing(theme.TIGHT)
        buttons.addWidget(self.next)
        buttons.addWidget(self.again)
        buttons.addStretch(1)
        page = QHBoxLayout(self._page)
        page.setContentsMargins(0, 0, 0, 0)
        page.setSpacing(theme.BETWEEN)
        page.addWidget(self.ring, 0, Qt.AlignmentFlag.AlignVCenter)
        page.addLayout(words, 1)
        page.addLayout(buttons)
        tools = QVBoxLayout()
        tools.setSpacing(theme.TIGHT)
        tools.addWidget(self.toggle)
        tools.addWidget(self.more)
        tools.addStretch(1)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self._title, 1)
        row.addWidget(self._page, 1)
        row.addLayout(tools)
        self.body.addLayout(row)
        self._title.hide()

    def _tool(self, name: str, icon: str, words: str) -> QToolButton:
        button = QToolButton()
        button.setObjectName(name)
        theme.as_role(button, "quiet")
        theme.set_icon(button, icon, "muted")
        button.setToolTip(words)
        button.setAccessibleName(words)
        return button
