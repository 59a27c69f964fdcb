"""The bar over Review's stage: a run and its style, a second one, the switch, and the blind vote."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QButtonGroup,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.project.run import BASE_VOICE
from studio.training.styles import RunChoice, RunSelection
from studio.ui import theme
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.widgets.card import CutLabel, label
from studio.ui.widgets.run_chooser import RunChooser

FOLDED_BELOW = 850
"""Pixels of the bar's width under which the camera's button beside Play alone has the views."""


class VoteBar(QWidget):
    """Two buttons that switch, one that begins a vote, and the answers while one is under way.

    Signals:
        front_requested: the run to see, 0 for A or 1 for B.
        vote_requested: begin a blind vote.
        voted: the better one, 0 for A or 1 for B; -1 for no difference.
        cancelled: end the vote without an answer.
    """

    front_requested = Signal(int)
    vote_requested = Signal()
    voted = Signal(int)
    cancelled = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        # Which run hides behind 1 and which behind 2.
        self._order: tuple[int, int] | None = None
        self._front = 0
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.TIGHT)
        self.sides: list[QToolButton] = []
        group = QButtonGroup(self)
        for place in (0, 1):
            button = QToolButton()
            button.setObjectName(f"review_side_{'ab'[place]}")
            button.setCheckable(True)
            theme.as_role(button, "chip")
            button.setToolTip(tip_of("other_run"))
            button.clicked.connect(lambda _=False, i=place: self.front_requested.emit(self._side_at(i)))
            group.addButton(button)
            row.addWidget(button)
            self.sides.append(button)
        self.begin_button = self._button("blind_vote", self.tr("Blind vote"), "mdi6.eye-off-outline")
        self.begin_button.setToolTip(self.tr("Judge the two without knowing which is which"))
        self.begin_button.clicked.connect(self.vote_requested)
        self._result = CutLabel("caption", "vote_result")
        self.answers: list[QPushButton] = []
        for name, text, answer in (
            ("vote_1", self.tr("1 is better"), 0),
            ("vote_2", self.tr("2 is better"), 1),
            ("vote_none", self.tr("No difference"), -1),
        ):
            choice = QPushButton(text)
            choice.setObjectName(name)
            choice.clicked.connect(lambda _=False, i=answer: self._on_answer(i))
            self.answers.append(choice)
        self.give_up = self._button("vote_cancel", self.tr("Cancel"))
        self.give_up.clicked.connect(self.cancelled)
        for widget in (self.begin_button, *self.answers, self.give_up, self._result):
            row.addWidget(widget)
        self._show()

    @property
    def running(self) -> bool:
        """Whether a vote is under way."""
        return self._order is not None

    @property
    def shown_number(self) -> int:
        """The number of the run that is seen, 1 or 2."""
        return 1 + (self._order or (0, 1)).index(self._front)

    def begin(self, order: tuple[int, int]) -> None:
        """Ask which is better.

        Args:
            order: the run behind 1 and the run behind 2.
        """
        self._order = order
        self._result.clear()
        self._show()

    def end(self) -> None:
        """No vote any more."""
        self._order = None
        self._show()

    def show_front(self, front: int, ready: bool) -> None:
        """Which run is seen, and whether both are there to switch between."""
        self._front = front
        for button in self.sides:
            button.setEnabled(ready)
        self.begin_button.setEnabled(ready)
        tip = "" if ready else self.tr("Choose a run for both sides first")
        self.begin_button.setToolTip(tip or self.tr("Judge the two without knowing which is which"))
        self._show()

    def show_result(self, text: str) -> None:
        """What came of the vote."""
        self._result.setText(text)
        self._result.setToolTip(text)

    def show_brief(self, brief: bool) -> None:
        """Name the vote by its picture alone, where two rows of choosers leave no room for words."""
        self.begin_button.setText("" if brief else self.tr("Blind vote"))
        self.begin_button.setAccessibleName(self.tr("Blind vote"))

    def other(self) -> None:
        """Switch to the one that is not seen."""
        # The key works everywhere in the tab, the buttons are there only while two are compared.
        if self.isVisible() and self.sides[0].isEnabled():
            self.front_requested.emit(1 - self._front)

    def _show(self) -> None:
        blind = self.running
        for place, button in enumerate(self.sides):
            button.setText(str(place + 1) if blind else "AB"[place])
            button.setAccessibleName(
                (self.tr("Show {0}") if blind else self.tr("Show run {0}")).format(button.text())
            )
            with QSignalBlocker(button):
                button.setChecked(self._side_at(place) == self._front)
        self.begin_button.setVisible(not blind)
        self._result.setVisible(not blind)
        for answer in (*self.answers, self.give_up):
            answer.setVisible(blind)

    def _side_at(self, place: int) -> int:
        return self._order[place] if self._order is not None else place

    def _on_answer(self, place: int) -> None:
        self.voted.emit(-1 if place < 0 else self._side_at(place))

    def _button(self, name: str, text: str, icon: str = "") -> QPushButton:
        button = QPushButton(text)
        button.setObjectName(name)
        theme.as_role(button, "quiet")
        if icon:
            theme.set_icon(button, icon, "muted")
        return button


class WorkProgress(QWidget):
    """How far a child process is, with a button that ends it.

    Args:
        names: object names of its bar, text and button.
        title: what is done, for people who do not see the bar.

    Signals:
        cancelled: end it.
    """

    cancelled = Signal()

    def __init__(self, names: tuple[str, str, str], title: str) -> None:
        super().__init__()
        self._bar = QProgressBar()
        self._bar.setObjectName(names[0])
        self._bar.setAccessibleName(title)
        self._bar.setTextVisible(False)
        self._bar.setFixedWidth(120)
        self._text: QLabel = label("", "caption", names[1])
        cancel = QPushButton(self.tr("Cancel"))
        cancel.setObjectName(names[2])
        theme.as_role(cancel, "quiet")
        cancel.clicked.connect(self.cancelled)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        for widget in (self._bar, self._text, cancel):
            row.addWidget(widget, 0, Qt.AlignmentFlag.AlignVCenter)
        self.hide()

    def show_progress(self, text: str, fraction: float | None) -> None:
        """Say how far it is; None hides it, a negative fraction only moves."""
        self.setVisible(fraction is not None)
        self._text.setText(text)
        if fraction is not None:
            # From 0 to 0 Qt's bar moves without saying how far it is.
            self._bar.setRange(0, 0 if fraction < 0 else 1000)
            self._bar.setValue(round(1000 * max(fraction, 0.0)))


class RunBar(QWidget):
    """All of it: one row, and a second one while two runs are compared or motion is made.

    Signals:
        chosen: (0 for A or 1 for B, a RunSelection).
        two_toggled: whether a second run is compared.
        front_requested: 0 for A, 1 for B.
        cancelled: stop generating.
        train_requested: there is no run but the base voice.
        ghost_toggled: the button went down or up.
        view_requested: "front", "three_quarter" or "side".
        style_requested: the run is to move like the take on the stage.
    """

    chosen = Signal(int, object)
    two_toggled = Signal(bool)
    front_requested = Signal(int)
    cancelled = Signal()
    train_requested = Signal()
    ghost_toggled = Signal(bool)
    view_requested = Signal(str)
    style_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.first = RunChooser(self.tr("Run"), "", self.tr("Captured motion only"))
        self.second = RunChooser("B", "_b", self.tr("Choose a run"))
        self.first.chosen.connect(lambda selection: self.chosen.emit(0, selection))
        self.second.chosen.connect(lambda selection: self.chosen.emit(1, selection))
        self._busy = self._can_two = self._can_show_style = self._has_views = False
        self.vote = VoteBar()
        self.vote.front_requested.connect(self.front_requested)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE)
        column.addLayout(self._first_row())
        column.addLayout(self._second_row())
        self._why = label("", "caption", "why_no_prediction")
        self._why.setWordWrap(True)
        column.addWidget(self._why)
        self.show_why("")
        self.show_generating("", None)
        self.show_two(False)

    @property
    def shown_number(self) -> int:
        """In a blind vote: whether the first or the second is seen, 1 or 2."""
        return self.vote.shown_number

    def show_runs(self, choices: Sequence[RunChoice], selections: Sequence[RunSelection]) -> None:
        """Fill both choosers.

        Args:
            choices: all runs that can generate.
            selections: what A and B are to show.
        """
        self.first.show_runs(choices, selections[0])
        self.second.show_runs(choices, selections[1])
        self._no_runs.setVisible(all(choice.id == BASE_VOICE for choice in choices))
        self.first.setVisible(bool(choices))
        self._can_two = len(choices) > 1 or any(choice.styles for choice in choices)
        self._arrange()

    def show_two(self, two: bool) -> None:
        """Show or hide the second run."""
        with QSignalBlocker(self.two):
            self.two.setChecked(two)
        self._arrange()

    def show_front(self, front: int, ready: bool) -> None:
        """Which run is seen, and whether the other can be switched to."""
        self.vote.show_front(front, ready)

    def show_generating(self, text: str, fraction: float | None) -> None:
        """Say that motion is being made; None hides it, a negative fraction only moves."""
        self._busy = fraction is not None
        self._generating.show_progress(text, fraction)
        self._arrange()

    def show_why(self, text: str) -> None:
        """Say why the chosen run predicts nothing; "" for nothing to say."""
        self._why.setText(text)
        self._why.setVisible(bool(text))

    def show_ghost_choice(self, possible: bool, bones: bool) -> None:
        """Offer the ghost where both motions have bones, the views where any has."""
        self.ghost.setVisible(possible)
        self._has_views = bones
        self._arrange()

    def show_style_choice(self, possible: bool) -> None:
        """Offer to show the run a style: there is a run, and a take that it can look at."""
        self._can_show_style = possible
        self._arrange()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if (event.size().width() < FOLDED_BELOW) != (event.oldSize().width() < FOLDED_BELOW):
            self._arrange()

    def begin_vote(self, order: tuple[int, int]) -> None:
        """Hide which run is which."""
        self.vote.begin(order)
        self._arrange()

    def end_vote(self) -> None:
        """Show the names again."""
        self.vote.end()
        self._arrange()

    def _arrange(self) -> None:
        two, blind = self.two.isChecked(), self.vote.running
        folded = self.width() < FOLDED_BELOW
        for button in self._views:
            button.setVisible(self._has_views and not folded)
        self.ghost.setText("" if folded else name_of("ghost"))
        self.two.setText("" if folded else self.tr("A/B"))
        self.vote.show_brief(folded)
        self.first.caption.setText("A" if two else "" if folded else self.tr("Run"))
        # While motion is made the row belongs to its progress: there is no room for both in a small window.
        self.vote.setVisible(two and not self._busy)
        self.second.setVisible(two and not blind)
        self.first.setEnabled(not blind)
        # In a blind vote nothing tells which run is which: no name, and nothing that only one of them has.
        self.first.run.setVisible(not blind)
        self.first.caption.setVisible(not blind and bool(self.first.caption.text()))
        self.first.styles.setVisible(not blind and self.first.styles.count() > 1)
        for widget in (self.first.another, self.first.liveliness):
            widget.setVisible(not blind and self.first.draws)
        self._hidden.setVisible(blind)
        self.two.setVisible(self._can_two and not blind)
        self.move_like_this.setVisible(self._can_show_style and not blind)

    def _first_row(self) -> QHBoxLayout:
        self._no_runs = QPushButton(self.tr("Train a run of your own"))
        self._no_runs.setObjectName("review_go_train")
        theme.as_role(self._no_runs, "quiet")
        self._no_runs.clicked.connect(self.train_requested)
        self.two = QPushButton()
        self.two.setAccessibleName(self.tr("A/B"))
        self.two.setObjectName("review_two")
        self.two.setCheckable(True)
        self.two.setToolTip(self.tr("Compare with a second run or style on the same sound"))
        theme.set_icon(self.two, "mdi6.compare-horizontal", "muted")
        theme.as_role(self.two, "quiet")
        self.two.toggled.connect(lambda _: self._arrange())
        self.two.toggled.connect(self.two_toggled)
        # A picture alone: beside views and ghost there is no room for its name in a small window.
        self.move_like_this = QToolButton()
        self.move_like_this.setObjectName("move_like_this")
        self.move_like_this.setAccessibleName(name_of("move_like_this"))
        self.move_like_this.setToolTip(tip_of("move_like_this"))
        theme.set_icon(self.move_like_this, "mdi6.drama-masks", "muted")
        theme.as_role(self.move_like_this, "quiet")
        self.move_like_this.clicked.connect(self.style_requested)
        self.ghost = QPushButton(name_of("ghost"))
        self.ghost.setObjectName("ghost_button")
        self.ghost.setAccessibleName(name_of("ghost"))
        self.ghost.setCheckable(True)
        theme.set_icon(self.ghost, "mdi6.layers-outline", "muted")
        self.ghost.setToolTip(tip_of("ghost"))
        theme.as_role(self.ghost, "quiet")
        self.ghost.toggled.connect(self.ghost_toggled)
        self._hidden = label(self.tr("A and B in random order"), "muted")
        self._views = self._view_buttons()
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        for widget in (self.first, self._no_runs, self._hidden, self.move_like_this, self.two):
            row.addWidget(widget)
        row.addStretch(1)
        for button in self._views:
            row.addWidget(button)
        row.addWidget(self.ghost)
        return row

    def _second_row(self) -> QHBoxLayout:
        names = ("generate_bar", "generate_text", "cancel_generate")
        self._generating = WorkProgress(names, self.tr("Generating"))
        self._generating.cancelled.connect(self.cancelled)
        names = ("style_bar", "style_text", "cancel_style")
        self.style_progress = WorkProgress(names, self.tr("Watching how this take moves"))
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        for widget in (self.second, self.vote, self._generating, self.style_progress):
            row.addWidget(widget)
        row.addStretch(1)
        return row

    def _view_buttons(self) -> list[QToolButton]:
        """One set for both figures, which share their camera."""
        buttons = []
        for name, text, tip in (
            ("front", self.tr("Front"), self.tr("Look from the front")),
            ("three_quarter", self.tr("Three-quarter"), self.tr("Look from between front and side")),
            ("side", self.tr("Side"), self.tr("Look from the side")),
        ):
            button = QToolButton()
            button.setObjectName(f"review_view_{name}")
            button.setText(text)
            button.setToolTip(tip)
            button.setAccessibleName(tip)
            theme.as_role(button, "chip")
            button.clicked.connect(lambda _=False, view=name: self.view_requested.emit(view))
            button.hide()
            buttons.append(button)
        return buttons
