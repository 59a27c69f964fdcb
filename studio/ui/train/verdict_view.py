"""The verdict on the shown run, and the button that measures what more takes would bring."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QPushButton, QStackedWidget, QWidget

from studio.evaluation.verdict import RunVerdict
from studio.ui import theme
from studio.ui.language import sentences
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.widgets.card import label

GRADE_ICONS = {
    "good": ("mdi6.check-circle", "good"),
    "fair": ("mdi6.circle-half-full", "warn"),
    "poor": ("mdi6.alert-circle", "bad"),
}
LEAST_PX = 36
"""Height of two lines, kept while there are fewer: what stands above must not move with the words."""


class VerdictRow(QWidget):
    """How good the shown run is and what would help, in words; and what more takes would bring.

    Signals:
        curve_requested: measure it.
        curve_cancelled: do not.
    """

    curve_requested = Signal()
    curve_cancelled = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._icon = QLabel()
        self.text = label("", "", "run_verdict")
        self.text.setWordWrap(True)
        self.text.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self.measure = QPushButton(name_of("measure_curve"))
        self.measure.setObjectName("measure_curve")
        theme.set_icon(self.measure, "mdi6.chart-timeline-variant", "muted")
        self.measure.clicked.connect(self.curve_requested)
        self._bar = QProgressBar()
        self._bar.setObjectName("curve_bar")
        self._bar.setRange(0, 1000)
        self._bar.setTextVisible(False)
        self._bar.setAccessibleName(self.tr("Measuring what more takes would bring"))
        self._state = label("", "caption", "curve_state")
        self.cancel = QPushButton(self.tr("Cancel"))
        self.cancel.setObjectName("cancel_curve")
        self.cancel.clicked.connect(self.curve_cancelled)
        busy = QWidget()
        row = QHBoxLayout(busy)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        for part in (self._state, self._bar, self.cancel):
            row.addWidget(part)
        self._stack = QStackedWidget()
        self._stack.addWidget(self.measure)
        self._stack.addWidget(busy)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        row.addWidget(self._icon, 0, Qt.AlignmentFlag.AlignVCenter)
        row.addWidget(self.text, 1)
        row.addWidget(self._stack, 0, Qt.AlignmentFlag.AlignVCenter)
        self.setFixedHeight(LEAST_PX)

    def show_verdict(self, verdict: RunVerdict, nothing: str) -> None:
        """Show what is said of the shown run.

        Args:
            verdict: its words.
            nothing: what stands there where nothing was measured.
        """
        name, token = GRADE_ICONS.get(verdict.grade, ("", ""))
        self._icon.setVisible(bool(name))
        if name:
            self._icon.setPixmap(theme.icon(name, token).pixmap(theme.icon_size(big=True)))
        # With what it was measured on: the charts beside it are of validation, and may say otherwise.
        self.text.setText(sentences(verdict.text, verdict.basis) if verdict.text else nothing)

    def show_curve(self, ready: bool, why_not: str, learnt: str) -> None:
        """Offer to measure what more takes would bring.

        Args:
            ready: it can be done now.
            why_not: why it cannot, "" where it can.
            learnt: what was found before, "" for nothing.
        """
        self._stack.setCurrentIndex(0)
        self.measure.setEnabled(ready)
        self.measure.setToolTip(
            why_not or "\n".join(part for part in (tip_of("measure_curve"), learnt) if part)
        )

    def show_measuring(self, text: str, fraction: float) -> None:
        """Say how far the measuring is, 0..1, and offer to cancel it."""
        self._stack.setCurrentIndex(1)
        self._state.setText(text)
        self._bar.setValue(round(1000 * fraction))
