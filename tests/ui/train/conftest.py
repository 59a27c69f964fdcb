"""What tests of Train share: the tab as it stands in the window, on the toy project."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from pytestqt.qtbot import QtBot

from studio.dataset import balance
from studio.ui.session import Session
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.view import TrainView
from tests.fakes import FakeChildTask


@pytest.fixture
def child() -> FakeChildTask | None:
    """What runs the training: a real child here; a file of tests may give a fake one."""
    return None


@pytest.fixture
def tab(
    qtbot: QtBot, session: Session, child: FakeChildTask | None
) -> Iterator[tuple[TrainView, TrainPresenter]]:
    """The tab, shown."""
    view = TrainView()
    presenter = TrainPresenter(view, session, child)
    qtbot.addWidget(view, before_close_func=lambda _: presenter.close())
    view.resize(1280, 754)
    view.show()
    presenter.activate()
    yield view, presenter
    presenter.close()


@pytest.fixture
def enough_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Toys of six seconds count as enough to keep one of them back."""
    monkeypatch.setattr(balance, "FEW_TAKES", 1)
    monkeypatch.setattr(balance, "FEW_SECONDS", 0.0)
