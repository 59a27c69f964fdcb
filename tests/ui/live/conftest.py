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
from tests.inference.live.runs import add_run
from tests.ui.live.children import FakeChild, Room


@pytest.fixture
def room(qtbot: QtBot) -> Iterator[Callable[..., Room]]:
    """Builds the tab, shown; the call takes the project, the child where it is to be none, and settings."""
    made: list[LivePresenter] = []

    def build(project: Project | None, child: FakeChild | None = None, **settings: object) -> Room:
        session = Session(Settings().changed(**settings))
        session.project = project
        view = LiveView()
        presenter = LivePresenter(view, session, child)  # type: ignore[arg-type]
        made.append(presenter)
        qtbot.addWidget(view, before_close_func=lambda _: presenter.close())
        view.resize(1200, 760)
        view.show()
        presenter.activate()
        return view, presenter, session

    yield build
    for presenter in made:
        presenter.close()


@pytest.fixture
def child() -> FakeChild:
    """Performs nothing."""
    return FakeChild()


@pytest.fixture
def performing(room: Callable[..., Room], toy_project: Project, child: FakeChild) -> Room:
    """The tab, live with a child that says only what a test has it say."""
    add_run(toy_project)
    built = room(toy_project, child)
    built[0].source.start.click()
    return built
