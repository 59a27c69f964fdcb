"""The dialog that lists every key."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtWidgets import QDialog, QGridLayout, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.widgets.card import heading, label


def groups() -> tuple[tuple[str, tuple[tuple[str, str], ...]], ...]:
    """(group, ((keys, what they do), ...)) in the order shown."""
    tr = _tr
    return (
        (
            tr("Everywhere"),
            (
                ("Ctrl+1 … 5", tr("Record, Curate, Train, Review, Live")),
                ("Ctrl+N, Ctrl+O", tr("New project, open a project")),
                ("Ctrl+I", tr("Import sound and motion")),
                ("Ctrl+Z, Ctrl+Y", tr("Undo, redo (or Ctrl+Shift+Z) in this tab")),
                ("Ctrl+W, Ctrl+Q", tr("Close the project, quit")),
                ("F6, Esc", tr("Go to a message, take it away")),
                ("F10", tr("Menu")),
                ("F11", tr("Full screen")),
                ("Ctrl+/", tr("This list")),
            ),
        ),
        (
            tr("Record"),
            (
                ("F1, Space", tr("Start and stop recording")),
                ("Esc", tr("Cancel the countdown")),
            ),
        ),
        (
            tr("Curate and Review"),
            (
                ("Space", tr("Play and pause")),
                ("← →", tr("One frame; with Ctrl 4, with Ctrl+Alt 100")),
                ("Home, End", tr("First and last frame")),
                ("L", tr("Loop")),
            ),
        ),
        (
            tr("Curate"),
            (
                ("I, O", tr("In point, out point")),
                ("Shift", tr("with ← → Home End: select a span")),
                ("1 … 9", tr("Label; hold while playing to label a span")),
                ("X, Del", tr("Exclude the span, remove the label")),
                ("+ − F", tr("Closer, wider, whole take")),
                ("P", tr("Waveform or spectrogram")),
                ("B", tr("Before and after cleaning the sound")),
                ("Ctrl+A, F2", tr("All takes; change what the table's row says")),
            ),
        ),
        (
            tr("Review"),
            (
                ("G", tr("Captured figure over the predicted one")),
                ("B", tr("Switch between A and B")),
                ("Del", tr("Remove a dropped sound from the list")),
            ),
        ),
        (
            tr("Live"),
            (
                ("M", tr("Mute the microphone")),
                ("F", tr("Freeze the avatar")),
                ("N", tr("Neutral pose, the panic key")),
            ),
        ),
        (
            tr("Figure"),
            (
                (tr("Drag, ← → ↑ ↓"), tr("Turn around the figure")),
                (tr("Wheel, + −"), tr("Closer, further away")),
                (tr("Double-click"), tr("Back to the first view")),
            ),
        ),
    )


class ShortcutsDialog(QDialog):
    """Every key by room."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("shortcuts_dialog")
        self.setWindowTitle(self.tr("List of keys"))
        columns = QHBoxLayout()
        columns.setSpacing(40)
        listed = groups()
        for part in ((*listed[:2], listed[-1]), listed[2:-1]):
            column = QVBoxLayout()
            column.setSpacing(theme.INSIDE)
            for title, keys in part:
                column.addWidget(heading(title))
                column.addLayout(_rows(keys))
                column.addSpacing(theme.BETWEEN)
            column.addStretch(1)
            columns.addLayout(column)
        close = QPushButton(self.tr("Close"))
        close.clicked.connect(self.accept)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(theme.EDGE, theme.EDGE, theme.EDGE, theme.BETWEEN)
        outer.addLayout(columns)
        outer.addWidget(close, 0, Qt.AlignmentFlag.AlignRight)


def _rows(keys: tuple[tuple[str, str], ...]) -> QGridLayout:
    grid = QGridLayout()
    grid.setHorizontalSpacing(20)
    grid.setVerticalSpacing(6)
    grid.setColumnStretch(1, 1)
    for row, (key, what) in enumerate(keys):
        name = label(key)
        name.setFont(theme.ui_font(semibold=True))
        name.setMinimumWidth(150)
        grid.addWidget(name, row, 0)
        grid.addWidget(label(what, "muted"), row, 1)
    return grid


def _tr(text: str) -> str:
    return QCoreApplication.translate("Shortcuts", text)
