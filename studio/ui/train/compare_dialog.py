"""The window that holds runs against each other: figures, bars and curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QHBoxLayout,
    QProgressBar,
    QPushButton,
    QStackedLayout,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.train.compare_facts import Comparison
from studio.ui.train.compare_table import CompareTable
from studio.ui.train.run_facts import ALIVE
from studio.ui.widgets.card import label
from studio.ui.widgets.loss_plot import LossPlot

Points = Mapping[str, Sequence[tuple[int, float | None]]]


class CompareDialog(QDialog):
    """Runs side by side; work goes on in the window behind it.

    Args:
        runs: their ids, in the order of the columns.
        parent: the tab.

    Signals:
        ground_chosen: measure on another split, "test" or "val".
    """

    ground_chosen = Signal(str)

    def __init__(self, runs: Sequence[str], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("compare_dialog")
        self.setWindowTitle(self.tr("Compare runs"))
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.resize(1040, 680)
        self.table = CompareTable()
        self._told = label("", "muted", "compare_told")
        self._told.setWordWrap(True)
        self._state = label("", "muted", "compare_state")
        self._bar = QProgressBar()
        self._bar.setRange(0, 100 * (len(runs) + 1))
        self._bar.setTextVisible(False)
        self._bar.setAccessibleName(self.tr("Measuring"))
        self.ground = QComboBox()
        self.ground.setObjectName("compare_ground")
        self.ground.setAccessibleName(self.tr("Measured on"))
        self.ground.addItem(self.tr("Test takes"), "test")
        self.ground.addItem(self.tr("Validation takes"), "val")
        self.ground.currentIndexChanged.connect(
            lambda _: self.ground_chosen.emit(str(self.ground.currentData()))
        )
        series = [(run, run) for run in runs]
        self.error_plot = LossPlot(self.tr("Error on validation"), series)
        words = self.tr("In the green band it moves as much as the performer")
        self.motion_plot = LossPlot(self.tr("Motion against captured"), series, (*ALIVE, words), 2)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        column.setSpacing(12)
        column.addLayout(self._head())
        column.addLayout(self._middle(), 3)
        plots = QHBoxLayout()
        plots.setSpacing(theme.BETWEEN)
        plots.addWidget(self.error_plot, 1)
        plots.addWidget(self.motion_plot, 1)
        column.addLayout(plots, 2)
        close = QPushButton(self.tr("Close"))
        close.setObjectName("compare_close")
        close.clicked.connect(self.accept)
        column.addWidget(close, 0, Qt.AlignmentFlag.AlignRight)

    def show_busy(self, measured: float, words: str) -> None:
        """Say how many runs have been measured, and how much of the next one."""
        self._stack.setCurrentIndex(0)
        self._bar.setVisible(True)
        self._bar.setValue(round(100 * measured))
        self._state.setText(words)
        self.ground.setEnabled(False)

    def show_failure(self, sentence: str) -> None:
        """Say why there is no table."""
        self._stack.setCurrentIndex(0)
        self._bar.setVisible(False)
        self._state.setText(sentence)
        self.ground.setEnabled(True)

    def show_compared(self, compared: Comparison, told: str) -> None:
        """Show the table.

        Args:
            compared: its content.
            told: what is to be known of it.
        """
        self.table.show_compared(compared)
        self._told.setText(told)
        self._stack.setCurrentIndex(1)
        self.ground.setEnabled(True)

    def show_curves(self, error: Points, motion: Points) -> None:
        """The curves of each run, by its id."""
        self.error_plot.show_points(error, None)
        self.motion_plot.show_points(motion, None)

    def _head(self) -> QHBoxLayout:
        row = QHBoxLayout()
        caption = label(self.tr("Measured on"), "muted")
        caption.setBuddy(self.ground)
        row.addWidget(caption)
        row.addWidget(self.ground)
        row.addWidget(self._told, 1)
        return row

    def _middle(self) -> QStackedLayout:
        busy = QWidget()
        column = QVBoxLayout(busy)
        column.addStretch(1)
        self._state.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._state.setWordWrap(True)
        column.addWidget(self._state)
        column.addWidget(self._bar)
        column.addStretch(1)
        self._stack = QStackedLayout()
        self._stack.addWidget(busy)
        self._stack.addWidget(self.table)
        return self._stack
