"""What pictures say of the motion in them, and how two trackers of one face agree."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion.filmed import (
    COLUMNS,
    HIDDEN,
    HIDDEN_S,
    LOST_S,
    NO_FACE,
    PictureFlag,
    agreement,
    main_values,
    shares,
    spans,
    webcam_left_out,
)

FACE, MERGED = int(PictureFlag.FACE), int(PictureFlag.MERGED)


def test_shares_are_of_the_pictures_with_a_face() -> None:
    flags = np.array([FACE] * 4 + [FACE | int(PictureFlag.DARK)] * 4 + [0] * 2)
    found = shares(flags)
    assert (found["face_seen"], found["face_dark"], found["mouth_hidden"]) == ("0.8000", "0.5000", "0.0000")
    assert set(shares(np.array([0, 0])).values()) == {"0.0000"}


def test_a_span_ends_with_the_picture_behind_it() -> None:
    times = np.arange(60) / 30
    lost = (times >= 0.5) & (times < 1.0)
    lost[5] = True
    assert spans(times, lost, LOST_S, NO_FACE) == [(0.5, pytest.approx(1.0), NO_FACE)]


def test_what_another_tracker_saw_is_not_left_out() -> None:
    times = np.arange(120) / 30
    flags = np.full(120, FACE | MERGED)
    flags[30:45] = MERGED
    flags[60:90] |= int(PictureFlag.HIDDEN)
    flags[100:103] |= int(PictureFlag.HIDDEN)
    assert HIDDEN_S > 0.1
    assert webcam_left_out(times, flags) == ((1.0, 1.5, NO_FACE), (2.0, 3.0, HIDDEN))
    assert webcam_left_out(times, flags & ~MERGED) == ()


def curves(t: np.ndarray) -> np.ndarray:
    """Jaw, mouth and blinks of somebody who talks."""
    jaw = np.clip(np.sin(2 * np.pi * 2.3 * t) + np.sin(2 * np.pi * 3.7 * t + 1) + np.sin(1.9 * t), 0, 2) / 2
    return np.stack([jaw, 0.3 * jaw + 0.1 * np.sin(3 * t), (t % 3.1 < 0.2).astype(float)], axis=1)


def together(late: float, noise: float = 0.0, seconds: float = 20.0) -> np.ndarray:
    """Rows of a webcam at 30 a second that shows what a phone at 60 a second saw so long before."""
    rng = np.random.default_rng(4)
    t = 1000 + np.arange(round(seconds * 30)) / 30
    theirs = np.floor(t * 60) / 60
    ours = curves(t - late) + noise * rng.normal(size=(len(t), 3))
    flags = np.full(len(t), FACE | int(PictureFlag.PHONE))
    return np.column_stack([t, flags, ours, theirs, curves(theirs)])


@pytest.mark.parametrize("late", [0.05, -0.02, 0.2])
def test_a_webcam_that_is_late_agrees_once_that_is_taken_out(late: float) -> None:
    found = agreement(together(late))
    assert found is not None
    assert found.phone
    assert found.lag_ms == pytest.approx(1000 * late, abs=8)
    assert min(found.jaw or 0, found.mouth or 0, found.blinks or 0) > 0.9


def test_two_who_do_not_agree_are_told_apart() -> None:
    rows = together(0.0)
    rng = np.random.default_rng(9)
    rows[:, 2:5] = rng.random((len(rows), 3))
    found = agreement(rows)
    assert found is not None
    assert found.lag_ms is None
    assert abs(found.jaw or 0) < 0.4
    rows = together(0.0)
    rows[:, 4] = 0.0
    still = agreement(rows)
    assert still is not None
    assert still.blinks is None


def test_one_tracker_alone_is_no_comparison() -> None:
    rows = together(0.0)
    rows[:, 5:] = np.nan
    assert agreement(rows) is None
    assert agreement(together(0.0, seconds=3.0)) is None
    assert agreement(np.zeros((0, COLUMNS))) is None


def test_a_phone_that_comes_late_is_compared_from_there_on() -> None:
    rows = together(0.05, seconds=30.0)
    rows[: 30 * 12, 5:] = np.nan
    found = agreement(rows)
    assert found is not None
    assert found.lag_ms == pytest.approx(50, abs=8)


def test_only_arkits_face_has_main_values() -> None:
    assert main_values({"A": 0.4}) is None
    assert main_values({"JawOpen": 0.4, "EyeBlinkLeft": 1.0, "EyeBlinkRight": 0.5}) == (0.4, 0.0, 0.75)
