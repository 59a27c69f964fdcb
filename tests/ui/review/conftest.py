"""What tests of Review share: the tab on the toy project, and who listens to it."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest
from pytestqt.qtbot import QtBot

from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.session import Session

Tab = tuple[ReviewView, ReviewPresenter]


@pytest.fixture
def opened(qtbot: QtBot, session: Session) -> Iterator[Tab]:
    """The tab as it comes up, with nothing read yet."""
    view = ReviewView()
    presenter = ReviewPresenter(view, session)
    qtbot.addWidget(view)
    view.resize(1280, 754)
    view.show()
    presenter.activate()
    yield view, presenter
    presenter.close()


@pytest.fixture
def tab(qtbot: QtBot, opened: Tab) -> Tab:
    """The tab with a take on its stage."""
    _, presenter = opened
    qtbot.waitUntil(lambda: presenter.model.tuned is not None)
    return opened


@pytest.fixture
def listeners() -> Iterator[list[socket.socket]]:
    """Two programs that motion is sent to."""
    found = []
    for _ in range(2):
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(60.0)
        found.append(listener)
    yield found
    for listener in found:
        listener.close()
