"""What to fix, in the window: there with one click, out with another, back with undo."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton, QToolButton
from pytestqt.qtbot import QtBot

from studio.dataset.suggest import WorstSpan
from studio.motion import Motion
from studio.project import Project
from studio.take import TakeInfo
from studio.ui.curate.presenter import CuratePresenter
from studio.ui.curate.view import CurateView
from studio.ui.session import Session

LEFT = Qt.MouseButton.LeftButton
LONG = 30_000


class Room:
    def __init__(self, qtbot: QtBot, project: Project) -> None:
        self.qtbot, self.session = qtbot, Session()
        self.session.project = project
        self.view = CurateView()
        self.presenter = CuratePresenter(self.view, self.session)
        qtbot.addWidget(self.view)
        self.view.resize(1280, 748)
        self.view.show()
        self.presenter.activate()

    def button(self, name: str) -> QPushButton | QToolButton | None:
        """The one that is shown; those of an earlier list may still wait to be deleted."""
        for kind in (QPushButton, QToolButton):
            for found in self.view.findChildren(kind, name):
                if found.isVisible():
                    return found
        return None

    def click(self, name: str) -> None:
        self.qtbot.waitUntil(lambda: self.button(name) is not None, timeout=LONG)
        button = self.button(name)
        assert button is not None
        self.qtbot.mouseClick(button, LEFT)


def _gappy(project: Project, folder: Path, name: str, gap: float) -> None:
    times = np.concatenate([np.arange(0, 3, 1 / 30), np.arange(3 + gap, 8, 1 / 30)])
    motion = Motion.build(times, ("A",), np.sin(7 * times)[:, None] ** 2)
    sound = folder / "a.wav"
    soundfile.write(
        sound, (np.random.default_rng(1).normal(size=16_000 * 8) * 0.1).astype(np.float32), 16_000
    )
    project.add_take(name, TakeInfo(name), motion, sound)


@pytest.fixture
def room(qtbot: QtBot, tmp_path: Path) -> Iterator[Room]:
    project = Project.create(tmp_path / "P")
    for name, gap in (("fine", 0.0), ("gappy", 2.0)):
        _gappy(project, tmp_path, name, gap)
    made = Room(qtbot, project)
    yield made
    made.presenter.close()


def _gap(room: Room) -> int:
    """Which row of the list is the gap."""
    from studio.dataset.suggest import suggest

    assert room.session.project is not None
    durations = {take.id: take.info.duration for take in room.session.project.takes}
    found = suggest(room.presenter.model.dataset, durations, room.presenter.model.reports)
    return [(one.selection, one.kind) for one in found].index(("gappy", "gap"))


def test_one_click_goes_to_the_place_and_one_leaves_it_out(room: Room) -> None:
    room.click("to_fix_button")
    room.qtbot.waitUntil(lambda: len(room.presenter.model.reports) == 2, timeout=LONG)
    room.presenter.suggestions.show()
    number = _gap(room)
    room.click(f"suggestion_{number}_go")
    timeline = room.view.bench.timeline
    room.qtbot.waitUntil(lambda: timeline.span is not None, timeout=LONG)
    assert room.view.library.current == "gappy"
    assert timeline.span == pytest.approx((3.0, 5.0), abs=0.1)
    room.click(f"suggestion_{number}_exclude")
    assert room.session.project is not None
    assert room.presenter.model.dataset["gappy"].excluded == (pytest.approx((3.0, 5.0), abs=0.1),)
    assert room.session.project.undo_name == "Exclude a span of gappy"
    room.session.undo()
    assert room.presenter.model.dataset["gappy"].excluded == ()


def test_a_take_that_chips_hide_is_shown_all_the_same(room: Room) -> None:
    room.view.library.search.setText("fine")
    room.qtbot.waitUntil(lambda: room.view.library.filter.rowCount() == 1, timeout=LONG)
    room.view.library.reveal("gappy")
    assert room.view.library.current == "gappy"
    assert room.view.library.filter.rowCount() == 2


def test_spans_of_a_run_are_listed_with_their_run(room: Room) -> None:
    room.presenter.suggestions.show_errors_of("best_001", {"fine": (WorstSpan(1.0, 2.0, 9.0),)})
    room.click("to_fix_button")
    shown = [button.text() for button in room.view.library.suggestions.findChildren(QToolButton)]
    assert "fine  00:01.0" in shown


def test_without_a_run_there_is_nothing_to_compare_with(room: Room) -> None:
    room.click("to_fix_button")
    assert not room.view.library.suggestions.compare.isVisible()
