"""What an export asks besides formats and name: part, span, frame rate, pictures, with Tune or without."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QRegularExpression, QSignalBlocker, Signal
from PySide6.QtGui import QRegularExpressionValidator
from PySide6.QtWidgets import QCheckBox, QComboBox, QGridLayout, QLabel, QSizePolicy, QWidget

from studio.errors import StudioError
from studio.render.background import ROOM, Background
from studio.ui import messages, tasks, theme
from studio.ui.review.tune_controls import Fold
from studio.ui.widgets.background_menu import BackgroundButton
from studio.ui.widgets.card import label

SIZES = ((1280, 720), (1920, 1080), (3840, 2160), (1080, 1080), (1080, 1920), (640, 360))
LABELS_PX = 52


@dataclass(frozen=True)
class ExportOptions:
    """What was chosen.

    Args:
        part: "all", "face" or "body".
        selection: only what is selected on the timeline.
        tuned: with the sliders of Tune.
        size: pixels of a film or still.
        background: what is behind the performer.
    """

    part: str = "all"
    selection: bool = False
    tuned: bool = True
    size: tuple[int, int] = SIZES[0]
    background: Background = ROOM


class OptionsForm(QWidget):
    """What matters for this export alone, and `fold` with the rest, closed until it is opened.

    Signals:
        changed: something was chosen.

    Attributes:
        fold: part, frames and sliders; its head names what is not as it comes.
    """

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._opening = tasks.LatestTask(self)
        self._build_boxes()
        self._span_words, self._size_words = caption(self.tr("Span")), caption(self.tr("Picture"))
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(theme.INSIDE)
        grid.setColumnStretch(1, 1)
        self._behind_words = caption(self.tr("Behind"))
        for row, (text, box) in enumerate(
            (
                (self._size_words, self.picture),
                (self._behind_words, self.background),
                (self._span_words, self.span),
            )
        ):
            grid.addWidget(text, row, 0)
            grid.addWidget(box, row, 1)
        self.fold = Fold("export", self.tr("Options"), is_open=False)
        for row, (title, box) in enumerate(((self.tr("Part"), self.part), (self.tr("Frames"), self.fps))):
            self.fold.grid.addWidget(caption(title), row, 0)
            self.fold.grid.addWidget(box, row, 1)
        self.fold.grid.addWidget(self.tuned, 2, 0, 1, 2)
        self.fold.reset_requested.connect(self._on_reset)
        self.changed.connect(self._show_changed)
        self.show_selection(None)
        self.show_drawn(False)

    @property
    def options(self) -> ExportOptions:
        """What is chosen."""
        return ExportOptions(
            str(self.part.currentData()),
            bool(self.span.currentData()) and self.span.isEnabled(),
            self.tuned.isChecked(),
            self._size() or SIZES[0],
            self.background.background,
        )

    def show_selection(self, span: tuple[float, float] | None) -> None:
        """Offer what is selected on the timeline; where nothing is, all of it is exported."""
        self._selected = span is not None
        self.span.setEnabled(span is not None)
        self.span.setVisible(span is not None)
        self._span_words.setVisible(span is not None)
        text = (
            self.tr("Selection, {0} s").format(f"{span[1] - span[0]:.1f}") if span else self.tr("Selection")
        )
        with QSignalBlocker(self.span):
            self.span.setItemText(1, text)
            if span is None:
                self.span.setCurrentIndex(0)
        self._fit()

    def show_drawn(self, drawn: bool) -> None:
        """Ask for the size of pictures, and what is behind, where some are drawn."""
        self._drawn = drawn
        for widget in (self.picture, self._size_words, self.background, self._behind_words):
            widget.setVisible(drawn)
        self._fit()

    def show_background(self, background: Background) -> None:
        """Propose what is behind: as the stage shows it."""
        self._opening.drop()
        self.background.show_background(background)
        self.changed.emit()

    @property
    def needs_size(self) -> bool:
        """Whether pictures are drawn and what is written is no size, as while it is typed."""
        return self._drawn and self._size() is None

    def _size(self) -> tuple[int, int] | None:
        """What is written in the box; None where that is no size."""
        line = self.picture.lineEdit()
        if line is None or not line.hasAcceptableInput():
            return None
        wide, _, high = self.picture.currentText().replace("×", "x").lower().partition("x")
        return int(wide), int(high)

    def _fit(self) -> None:
        # An empty row would leave a gap.
        self.setVisible(self._selected or self._drawn)

    def _on_reset(self) -> None:
        self.part.setCurrentIndex(0)
        self.fps.setCurrentIndex(0)
        self.tuned.setChecked(True)

    def _show_changed(self) -> None:
        """What is chosen is read on a closed fold, too."""
        text = [self.part.currentText().lower()] if self.part.currentIndex() else []
        text += [self.fps.currentText()] if self.fps.currentIndex() else []
        text += [] if self.tuned.isChecked() else [self.tr("without Tune settings")]
        summary = self.tr("Options: {0}").format(", ".join(text)) if text else self.tr("Options")
        self.fold.head.setText(summary)
        self.fold.head.setToolTip(summary if text else "")
        self.fold.show_changed(bool(text))

    def _build_boxes(self) -> None:
        self._selected = self._drawn = False
        self.part = self._box("export_part", self.tr("Part"))
        for text, name in (
            (self.tr("Face and body"), "all"), (self.tr("Face"), "face"), (self.tr("Body"), "body")
        ):  # fmt: skip
            self.part.addItem(text, name)
        self.fps = self._box("export_fps", self.tr("Frames"))
        self.fps.addItem(self.tr("As they are"), 0.0)
        for fps in (24, 30, 60, 120):
            self.fps.addItem(self.tr("{0} frames/s").format(fps), float(fps))
        self.span = self._box("export_span", self.tr("Span"))
        self.span.addItem(self.tr("All of it"), False)
        self.span.addItem(self.tr("Selection"), True)
        self.span.setToolTip(self.tr("Select a span on the timeline by dragging with Shift held"))
        self.picture = self._box("export_size", self.tr("Picture"))
        self.picture.setEditable(True)
        self.picture.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        written = QRegularExpression(r"\d{2,4} *[xX×] *\d{2,4}")
        self.picture.setValidator(QRegularExpressionValidator(written, self.picture))
        self.picture.setToolTip(self.tr("Width x height in pixels. Choose one or type your own"))
        for wide, high in SIZES:
            self.picture.addItem(f"{wide} x {high}", (wide, high))
        self.background = BackgroundButton("export_")
        self.background.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.background.chosen.connect(self._on_background)
        self.tuned = QCheckBox(self.tr("With Tune settings"))
        self.tuned.setObjectName("export_tuned")
        self.tuned.setChecked(True)
        self.tuned.toggled.connect(lambda _: self.changed.emit())

    def _on_background(self, text: str) -> None:
        before = self.background.background

        def refused(error: BaseException) -> None:
            self.show_background(before)
            messages.show_error(self, error)

        try:
            background = Background.parse(text)
        except StudioError as error:
            refused(error)
            return
        self.show_background(background)
        if background.is_image:
            # What cannot be read is said now, and not when the export fails.
            self._opening.run(background.load, lambda _: None, refused)

    def _box(self, name: str, text: str) -> QComboBox:
        box = QComboBox()
        box.setObjectName(name)
        box.setAccessibleName(text)
        box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        box.setMinimumContentsLength(12)
        box.currentIndexChanged.connect(lambda _: self.changed.emit())
        return box


def caption(text: str) -> QLabel:
    """What stands before a field; all are as wide, so that the fields stand in one line."""
    made = label(text, "muted")
    made.setMinimumWidth(LABELS_PX)
    return made
