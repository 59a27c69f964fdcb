"""Moods painted over a sound, in a tab with a run that was really taught one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from studio.motion import Motion
from studio.project import Project
from studio.project.painted_moods import read_moods
from studio.training.styles import RunChoice
from studio.ui.review.model import A
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from studio.ui.widgets.timeline.timeline import Timeline
from tests import toys
from tests.training.loop.test_train import tiny, trained

MINUTE = 60_000
Tab = tuple[ReviewView, ReviewPresenter]


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Path:
    project = toys.make(tmp_path_factory.mktemp("taught") / "Toy", happy=(1.5, 4.5))
    trained(project, tiny("epochs=1", "members=1", "style_by=take"))
    return project.folder


@pytest.fixture
def toy_project(taught: Path, tmp_path: Path) -> Project:
    return toys.copied(taught, tmp_path)


@pytest.fixture
def tab(opened: Tab) -> Tab:
    return opened


def made(qtbot: QtBot, presenter: ReviewPresenter) -> Motion:
    side = presenter.model.sides[A]
    qtbot.waitUntil(lambda: side.complete and not presenter.tune.busy, timeout=MINUTE)
    assert side.motion is not None
    return side.motion


def drag(timeline: Timeline, start: float, end: float) -> None:
    lane = timeline.lane("labels", "mood")
    assert lane is not None
    a, b = (QPoint(round(timeline.x_of(t)), lane.top + lane.height // 2) for t in (start, end))
    QTest.mousePress(timeline, Qt.MouseButton.LeftButton, pos=a)
    QTest.mouseMove(timeline, b)
    QTest.mouseRelease(timeline, Qt.MouseButton.LeftButton, pos=b)


def test_a_mood_is_painted_heard_by_the_run_undone_clicked_away_and_kept(
    qtbot: QtBot, tab: Tab, session: Session
) -> None:
    view, presenter = tab
    plain = made(qtbot, presenter)
    assert list(view.moods.chips) == ["happy"]
    assert view.moods.brush == "happy"
    drag(view.timeline, 2.0, 4.0)
    (label,) = view.timeline.content.labels
    assert (label.text, label.t, label.duration) == (
        "happy",
        pytest.approx(2.0, abs=0.05),
        pytest.approx(2, abs=0.1),
    )
    happy = made(qtbot, presenter)
    apart = np.abs(happy.shapes - plain.shapes).max(axis=1)
    assert apart[60:110].min() > 0, "within the span every frame is told the mood"
    assert apart[:54].max() == pytest.approx(0.0, abs=1e-6)
    assert presenter.undo_scope.undo() == "Paint happy"
    assert view.timeline.content.labels == ()
    assert made(qtbot, presenter).shapes == pytest.approx(plain.shapes, abs=1e-6)
    assert presenter.undo_scope.redo() == "Paint happy"
    drag(view.timeline, 3.0, 3.0)
    assert view.timeline.content.labels == ()
    assert presenter.undo_scope.undo_name == "Remove happy"
    assert presenter.undo_scope.undo() == "Remove happy"
    # Opened again, what was painted is there as it was left.
    presenter.close()
    assert session.project is not None
    (kept,) = read_moods(session.project.folder).spans.values()
    assert [span.name for span in kept] == ["happy"]
    session.project_opened.emit()
    qtbot.waitUntil(lambda: presenter.model.moods.spans != {})
    assert presenter.model.moods.spans == dict.fromkeys(presenter.model.moods.spans, kept)
    assert presenter.undo_scope.undo_name == ""


def test_sliders_mix_styles_and_say_how_strong_a_mood_is(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    made(qtbot, presenter)
    drag(view.timeline, 1.0, 4.0)
    whole = made(qtbot, presenter)
    view.moods._strengths["happy"].box.setValue(0.5)
    view.moods._shares["Toy_001"].box.setValue(0.6)
    view.moods._shares["average"].box.setValue(0.4)
    qtbot.waitUntil(lambda: bool(presenter.model.sides[A].selection.mix), timeout=MINUTE)
    words = presenter.model.words(A)
    assert words[:2] == ("--mix=average:0.4", "--mix=Toy_001:0.6")
    assert words[2].startswith("--mood=happy*0.5:")
    mixed = made(qtbot, presenter)
    assert np.abs(mixed.shapes - whole.shapes).max() > 1e-4
    assert presenter.model.sides[A].selection.title.endswith("(mix)")
    # A style that is chosen takes the place of the mix.
    view.bar.first.styles.setCurrentIndex(1)
    assert presenter.model.sides[A].selection.mix == ()
    assert view.moods.shares["Toy_001"] == 0.0


def test_a_run_without_moods_shows_where_they_come_from(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    made(qtbot, presenter)
    view.moods.show_run(None, hint=True)
    assert view.moods.findChild(object, "moods_hint").text() == (  # type: ignore[attr-defined]
        "Want moods? Label them in Curate, train again, then paint them here."
    )
    assert not view.moods.mix.isVisible()
    chosen: list[str] = []
    view.moods.brush_chosen.connect(chosen.append)
    view.moods.show_run(RunChoice("x", moods=("a", "b", "c", "d", "e")), hint=True)
    assert view.moods.list.isVisible(), "chips for five have no room in a small window"
    view.moods.list.setCurrentText("c")
    view.moods.list.textActivated.emit("c")
    assert (chosen, view.moods.brush) == (["c"], "c")
    view.moods.show_run(None, hint=False)
    assert not view.moods.isVisible()
