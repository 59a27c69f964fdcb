"""A take is recorded with the microphone that Live listens to: both go on."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui import tasks
from studio.ui.live.presenter import LivePresenter
from studio.ui.live.view import LiveView
from studio.ui.record.presenter import RecordPresenter
from studio.ui.record.view import RecordView
from tests.inference.live.runs import add_run
from tests.ports import free_port
from tests.ui.live.children import Room


def performs(view: LiveView, live: LivePresenter) -> bool:
    """Whether poses come and the microphone gives sound, silent or not."""
    return bool(view.meters.shown_names) and live.model.state is not None and not live.model.state.lost


@pytest.mark.slow
def test_a_take_is_recorded_while_live(
    room: Callable[..., Room], toy_project: Project, qtbot: QtBot, virtual_audio: str
) -> None:
    add_run(toy_project)
    view, live, session = room(toy_project, vmc_port=free_port(), countdown=0.0, pre_roll=0.0, slate="Both")
    record_view = RecordView()
    record = RecordPresenter(record_view, session)
    qtbot.addWidget(record_view, before_close_func=lambda _: record.close())
    record_view.show()
    record.activate()
    qtbot.waitUntil(lambda: record.model.recorder is not None and record_view.slate_bar.record.isEnabled())
    recorder = record.model.recorder
    assert recorder is not None
    qtbot.waitUntil(lambda: recorder.snapshot().audio_alive)
    with qtbot.waitSignal(session.microphones_listed):  # though Record has one open
        view.source.refresh.click()
    qtbot.waitUntil(lambda: recorder.snapshot().audio_alive)
    view.source.start.click()
    qtbot.waitUntil(lambda: performs(view, live))
    record_view.slate_bar.record.click()
    qtbot.waitUntil(lambda: session.rolling)
    qtbot.waitUntil(lambda: recorder.snapshot().elapsed > 1.0)
    view.meters.clear()  # what came before does not count
    live.model.state = None
    qtbot.waitUntil(lambda: performs(view, live))
    record_view.slate_bar.record.click()
    qtbot.waitUntil(lambda: len(toy_project.takes) == 4)
    take = next(take for take in toy_project.takes if take.id.startswith("Both"))
    assert take.audio_path is not None
    assert 0.5 < take.info.audio_seconds <= take.info.duration + 0.01
    assert live.model.task.running
    view.source.start.click()
    qtbot.waitUntil(lambda: not live.model.task.running)
    record.close()
    tasks.wait()
