"""Switches between two runs and asks which is better, without saying which is which."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QLabel, QPushButton, QToolButton, QWidget

from studio.ui import theme
from studio.ui.widgets.card import label


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
        self._order: tuple[int, int] | None = None  # which run hides behind 1 and which behind 2
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
            button.setToolTip(self.tr("Switch at once, while it plays (B)"))
            button.clicked.connect(lambda _=False, i=place: self.front_requested.emit(self._side_at(i)))
            group.addButton(button)
            row.addWidget(button)
            self.sides.append(button)
        self.begin_button = self._button("blind_vote", self.tr("Blind vote"), "mdi6.eye-off-outline")
        self.begin_button.setToolTip(self.tr("Judge the two without knowing which is which"))
        self.begin_button.clicked.connect(self.vote_requested)
        self._result: QLabel = label("", "caption", "vote_result")
        self.answers: list[QPushButton] = []
        for name, words, answer in (
            ("vote_1", self.tr("1 is better"), 0),
            ("vote_2", self.tr("2 is better"), 1),
            ("vote_none", self.tr("No difference"), -1),
        ):
            choice = QPushButton(words)
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

    def other(self) -> None:
        """Switch to the one that is not seen."""
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

    def _button(self, name: str, words: str, icon: str = "") -> QPushButton:
        button = QPushButton(words)
        button.setObjectName(name)
        theme.as_role(button, "quiet")
        if icon:
            theme.set_icon(button, icon, "muted")
        return button
