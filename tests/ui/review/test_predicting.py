"""Motion that is seen while the rest of it is still being made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from studio.errors import StudioError
from studio.ipc.events import PieceEvent
from studio.motion import Motion
from studio.take.motion_file import write_motion
from studio.training.styles import RunSelection
from studio.ui.review.predicting import GenerateTask, _Pieces, _read_kept
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.scene import A
from studio.ui.review.view import ReviewView
from studio.ui.tasks import Job


def _piece(folder: Path, number: int, seconds: float = 2.0) -> PieceEvent:
    times = number * seconds + np.arange(round(seconds * 30)) / 30
    file = folder / f"piece_{number}.arrow"
    write_motion(file, Motion.build(times, ("A",), np.full((len(times), 1), 0.1 * (number + 1))))
    return PieceEvent(str(file))


@pytest.fixture
def predicting(qtbot: QtBot) -> GenerateTask:
    """One whose child is only told of: the pieces come when the test says so."""
    made = GenerateTask()
    made._job, made._pieces = Job(made), _Pieces.begin()
    return made


def test_the_beginning_is_handed_on_before_the_end_is_there(
    qtbot: QtBot, predicting: GenerateTask, tmp_path: Path
) -> None:
    job, folder = predicting._job, predicting._pieces.folder
    assert job is not None
    assert folder is not None
    for number in range(2):
        with qtbot.waitSignal(predicting.grown) as grown:
            predicting._on_event(job, _piece(tmp_path, number))
        assert grown.args is not None
        assert len(grown.args[0]) == 60 * (number + 1)
    path = tmp_path / "whole.arrow"
    path.write_bytes(b"not read: the pieces are the whole")
    with qtbot.waitSignal(predicting.predicted) as whole:
        predicting._on_event(job, _piece(tmp_path, 2))
        predicting._on_generated(job, path)
    assert whole.args is not None
    assert len(whole.args[0]) == 180
    assert whole.args[0].shapes[[0, 60, 120], 0].tolist() == pytest.approx([0.1, 0.2, 0.3])
    qtbot.waitUntil(lambda: not folder.exists())


def test_a_piece_that_cannot_be_read_costs_only_the_time_until_the_end(
    qtbot: QtBot, predicting: GenerateTask, tmp_path: Path
) -> None:
    job = predicting._job
    assert job is not None
    seen: list[Motion] = []
    predicting.grown.connect(seen.append)
    _piece(tmp_path, 0)
    with qtbot.waitSignal(predicting.predicted) as whole:
        predicting._on_event(job, PieceEvent(str(tmp_path / "gone.arrow")))
        qtbot.waitUntil(lambda: not predicting._pieces.reading)
        predicting._on_generated(job, tmp_path / "piece_0.arrow")
    assert whole.args is not None
    assert len(whole.args[0]) == 60
    assert not seen


def test_a_last_piece_that_cannot_be_read_does_not_keep_the_whole_back(
    qtbot: QtBot, predicting: GenerateTask, tmp_path: Path
) -> None:
    job = predicting._job
    assert job is not None
    _piece(tmp_path, 0)
    with qtbot.waitSignal(predicting.predicted, timeout=30_000) as whole:
        predicting._on_event(job, PieceEvent(str(tmp_path / "gone.arrow")))
        assert predicting._pieces.reading
        predicting._on_generated(job, tmp_path / "piece_0.arrow")  # before that reading has come back
    assert whole.args is not None
    assert len(whole.args[0]) == 60


def test_what_was_cancelled_is_not_handed_on(qtbot: QtBot, predicting: GenerateTask, tmp_path: Path) -> None:
    job, folder = predicting._job, predicting._pieces.folder
    assert job is not None
    assert folder is not None
    seen: list[Motion] = []
    for signal in (predicting.grown, predicting.predicted):
        signal.connect(seen.append)
    predicting._on_event(job, _piece(tmp_path, 0))
    predicting.cancel()
    predicting._on_event(job, _piece(tmp_path, 1))
    qtbot.wait(100)
    assert not seen
    qtbot.waitUntil(lambda: not folder.exists())


def test_a_child_that_was_ending_leaves_nothing_behind_where_the_window_closes(
    qtbot: QtBot, predicting: GenerateTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, folder = predicting._job, predicting._pieces.folder
    assert job is not None
    assert folder is not None
    alive, closed = [True], list[bool]()
    monkeypatch.setattr(Job, "running", property(lambda _: alive[0]))
    monkeypatch.setattr(job, "cancel", lambda: None)
    monkeypatch.setattr(job, "close", lambda: closed.append(True))
    predicting.cancel()
    assert folder.is_dir(), "the child may still write"
    predicting.close()
    alive[0] = False
    assert closed
    qtbot.waitUntil(lambda: not folder.exists())


def test_a_kept_motion_that_cannot_be_read_is_gone_before_it_is_told(
    qtbot: QtBot, predicting: GenerateTask, tmp_path: Path
) -> None:
    """It is removed where it was read, on the pool: the window never waits for a disk."""
    path = tmp_path / "kept.arrow"
    path.write_bytes(b"no motion")
    with pytest.raises(StudioError):
        _read_kept(path)
    assert not path.exists()
    path.write_bytes(b"no motion")
    there: list[bool] = []
    predicting.failed.connect(lambda _: there.append(path.exists()))
    predicting._read(path)
    qtbot.waitUntil(lambda: bool(there))
    assert there == [False]


def test_the_beginning_plays_and_the_rest_is_marked_on_the_timeline(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, presenter = tab
    scene = presenter.scene
    assert scene.captured.motion is not None
    scene.sides[A].wanted, scene.sides[A].asked = RunSelection("quick_001"), True
    half = scene.captured.motion.between(0.0, 3.0)
    presenter._making._on_grown(A, half)
    qtbot.waitUntil(lambda: view.timeline.content.unmade is not None)
    assert view.timeline.content.unmade == pytest.approx((half.times[-1], 6.0))
    assert view.stage.predicted.isVisible()
    assert not view.export.export.isEnabled(), "half a motion is not exported"
    view.seek_requested.emit(1.0)
    presenter._making._on_predicted(A, scene.captured.motion)
    qtbot.waitUntil(lambda: view.timeline.content.unmade is None)
    qtbot.waitUntil(view.export.export.isEnabled)
    assert scene.player is not None
    assert scene.player.position == pytest.approx(1.0), "what grows does not move who looks at it"
    presenter.close()
