"""The five rooms: which there are, and how each is built when it is first needed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from PySide6.QtWidgets import QWidget

from studio.actions import TABS
from studio.ui.session import Session
from studio.ui.undo import UndoScope

NAMES = TABS
ICONS = {
    "record": "mdi6.record-circle-outline",
    "curate": "mdi6.playlist-edit",
    "train": "mdi6.chart-bell-curve-cumulative",
    "review": "mdi6.play-circle-outline",
    "live": "mdi6.account-voice",
}


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
