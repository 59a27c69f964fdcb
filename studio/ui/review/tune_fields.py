"""A number with a slider, and a fold that holds some of them: what the Tune panel is built of."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QEvent, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QSlider,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.widgets.card import label

NUMBER_WIDTH, CAPTION_WIDTH = 84, 70


@dataclass(frozen=True)
class Number:
    """What a slider is about.

    Args:
        name: the field of Tuning.
        title, tip: its words; the tip is a sentence without its full stop.
        limits: lowest and highest value.
        step: of slider and arrows.
        neutral: the value that changes nothing.
        decimals: digits after the point.
        unit: written behind the number.
    """

    name: str
    title: str
    tip: str
    limits: tuple[float, float]
    step: float
    neutral: float
    decimals: int = 2
    unit: str = ""


class ResetSlider(QSlider):
    """A slider that a double-click brings back, and that a scrolling wheel passes over.

    Signals:
        reset_requested: it was double-clicked.
    """

    reset_requested = Signal()

    def __init__(self) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self.setMinimumWidth(48)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.reset_requested.emit()
        event.accept()

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()  # the panel scrolls; what lies under the mouse by chance stays as it is


class NoWheelSpinBox(QDoubleSpinBox):
    """A number that the wheel changes only once it was clicked, and whose undo is the tuning's."""

    def __init__(self) -> None:
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def event(self, event: QEvent) -> bool:
        """Leave undo to the tab: what is typed here is tuned at once, so there is no text to take back."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            keys = QKeySequence.StandardKey
            if event.matches(keys.Undo) or event.matches(keys.Redo):
                event.ignore()
                return True
        return super().event(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()


class NoWheelComboBox(QComboBox):
    """A choice that the wheel leaves alone, and that elides what does not fit."""

    def __init__(self) -> None:
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(8)

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()


class NumberRow(QWidget):
    """One number: its words, a slider and the number itself, as cells of a grid.

    Signals:
        changed: the person moved it.
    """

    changed = Signal()

    def __init__(self, about: Number, grid: QGridLayout) -> None:
        super().__init__()
        self.about = about
        self.slider, self.box = ResetSlider(), NoWheelSpinBox()
        low, high = about.limits
        self.slider.setRange(round(low / about.step), round(high / about.step))
        self.slider.setObjectName(f"tune_{about.name}_slider")
        self.box.setObjectName(f"tune_{about.name}")
        self.box.setRange(low, high)
        self.box.setSingleStep(about.step)
        self.box.setDecimals(about.decimals)
        self.box.setFont(theme.figures_font())
        self.box.setFixedWidth(NUMBER_WIDTH)
        self.box.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.box.setButtonSymbols(QAbstractSpinBox.ButtonSymbols.UpDownArrows)
        self.box.setSuffix(about.unit)
        self.caption = label(about.title)
        self.caption.setBuddy(self.box)
        self.caption.setMinimumWidth(CAPTION_WIDTH)
        for widget in (self.slider, self.box):
            widget.setAccessibleName(about.title)
        self.show_value(about.neutral)
        self.set_available(True, "")
        self.slider.valueChanged.connect(lambda place: self.box.setValue(place * about.step))
        self.slider.reset_requested.connect(lambda: self.box.setValue(about.neutral))
        self.box.valueChanged.connect(self._on_value)
        row = grid.rowCount()
        for x, part in enumerate((self.caption, self.slider, self.box)):
            grid.addWidget(part, row, x)

    @property
    def value(self) -> float:
        """How it stands."""
        return self.box.value()

    def show_value(self, value: float) -> None:
        """Move it without saying so."""
        with QSignalBlocker(self.slider), QSignalBlocker(self.box):
            self.box.setValue(value)
            self.slider.setValue(round(value / self.about.step))

    def set_available(self, there: bool, why_not: str) -> None:
        """Enable it, or say in its tip why it would do nothing."""
        tip = f"{self.about.tip}. " + self.tr("Double-click the slider to reset.")
        for widget in (self.caption, self.slider, self.box):
            widget.setEnabled(there)
            widget.setToolTip(tip if there else why_not)

    def _on_value(self, value: float) -> None:
        with QSignalBlocker(self.slider):
            self.slider.setValue(round(value / self.about.step))
        self.changed.emit()


class Fold(QWidget):
    """A part of the panel that opens and closes.

    Signals:
        reset_requested: bring everything in it back.
    """

    reset_requested = Signal()

    def __init__(self, name: str, title: str, is_open: bool) -> None:
        super().__init__()
        self.setObjectName(f"tune_fold_{name}")
        self.head = QPushButton(title)
        self.head.setObjectName(f"tune_open_{name}")
        self.head.setCheckable(True)
        self.head.setFont(theme.ui_font(semibold=True))
        theme.as_role(self.head, "fold")
        self.reset = QToolButton()
        self.reset.setObjectName(f"tune_reset_{name}")
        words = self.tr("Reset: {0}").format(title)
        self.reset.setToolTip(words)
        self.reset.setAccessibleName(words)
        theme.set_icon(self.reset, "mdi6.restore", "accent")
        theme.as_role(self.reset, "quiet")
        policy = self.reset.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.reset.setSizePolicy(policy)
        self.room = QWidget()
        self.body = QVBoxLayout(self.room)
        self.body.setContentsMargins(0, 4, 0, 8)
        self.body.setSpacing(theme.INSIDE)
        self.grid = QGridLayout()
        self.grid.setHorizontalSpacing(theme.INSIDE)
        self.grid.setVerticalSpacing(6)
        self.grid.setColumnStretch(1, 1)
        self.body.addLayout(self.grid)
        self._lay_out()
        self.head.toggled.connect(self._on_toggled)
        self.reset.clicked.connect(self.reset_requested)
        self.head.setChecked(is_open)
        self._on_toggled(is_open)
        self.show_changed(False)

    def show_changed(self, changed: bool) -> None:
        """Whether anything in it is not as it comes."""
        self.reset.setVisible(changed)

    def _lay_out(self) -> None:
        row = QHBoxLayout()
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(self.head, 1)
        row.addWidget(self.reset)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addLayout(row)
        column.addWidget(self.room)

    def _on_toggled(self, is_open: bool) -> None:
        theme.set_icon(self.head, "mdi6.chevron-down" if is_open else "mdi6.chevron-right", "muted")
        self.room.setVisible(is_open)
