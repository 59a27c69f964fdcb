"""The takes of today: hear, keep, do again, note."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLineEdit, QScrollArea, QToolButton, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.widgets.card import Card, CutLabel, Picture, label

SHOWN = 40
BUTTON_PX = 28
"""As narrow as a finger can hit: the take's name needs the room."""


@dataclass(frozen=True)
class TakeLine:
    """What a row says of one take.

    Args:
        id: the take's.
        duration: m:ss.
        grade: "A" to "D", "" while it is looked at.
        reason: the worst finding in one sentence, "" where there is none.
        kept: starred by the performer.
        note: the performer's words.
        playing: it is heard right now.
        proof: whether the files hold all of it, in a sentence; "" while they are read again.
        proven: whether that is good. details: what was counted.
        recorded: in this studio, so that it can be recorded again.
    """

    id: str
    duration: str
    grade: str = ""
    reason: str = ""
    kept: bool = False
    note: str = ""
    playing: bool = False
    proof: str = ""
    proven: bool = True
    details: str = ""
    recorded: bool = True


class SavedTakeRow(QFrame):
    """One take.

    Signals:
        play_clicked, keep_clicked, redo_clicked: the take's id.
        note_written: the id and the words.
    """

    play_clicked = Signal(str)
    keep_clicked = Signal(str)
    redo_clicked = Signal(str)
    note_written = Signal(str, str)

    def __init__(self, take_id: str) -> None:
        super().__init__()
        self.take_id = take_id
        self._line: TakeLine | None = None
        self.play = self._button("take_play", self.tr("Play"), lambda: self.play_clicked.emit(take_id))
        self.keep = self._button("take_keep", self.tr("Keep"), lambda: self.keep_clicked.emit(take_id))
        self.redo = self._button("take_redo", self.tr("Re-record"), lambda: self.redo_clicked.emit(take_id))
        self.redo.setToolTip(self.tr("Delete and re-record; Esc in the countdown brings this take back"))
        self.redo.setText(self.tr("Re-record"))
        self.redo.setFixedWidth(self.redo.sizeHint().width())
        self.note_button = self._button("take_note", self.tr("Write a note"), self._on_note)
        theme.set_icon(self.note_button, "mdi6.note-edit-outline", "muted")
        self.name = CutLabel(cut=Qt.TextElideMode.ElideMiddle)
        self.name.setText(take_id)
        self.name.setToolTip(take_id)
        self.duration = label("", "muted")
        self.duration.setFont(theme.figures_font())
        self.grade = label()
        self.grade.setFont(theme.figures_font(semibold=True))
        self.proof_icon = Picture("mdi6.check-circle", 14, "good")
        self.proof = label("", "muted", "take_proof")
        self.proof.setWordWrap(True)
        self.reason = label("", "caption")
        self.reason.setWordWrap(True)
        self.note = QLineEdit()
        self.note.setObjectName("take_note_text")
        self.note.setPlaceholderText(self.tr("Note"))
        self.note.setAccessibleName(self.tr("Note on {0}").format(take_id))
        self.note.editingFinished.connect(self._on_note_finished)
        self.note.hide()
        self._lay_out()

    def show_line(self, line: TakeLine) -> None:
        """Show what is known of the take."""
        if line == self._line:
            return
        self._line = line
        self.duration.setText(line.duration)
        # What was made elsewhere cannot be made again here, and one wrong click would put it away.
        self.redo.setVisible(line.recorded)
        self.grade.setText(line.grade or "…")
        theme.as_role(
            self.grade, {"A": "good", "B": "good", "C": "warn", "D": "bad"}.get(line.grade, "muted")
        )
        words = " · ".join(part for part in (line.note, line.reason) if part)
        self.reason.setText(words)
        self.reason.setVisible(bool(words))
        self.proof.setText(line.proof or self.tr("Reading it again…"))
        self.proof.setToolTip(line.details)
        theme.as_role(self.proof, ("good" if line.proven else "bad") if line.proof else "muted")
        icon = ("mdi6.check-circle", "good") if line.proven else ("mdi6.alert-circle", "bad")
        self.proof_icon.set_icon(*(icon if line.proof else ("mdi6.circle-outline", "disabled")))
        theme.set_icon(self.play, "mdi6.stop" if line.playing else "mdi6.play", "accent")
        star, token = ("mdi6.star", "warn") if line.kept else ("mdi6.star-outline", "muted")
        theme.set_icon(self.keep, star, token)
        if not self.note.isVisible():
            self.note.setText(line.note)

    def _lay_out(self) -> None:
        top = QHBoxLayout()
        top.setSpacing(2)
        top.addWidget(self.play)
        top.addWidget(self.name, 1)
        top.addWidget(self.duration)
        top.addSpacing(8)
        top.addWidget(self.grade)
        top.addSpacing(4)
        for button in (self.keep, self.note_button):
            top.addWidget(button)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 2, 0, 2)
        column.setSpacing(0)
        column.addLayout(top)
        proof = QHBoxLayout()
        proof.setContentsMargins(8, 0, 4, 0)
        proof.setSpacing(theme.INSIDE)
        proof.addWidget(self.proof_icon, 0, Qt.AlignmentFlag.AlignTop)
        proof.addWidget(self.proof, 1)
        proof.addWidget(self.redo, 0, Qt.AlignmentFlag.AlignTop)
        column.addLayout(proof)
        words = QHBoxLayout()
        words.setContentsMargins(30, 0, 4, 0)
        words.addWidget(self.reason)
        column.addLayout(words)
        column.addWidget(self.note)

    def _button(self, name: str, text: str, work: object) -> QToolButton:
        button = QToolButton()
        button.setObjectName(name)
        button.setToolTip(text)
        button.setAccessibleName(f"{text}: {self.take_id}")
        theme.as_role(button, "quiet")
        button.setFixedWidth(BUTTON_PX)
        button.clicked.connect(work)
        return button

    def _on_note(self) -> None:
        self.note.setVisible(not self.note.isVisible())
        if self.note.isVisible():
            self.note.setFocus()

    def _on_note_finished(self) -> None:
        self.note.hide()
        if self._line is not None and self.note.text() != self._line.note:
            self.note_written.emit(self.take_id, self.note.text())


class TakesCard(Card):
    """Rows, the newest first.

    Signals:
        play_requested, keep_requested, redo_requested: a take's id.
        note_written: the id and the words.
        curate_requested: go on to Curate.
    """

    play_requested = Signal(str)
    keep_requested = Signal(str)
    redo_requested = Signal(str)
    note_written = Signal(str, str)
    curate_requested = Signal()

    def __init__(self) -> None:
        super().__init__(self.tr("Takes today"))
        self._rows: dict[str, SavedTakeRow] = {}
        go_on = QToolButton()
        go_on.setObjectName("go_to_curate")
        go_on.setText(self.tr("Curate ›"))
        theme.as_role(go_on, "quiet")
        go_on.clicked.connect(self.curate_requested)
        self._go_on = go_on
        self.head.addWidget(go_on)
        self._empty = label(self.tr("No takes today yet."), "muted")
        self._empty.setWordWrap(True)
        self._empty.setAlignment(Qt.AlignmentFlag.AlignCenter)
        inner = QWidget()
        inner.setObjectName("scrolled")
        self._column = QVBoxLayout(inner)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(0)
        self._column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(inner)
        self.body.addWidget(self._empty, 1)
        self.body.addWidget(scroll, 1)
        self._scroll = scroll
        self.show_lines([])

    def show_lines(self, lines: list[TakeLine]) -> None:
        """Show takes, the newest first; rows that stay keep their place and what is typed in them."""
        listed = {line.id for line in lines[:SHOWN]}
        for gone in [take_id for take_id in self._rows if take_id not in listed]:
            row = self._rows.pop(gone)
            self._column.removeWidget(row)
            row.deleteLater()
        for place, line in enumerate(lines[:SHOWN]):
            found = self._rows.get(line.id)
            if found is None:
                found = self._rows[line.id] = self._new_row(line.id)
                self._column.insertWidget(place, found)
            found.show_line(line)
        self._empty.setVisible(not lines)
        self._scroll.setVisible(bool(lines))
        self._go_on.setVisible(bool(lines))

    @property
    def shown(self) -> tuple[str, ...]:
        """The ids listed, from the top."""
        rows = (self._column.itemAt(i) for i in range(self._column.count() - 1))
        widgets = (item.widget() for item in rows if item is not None)
        return tuple(widget.take_id for widget in widgets if isinstance(widget, SavedTakeRow))

    def row(self, take_id: str) -> SavedTakeRow:
        """The row of a take."""
        return self._rows[take_id]

    def _new_row(self, take_id: str) -> SavedTakeRow:
        row = SavedTakeRow(take_id)
        row.play_clicked.connect(self.play_requested)
        row.keep_clicked.connect(self.keep_requested)
        row.redo_clicked.connect(self.redo_requested)
        row.note_written.connect(self.note_written)
        return row
