"""What the check of a take found: each with its reason, a way there, and a way out."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QToolButton, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.widgets.card import label
from studio.ui.widgets.time_view import clock
from studio.ui.widgets.timeline_content import Mark

ICONS = {"muted": "mdi6.information-outline", "warn": "mdi6.alert", "bad": "mdi6.alert-circle"}


class Findings(QWidget):
    """A list of marks in words.

    Signals:
        chosen: the Mark to go to.
        exclude_requested: the Mark whose span is to be left out.
    """

    chosen = Signal(object)
    exclude_requested = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(theme.INSIDE)
        self._shown: tuple[object, ...] = ("",)

    def show_marks(self, marks: Sequence[Mark], placed: Sequence[Mark], sentence: str) -> None:
        """Show what was found.

        Args:
            marks: all of it, the worst first.
            placed: those that lie at a moment of the take, so that one can go there.
            sentence: said where nothing was found, or while nothing is known.
        """
        key = (tuple(marks), tuple(placed), sentence)
        if key == self._shown:
            return
        self._shown = key
        while (item := self._column.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()  # it is deleted a moment later, and must not be seen below the new ones
                widget.deleteLater()
        if not marks:
            words = label(sentence, "muted", "findings_none")
            words.setWordWrap(True)
            self._column.addWidget(words)
        for number, mark in enumerate(marks):
            self._column.addWidget(self._row(mark, mark in placed, number))

    def _row(self, mark: Mark, is_placed: bool, number: int) -> QWidget:
        row = QWidget()
        across = QHBoxLayout(row)
        across.setContentsMargins(0, 0, 0, 0)
        across.setSpacing(theme.INSIDE)
        sign = QLabel()
        sign.setPixmap(theme.icon(ICONS[mark.severity], mark.severity).pixmap(theme.icon_size()))
        across.addWidget(sign, 0, Qt.AlignmentFlag.AlignTop)
        column = QVBoxLayout()
        column.setSpacing(2)
        what, _, remedy = mark.text.partition("\n")
        for text, role in ((what, ""), (remedy, "caption")):
            if text:
                words = label(text, role)
                words.setWordWrap(True)
                column.addWidget(words)
        if is_placed:
            column.addLayout(self._buttons(mark, number))
        across.addLayout(column, 1)
        return row

    def _buttons(self, mark: Mark, number: int) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(theme.TIGHT)
        go = QToolButton()
        go.setText(clock(mark.t))
        go.setToolTip(self.tr("Go there"))
        go.setAccessibleName(self.tr("Go to {0}").format(clock(mark.t)))
        go.setObjectName(f"finding_{number}_go")
        theme.as_role(go, "chip")
        go.clicked.connect(lambda: self.chosen.emit(mark))
        row.addWidget(go)
        if mark.duration > 0:
            out = QPushButton(self.tr("Exclude"))
            out.setToolTip(self.tr("Leave this span out of training"))
            out.setObjectName(f"finding_{number}_exclude")
            theme.as_role(out, "chip")
            out.clicked.connect(lambda: self.exclude_requested.emit(mark))
            row.addWidget(out)
        row.addStretch(1)
        return row
