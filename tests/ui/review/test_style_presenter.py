"""Move like this: a run is shown a style by the take on the stage, and moves in it at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from studio.errors import StudioError
from studio.project import Project
from studio.training.loop.train import train
from studio.training.recipe import load_recipe
from studio.training.styles import RunSelection
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from tests import toys

MINUTE = 60_000
Tab = tuple[ReviewView, ReviewPresenter]


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    project = toys.make(tmp_path_factory.mktemp("style") / "Toy", seconds=12.0, bones=False)
    tiny = ["units=8", "epochs=1", "steps=3", "crops=2", "crop_frames=30"]
    train(project, load_recipe("quick").with_overrides(tiny), on_event=lambda event: None)
    project.close()
    return project.folder


@pytest.fixture
def toy_project(trained: Path, tmp_path: Path) -> Iterator[Project]:
    project = toys.copied(trained, tmp_path)
    yield project
    project.close()


@pytest.fixture
def tab(tab: Tab) -> Tab:
    """A take on the stage, and the run that is to make something of its sound; nobody waits for that."""
    tab[1].show_run("quick_001")
    return tab


def _wait_for_motion(qtbot: QtBot, presenter: ReviewPresenter) -> None:
    model = presenter.model
    qtbot.waitUntil(lambda: model.predicted is not None and model.complete, timeout=MINUTE)


def _move_like_this(qtbot: QtBot, view: ReviewView) -> None:
    assert view.bar.move_like_this.isVisible()
    qtbot.mouseClick(view.bar.move_like_this, Qt.MouseButton.LeftButton)


def test_the_selected_stretch_becomes_a_style_that_is_chosen(
    qtbot: QtBot, tab: Tab, session: Session
) -> None:
    view, presenter = tab
    model, box = presenter.model, view.bar.first.styles
    item = model.item
    assert item is not None
    _wait_for_motion(qtbot, presenter)
    model.set_span((2.0, 9.0))
    before = model.predicted
    _move_like_this(qtbot, view)
    assert view.bar.style_progress.isVisible()
    assert not view.bar.move_like_this.isEnabled()
    name = f"like {item.title}"
    qtbot.waitUntil(lambda: model.sides[0].selection == RunSelection("quick_001", name), timeout=MINUTE)
    _wait_for_motion(qtbot, presenter)
    assert box.currentText() == name
    assert model.predicted is not before
    assert not view.bar.style_progress.isVisible()
    assert view.bar.move_like_this.isEnabled()
    assert session.project is not None
    assert name in session.project.run("quick_001").facts.styles


def test_without_a_selection_ten_seconds_around_the_playhead_are_taken(tab: Tab) -> None:
    _, presenter = tab
    player = presenter.model.player
    assert player is not None
    for position, span in ((6.0, (1.0, 11.0)), (0.5, (0.0, 10.0)), (12.0, (2.0, 12.0))):
        player.seek(position)
        assert presenter.style.span == pytest.approx(span, abs=0.05)
    presenter.model.set_span((3.0, 7.0))
    assert presenter.style.span == (3.0, 7.0)


def test_a_stretch_that_is_too_short_is_said(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    # The sentence is shown by whoever listens; here nobody is to open a dialog.
    presenter.model.failed.disconnect()
    presenter.model.set_span((2.0, 3.0))
    with qtbot.waitSignal(presenter.model.failed, timeout=MINUTE) as failed:
        _move_like_this(qtbot, view)
    assert failed.args is not None
    error = failed.args[0]
    assert isinstance(error, StudioError)
    assert "1.0 s long, too short to show how it moves" in error.what
    qtbot.waitUntil(view.bar.move_like_this.isEnabled)


def test_cancel_ends_it_and_nothing_is_kept(qtbot: QtBot, tab: Tab, session: Session) -> None:
    view, _ = tab
    _move_like_this(qtbot, view)
    cancel = view.findChild(QPushButton, "cancel_style")
    assert cancel is not None
    qtbot.mouseClick(cancel, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(view.bar.move_like_this.isEnabled, timeout=MINUTE)
    assert not view.bar.style_progress.isVisible()
    assert session.project is not None
    assert session.project.run("quick_001").facts.styles == ("Toy_001", "Toy_002")


def test_captured_motion_alone_shows_no_run_anything(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    view.bar.first.run.setCurrentIndex(0)
    assert presenter.model.captured_only
    assert not view.bar.move_like_this.isVisible()
