"""What to fix, in the window: there with one click, out with another, back with undo."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton, QToolButton
from pytestqt.qtbot import QtBot

from studio.dataset import edits
from studio.dataset.suggest import WorstSpan
from studio.motion import Motion
from studio.project import Project
from studio.take import TakeInfo
from studio.ui.curate.presenter import CuratePresenter
from studio.ui.curate.view import CurateView
from studio.ui.session import Session
from tests.formats.examples import a_sound

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
    for name, gap in (("fine", 0.0), ("gappy", 0.9)):
        _gappy(project, tmp_path, name, gap)
    made = Room(qtbot, project)
    yield made
    made.presenter.close()


def _gap(room: Room) -> int:
    """Which row of the list is the gap."""
    from studio.dataset.suggest import grouped, suggest

    assert room.session.project is not None
    durations = {take.id: take.info.duration for take in room.session.project.takes}
    found = grouped(suggest(room.presenter.model.dataset, durations, room.presenter.model.reports))
    return [(row[0].selection, row[0].kind) for row in found].index(("gappy", "gap"))


def test_one_click_goes_to_the_place_and_one_leaves_it_out(room: Room) -> None:
    room.click("to_fix_button")
    room.qtbot.waitUntil(lambda: len(room.presenter.model.reports) == 2, timeout=LONG)
    room.presenter.suggestions.show()
    number = _gap(room)
    room.click(f"suggestion_{number}_go")
    timeline = room.view.bench.timeline
    room.qtbot.waitUntil(lambda: timeline.span is not None, timeout=LONG)
    assert room.view.library.current == "gappy"
    assert timeline.span == pytest.approx((3.0, 3.9), abs=0.1)
    room.click(f"suggestion_{number}_exclude")
    assert room.session.project is not None
    assert room.presenter.model.dataset["gappy"].excluded == (pytest.approx((3.0, 3.9), abs=0.1),)
    assert room.session.project.undo_name == "Exclude a span of gappy"
    room.session.undo()
    assert room.presenter.model.dataset["gappy"].excluded == ()


def test_equal_findings_are_one_row_with_one_action_and_one_step(qtbot: QtBot, tmp_path: Path) -> None:
    project = Project.create(tmp_path / "P")
    names = tuple(f"radio_{number}" for number in range(1, 9))
    for name in names:
        project.add_take(name, TakeInfo(name, source="imported"), None, a_sound(tmp_path / "a.wav", 2.0))
    # As in projects of a time when every new take was marked so.
    project.edit("Train", edits.set_split(project.dataset, names, "train"))
    made = Room(qtbot, project)
    room_list = made.view.library.suggestions
    made.click("to_fix_button")
    qtbot.waitUntil(lambda: len(made.presenter.model.reports) == len(names), timeout=LONG)
    made.presenter.suggestions.show()

    def shown() -> list[str]:
        return [one.text() for one in room_list.findChildren(QLabel) if one.isVisible()]

    qtbot.waitUntil(lambda: "8 takes have no motion." in shown())
    assert "radio_1, radio_2, radio_3, radio_4, radio_5, radio_6 and 2 more" in shown()
    rows = [one for one in room_list.findChildren(QPushButton) if one.text() == "Do not use"]
    assert made.view.library.fix_button.text() == f"To fix ({sum(one.isVisible() for one in rows)})"
    before = project.dataset
    made.click("suggestion_0_exclude")
    assert {s.split for s in project.dataset.selections} == {""}
    assert project.undo_name == "Leave 8 takes out"
    made.presenter.suggestions.show()
    assert made.view.library.fix_button.text() == "To fix"
    qtbot.waitUntil(lambda: "8 takes are not used: training needs both sound and motion." in shown())
    made.click("suggestion_0_go")
    assert made.view.library.table.isVisible()
    assert made.view.library.chosen == names
    made.session.undo()
    assert project.dataset == before
    made.presenter.close()


def test_a_take_that_chips_hide_is_shown_all_the_same(room: Room) -> None:
    room.view.library.search.setText("fine")
    room.qtbot.waitUntil(lambda: room.view.library.filter.rowCount() == 1, timeout=LONG)
    room.view.library.reveal(["gappy"])
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
