"""What tests of Record share: the tab of an empty project, listening on a port of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from studio.settings import NO_MICROPHONE
from studio.ui import tasks, theme
from studio.ui.record.presenter import RecordPresenter
from studio.ui.record.view import RecordView
from studio.ui.session import Session
from tests.ports import free_port


@pytest.fixture
def tab(qtbot, qapp, tmp_path: Path) -> Iterator[tuple[RecordView, RecordPresenter, Session]]:
    theme.apply(qapp)
    session = Session()
    session.change_settings(vmc_port=free_port(), audio_device=NO_MICROPHONE)
    session.create_project(tmp_path / "Project")
    view = RecordView()
    qtbot.addWidget(view)
    presenter = RecordPresenter(view, session)
    view.resize(1280, 750)
    view.show()
    presenter.activate()
    qtbot.waitUntil(
        lambda: presenter.model.recorder is not None and bool(presenter.model.recorder.snapshot().ports)
    )
    yield view, presenter, session
    view.trackers.reject()
    presenter.close()
    tasks.wait()
