"""What else an export asks: further formats, part, span, sliders, and how pictures are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QCheckBox, QComboBox, QGridLayout, QLabel, QMenu, QToolButton, QWidget

from studio import formats
from studio.ui import theme
from studio.ui.review.tune_controls import Fold
from studio.ui.widgets.card import label

SIZES = ((1280, 720), (1920, 1080), (1080, 1080), (1080, 1920), (640, 360))
LABELS_PX = 52
DRAWN = frozenset({"mp4", "png"})
"""Formats that are pictures."""


@dataclass(frozen=True)
class FormatChoice:
    """A format to export to: module name, title, suffix, what it leaves out."""

    name: str
    title: str
    suffix: str
    note: str


def format_choices() -> list[FormatChoice]:
    """The formats that can be written, those asked for most first."""
    found = [
        FormatChoice(name, module.TITLE, formats.written_suffix(module), module.NOTE)
        for name, module in formats.writers().items()
    ]
    order = {"vrma": 0, "bvh": 1, "saia_csv": 2, "mp4": 3, "png": 4}
    return sorted(found, key=lambda choice: (order.get(choice.name, 9), choice.title))


@dataclass(frozen=True)
class ExportOptions:
    """What was chosen.

    Args:
        part: "all", "face" or "body".
        selection: only what is selected on the timeline.
        tuned: with the sliders of Tune.
        size: pixels of a film or still.
        clear: a still without the room.
    """

    part: str = "all"
    selection: bool = False
    tuned: bool = True
    size: tuple[int, int] = SIZES[0]
    clear: bool = False


class MoreFormats(QToolButton):
    """A menu of further formats for the same export.

    Signals:
        changed: others are ticked now.
    """

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("more_formats")
        self.setAccessibleName(self.tr("Further formats"))
        self.setToolTip(self.tr("Export to several formats at once"))
        theme.set_icon(self, "mdi6.plus", "muted")
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._menu = QMenu(self)
        self.setMenu(self._menu)
        self._actions: dict[str, QAction] = {}

    def show_formats(self, formats: dict[str, str]) -> None:
        """Fill the menu: titles by name."""
        self._menu.clear()
        self._actions = {}
        for name, title in formats.items():
            action = self._menu.addAction(title)
            action.setCheckable(True)
            action.setObjectName(f"more_{name}")
            action.toggled.connect(lambda _: self.changed.emit())
            self._actions[name] = action

    def chosen(self, besides: str) -> tuple[str, ...]:
        """The names that are ticked, without the one that is exported anyway."""
        return tuple(name for name, one in self._actions.items() if one.isChecked() and name != besides)


class OptionsForm(QWidget):
    """What matters for this export alone, and `fold` with the rest, closed until it is wanted.

    Signals:
        changed: something was chosen.

    Attributes:
        fold: part, frames and sliders; its head names what is not as it comes.
    """

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._build_boxes()
        self._span_words, self._size_words = caption(self.tr("Span")), caption(self.tr("Picture"))
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(theme.INSIDE)
        grid.setColumnStretch(1, 1)
        for row, (words, box) in enumerate(((self._size_words, self.picture), (self._span_words, self.span))):
            grid.addWidget(words, 2 * row, 0)
            grid.addWidget(box, 2 * row, 1)
        grid.addWidget(self.clear_room, 1, 0, 1, 2)
        self.fold = Fold("export", self.tr("Options"), is_open=False)
        for row, (title, box) in enumerate(((self.tr("Part"), self.part), (self.tr("Frames"), self.fps))):
            self.fold.grid.addWidget(caption(title), row, 0)
            self.fold.grid.addWidget(box, row, 1)
        self.fold.grid.addWidget(self.tuned, 2, 0, 1, 2)
        self.fold.reset_requested.connect(self._on_reset)
        self.changed.connect(self._show_changed)
        self.show_selection(None)
        self.show_drawn(film=False, still=False)

    @property
    def options(self) -> ExportOptions:
        """What is chosen."""
        return ExportOptions(
            str(self.part.currentData()),
            bool(self.span.currentData()) and self.span.isEnabled(),
            self.tuned.isChecked(),
            tuple(self.picture.currentData()),
            self.clear_room.isChecked(),
        )

    def show_selection(self, span: tuple[float, float] | None) -> None:
        """Offer what is selected on the timeline; where nothing is, all of it is exported."""
        self._selected = span is not None
        self.span.setEnabled(span is not None)
        self.span.setVisible(span is not None)
        self._span_words.setVisible(span is not None)
        words = (
            self.tr("Selection, {0} s").format(f"{span[1] - span[0]:.1f}") if span else self.tr("Selection")
        )
        with QSignalBlocker(self.span):
            self.span.setItemText(1, words)
            if span is None:
                self.span.setCurrentIndex(0)
        self._fit()

    def show_drawn(self, film: bool, still: bool) -> None:
        """Ask for the size of pictures where some are drawn."""
        self._drawn = film or still
        self.picture.setVisible(film or still)
        self._size_words.setVisible(film or still)
        self.clear_room.setVisible(still)
        self._fit()

    def _fit(self) -> None:
        self.setVisible(self._selected or self._drawn)  # an empty row would leave a gap

    def _on_reset(self) -> None:
        self.part.setCurrentIndex(0)
        self.fps.setCurrentIndex(0)
        self.tuned.setChecked(True)

    def _show_changed(self) -> None:
        """What is chosen is read on a closed fold, too."""
        words = [self.part.currentText().lower()] if self.part.currentIndex() else []
        words += [self.fps.currentText()] if self.fps.currentIndex() else []
        words += [] if self.tuned.isChecked() else [self.tr("without Tune")]
        told = self.tr("Options: {0}").format(", ".join(words)) if words else self.tr("Options")
        self.fold.head.setText(told)
        self.fold.head.setToolTip(told if words else "")
        self.fold.show_changed(bool(words))

    def _build_boxes(self) -> None:
        self._selected = self._drawn = False
        self.part = self._box("export_part", self.tr("Part"))
        for words, name in (
            (self.tr("Face and body"), "all"), (self.tr("Face"), "face"), (self.tr("Body"), "body")
        ):  # fmt: skip
            self.part.addItem(words, name)
        self.fps = self._box("export_fps", self.tr("Frames"))
        self.fps.addItem(self.tr("As they are"), 0.0)
        for fps in (24, 30, 60, 120):
            self.fps.addItem(self.tr("{0} frames/s").format(fps), float(fps))
        self.span = self._box("export_span", self.tr("Span"))
        self.span.addItem(self.tr("All of it"), False)
        self.span.addItem(self.tr("Selection"), True)
        self.span.setToolTip(self.tr("Select a span on the timeline by dragging with Shift held"))
        self.picture = self._box("export_size", self.tr("Picture"))
        for wide, high in SIZES:
            self.picture.addItem(f"{wide} x {high}", (wide, high))
        self.tuned = QCheckBox(self.tr("With the sliders of Tune"))
        self.tuned.setObjectName("export_tuned")
        self.tuned.setChecked(True)
        self.tuned.toggled.connect(lambda _: self.changed.emit())
        self.clear_room = QCheckBox(self.tr("Still without the room"))
        self.clear_room.setObjectName("export_clear")

    def _box(self, name: str, words: str) -> QComboBox:
        box = QComboBox()
        box.setObjectName(name)
        box.setAccessibleName(words)
        box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        box.setMinimumContentsLength(12)
        box.currentIndexChanged.connect(lambda _: self.changed.emit())
        return box


def caption(words: str) -> QLabel:
    """What stands before a field; all are as wide, so that the fields stand in one line."""
    made = label(words, "muted")
    made.setMinimumWidth(LABELS_PX)
    return made
