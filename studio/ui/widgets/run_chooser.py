"""Which run makes the motion: the run, its style, how lively, and another throw of the dice."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QMenu, QToolButton, QWidget

from studio.training.styles import RunChoice, RunSelection
from studio.ui import theme
from studio.ui.language import native
from studio.ui.widgets.card import CutComboBox, label


class RunChooser(QWidget):
    """A run and, where it knows several, its style.

    Signals:
        chosen: a RunSelection.
    """

    chosen = Signal(object)

    def __init__(self, caption: str, name: str, none: str) -> None:
        super().__init__()
        self._none = none
        self._choices: tuple[RunChoice, ...] = ()
        self.run, self.styles = CutComboBox(), CutComboBox()
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
            box.setMinimumWidth(130 if box is self.run else 116)
            box.setMaximumWidth(240)
        self.another = QToolButton()
        self.another.setObjectName(f"review_another{name}")
        self.another.setAccessibleName(self.tr("Another variation"))
        self.another.setToolTip(self.tr("Another variation: this run moves a little differently each time"))
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
    def wanted(self) -> RunSelection:
        """What stands in the boxes."""
        style = str(self.styles.currentData() or "") if self.styles.count() else ""
        return RunSelection(str(self.run.currentData() or ""), style, self._seed, self._lively)

    @property
    def manner(self) -> str:
        """What the icons stand at, in words; "" for a run that does not draw its motion."""
        if not self.draws:
            return ""
        chosen = (action.text() for action in self.liveliness.menu().actions() if action.isChecked())
        lively = next(chosen, f"{self._lively:g}").lower()
        return self.tr("Liveliness: {0}. Variation {1}.").format(lively, self._seed + 1)

    def show_runs(self, choices: Sequence[RunChoice], wanted: RunSelection) -> None:
        """Fill the boxes."""
        self._choices = tuple(choices)
        with QSignalBlocker(self.run):
            self.run.clear()
            self.run.addItem(self._none, "")
            for choice in choices:
                self.run.addItem(native(choice.title), choice.id)
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
                self.styles.addItem(self.tr("{0} (usual)").format(self._title(run.style)), "")
                for name in run.styles:
                    if name != run.style:
                        self.styles.addItem(self._title(name), name)
                self.styles.setCurrentIndex(max(self.styles.findData(style), 0))
        self.styles.setVisible(self.styles.count() > 1)
        self.another.setVisible(self.draws)
        self.liveliness.setVisible(self.draws)

    def _title(self, style: str) -> str:
        return self.tr("average") if style == "average" else style
