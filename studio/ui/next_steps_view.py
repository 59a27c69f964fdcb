"""The strip under the tabs: the steps from the first take to going live, each with its one button."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QT_TRANSLATE_NOOP, QCoreApplication, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QPushButton, QToolButton

from studio.ui import theme
from studio.ui.shortcuts import name_of
from studio.ui.widgets.card import label
from studio.ui.widgets.timeline.time_view import minutes

FOLDED_BELOW = 1100
"""Pixels of width under which the current step stands alone."""
HEIGHT = 36

STEPS = ("record", "check", "train", "watch", "live")
"""In their order; each has a button here."""
_TEXTS: dict[str, Any] = {
    "record": QT_TRANSLATE_NOOP("StepStrip", "Record two minutes"),
    "check": QT_TRANSLATE_NOOP("StepStrip", "Check"),
    "train": QT_TRANSLATE_NOOP("StepStrip", "Train"),
    "watch": QT_TRANSLATE_NOOP("StepStrip", "Watch"),
    "live": QT_TRANSLATE_NOOP("StepStrip", "Go live"),
}
_TIPS: dict[str, Any] = {
    "record": QT_TRANSLATE_NOOP(
        "StepStrip", "Record your voice and motion together; two minutes are a start"
    ),
    "check": QT_TRANSLATE_NOOP("StepStrip", "Look through what you recorded, and leave out what went wrong"),
    "train": QT_TRANSLATE_NOOP("StepStrip", "Let a network learn how you move when you speak"),
    "watch": QT_TRANSLATE_NOOP("StepStrip", "Watch what it makes of a voice it has not learnt from"),
    "live": QT_TRANSLATE_NOOP("StepStrip", "Speak, and your avatar moves now"),
}


class StepStrip(QFrame):
    """The steps in one line; those that are done have a tick, the current one stands out.

    Signals:
        step_requested: a step's button was pressed; carries its name.
        dismissed: the strip is not wanted.
    """

    step_requested = Signal(str)
    dismissed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("next_steps")
        theme.as_role(self, "bar")
        self.setFixedHeight(HEIGHT)
        self._current = ""
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(theme.BETWEEN, 0, theme.INSIDE, 0)
        self._row.setSpacing(theme.INSIDE)
        self._heading = label("", "muted", "next_steps_heading")
        self._row.addWidget(self._heading)
        self.buttons: dict[str, QPushButton] = {}
        for step in STEPS:
            button = self.buttons[step] = QPushButton(_tr(_TEXTS[step]))
            button.setObjectName(f"step_{step}")
            button.setToolTip(_tr(_TIPS[step]))
            theme.as_role(button, "quiet")
            button.clicked.connect(lambda _=False, step=step: self.step_requested.emit(step))
            self._row.addWidget(button)
        self._row.addStretch(1)
        close = QToolButton()
        close.setObjectName("next_steps_close")
        close.setToolTip(self.tr("Hide these steps; the menu's View brings them back"))
        close.setAccessibleName(self.tr("Hide the next steps"))
        theme.set_icon(close, "mdi6.close", "muted")
        theme.as_role(close, "quiet")
        close.clicked.connect(self.dismissed)
        self._row.addWidget(close)
        self.show_steps((), STEPS[0])

    def show_recorded(self, seconds: float, target: float) -> None:
        """Say how much there is of the target; what is enough or nothing yet needs no number."""
        words = self.tr("Record: {0} of {1}").format(minutes(int(seconds)), minutes(target))
        self.buttons["record"].setText(words if 1 <= seconds < target else _tr(_TEXTS["record"]))

    def show_steps(self, done: Sequence[str], current: str) -> None:
        """Tick off what is done, and let the current step stand out, "" where all are done."""
        self._current = current
        for number, (step, button) in enumerate(self.buttons.items(), 1):
            ticked = step in done
            symbol = "mdi6.check-circle" if ticked else f"mdi6.numeric-{number}-circle-outline"
            theme.set_icon(button, symbol, "good" if ticked else "accent" if step == current else "muted")
            theme.as_role(button, "step" if step == current else "quiet")
            about = self.tr("{0}, done") if ticked else "{0}"
            button.setAccessibleName(about.format(button.text()))
        self._fold()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fold()

    def _fold(self) -> None:
        """On a narrow window only the current step has room."""
        folded = self.width() < FOLDED_BELOW and bool(self._current)
        for step, button in self.buttons.items():
            button.setVisible(not folded or step == self._current)
        number = STEPS.index(self._current) + 1 if self._current else 0
        if folded:
            self._heading.setText(self.tr("Step {0} of {1}:").format(number, len(STEPS)))
        else:
            self._heading.setText(name_of("next_steps") if self._current else self.tr("All done"))


def _tr(text: str) -> str:
    return QCoreApplication.translate("StepStrip", text)
