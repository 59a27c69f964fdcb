"""Layout of the Curate tab: library, figure, inspector, and one timeline below; and its keys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from PySide6.QtCore import QEvent, QObject, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QMenu,
    QSplitter,
    QStackedLayout,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.curate.bench_view import Bench
from studio.ui.curate.inspector_view import Inspector
from studio.ui.curate.library_view import Library
from studio.ui.curate.take_table import split_title
from studio.ui.shortcuts import pressed
from studio.ui.widgets.card import Card, EmptyState
from studio.ui.widgets.figure.pane import Pane

_SHIFT, _CTRL, _ALT = (
    Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.AltModifier,
)  # fmt: skip

_GOING = frozenset({"step_back", "step_forward", "first_frame", "last_frame"})


class CurateView(QWidget):
    """Everything in the tab.

    Signals:
        step_requested: (frames, whether to select on the way).
        edge_requested: (-1 the start or 1 the end, whether to select on the way).
        mark_requested: "in" or "out" at the playhead.
        word_pressed, word_released: a key 1..9 went down or up.
        delete_requested: the label or span that is selected is to go.
        menu_chosen: (what, value) from the context menu.
        record_requested: a take is to be recorded.
    """

    step_requested = Signal(int, bool)
    edge_requested = Signal(int, bool)
    mark_requested = Signal(str)
    word_pressed = Signal(int)
    word_released = Signal(int)
    delete_requested = Signal()
    menu_chosen = Signal(str, object)
    record_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.library = Library()
        empty = self.tr("Select a take to see it move.")
        self.stage = Pane("curate_stage", "", empty, "mdi6.human", "figure")
        self.inspector = Inspector()
        self.bench = Bench()
        bench, mark = self.bench, self.mark_requested
        # These work while a number box has the keyboard too, which has no use for letters.
        self._letters: dict[str, Callable[[], object]] = {
            "play": bench.play_requested.emit,
            "in_point": lambda: mark.emit("in"),
            "out_point": lambda: mark.emit("out"),
            "loop": bench.loop.click,
            "exclude": bench.exclude.click,
            "compare_cleaning": bench.clean.compared.emit,
            "sound_picture": bench.picture.click,
            "zoom_fit": bench.timeline.fit,
            "go_back": self._go_back,
        }
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._stack = QStackedLayout(self)
        self._stack.addWidget(self._build_page())
        self._stack.addWidget(self._build_empty())
        for control in (*self.findChildren(QAbstractButton), *self.findChildren(QAbstractSpinBox)):
            control.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Give the timeline its keys while a button or a number box has the focus.

        Buttons would use arrows to pass the focus on, and a number box would swallow Space and letters.
        """
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            action = pressed(event, "curate")
            if isinstance(watched, QAbstractButton) and action in _GOING:
                return self._handle(event)
            if isinstance(watched, QAbstractSpinBox) and action in self._letters and not event.modifiers():
                return self._handle(event)
        return super().eventFilter(watched, event)

    def show_empty(self, empty: bool) -> None:
        """Show what goes here and the buttons that bring it, or the page itself."""
        self._stack.setCurrentIndex(1 if empty else 0)

    def show_menu(self, place: QPoint, performers: Sequence[str], locked: bool, editable: bool) -> None:
        """The context menu of the selected rows, at a screen position."""
        menu = QMenu(self)
        menu.setObjectName("take_menu")
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        use = menu.addMenu(self.tr("Use for"))
        for split in ("train", "val", "test", ""):
            self._offer(use, split_title(split), "split", split)
        stars = menu.addMenu(self.tr("Stars"))
        for count in range(6):
            self._offer(stars, "★" * count or self.tr("none"), "stars", count)
        who = menu.addMenu(self.tr("Performer"))
        for name in performers:
            self._offer(who, name, "performer", name)
        self._offer(who, self.tr("Someone else…"), "ask", "performer")
        self._offer(menu, self.tr("Tags…"), "ask", "tags")
        self._offer(
            menu, self.tr("Unlock") if locked else self.tr("Keep as test takes"), "locked", not locked
        )
        menu.addSeparator()
        self._offer(menu, self.tr("Align by mouth and voice"), "align", None)
        self._offer(menu, self.tr("Align by claps"), "align", "clap")
        self._offer(menu, self.tr("Check again"), "check", None)
        self._offer(menu, self.tr("Open folder"), "folder", None)
        menu.addSeparator()
        self._offer(menu, self.tr("Remove"), "remove", None)
        for action in menu.actions():
            action.setEnabled(editable or action.text() == self.tr("Open folder"))
        menu.popup(place)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keys that nothing else in the tab used."""
        if not self._handle(event):
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """A word's key ends its label."""
        action = pressed(event, "curate")
        if action.startswith("label_") and not event.isAutoRepeat():
            self.word_released.emit(int(action[-1]))
        else:
            super().keyReleaseEvent(event)

    def _handle(self, event: QKeyEvent) -> bool:
        action, held = pressed(event, "curate"), event.modifiers()
        shift = bool(held & _SHIFT)
        steps = 100 if held & _CTRL and held & _ALT else 4 if held & _CTRL else 1
        if action in ("step_back", "step_forward"):
            self.step_requested.emit(-steps if action == "step_back" else steps, shift)
        elif action in ("first_frame", "last_frame"):
            self.edge_requested.emit(-1 if action == "first_frame" else 1, shift)
        elif held & (_CTRL | _ALT):
            return False
        elif action.startswith("label_"):
            if not event.isAutoRepeat():
                self.word_pressed.emit(int(action[-1]))
        else:
            return self._handle_letter(action)
        return True

    def _handle_letter(self, action: str) -> bool:
        bench = self.bench
        if action in self._letters:
            self._letters[action]()
        elif action in ("zoom_in", "zoom_out"):
            bench.timeline.zoom(2.0 if action == "zoom_out" else 0.5)
        elif action == "remove_marked":
            self.delete_requested.emit()
        else:
            return False
        return True

    def _go_back(self) -> None:
        """Leave what was opened last, one at each press: a question, the list to fix, a search."""
        library, question = self.library, self.bench.question
        if question.isVisible():
            question.dropped.emit()
        elif library.fix_button.isChecked():
            library.fix_button.setChecked(False)
        else:
            library.search.clear()
        self.setFocus()

    def _offer(self, menu: QMenu, text: str, what: str, value: object) -> None:
        action = menu.addAction(text)
        action.setObjectName(f"menu_{what}_{value}" if value is not None else f"menu_{what}")
        action.triggered.connect(partial(self._on_offer, what, value))

    def _on_offer(self, what: str, value: object, _checked: bool = False) -> None:
        self.menu_chosen.emit(what, value)

    def _build_page(self) -> QWidget:
        stage = Card()
        stage.layout().setContentsMargins(1, 1, 1, 1)  # type: ignore[union-attr]
        stage.body.addWidget(self.stage)
        top = QSplitter(Qt.Orientation.Horizontal)
        top.setObjectName("curate_top")
        for widget, stretch in ((self.library, 6), (stage, 3), (self.inspector, 0)):
            top.addWidget(widget)
            top.setStretchFactor(top.count() - 1, stretch)
        self.library.setMinimumWidth(420)
        stage.setMinimumWidth(190)
        self.inspector.setMinimumWidth(290)
        top.setSizes([700, 250, 300])
        whole = QSplitter(Qt.Orientation.Vertical)
        whole.setObjectName("curate_whole")
        whole.addWidget(top)
        whole.addWidget(self.bench)
        whole.setStretchFactor(0, 1)
        whole.setStretchFactor(1, 1)
        whole.setSizes([350, 370])
        for splitter in (top, whole):
            splitter.setHandleWidth(theme.PAGE)
            splitter.setChildrenCollapsible(False)
        page = QWidget()
        page.setObjectName("page")
        column = QVBoxLayout(page)
        column.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        column.addWidget(whole)
        return page

    def _build_empty(self) -> QWidget:
        sentence = self.tr("Your takes will appear here, ready to trim, label and split for training.")
        empty = EmptyState("mdi6.playlist-edit", sentence, self.tr("Record a take"), "empty_record_button")
        empty.clicked.connect(self.record_requested)
        other = self.library.build_import("empty_import_button")
        other.setIconSize(QSize(16, 16))
        column = empty.layout()
        assert isinstance(column, QVBoxLayout)
        column.insertWidget(column.count() - 1, other, 0, Qt.AlignmentFlag.AlignHCenter)
        return empty
