"""The Live tab on a project."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.settings import Settings
from studio.ui.live.presenter import LivePresenter
from studio.ui.live.view import LiveView
from studio.ui.session import Session
from tests.ui.live.children import Room


@pytest.fixture
def room(qtbot: QtBot) -> Iterator[Callable[..., Room]]:
    """Builds the tab, shown; the call takes the project and settings."""
    made: list[LivePresenter] = []

    def build(project: Project | None, **settings: object) -> Room:
        session = Session(Settings().changed(**settings))
        session.project = project
        view = LiveView()
        presenter = LivePresenter(view, session)
        made.append(presenter)
        qtbot.addWidget(view, before_close_func=lambda _: presenter.close())
        view.resize(1200, 760)
        view.show()
        presenter.activate()
        return view, presenter, session

    yield build
    for presenter in made:
        presenter.close()
