"""The data card of Train: how much there is to learn from, and what is wrong about it."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.train.data_facts import DataFacts, DataWarning, SplitFacts
from studio.ui.widgets.card import Card, CutLabel, label
from studio.ui.widgets.timeline.time_view import minutes

MOST_WARNINGS = 3
LEAST_WARNINGS_PX = 38
"""Height of two lines, which most warnings need."""


class DataCard(Card):
    """Takes by their use, channels and warnings.

    Signals:
        curate_requested: takes are to be chosen.
        validation_requested: set a take aside for validation.
    """

    curate_requested = Signal()
    validation_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(self.tr("Data"), parent)
        self._locked = ""
        self._data_total = label("", "", "data_total")
        self._data_total.setFont(theme.figures_font(theme.TITLE_PX, semibold=True))
        self._channels = CutLabel("caption", "data_channels")
        top = QHBoxLayout()
        top.addWidget(self._data_total)
        top.addStretch(1)
        top.addWidget(self._channels)
        self.body.addLayout(top)
        grid = QGridLayout()
        grid.setHorizontalSpacing(12)
        grid.setVerticalSpacing(2)
        self._split_labels: dict[str, QLabel] = {}
        words = (("train", self.tr("Training")), ("val", self.tr("Validation")), ("test", self.tr("Test")))
        for column, (key, title) in enumerate(words):
            grid.addWidget(label(title, "caption"), 0, column)
            value = label("", "", f"data_{key}")
            value.setFont(theme.figures_font())
            self._split_labels[key] = value
            grid.addWidget(value, 1, column)
            grid.setColumnStretch(column, 1)
        self.body.addLayout(grid)
        inside = QWidget()
        self._warnings = QVBoxLayout(inside)
        self._warnings.setContentsMargins(0, 0, 0, 0)
        self._warnings.setSpacing(theme.TIGHT)
        self._warnings.setAlignment(Qt.AlignmentFlag.AlignTop)
        # They scroll where there are many: a card that grew would move what stands below it.
        scroll = QScrollArea()
        scroll.setObjectName("data_warnings")
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        scroll.setMinimumHeight(LEAST_WARNINGS_PX)
        inside.setObjectName("scrolled")
        scroll.setWidget(inside)
        self.body.addWidget(scroll, 1)
        to_curate = QPushButton(self.tr("Choose takes"))
        to_curate.setToolTip(self.tr("In Curate: what to learn from, and what is kept to check the learning"))
        to_curate.setObjectName("train_go_curate")
        theme.as_role(to_curate, "quiet")
        to_curate.clicked.connect(self.curate_requested)
        self.head.addWidget(to_curate)
        self.setMinimumWidth(300)

    def show_facts(self, facts: DataFacts) -> None:
        """Show what there is."""
        words = self.tr("1 take  {1}") if facts.takes == 1 else self.tr("{0} takes  {1}")
        total = words.format(facts.takes, minutes(facts.seconds))
        if facts.performers:
            words = self.tr("1 performer") if facts.performers == 1 else self.tr("{0} performers")
            total += "  " + words.format(facts.performers)
        self._data_total.setText(total)
        for key, split in (("train", facts.train), ("val", facts.val), ("test", facts.test)):
            self._split_labels[key].setText(self._split_text(split))
        self._channels.setText(self.tr("{0} shapes, {1} bones").format(facts.shapes, facts.bones))
        self._show_warnings(facts.warnings)

    def show_locked(self, reason: str) -> None:
        """Why takes cannot be set aside here; "" where they can."""
        self._locked = reason
        for button in self.findChildren(QPushButton, "set_validation"):
            self._lock(button)

    def _lock(self, button: QPushButton) -> None:
        button.setEnabled(not self._locked)
        button.setToolTip(self._locked or self.tr("One take is kept to check the learning"))

    def _show_warnings(self, warnings: Sequence[DataWarning]) -> None:
        while (item := self._warnings.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                # Deleted later, it would still be seen below the new ones until then.
                widget.setParent(None)
                widget.deleteLater()
        for warning in warnings[:MOST_WARNINGS]:
            self._warnings.addWidget(self._warning(warning))

    def _warning(self, warning: DataWarning) -> QWidget:
        line = QWidget()
        row = QHBoxLayout(line)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        token = "bad" if warning.stops else "warn"
        symbol = QLabel()
        symbol.setPixmap(theme.icon("mdi6.alert-outline", token).pixmap(theme.icon_size()))
        row.addWidget(symbol, 0, Qt.AlignmentFlag.AlignTop)
        words = label(warning.text, "caption")
        words.setWordWrap(True)
        row.addWidget(words, 1)
        if warning.repair == "val":
            button = QPushButton(self.tr("Set one aside"))
            button.setObjectName("set_validation")
            theme.as_role(button, "chip")
            button.clicked.connect(self.validation_requested)
            self._lock(button)
            row.addWidget(button, 0, Qt.AlignmentFlag.AlignTop)
        return line

    def _split_text(self, split: SplitFacts) -> str:
        return self.tr("{0}  ({1})").format(split.takes, minutes(split.seconds)) if split.takes else "0"
