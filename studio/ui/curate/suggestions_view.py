"""What is wrong, with a way there and a way out: in one take, and over the whole project the worst first."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QCoreApplication, Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.dataset.suggest import Suggestion
from studio.ui import theme
from studio.ui.language import native
from studio.ui.widgets.card import label
from studio.ui.widgets.timeline.content import Mark
from studio.ui.widgets.timeline.time_view import clock

MOST = 40
"""Rows built; what comes after them shows as these are dealt with."""
NAMED = 6
"""Takes of one row that are named in it."""

Group = tuple[Suggestion, ...]


class Suggestions(QWidget):
    """The list, the worst first, and the choice of a run to hold the takes against.

    A row is one Suggestion, or several that are equal but for their takes.

    Signals:
        chosen: the row's Suggestions, to go to.
        exclude_requested: the row's Suggestions, whose span or whole takes are to be left out.
        compare_requested: id of the run whose errors are wanted.
    """

    chosen = Signal(object)
    exclude_requested = Signal(object)
    compare_requested = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("suggestions")
        self._shown: tuple[object, ...] = ("",)
        self._editable = True
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE)
        column.addLayout(self._build_head())
        inside = QWidget()
        inside.setObjectName("scrolled")
        self._rows = QVBoxLayout(inside)
        self._rows.setContentsMargins(0, 0, 4, 0)
        self._rows.setSpacing(theme.INSIDE)
        scroll = QScrollArea()
        scroll.setWidget(inside)
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        column.addWidget(scroll, 1)

    def show_suggestions(self, rows: Sequence[Group], waiting: int, notes: Sequence[Group] = ()) -> None:
        """Show what was found.

        Args:
            rows: the worst first.
            waiting: takes whose check is still to come.
            notes: what is no fault, below them.
        """
        key = (tuple(rows[:MOST]), len(rows), waiting, self._editable, tuple(notes))
        if key == self._shown:
            return
        self._shown = key
        self._summary.setText(self._words(len(rows), waiting))
        while (item := self._rows.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        for number, group in enumerate((*rows[:MOST], *notes)):
            self._rows.addWidget(self._row(group, number))
        self._rows.addStretch(1)

    def show_runs(self, runs: Sequence[str], busy: str = "") -> None:
        """Offer runs to compare with; `busy` says how far the comparing has come."""
        now = self.run.currentText()
        names = [self.run.itemText(i) for i in range(self.run.count())]
        if names != list(runs):
            self.run.clear()
            self.run.addItems(list(runs))
            if now in runs:
                self.run.setCurrentText(now)
        for widget in (self.run, self.compare):
            widget.setVisible(bool(runs))
        self.run.setEnabled(not busy)
        self.compare.setEnabled(not busy)
        self.compare.setText(busy or self.tr("Compare"))

    def set_editable(self, editable: bool) -> None:
        """Whether spans may be left out here."""
        self._editable = editable

    def _words(self, count: int, waiting: int) -> str:
        if waiting:
            return self.tr("{0} found; still checking (takes left: {1}).").format(count, waiting)
        if not count:
            return self.tr("Nothing to fix.")
        if count > MOST:
            return self.tr("The worst {0} of {1} things to look at.").format(MOST, count)
        if count == 1:
            return self.tr("1 thing to look at.")
        return self.tr("{0} things to look at, the worst first.").format(count)

    def _build_head(self) -> QHBoxLayout:
        self._summary = label("", "muted", "suggestions_summary")
        self.run = QComboBox()
        self.run.setObjectName("suggestions_run")
        self.run.setAccessibleName(self.tr("Run to compare with"))
        self.compare = QPushButton(self.tr("Compare"))
        self.compare.setObjectName("suggestions_compare")
        self.compare.setToolTip(
            self.tr("Find the spans where this run differs most from the captured motion")
        )
        self.compare.clicked.connect(lambda: self.compare_requested.emit(self.run.currentText()))
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self._summary, 1)
        row.addWidget(self.run)
        row.addWidget(self.compare)
        return row

    def _row(self, group: Group, number: int) -> QWidget:
        one = group[0]
        row = QWidget()
        row.setObjectName(f"suggestion_{number}")
        across = QHBoxLayout(row)
        across.setContentsMargins(0, 0, 0, 0)
        across.setSpacing(theme.INSIDE)
        severity = "bad" if one.weight >= 0.7 else "warn" if one.weight >= 0.3 else "muted"
        sign = QLabel()
        sign.setPixmap(theme.icon(ICONS[severity], severity).pixmap(theme.icon_size()))
        across.addWidget(sign, 0, Qt.AlignmentFlag.AlignTop)
        column = QVBoxLayout()
        column.setSpacing(2)
        texts = [(native(one.what), ""), (native(one.remedy), "caption")]
        if len(group) > 1:
            texts = [(what_of(group), ""), (names_of(group, NAMED), "caption"), texts[1]]
        for text, role in texts:
            words = label(text, role)
            words.setWordWrap(True)
            column.addWidget(words)
        across.addLayout(column, 1)
        self._add_go(across, group, number)
        if one.weight > 0:
            self._add_out(across, group, number)
        return row

    def _add_go(self, across: QHBoxLayout, group: Group, number: int) -> None:
        one = group[0]
        go = QToolButton()
        if len(group) > 1:
            go.setText(self.tr("Show all {0}").format(len(group)))
            go.setToolTip(self.tr("Show them in the library: {0}").format(names_of(group, MOST)))
            go.setAccessibleName(self.tr("Show {0} takes in the library").format(len(group)))
        else:
            go.setText(f"{one.selection}  {clock(one.span[0]) if one.span else ''}".strip())
            go.setToolTip(self.tr("Go there"))
            go.setAccessibleName(self.tr("Go to {0}").format(go.text()))
        go.setObjectName(f"suggestion_{number}_go")
        theme.as_role(go, "chip")
        go.clicked.connect(lambda: self.chosen.emit(group))
        across.addWidget(go, 0, Qt.AlignmentFlag.AlignTop)

    def _add_out(self, across: QHBoxLayout, group: Group, number: int) -> None:
        one = group[0]
        is_moment = one.span is not None and one.span[1] <= one.span[0]
        out = QPushButton(self.tr("Exclude") if one.span else self.tr("Do not use"))
        out.setObjectName(f"suggestion_{number}_exclude")
        out.setToolTip(
            self.tr("Leave this span out of training")
            if one.span
            else self.tr("Leave the whole take out of training")
            if len(group) == 1
            else self.tr("Leave all {0} takes out of training").format(len(group))
        )
        theme.as_role(out, "chip")
        out.setEnabled(self._editable and not is_moment)
        if is_moment:
            out.setToolTip(self.tr("This is a single moment: go there and drag across the part to leave out"))
        out.clicked.connect(lambda: self.exclude_requested.emit(group))
        across.addWidget(out, 0, Qt.AlignmentFlag.AlignTop)


def what_of(group: Group) -> str:
    """One sentence for what several takes have in common."""
    known = {
        "no_motion": _tr("{0} takes have no motion."),
        "no_sound": _tr("{0} takes have no sound."),
        "short": _tr("{0} takes last less than a second."),
        "leak": _tr("{0} parts test the training, but other parts of their takes are trained on."),
        "unsure": _tr("In {0} takes mouth and voice may be out of sync."),
        "unused": _tr("{0} takes are not used: training needs both sound and motion."),
    }
    sentence = known.get(group[0].kind, _tr("{0} takes like this: {1}"))
    return sentence.format(len(group), native(group[0].what))


def names_of(group: Group, most: int) -> str:
    """The takes of a row by name, the first of them where there are many."""
    names = [one.selection for one in group]
    text = ", ".join(names[:most])
    return _tr("{0} and {1} more").format(text, len(names) - most) if len(names) > most else text


def _tr(text: str) -> str:
    return QCoreApplication.translate("Suggestions", text)


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
                # It is deleted a moment later, and must not be seen below the new ones.
                widget.hide()
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
