"""The Train tab: what there is to learn from, which preset, the curves while it learns, and all runs."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QPushButton,
    QScrollArea,
    QStackedLayout,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.shortcuts import name_of, pressed, tip_of
from studio.ui.train.data_view import DataCard
from studio.ui.train.progress_view import ProgressCard
from studio.ui.train.recipe_view import RecipeCard
from studio.ui.train.runs_view import RunsCard
from studio.ui.widgets.card import EmptyState


class _Cards(QWidget):
    """Cards that wrap words and are laid out by their least height: what holds them else gives them all the
    height the words could use, or less than they need."""

    def hasHeightForWidth(self) -> bool:
        return False


class TrainView(QWidget):
    """The tab's cards, and what is seen in their place before there is anything to learn from.

    Signals:
        record_requested: go to that tab.
        import_requested: bring in a run of another computer, into a project that has no takes.
    """

    record_requested = Signal()
    import_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self.data, self.recipe, self.progress, self.runs = (
            DataCard(),
            RecipeCard(),
            ProgressCard(),
            RunsCard(),
        )
        self.empty = EmptyState(
            "mdi6.school-outline",
            self.tr("Training learns from takes. Record a take, or import a run made elsewhere."),
            self.tr("Record a take"),
            "train_go_record",
        )
        self.empty.clicked.connect(self.record_requested)
        self._import = QPushButton(name_of("import_run"))
        self._import.setObjectName("train_import_run")
        theme.as_role(self._import, "quiet")
        self._import.clicked.connect(self.import_requested)
        column = self.empty.layout()
        assert isinstance(column, QVBoxLayout)
        # Before the stretch that keeps the rest in the middle.
        column.insertWidget(column.count() - 1, self._import, 0, Qt.AlignmentFlag.AlignHCenter)
        cards = _Cards()
        page = QWidget()
        page.setObjectName("scrolled")
        around = QVBoxLayout(page)
        around.setContentsMargins(0, 0, 0, 0)
        around.addWidget(cards)
        # It fits the smallest window; what is opened in there, drawer or log, scrolls.
        scroll = QScrollArea()
        scroll.setObjectName("train_scroll")
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        scroll.setWidget(page)
        self.cards = cards
        self._stack = QStackedLayout(self)
        self._stack.addWidget(self.empty)
        self._stack.addWidget(scroll)
        rows = QVBoxLayout(cards)
        rows.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        rows.setSpacing(12)
        head = _Cards()
        top = QHBoxLayout(head)
        top.setContentsMargins(0, 0, 0, 0)
        top.setSpacing(12)
        top.addWidget(self.data, 4)
        top.addWidget(self.recipe, 9)
        rows.addWidget(head)
        for card, share in ((self.progress, 3), (self.runs, 2)):
            held = _Cards()
            inside = QVBoxLayout(held)
            inside.setContentsMargins(0, 0, 0, 0)
            inside.addWidget(card)
            rows.addWidget(held, share)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go back: close one thing that was opened at each press."""
        if pressed(event, "train") != "close_opened":
            super().keyPressEvent(event)
            return
        opened = (self.runs.details, self.progress.details, self.recipe.advanced)
        button = next((one for one in opened if one.isChecked()), None)
        if button is not None:
            button.setChecked(False)
        self.setFocus()

    def show_empty(self, empty: bool) -> None:
        """Show the empty state, or the cards."""
        self._stack.setCurrentIndex(0 if empty else 1)

    def show_locked(self, reason: str) -> None:
        """Why no run can be brought in here; "" where it can."""
        self._import.setEnabled(not reason)
        self._import.setToolTip(reason or tip_of("import_run"))
