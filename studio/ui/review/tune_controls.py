"""What the Tune panel is built of: numbers with sliders, folds, and the folds that hold more than sliders."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QEvent, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
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

from studio.playback.layers.regions import REGIONS
from studio.playback.layers.tuning import (
    EVERYTHING,
    FACE_ONLY,
    GAIN_LIMITS,
    LIFT_LIMITS,
    MOUTH_ONLY,
    UPPER_BODY,
    ShapeTuning,
    Tuning,
)
from studio.ui import theme
from studio.ui.widgets.card import label

NUMBER_WIDTH, CAPTION_WIDTH = 84, 70


@dataclass(frozen=True)
class Number:
    """What a slider is about.

    Args:
        name: the field of Tuning.
        title, tip: its text; the tip is a sentence without its full stop.
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
        # The panel scrolls; what lies under the mouse by chance stays as it is.
        event.ignore()


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
        # By click and Tab, not by the wheel that happens to pass over it.
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(8)

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()


class NumberRow(QWidget):
    """One number: its text, a slider and the number itself, as cells of a grid.

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
        """The number."""
        return self.box.value()

    def show_value(self, value: float) -> None:
        """Show a number, without emitting `changed`."""
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
        text = self.tr("Reset: {0}").format(title)
        self.reset.setToolTip(text)
        self.reset.setAccessibleName(text)
        theme.set_icon(self.reset, "mdi6.restore", "accent")
        theme.as_role(self.reset, "quiet")
        policy = self.reset.sizePolicy()
        # A button that comes and goes must not move the title beside it.
        policy.setRetainSizeWhenHidden(True)
        self.reset.setSizePolicy(policy)
        self.content = QWidget()
        self.body = QVBoxLayout(self.content)
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
        column.addWidget(self.content)

    def _on_toggled(self, is_open: bool) -> None:
        theme.set_icon(self.head, "mdi6.chevron-down" if is_open else "mdi6.chevron-right", "muted")
        self.content.setVisible(is_open)


class ShapesFold(Fold):
    """Vowels, and the gain and lift of one blend shape at a time.

    Signals:
        changed: the name of what the person changed.
    """

    changed = Signal(str)

    def __init__(self) -> None:
        super().__init__("shapes", self.tr("Single shapes"), False)
        self._shapes: tuple[ShapeTuning, ...] = ()
        self.top_vowels = QCheckBox(self.tr("At most two vowels at a time"))
        self.top_vowels.setObjectName("tune_top_vowels")
        self.body.insertWidget(0, self.top_vowels)
        self.shape = NoWheelComboBox()
        self.shape.setObjectName("tune_shape")
        self.shape.setAccessibleName(self.tr("Blend shape"))
        self.grid.addWidget(label(self.tr("Shape")), 0, 0)
        self.grid.addWidget(self.shape, 0, 1, 1, 2)
        gain = self.tr("Makes this blend shape stronger or weaker")
        lift = self.tr("Adds a constant amount to this blend shape")
        self.gain = NumberRow(Number("gain", self.tr("Gain"), gain, GAIN_LIMITS, 0.05, 1.0), self.grid)
        self.lift = NumberRow(Number("lift", self.tr("Offset"), lift, LIFT_LIMITS, 0.05, 0.0), self.grid)
        self.list = label("", "caption", "tune_shapes_changed")
        self.list.setWordWrap(True)
        self.body.addWidget(self.list)
        self.top_vowels.toggled.connect(lambda _: self.changed.emit("top_vowels"))
        self.shape.currentTextChanged.connect(lambda _: self._show_shape())
        for row in (self.gain, self.lift):
            row.changed.connect(self._on_changed)
        self.show_names((), False)

    @property
    def shapes(self) -> tuple[ShapeTuning, ...]:
        """What is done to single shapes."""
        return self._shapes

    def show_tuning(self, tuning: Tuning) -> None:
        """Show a tuning, without emitting `changed`."""
        self._shapes = tuning.shapes
        with QSignalBlocker(self.top_vowels):
            self.top_vowels.setChecked(tuning.top_vowels)
        self._show_shape()
        self.show_changed(tuning.top_vowels or bool(tuning.shapes))

    def show_names(self, names: tuple[str, ...], vowels: bool) -> None:
        """Offer the blend shapes of the motion."""
        if [self.shape.itemText(i) for i in range(self.shape.count())] != list(names):
            before = self.shape.currentText()
            with QSignalBlocker(self.shape):
                self.shape.clear()
                self.shape.addItems(list(names))
                # Another motion may lack the shape that was looked at.
                self.shape.setCurrentIndex(max(self.shape.findText(before), 0) if names else -1)
        none = self.tr("This motion has no blend shapes.")
        self.shape.setEnabled(bool(names))
        for row in (self.gain, self.lift):
            row.set_available(bool(names), none)
        self.top_vowels.setEnabled(vowels)
        tip = self.tr("Fades weaker vowels, so the mouth does not look mumbly.")
        self.top_vowels.setToolTip(tip if vowels else self.tr("This motion has no vowels to choose among."))
        self._show_shape()

    def _show_shape(self) -> None:
        shape = Tuning(shapes=self._shapes).shape(self.shape.currentText())
        self.gain.show_value(shape.gain)
        self.lift.show_value(shape.lift)
        text = [f"{one.name} × {one.gain:.2f} {one.lift:+.2f}" for one in self._shapes]
        self.list.setText("\n".join(text))
        self.list.setVisible(bool(text))

    def _on_changed(self) -> None:
        shape = ShapeTuning(self.shape.currentText(), self.gain.value, self.lift.value)
        self._shapes = Tuning(shapes=self._shapes).with_shape(shape)
        self._show_shape()
        self.changed.emit(f"shape {shape.name}")


class MovesFold(Fold):
    """Which regions move, and what becomes of the others.

    Signals:
        changed: the name of what the person changed.
    """

    changed = Signal(str)

    def __init__(self) -> None:
        super().__init__("moves", self.tr("What moves"), False)
        self.choice = NoWheelComboBox()
        self.choice.setObjectName("tune_mask")
        self.choice.setAccessibleName(self.tr("What moves"))
        for text, moves in (
            (self.tr("Everything"), EVERYTHING),
            (self.tr("Face only"), FACE_ONLY),
            (self.tr("Mouth only"), MOUTH_ONLY),
            (self.tr("Upper body and face"), UPPER_BODY),
            (self.tr("Your choice"), None),
        ):
            self.choice.addItem(text, moves)
        self.rest = NoWheelComboBox()
        self.rest.setObjectName("tune_rest")
        self.rest.setAccessibleName(self.tr("The rest"))
        self.rest.addItem(self.tr("stays still"), False)
        self.rest.addItem(self.tr("is not sent"), True)
        self.rest.setToolTip(
            self.tr(
                "Held still: sent and exported at rest. Left to other programs: not sent at all, for "
                "instance where a camera moves head and body and this studio only the mouth."
            )
        )
        self.body.insertWidget(0, self.choice)
        self.checks = {region: QCheckBox(text) for region, text in self._regions()}
        cells = QGridLayout()
        cells.setVerticalSpacing(6)
        for index, (region, check) in enumerate(self.checks.items()):
            check.setObjectName(f"tune_moves_{region}")
            check.toggled.connect(self._on_checked)
            cells.addWidget(check, index // 3, index % 3)
        self.body.addLayout(cells)
        self.grid.addWidget(label(self.tr("The rest")), 0, 0)
        self.grid.addWidget(self.rest, 0, 1)
        # The grid goes last: what becomes of the rest is asked after what moves.
        self.body.removeItem(self.grid)
        self.body.addLayout(self.grid)
        self.choice.activated.connect(self._on_mask)
        self.rest.activated.connect(lambda _: self.changed.emit("left_out"))
        self.show_tuning(Tuning())

    @property
    def moves(self) -> frozenset[str]:
        """The regions that move."""
        return frozenset(region for region, check in self.checks.items() if check.isChecked())

    def show_tuning(self, tuning: Tuning) -> None:
        """Show a tuning, without emitting `changed`."""
        for region, check in self.checks.items():
            with QSignalBlocker(check):
                check.setChecked(region in tuning.moves)
        self._show_mask(tuning.moves)
        self.rest.setCurrentIndex(int(tuning.left_out))
        self.show_changed(tuning.moves != EVERYTHING or tuning.left_out)

    def _show_mask(self, moves: frozenset[str]) -> None:
        known = [i for i in range(self.choice.count()) if self.choice.itemData(i) == moves]
        self.choice.setCurrentIndex(known[0] if known else self.choice.count() - 1)
        self.rest.setEnabled(moves != EVERYTHING)

    def _on_mask(self, index: int) -> None:
        moves = self.choice.itemData(index)
        if moves is not None:
            for region, check in self.checks.items():
                with QSignalBlocker(check):
                    check.setChecked(region in moves)
            self._show_mask(moves)
            self.changed.emit("moves")

    def _on_checked(self) -> None:
        self._show_mask(self.moves)
        self.changed.emit("moves")

    def _regions(self) -> list[tuple[str, str]]:
        text = {
            "mouth": self.tr("Mouth"), "brows": self.tr("Brows"), "eyes": self.tr("Eyes"),
            "face": self.tr("Face"), "head": self.tr("Head"), "torso": self.tr("Torso"),
            "arms": self.tr("Arms"), "hands": self.tr("Hands"), "legs": self.tr("Legs"),
        }  # fmt: skip
        return [(region, text[region]) for region in REGIONS]


class GroundFold(Fold):
    """Whether the avatar stays where it is.

    Signals:
        changed: the name of what the person changed.
    """

    changed = Signal(str)

    def __init__(self) -> None:
        super().__init__("ground", self.tr("Ground"), False)
        self.lock_root = QCheckBox(self.tr("Stay in place"))
        self.lock_root.setToolTip(self.tr("Stops the avatar from drifting across the floor."))
        self.plant_feet = QCheckBox(self.tr("Keep the feet on the floor"))
        self.plant_feet.setToolTip(self.tr("Feet stay planted; the knees bend to match."))
        for name, check in (("lock_root", self.lock_root), ("plant_feet", self.plant_feet)):
            check.setObjectName(f"tune_{name}")
            check.toggled.connect(lambda _, name=name: self.changed.emit(name))
            self.body.addWidget(check)
        self.body.setSpacing(theme.TIGHT)

    def show_tuning(self, tuning: Tuning) -> None:
        """Show a tuning, without emitting `changed`."""
        for check, on in ((self.lock_root, tuning.lock_root), (self.plant_feet, tuning.plant_feet)):
            with QSignalBlocker(check):
                check.setChecked(on)
        self.show_changed(tuning.lock_root or tuning.plant_feet)

    def show_available(self, body: bool, legs: bool) -> None:
        """Enable what the motion has bones for."""
        self.lock_root.setEnabled(body)
        self.plant_feet.setEnabled(legs)
