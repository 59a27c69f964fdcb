from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion
from studio.training.metrics import Pair
from studio.training.metrics_worst import frame_errors


def _motion(*columns: np.ndarray) -> Motion:
    names = ("A", "Joy", "Neutral")[: len(columns)]
    return Motion.build(np.arange(len(columns[0])) / 30, names, np.stack(columns, axis=1))


def test_errors_are_told_in_deviations_of_what_was_captured() -> None:
    wide, quiet = np.tile([0.0, 1.0], 50), np.tile([0.4, 0.5], 50)
    still = np.full(100, 0.5)
    off = quiet.copy()
    off[40] += 0.05  # one deviation of that column, in one of the two that move
    pair = Pair(_motion(wide, quiet, still), _motion(wide, off, still + 0.3))
    times, error = frame_errors({"a": pair})["a"]
    assert times[40] == pytest.approx(40 / 30)
    assert error[40] == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert np.delete(error, 40) == pytest.approx(0.0, abs=1e-6)


def test_frames_that_do_not_count_have_no_error() -> None:
    valid = np.ones(100)
    valid[10:20] = 0
    wide = np.tile([0.0, 1.0], 50)
    _, error = frame_errors({"a": Pair(_motion(wide), _motion(wide * 0.5), valid)})["a"]
    assert np.flatnonzero(np.isnan(error)).tolist() == list(range(10, 20))


def test_takes_without_a_common_channel_have_no_error() -> None:
    times = np.arange(10) / 30
    truth = Motion.build(times, ("A",), np.linspace(0, 1, 10)[:, None])
    other = Motion.build(times, ("E",), np.linspace(0, 1, 10)[:, None])
    assert np.isnan(frame_errors({"a": Pair(truth, other)})["a"][1]).all()
