"""Sliders laid over the motion: seen, sent and exported as they stand."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QDoubleSpinBox, QGridLayout, QPushButton, QSlider, QVBoxLayout, QWidget

from studio.playback.layers import Tuning
from studio.ui import theme
from studio.ui.widgets.card import label


class ResetSlider(QSlider):
    """A slider that a double-click brings back.

    Signals:
        reset_requested: it was double-clicked.
    """

    reset_requested = Signal()

    def __init__(self) -> None:
        super().__init__(Qt.Orientation.Horizontal)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.reset_requested.emit()
        event.accept()


class TunePanel(QWidget):
    """All sliders.

    Signals:
        tuning_changed: a Tuning.
    """

    tuning_changed = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._fields: dict[str, tuple[ResetSlider, QDoubleSpinBox, float]] = {}
        grid = QGridLayout()
        grid.setHorizontalSpacing(theme.INSIDE)
        grid.setVerticalSpacing(10)
        for row, (name, title, low, high, step, decimals, tip) in enumerate(self._controls()):
            self._add(grid, row, name, title, (low, high, step, decimals), tip)
        grid.setColumnStretch(1, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 12, 12, 12)
        column.setSpacing(12)
        column.addLayout(grid)
        hint = label(self.tr("What you tune here is what is sent and exported."), "caption")
        hint.setWordWrap(True)
        column.addWidget(hint)
        self.reset = QPushButton(self.tr("Reset all"))
        self.reset.setObjectName("tune_reset")
        theme.as_role(self.reset, "quiet")
        self.reset.clicked.connect(lambda: self.set_tuning(Tuning()))
        column.addWidget(self.reset, 0, Qt.AlignmentFlag.AlignLeft)
        column.addStretch(1)

    @property
    def tuning(self) -> Tuning:
        """How the sliders stand."""
        return Tuning().changed(**{name: box.value() for name, (_, box, _) in self._fields.items()})

    def set_tuning(self, tuning: Tuning) -> None:
        """Move the sliders, and say so once."""
        for name, (slider, box, step) in self._fields.items():
            with QSignalBlocker(slider), QSignalBlocker(box):
                box.setValue(getattr(tuning, name))
                slider.setValue(round(getattr(tuning, name) / step))
        self.tuning_changed.emit(self.tuning)

    def show_available(self, face: bool, bones: bool) -> None:
        """Enable what the motion has; a slider without channels would do nothing."""
        for name, there in (
            ("mouth", face), ("face", face), ("head", bones), ("torso", bones), ("arms", bones),
        ):  # fmt: skip
            for widget in self._fields[name][:2]:
                widget.setEnabled(there)

    def _controls(self) -> list[tuple[str, str, float, float, float, int, str]]:
        return [
            ("mouth", self.tr("Mouth"), 0.0, 2.0, 0.05, 2, self.tr("Strength of the mouth's blend shapes")),
            ("face", self.tr("Face"), 0.0, 2.0, 0.05, 2, self.tr("Strength of all other blend shapes")),
            ("head", self.tr("Head"), 0.0, 2.0, 0.05, 2, self.tr("How far neck and head swing")),
            ("torso", self.tr("Torso"), 0.0, 2.0, 0.05, 2, self.tr("How far hips and spine swing")),
            ("arms", self.tr("Arms"), 0.0, 2.0, 0.05, 2, self.tr("How far shoulders and arms swing")),
            (
                "smoothing", self.tr("Smoothing"), 0.0, 0.3, 0.01, 2,
                self.tr("Calms trembling, in seconds; lips still close and blinks stay sharp"),
            ),
            (
                "offset_ms", self.tr("Offset"), -300.0, 300.0, 5.0, 0,
                self.tr("Motion later (+) or earlier (-) than the sound, in milliseconds"),
            ),
        ]  # fmt: skip

    def _add(
        self, grid: QGridLayout, row: int, name: str, title: str,
        limits: tuple[float, float, float, int], tip: str,
    ) -> None:  # fmt: skip
        low, high, step, decimals = limits
        slider, box = ResetSlider(), QDoubleSpinBox()
        slider.setRange(round(low / step), round(high / step))
        slider.setObjectName(f"tune_{name}_slider")
        box.setRange(low, high)
        box.setSingleStep(step)
        box.setDecimals(decimals)
        box.setObjectName(f"tune_{name}")
        box.setFont(theme.figures_font())
        box.setFixedWidth(84)
        box.setAlignment(Qt.AlignmentFlag.AlignRight)
        box.setSuffix({"smoothing": " s", "offset_ms": " ms"}.get(name, ""))
        default = getattr(Tuning(), name)
        box.setValue(default)
        slider.setValue(round(default / step))
        caption = label(title)
        caption.setBuddy(box)
        for widget in (caption, slider, box):
            widget.setToolTip(f"{tip}. " + self.tr("Double-click the slider to reset."))
        slider.setAccessibleName(title)
        box.setAccessibleName(title)
        self._fields[name] = (slider, box, step)
        slider.valueChanged.connect(lambda value: box.setValue(value * step))
        slider.reset_requested.connect(lambda: box.setValue(default))
        box.valueChanged.connect(lambda value: self._on_value(slider, round(value / step)))
        for x, part in enumerate((caption, slider, box)):
            grid.addWidget(part, row, x)

    def _on_value(self, slider: QSlider, place: int) -> None:
        with QSignalBlocker(slider):
            slider.setValue(place)
        self.tuning_changed.emit(self.tuning)
