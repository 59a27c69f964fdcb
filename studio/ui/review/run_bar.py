"""The bar over Review's stage: which run and style, a second one, the switch, and the blind vote."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QLabel,
    QMenu,
    QProgressBar,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.review.clip import RunChoice, Wanted
from studio.ui.review.vote_bar import VoteBar
from studio.ui.widgets.card import label


class RunChooser(QWidget):
    """A run and, where it knows several, its style.

    Signals:
        chosen: a Wanted.
    """

    chosen = Signal(object)

    def __init__(self, caption: str, name: str, none: str) -> None:
        super().__init__()
        self._none = none
        self._choices: tuple[RunChoice, ...] = ()
        self.run, self.styles = QComboBox(), QComboBox()
        self.run.setObjectName(f"review_run{name}")
        self.run.setAccessibleName(self.tr("Run"))
        self.run.setMinimumWidth(130)
        self.styles.setObjectName(f"review_style{name}")
        self.styles.setAccessibleName(self.tr("Style"))
        self.styles.setMinimumWidth(140)
        self.styles.setToolTip(
            self.tr("Whose way of moving: a take or performer it learnt from, or the average of all")
        )
        self.liveliness = QToolButton()
        self.liveliness.setObjectName(f"review_liveliness{name}")
        self.liveliness.setAccessibleName(self.tr("Liveliness"))
        self.liveliness.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        theme.set_icon(self.liveliness, "mdi6.human-greeting-variant", "muted")
        theme.as_role(self.liveliness, "quiet")
        self.liveliness.setMenu(self._liveliness_menu())
        for box in (self.run, self.styles):  # as wide as its names, narrower where there is no room
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
            box.setMinimumWidth(130 if box is self.run else 100)
            box.setMaximumWidth(240)
        self.another = QToolButton()
        self.another.setObjectName(f"review_another{name}")
        self.another.setAccessibleName(self.tr("Another take"))
        self.another.setToolTip(self.tr("Another take: this run moves a little differently each time"))
        theme.set_icon(self.another, "mdi6.dice-multiple-outline", "muted")
        theme.as_role(self.another, "quiet")
        self.another.clicked.connect(self._on_another)
        self._seed, self._lively = 0, 1.0
        self.caption = label(caption, "muted")
        self.caption.setBuddy(self.run)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        for widget in (self.caption, self.run, self.styles, self.liveliness, self.another):
            row.addWidget(widget)
        self.run.currentIndexChanged.connect(lambda _: self._on_run())
        self.styles.currentIndexChanged.connect(lambda _: self.chosen.emit(self.wanted))

    def _liveliness_menu(self) -> QMenu:
        """How far the body may go from the pose that is expected for the sound."""
        menu, group = QMenu(self), QActionGroup(self)
        for value, title in (
            (0.0, self.tr("As expected")),
            (0.5, self.tr("Calm")),
            (1.0, self.tr("As learnt")),
            (1.5, self.tr("Lively")),
            (2.0, self.tr("Very lively")),
        ):
            action = group.addAction(title)
            action.setCheckable(True)
            action.setData(value)
            menu.addAction(action)
        group.triggered.connect(self._on_liveliness)
        return menu

    @property
    def draws(self) -> bool:
        """Whether the chosen run moves differently with another seed."""
        return any(choice.draws for choice in self._choices if choice.id == self.run.currentData())

    @property
    def wanted(self) -> Wanted:
        """What stands in the boxes."""
        style = str(self.styles.currentData() or "") if self.styles.count() else ""
        return Wanted(str(self.run.currentData() or ""), style, self._seed, self._lively)

    @property
    def manner(self) -> str:
        """What the icons stand at, in words; "" for a run that does not draw its motion."""
        if not self.draws:
            return ""
        chosen = (action.text() for action in self.liveliness.menu().actions() if action.isChecked())
        lively = next(chosen, f"{self._lively:g}").lower()
        return self.tr("Liveliness: {0}. Take {1} of the dice.").format(lively, self._seed + 1)

    def show_runs(self, choices: Sequence[RunChoice], wanted: Wanted) -> None:
        """Fill the boxes."""
        self._choices = tuple(choices)
        with QSignalBlocker(self.run):
            self.run.clear()
            self.run.addItem(self._none, "")
            for choice in choices:
                self.run.addItem(choice.id, choice.id)
            self.run.setCurrentIndex(max(self.run.findData(wanted.run), 0))
        self._seed = wanted.seed
        self._show_liveliness(wanted.liveliness)
        self._show_styles(wanted.style)

    def _on_another(self) -> None:
        self._seed += 1
        self.chosen.emit(self.wanted)

    def _on_liveliness(self, action: QAction) -> None:
        self._show_liveliness(float(action.data()))
        self.chosen.emit(self.wanted)

    def _show_liveliness(self, value: float) -> None:
        self._lively = value
        for action in self.liveliness.menu().actions():
            action.setChecked(action.data() == value)
            if action.data() == value:
                tip = self.tr("Liveliness: {0}. How far the body goes from what is expected for the sound")
                self.liveliness.setToolTip(tip.format(action.text().lower()))

    def _on_run(self) -> None:
        self._seed = 0
        self._show_liveliness(1.0)
        self._show_styles("")
        self.chosen.emit(self.wanted)

    def _show_styles(self, style: str) -> None:
        """The styles of the chosen run, its own choice first."""
        run = next((c for c in self._choices if c.id == self.run.currentData()), None)
        with QSignalBlocker(self.styles):
            self.styles.clear()
            if run is not None and run.styles:
                self.styles.addItem(self.tr("{0} (best)").format(self._title(run.style)), "")
                for name in run.styles:
                    if name != run.style:
                        self.styles.addItem(self._title(name), name)
                self.styles.setCurrentIndex(max(self.styles.findData(style), 0))
        self.styles.setVisible(self.styles.count() > 1)
        self.another.setVisible(self.draws)
        self.liveliness.setVisible(self.draws)

    def _title(self, style: str) -> str:
        return self.tr("average") if style == "average" else style


class RunBar(QWidget):
    """All of it: one row, and a second one while two runs are compared or motion is made.

    Signals:
        chosen: (0 for A or 1 for B, a Wanted).
        two_toggled: whether a second run is wanted.
        front_requested: 0 for A, 1 for B.
        cancelled: stop generating.
        train_requested: there is no run yet.
        ghost_toggled: the button went down or up.
        view_requested: "front", "three_quarter" or "side".
    """

    chosen = Signal(int, object)
    two_toggled = Signal(bool)
    front_requested = Signal(int)
    cancelled = Signal()
    train_requested = Signal()
    ghost_toggled = Signal(bool)
    view_requested = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.first = RunChooser(self.tr("Run"), "", self.tr("No run, captured only"))
        self.second = RunChooser("B", "_b", self.tr("Choose a run"))
        self.first.chosen.connect(lambda wanted: self.chosen.emit(0, wanted))
        self.second.chosen.connect(lambda wanted: self.chosen.emit(1, wanted))
        self._busy = self._can_two = False
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

    def show_runs(self, choices: Sequence[RunChoice], wanted: Sequence[Wanted]) -> None:
        """Fill both choosers.

        Args:
            choices: all runs that can generate.
            wanted: what A and B are to show.
        """
        self.first.show_runs(choices, wanted[0])
        self.second.show_runs(choices, wanted[1])
        self._no_runs.setVisible(not choices)
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
        busy = self._busy = fraction is not None
        for widget in (self._bar, self._text, self._cancel):
            widget.setVisible(busy)
        self._text.setText(text)
        if fraction is not None:
            self._bar.setRange(0, 0 if fraction < 0 else 1000)
            self._bar.setValue(round(1000 * max(fraction, 0.0)))
        self._arrange()

    def show_why(self, text: str) -> None:
        """Say why the chosen run predicts nothing; "" for nothing to say."""
        self._why.setText(text)
        self._why.setVisible(bool(text))

    def show_ghost_choice(self, possible: bool, bones: bool) -> None:
        """Offer the ghost where both motions have bones, the views where any has."""
        self.ghost.setVisible(possible)
        for button in self._views:
            button.setVisible(bones)

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
        self.first.caption.setText("A" if two else self.tr("Run"))
        self.vote.setVisible(two and not self._busy)
        self.second.setVisible(two and not blind)
        self.first.setEnabled(not blind)
        self.first.run.setVisible(not blind)
        self.first.caption.setVisible(not blind)
        self.first.styles.setVisible(not blind and self.first.styles.count() > 1)
        for widget in (self.first.another, self.first.liveliness):
            widget.setVisible(not blind and self.first.draws)
        self._hidden.setVisible(blind)
        self.two.setVisible(self._can_two and not blind)

    def _first_row(self) -> QHBoxLayout:
        self._no_runs = QPushButton(self.tr("Train a run to see it predict"))
        self._no_runs.setObjectName("review_go_train")
        theme.as_role(self._no_runs, "quiet")
        self._no_runs.clicked.connect(self.train_requested)
        self.two = QPushButton(self.tr("A/B"))
        self.two.setObjectName("review_two")
        self.two.setCheckable(True)
        self.two.setToolTip(self.tr("Hold a second run or style beside this one, on the same sound"))
        theme.set_icon(self.two, "mdi6.compare-horizontal", "muted")
        theme.as_role(self.two, "quiet")
        self.two.toggled.connect(lambda _: self._arrange())
        self.two.toggled.connect(self.two_toggled)
        self.ghost = QPushButton(self.tr("Ghost"))
        self.ghost.setObjectName("ghost_button")
        self.ghost.setCheckable(True)
        theme.set_icon(self.ghost, "mdi6.layers-outline", "muted")
        self.ghost.setToolTip(self.tr("Lay the captured figure over the predicted one (G)"))
        theme.as_role(self.ghost, "quiet")
        self.ghost.toggled.connect(self.ghost_toggled)
        self._hidden = label(self.tr("Two runs, in an order of chance"), "muted")
        self._views = self._view_buttons()
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        for widget in (self.first, self._no_runs, self._hidden, self.two):
            row.addWidget(widget)
        row.addStretch(1)
        for button in self._views:
            row.addWidget(button)
        row.addWidget(self.ghost)
        return row

    def _second_row(self) -> QHBoxLayout:
        self._text: QLabel = label("", "caption", "generate_text")
        self._bar = QProgressBar()
        self._bar.setObjectName("generate_bar")
        self._bar.setAccessibleName(self.tr("Generating"))
        self._bar.setTextVisible(False)
        self._bar.setFixedWidth(120)
        self._cancel = QPushButton(self.tr("Cancel"))
        self._cancel.setObjectName("cancel_generate")
        theme.as_role(self._cancel, "quiet")
        self._cancel.clicked.connect(self.cancelled)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self.second)
        row.addWidget(self.vote)
        for widget in (self._bar, self._text, self._cancel):
            row.addWidget(widget, 0, Qt.AlignmentFlag.AlignVCenter)
        row.addStretch(1)
        return row

    def _view_buttons(self) -> list[QToolButton]:
        """One set for both figures, which share their camera."""
        buttons = []
        for name, words, tip in (
            ("front", self.tr("Front"), self.tr("Look from the front")),
            ("three_quarter", "3/4", self.tr("Look from between front and side")),
            ("side", self.tr("Side"), self.tr("Look from the side")),
        ):
            button = QToolButton()
            button.setObjectName(f"review_view_{name}")
            button.setText(words)
            button.setToolTip(tip)
            button.setAccessibleName(tip)
            theme.as_role(button, "chip")
            button.clicked.connect(lambda _=False, view=name: self.view_requested.emit(view))
            button.hide()
            buttons.append(button)
        return buttons
