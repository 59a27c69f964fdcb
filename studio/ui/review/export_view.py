"""The Export panel: which formats, part, span, frame rate, name and folder, and what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import (
    QComboBox,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QMenu,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio import formats
from studio.export.options import FormatChoice
from studio.files.atomic import safe_name
from studio.ui import theme
from studio.ui.language import native
from studio.ui.review.export_options_view import ExportOptions, OptionsForm, caption
from studio.ui.shortcuts import name_of
from studio.ui.widgets.card import label

DRAWN = frozenset({"mp4", "webm", "frames", "png"})
"""Formats that are pictures."""
SOLID = "mp4"
"""The one of them that cannot be transparent."""


class MoreFormats(QToolButton):
    """A menu of further formats for the same export.

    Signals:
        changed: others are ticked now.
    """

    changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("more_formats")
        self.setAccessibleName(self.tr("More formats"))
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


SIDES_PX, RIGHT_PX = 12, 4
"""Around the panel, and between its fields and a scroll bar."""


@dataclass(frozen=True)
class ExportRequest:
    """What to export: name without suffix, formats, frames a second (0: as they are), folder, options."""

    name: str
    formats: tuple[FormatChoice, ...]
    fps: float
    folder: Path
    options: ExportOptions = field(default_factory=ExportOptions)

    @property
    def files_there(self) -> tuple[Path, ...]:
        """Files that would be written over."""
        paths = [self.folder / f"{safe_name(self.name)}{one.suffix}" for one in self.formats]
        return tuple(file for path in paths for file in formats.targets(path) if file.exists())


class ExportPanel(QWidget):
    """The form.

    Signals:
        export_requested: an ExportRequest.
        cancel_requested: stop the export.
        folder_requested: show the exported files.
    """

    export_requested = Signal(object)
    cancel_requested = Signal()
    folder_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._formats: tuple[FormatChoice, ...] = ()
        self._ready = self._busy = False
        self._body = True
        self._proposed = ""
        form = QVBoxLayout()
        column = QVBoxLayout(self)
        column.setContentsMargins(SIDES_PX, SIDES_PX, SIDES_PX, SIDES_PX)
        column.setSpacing(10)
        column.addWidget(self._scrolling(form), 1)
        self.what = label("", "caption", "export_what")
        self.what.setWordWrap(True)
        self.what.hide()
        self.options = OptionsForm()
        self.fps = self.options.fps
        self.options.changed.connect(self._show_note)
        self._build_format(form)
        form.addWidget(self.options)
        form.addLayout(self._build_target())
        form.addWidget(self.options.fold)
        form.addStretch(1)
        # A scroll bar that comes or goes changes the width that the note may wrap in.
        self._scroll.verticalScrollBar().rangeChanged.connect(lambda *_: self._fit_note())
        column.addWidget(self.what)
        column.addLayout(self._build_buttons())
        self._build_outcome(column)

    def _scrolling(self, form: QVBoxLayout) -> QScrollArea:
        """The form; where a small window is too low for it, it scrolls, and the button stays in sight."""
        scroll = self._scroll = QScrollArea()
        scroll.setObjectName("export_scroll")
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QScrollArea.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        page = QWidget()
        page.setObjectName("scrolled")
        page.setLayout(form)
        scroll.setWidget(page)
        form.setContentsMargins(0, 0, RIGHT_PX, 0)
        form.setSpacing(10)
        return scroll

    def show_formats(self, formats: Sequence[FormatChoice]) -> None:
        """Fill the list."""
        self._formats = tuple(formats)
        self.format.clear()
        for choice in formats:
            self.format.addItem(f"{native(choice.title)} ({choice.suffix})", choice.name)
        self.more.show_formats({one.name: f"{native(one.title)} ({one.suffix})" for one in formats})
        self._show_note()

    def show_fps(self, fps: float) -> None:
        """Choose a frame rate; one that is not offered is added."""
        if self.fps.findData(fps) < 0:
            self.fps.addItem(self.tr("{0} frames/s").format(f"{fps:g}"), fps)
        self.fps.setCurrentIndex(self.fps.findData(fps))

    def show_target(self, name: str, folder: Path | None, ready: bool, body: bool = True) -> None:
        """What would be exported and where to.

        Args:
            name: of the files, without suffix.
            folder: where to, unless one was chosen.
            ready: whether there is a motion.
            body: whether it has bones; a face alone is better off in another format.
        """
        if ready and body != self._body:
            # A face alone is proposed as CSV: BVH, for one, holds nothing but bones.
            self._body = body
            proposed = next((c.name for c in self._formats if body or c.name == "saia_csv"), "")
            self.format.setCurrentIndex(max(self.format.findData(proposed), 0))
        if name != self.name.text() and not self._busy:
            self.show_result("", False)  # it was of another motion
        self.name.setText(name)
        # A folder that a person chose stays; one that was only proposed follows the project.
        if folder is not None and self.folder.text() in ("", self._proposed):
            # Another project has another one.
            self._proposed = str(folder)
            self.folder.setText(self._proposed)
        self._ready = ready
        self.what.setVisible(ready and bool(self.what.text()))
        self._show_note()

    def show_what(self, predicted: bool) -> None:
        """Which motion is exported: the one a run predicted, or the captured one."""
        text = self.tr("Exports the predicted motion.")
        self.what.setText(text if predicted else self.tr("Exports the captured motion."))
        self.what.setVisible(self._ready)

    def show_busy(self, fraction: float | None) -> None:
        """Show progress 0..1; negative only moves; None where nothing is under way."""
        self._busy = fraction is not None
        self._show_possible()
        self.cancel.setVisible(self._busy)
        self.bar.setVisible(self._busy)
        if fraction is not None:
            self.bar.setRange(0, 0 if fraction < 0 else 1000)
            self.bar.setValue(round(max(fraction, 0.0) * 1000))
            self.show_result("", False)

    def show_result(self, text: str, good: bool) -> None:
        """Say how it ended."""
        theme.as_role(self.result, "good" if good else "bad")
        self.result.setText(text)
        self.result.setVisible(bool(text))
        self.show_folder.setVisible(bool(text) and good)
        # A small window has room for only one of the two.
        self.note.setVisible(not text)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_note()

    def _on_format(self) -> None:
        if not self._busy:
            self.show_result("", False)
        self._show_note()

    def _show_note(self) -> None:
        choice, also = self._chosen(), self._also()
        text = native(choice.note) if choice else ""
        if also:
            text = self.tr("Also: {0}.").format(", ".join(native(one.title) for one in also))
        empty = self._empty()
        self.note.setText(empty or text)
        theme.as_role(self.note, "warn" if empty else "caption")
        self._show_possible()
        names = {one.name for one in (choice, *also) if one is not None}
        self.options.show_drawn(bool(names & DRAWN))
        self.note.show()
        self._fit_note()

    def _empty(self) -> str:
        """Why what is chosen cannot be written of this motion, as a sentence; "" where all can."""
        chosen = (self._chosen(), *self._also())
        titles = [native(one.title) for one in chosen if one is not None and one.bones_only]
        solid = any(one is not None and one.name == SOLID for one in chosen)
        if solid and self.options.options.background.is_clear:
            return self.tr("An .mp4 film cannot be transparent. Choose .webm, or another background.")
        if not (self._ready and titles) or self._body:
            return ""
        return self.tr("{0} holds a body alone, and this motion is a face. Choose another format.").format(
            titles[0]
        )

    def _show_possible(self) -> None:
        why = self._empty() if self._ready else self.tr("There is no motion to export yet")
        self.export.setEnabled(self._ready and not self._busy and not why)
        self.export.setToolTip(why)

    def _fit_note(self) -> None:
        # A tab's page does not pass on that wrapped text grows with less width. What a label needs is never
        # less than its least height, which is taken away first.
        self.note.setMinimumHeight(0)
        bar = self._scroll.verticalScrollBar()
        margins = 2 * SIDES_PX + RIGHT_PX + (bar.sizeHint().width() if bar.maximum() > 0 else 0)
        self.note.setMinimumHeight(max(self.note.heightForWidth(max(self.width() - margins, 100)), 0))

    def _chosen(self) -> FormatChoice | None:
        name = self.format.currentData(Qt.ItemDataRole.UserRole)
        return next((choice for choice in self._formats if choice.name == name), None)

    def _also(self) -> tuple[FormatChoice, ...]:
        """The further formats that are ticked."""
        names = self.more.chosen(besides=str(self.format.currentData() or ""))
        return tuple(choice for choice in self._formats if choice.name in names)

    def _choose_folder(self) -> None:
        found = QFileDialog.getExistingDirectory(self, self.tr("Export into"), self.folder.text())
        if found:
            self.folder.setText(found)

    def _on_export(self) -> None:
        choice, name = self._chosen(), self.name.text().strip()
        if not name:
            self.show_result(self.tr("Give it a name first."), False)
        elif not self.folder.text().strip():
            self.show_result(self.tr("Choose a folder first."), False)
        elif self.options.needs_size:
            self.show_result(self.tr("Finish the picture's size first, such as 1920 x 1080."), False)
        elif choice is not None:
            folder = Path(self.folder.text().strip()).expanduser()
            fps, options = float(self.fps.currentData()), self.options.options
            self.export_requested.emit(ExportRequest(name, (choice, *self._also()), fps, folder, options))

    def _build_format(self, form: QVBoxLayout) -> None:
        """Which formats, and what they leave out."""
        self.format = QComboBox()
        self.format.setObjectName("export_format")
        self.format.setAccessibleName(self.tr("Format"))
        self.format.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.format.currentIndexChanged.connect(lambda _: self._on_format())
        self.more = MoreFormats()
        self.more.changed.connect(self._show_note)
        self.note = label("", "caption", "export_note")
        self.note.setWordWrap(True)
        choice = QHBoxLayout()
        choice.setSpacing(theme.TIGHT)
        choice.addWidget(self.format, 1)
        choice.addWidget(self.more)
        form.addLayout(choice)
        form.addWidget(self.note)

    def _build_target(self) -> QGridLayout:
        """What the files are called, and where they go."""
        self.name = QLineEdit()
        self.name.setObjectName("export_name")
        self.name.setAccessibleName(self.tr("Name"))
        grid = QGridLayout()
        grid.setHorizontalSpacing(theme.INSIDE)
        grid.setVerticalSpacing(theme.INSIDE)
        grid.setColumnStretch(1, 1)
        grid.addWidget(caption(self.tr("Name")), 0, 0)
        grid.addWidget(self.name, 0, 1)
        grid.addWidget(caption(self.tr("Folder")), 1, 0)
        grid.addLayout(self._build_folder(), 1, 1)
        return grid

    def _build_folder(self) -> QHBoxLayout:
        self.folder = QLineEdit()
        self.folder.setObjectName("export_folder")
        self.folder.setAccessibleName(self.tr("Folder"))
        choose = QToolButton()
        choose.setObjectName("choose_export_folder")
        choose.setAccessibleName(self.tr("Choose the folder"))
        theme.set_icon(choose, "mdi6.folder-outline", "muted")
        choose.clicked.connect(self._choose_folder)
        row = QHBoxLayout()
        row.setSpacing(theme.TIGHT)
        row.addWidget(self.folder, 1)
        row.addWidget(choose)
        return row

    def _build_buttons(self) -> QHBoxLayout:
        self.export = QPushButton(name_of("export"))
        self.export.setObjectName("export_button")
        theme.as_role(self.export, "primary")
        self.export.clicked.connect(self._on_export)
        self.cancel = QPushButton(self.tr("Cancel"))
        self.cancel.setObjectName("cancel_export")
        self.cancel.clicked.connect(self.cancel_requested)
        self.cancel.hide()
        row = QHBoxLayout()
        row.addWidget(self.export, 1)
        row.addWidget(self.cancel)
        return row

    def _build_outcome(self, column: QVBoxLayout) -> None:
        """How far it is, and what came of it."""
        self.bar = QProgressBar()
        self.bar.setObjectName("export_bar")
        self.bar.setTextVisible(False)
        self.bar.setAccessibleName(self.tr("Export progress"))
        self.bar.hide()
        self.result = label("", "good", "export_result")
        self.result.setWordWrap(True)
        self.result.hide()
        self.show_folder = QPushButton(self.tr("Open folder"))
        self.show_folder.setObjectName("show_export_folder")
        self.show_folder.clicked.connect(self.folder_requested)
        self.show_folder.hide()
        column.addWidget(self.bar)
        column.addWidget(self.result)
        column.addWidget(self.show_folder, 0, Qt.AlignmentFlag.AlignLeft)
