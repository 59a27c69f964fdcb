"""The five rooms: which there are, and how each is built when it is first needed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtWidgets import QLabel, QTabBar, QWidget

from studio.actions import TABS
from studio.ui import theme
from studio.ui.session import Session
from studio.ui.status_strip import BRIEF, SYMBOLS, WHOLE, StatusStrip
from studio.ui.undo import UndoScope

NAMES = TABS
ICONS = {
    "record": "mdi6.record-circle-outline",
    "curate": "mdi6.playlist-edit",
    "train": "mdi6.chart-bell-curve-cumulative",
    "review": "mdi6.play-circle-outline",
    "live": "mdi6.account-voice",
}


DOT_PX = 8
ICON_GAP_PX = 4
"""Between a tab's icon and its words."""


class NewsDots(QObject):
    """A dot on each tab where something is new, until the tab is seen.

    Args:
        bar: the tabs, in the order of NAMES.
        session: tells of news.
    """

    def __init__(self, bar: QTabBar, session: Session) -> None:
        super().__init__(bar)
        self._bar = bar
        session.news_changed.connect(self._on_news)
        session.project_opened.connect(self._forget)
        bar.currentChanged.connect(lambda index: self._show(index, ""))

    def _on_news(self, name: str, what: str) -> None:
        index = NAMES.index(name)
        # What is in front of somebody is seen.
        if index != self._bar.currentIndex() or not what:
            self._show(index, what)

    def _forget(self) -> None:
        for index in range(self._bar.count()):
            self._show(index, "")

    def _show(self, index: int, what: str) -> None:
        dot = None
        if what:
            dot = QLabel()
            dot.setObjectName("news_dot")
            dot.setPixmap(theme.icon("mdi6.circle", "good").pixmap(DOT_PX, DOT_PX))
            dot.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
            dot.setAccessibleName(what)
        elif self._bar.tabButton(index, QTabBar.ButtonPosition.RightSide) is None:
            return
        self._bar.setTabButton(index, QTabBar.ButtonPosition.RightSide, dot)
        self._bar.setTabToolTip(index, what)


class Folding(QObject):
    """Lets tabs and facts share one row: the facts fold to symbols first, then the tabs to their icons.

    Args:
        bar: the tabs, in the order of NAMES.
        status: the facts.
        place: what lies between the tabs and the row's end, with the facts in it.
    """

    def __init__(self, bar: QTabBar, status: StatusStrip, place: QWidget) -> None:
        super().__init__(bar)
        self._bar, self._status, self._place = bar, status, place
        self._words = [bar.tabText(index) for index in range(bar.count())]
        for watched in (bar, place):
            watched.installEventFilter(self)
        status.changed.connect(self.fit)
        bar.currentChanged.connect(self.fit)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() in (QEvent.Type.Resize, QEvent.Type.Show, QEvent.Type.LayoutRequest):
            self.fit()
        return False

    def fit(self) -> None:
        """Show as many words as there is room for."""
        bar, status = self._bar, self._status
        room = self._place.geometry().right() - bar.x() - theme.INSIDE
        icons = bar.isVisible() and self._width(whole=True) + status.width_at(SYMBOLS) > room
        left = room - self._width(whole=not icons)
        status.fold(next((one for one in (WHOLE, BRIEF) if status.width_at(one) <= left), SYMBOLS))
        for index, words in enumerate(self._words):
            text = "" if icons and index != bar.currentIndex() else words
            if text != bar.tabText(index):
                bar.setTabText(index, text)
                bar.setAccessibleTabName(index, words)
                bar.setTabToolTip(index, bar.tabToolTip(index) or ("" if text else words))

    def _width(self, whole: bool) -> int:
        """Pixels of the tabs with all their words, or with the shown one's alone."""
        bar = self._bar
        if not bar.isVisible():
            return 0
        width = bar.sizeHint().width()
        for index, words in enumerate(self._words):
            wanted = words if whole or index == bar.currentIndex() else ""
            shown = bar.tabText(index)
            if wanted != shown:
                room = bar.fontMetrics().horizontalAdvance(words) + ICON_GAP_PX
                width += room if wanted else -room
        return width


class Presenter(Protocol):
    """What the window asks of a room's presenter."""

    @property
    def undo_scope(self) -> UndoScope:
        """What Undo and Redo act on while the room is shown."""

    def activate(self) -> None:
        """The room is shown: live data may be pulled."""

    def deactivate(self) -> None:
        """Another room is shown: timers rest. A recording or a training goes on."""

    def close(self) -> None:
        """The window closes: let go of devices, children and OpenGL."""


def build(name: str, session: Session) -> tuple[QWidget, Presenter]:
    """The view and the presenter of a room."""
    view, presenter = _BUILDERS[name](session)
    view.setObjectName(f"{name}_view")
    return view, presenter


def _record(session: Session) -> tuple[QWidget, Presenter]:
    # Here and below: a tab's modules are imported when it is first shown, so that the window opens fast.
    from studio.ui.record.presenter import RecordPresenter
    from studio.ui.record.view import RecordView

    view = RecordView()
    return view, RecordPresenter(view, session)


def _curate(session: Session) -> tuple[QWidget, Presenter]:
    from studio.ui.curate.presenter import CuratePresenter
    from studio.ui.curate.view import CurateView

    view = CurateView()
    return view, CuratePresenter(view, session)


def _train(session: Session) -> tuple[QWidget, Presenter]:
    from studio.ui.train.presenter import TrainPresenter
    from studio.ui.train.view import TrainView

    view = TrainView()
    return view, TrainPresenter(view, session)


def _review(session: Session) -> tuple[QWidget, Presenter]:
    from studio.ui.review.presenter import ReviewPresenter
    from studio.ui.review.view import ReviewView

    view = ReviewView()
    return view, ReviewPresenter(view, session)


def _live(session: Session) -> tuple[QWidget, Presenter]:
    from studio.ui.live.presenter import LivePresenter
    from studio.ui.live.view import LiveView

    view = LiveView()
    return view, LivePresenter(view, session)


_BUILDERS: dict[str, Callable[[Session], tuple[QWidget, Presenter]]] = {
    "record": _record, "curate": _curate, "train": _train, "review": _review,
    "live": _live,
}  # fmt: skip
