"""What the check of a take found: as marks on the timeline, and as a list with a way there and a way out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QToolButton, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.widgets.card import label
from studio.ui.widgets.timeline.content import Mark
from studio.ui.widgets.timeline.time_view import clock

if TYPE_CHECKING:
    from studio.take.check import Finding, Report

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


def all_marks(report: Report | None) -> tuple[Mark, ...]:
    """Everything a check found, in its order."""
    return tuple(mark_of(finding) for finding in report.findings) if report else ()


def placed(report: Report | None) -> tuple[Mark, ...]:
    """What lies at a moment of the take."""
    found = report.findings if report else ()
    return tuple(mark_of(finding) for finding in found if finding.at is not None)


def mark_of(finding: Finding) -> Mark:
    """One finding as a mark; its sentence and remedy are on two lines."""
    severity = {"fatal": "bad", "major": "bad", "minor": "warn"}.get(finding.severity, "muted")
    start, end = (finding.at or 0.0), (finding.until or finding.at or 0.0)
    text = f"{finding.what}\n{finding.remedy}".strip()
    return Mark(start, max(end - start, 0.0), severity, title(finding.kind), text)


def title(kind: str) -> str:
    """A finding's kind in one or two words."""
    words = {
        "gap": _tr("gap"), "frozen": _tr("stands still"), "jitter": _tr("uneven"), "jump": _tr("jump"),
        "clipping": _tr("too loud"), "quiet": _tr("quiet"), "silence": _tr("silence"), "noise": _tr("noise"),
        "ends": _tr("one ends"), "starts": _tr("late start"), "values": _tr("bad values"),
        "offset": _tr("out of step"), "damaged": _tr("damaged"),
    }  # fmt: skip
    return words.get(kind, kind.replace("_", " "))


def _tr(text: str) -> str:
    return QCoreApplication.translate("Findings", text)
