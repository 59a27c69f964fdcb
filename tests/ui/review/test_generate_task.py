"""Motion that is seen while the rest of it is still being made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from studio.errors import StudioError
from studio.ipc.events import FilesDone, PieceEvent
from studio.motion import Motion
from studio.project import Project
from studio.project.run import generated_path
from studio.take.motion_file import write_motion
from studio.training.styles import RunSelection
from studio.ui.generate_task import GenerateTask
from studio.ui.review.model import A
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from tests.fakes import FakeChildTask


def _motion(number: int, seconds: float = 2.0) -> Motion:
    times = number * seconds + np.arange(round(seconds * 30)) / 30
    return Motion.build(times, ("A",), np.full((len(times), 1), 0.1 * (number + 1)))


@pytest.fixture
def child(tmp_path: Path) -> FakeChildTask:
    """Only told of: the pieces come when the test says so."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    return FakeChildTask(scratch)


@pytest.fixture
def task(qtbot: QtBot, child: FakeChildTask, toy_project: Project) -> GenerateTask:
    """A request under way."""
    made = GenerateTask(child=child)
    _request(made, toy_project)
    return made


def _request(task: GenerateTask, project: Project) -> None:
    folder = project.runs_folder / "quick_001"
    if not folder.exists():  # other weights would be another run's to the cache
        folder.mkdir(parents=True)
        (folder / "best.safetensors").write_bytes(b"weights")
        (folder / "report.json").write_text("{}", encoding="utf-8")
    sound = project.takes[0].audio_path
    assert sound is not None
    task.request(project, project.run("quick_001"), sound)


def _piece(child: FakeChildTask, number: int) -> Path:
    """The child writes a piece and says so."""
    file = Path(child.started[-1][-1]) / f"piece_{number}.arrow"
    write_motion(file, _motion(number))
    child.say(PieceEvent(str(file)))
    return file


def _end(child: FakeChildTask) -> None:
    """The child has written the whole, and ends."""
    parts = [_motion(number) for number in range(3)]
    times, shapes = (np.concatenate([getattr(one, name) for one in parts]) for name in ("times", "shapes"))
    path = Path(child.started[-1][child.started[-1].index("-o") + 1])
    write_motion(path, Motion.build(times, ("A",), shapes))
    child.end(FilesDone((str(path),)))


def test_the_beginning_is_handed_on_before_the_end_is_there(
    qtbot: QtBot, task: GenerateTask, child: FakeChildTask
) -> None:
    assert task.busy
    for number in range(2):
        with qtbot.waitSignal(task.grown) as grown:
            piece = _piece(child, number)
        assert grown.args is not None
        assert len(grown.args[0]) == 60 * (number + 1)
        assert not piece.exists(), "it was read, and the folder goes on the GUI thread"
    with qtbot.waitSignal(task.predicted) as whole:
        _piece(child, 2)
        _end(child)
    assert whole.args is not None
    assert len(whole.args[0]) == 180
    assert whole.args[0].shapes[[0, 60, 120], 0].tolist() == pytest.approx([0.1, 0.2, 0.3])
    assert not task.busy


def test_a_piece_that_cannot_be_read_costs_only_the_time_until_the_end(
    qtbot: QtBot, task: GenerateTask, child: FakeChildTask, tmp_path: Path
) -> None:
    seen: list[Motion] = []
    task.grown.connect(seen.append)
    with qtbot.waitSignal(task.predicted) as whole:
        child.say(PieceEvent(str(tmp_path / "gone.arrow")))
        qtbot.wait(50)
        _piece(child, 1)
        _end(child)
    assert whole.args is not None
    assert len(whole.args[0]) == 180
    assert not seen


def test_a_last_piece_that_cannot_be_read_does_not_keep_the_whole_back(
    qtbot: QtBot, task: GenerateTask, child: FakeChildTask, tmp_path: Path
) -> None:
    with qtbot.waitSignal(task.predicted, timeout=30_000) as whole:
        child.say(PieceEvent(str(tmp_path / "gone.arrow")))
        _end(child)  # before that reading has come back
    assert whole.args is not None
    assert len(whole.args[0]) == 180


def test_what_was_cancelled_is_not_handed_on(qtbot: QtBot, task: GenerateTask, child: FakeChildTask) -> None:
    seen: list[Motion] = []
    for signal in (task.grown, task.predicted):
        signal.connect(seen.append)
    _piece(child, 0)
    task.cancel()
    _piece(child, 1)
    qtbot.wait(100)
    assert not seen
    assert child.dropped == 1


def test_a_newer_request_replaces_the_one_before(
    qtbot: QtBot, task: GenerateTask, child: FakeChildTask, toy_project: Project
) -> None:
    _piece(child, 0)
    _request(task, toy_project)
    assert (child.dropped, len(child.started)) == (1, 2)
    with qtbot.waitSignal(task.grown) as grown:
        _piece(child, 0)
    assert grown.args is not None
    assert len(grown.args[0]) == 60, "nothing of the request before is in it"


def test_no_child_stays_behind_where_the_window_closes(task: GenerateTask, child: FakeChildTask) -> None:
    task.close()
    assert child.closed


def test_without_room_for_pieces_the_motion_is_seen_when_it_is_there(
    qtbot: QtBot, task: GenerateTask, child: FakeChildTask
) -> None:
    told: list[str] = []
    task.progressed.connect(lambda text, _: told.append(text))
    child.end(OSError("no space left on device"))
    assert task.busy, "the same once more, without pieces"
    assert "--pieces" not in child.started[-1]
    assert told == []
    with qtbot.waitSignal(task.predicted) as whole:
        _end(child)
    assert whole.args is not None
    assert len(whole.args[0]) == 180


def test_a_child_that_failed_is_told_of_once(qtbot: QtBot, task: GenerateTask, child: FakeChildTask) -> None:
    seen: list[BaseException] = []
    task.failed.connect(seen.append)
    failure = StudioError("It failed.", "Try again.")
    child.end(failure)
    assert seen == [failure]
    assert not task.busy


def test_a_cached_motion_that_cannot_be_read_is_gone_before_it_is_told(
    qtbot: QtBot, child: FakeChildTask, toy_project: Project
) -> None:
    """It is removed where it was read, on the pool: the window never waits for a disk."""
    task = GenerateTask(child=child)
    _request(task, toy_project)
    task.cancel()
    sound = toy_project.takes[0].audio_path
    assert sound is not None
    path = generated_path(toy_project.folder, toy_project.run("quick_001"), sound, ())
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"no motion")
    there: list[bool] = []
    task.failed.connect(lambda _: there.append(path.exists()))
    _request(task, toy_project)
    qtbot.waitUntil(lambda: bool(there))
    assert there == [False]
    assert not task.busy


def test_the_beginning_plays_and_the_rest_is_marked_on_the_timeline(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, presenter = tab
    model = presenter.model
    assert model.captured.motion is not None
    model.sides[A].selection, model.sides[A].requested = RunSelection("quick_001"), True
    half = model.captured.motion.between(0.0, 3.0)
    presenter.runs.tasks[A].grown.emit(half)
    qtbot.waitUntil(lambda: view.timeline.content.unmade is not None)
    assert view.timeline.content.unmade == pytest.approx((half.times[-1], 6.0))
    assert view.stage.predicted.isVisible()
    assert not view.export.export.isEnabled(), "half a motion is not exported"
    view.seek_requested.emit(1.0)
    presenter.runs.tasks[A].predicted.emit(model.captured.motion)
    qtbot.waitUntil(lambda: view.timeline.content.unmade is None)
    qtbot.waitUntil(view.export.export.isEnabled)
    assert model.player is not None
    assert model.player.position == pytest.approx(1.0), "what grows does not move who looks at it"
    presenter.close()
