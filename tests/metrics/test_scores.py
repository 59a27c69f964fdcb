"""Every figure on motion whose answer is known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from studio.metrics import scores
from studio.metrics.scores import Pair, frame_errors, score
from studio.motion import Motion, rotation

T = np.arange(120) / 30


def face(values: np.ndarray, names: tuple[str, ...] = ("A", "Blink")) -> Motion:
    return Motion.build(np.arange(len(values)) / 30, names, values)


def wave(phase: float = 0.0, size: float = 0.4) -> np.ndarray:
    return np.stack([0.5 + size * np.sin(6 * T + phase), 0.5 + size * np.cos(9 * T + phase)], axis=1)


def test_the_captured_motion_itself_is_perfect() -> None:
    figures = score([Pair(face(wave()), face(wave()))])
    for name in ("rmse", "nrmse", "mae"):
        assert figures[name] == 0
    for name in ("pearson", "pearson_mouth", "pearson_jaw", "motion_ratio", "std_ratio", "jerk_ratio"):
        assert figures[name] == pytest.approx(1.0)
    assert figures["geodesic_deg"] is None
    assert figures["rmse_body"] is None


def test_a_constant_offset_is_its_size() -> None:
    figures = score([Pair(face(wave()), face(wave() + 0.1))])
    assert figures["rmse"] == pytest.approx(0.1, abs=1e-6)
    assert figures["mae"] == pytest.approx(0.1, abs=1e-6)
    assert figures["nrmse"] == pytest.approx(0.1 / 0.8, rel=0.02)
    assert figures["motion_ratio"] == pytest.approx(1.0, abs=1e-5)


def test_half_the_size_is_half_as_lively_and_as_like() -> None:
    figures = score([Pair(face(wave()), face(wave(size=0.2)))])
    for name in ("motion_ratio", "std_ratio", "jerk_ratio"):
        assert figures[name] == pytest.approx(0.5, rel=1e-3)
    assert figures["pearson"] == pytest.approx(1.0)


def test_a_still_model_is_seen_although_its_rmse_is_low() -> None:
    truth = face(wave(size=0.05))
    figures = score([Pair(truth, face(np.full((120, 2), 0.5)))])
    assert figures["rmse"] is not None
    assert figures["rmse"] < 0.05
    assert figures["motion_ratio"] == 0
    assert figures["std_ratio"] == 0
    assert figures["pearson"] == 0


def test_jitter_shows_in_jerk() -> None:
    shaky = wave() + np.random.default_rng(0).normal(0, 0.03, (120, 2))
    figures = score([Pair(face(wave()), face(shaky))])
    assert figures["jerk_ratio"] is not None
    assert figures["jerk_ratio"] > 5


def test_geodesic_error_is_the_angle_in_degrees() -> None:
    axis = np.tile([0.0, 1.0, 0.0], (60, 2, 1))
    turn = np.linspace(0, 1, 60)[:, None]
    truth = rotation.from_axis_angle(axis, np.broadcast_to(turn, (60, 2)))
    other = rotation.from_axis_angle(axis, turn + np.radians([10.0, 30.0]))
    bones = ("Head", "LeftHand")
    pair = Pair(
        Motion.build(T[:60], bone_names=bones, rotations=truth),
        Motion.build(T[:60], bone_names=bones, rotations=other),
    )
    assert scores.geodesic_by_bone([pair]) == pytest.approx({"Head": 10.0, "LeftHand": 30.0}, abs=1e-3)
    figures = score([pair])
    assert figures["geodesic_deg"] == pytest.approx(20.0, abs=1e-3)
    assert figures["motion_ratio_head"] == pytest.approx(1.0, abs=1e-4)
    assert figures["motion_ratio_torso"] is None


def test_only_channels_both_have_are_compared() -> None:
    truth = face(wave(), ("A", "Smile"))
    predicted = face(wave() + np.array([0.0, 9.0]), ("A", "Frown"))
    assert score([Pair(truth, predicted)])["rmse"] == pytest.approx(0.0, abs=1e-6)


def test_frames_that_do_not_count_do_not_count() -> None:
    wrong = wave()
    wrong[50:70] += 5
    valid = np.ones(120)
    valid[50:70] = 0
    figures = score([Pair(face(wave()), face(wrong), valid)])
    assert figures["rmse"] == 0
    assert figures["motion_ratio"] == pytest.approx(1.0)


def test_the_jump_from_take_to_take_is_no_motion() -> None:
    low, high = face(wave() * 0.1), face(wave() * 0.1 + 0.9)
    one, both = score([Pair(low, low)]), score([Pair(low, low), Pair(high, face(wave() * 0.05 + 0.9))])
    assert one["motion_ratio"] == pytest.approx(1.0)
    assert both["motion_ratio"] == pytest.approx(0.75, rel=0.01)


def test_takes_with_other_channels_go_together() -> None:
    a, b = face(wave()), face(wave()[:, :1], ("Joy",))
    figures = score([Pair(a, face(wave() + 0.1)), Pair(b, face(wave()[:, :1] + 0.1, ("Joy",)))])
    assert figures["rmse"] == pytest.approx(0.1, abs=1e-6)
    assert figures["motion_ratio"] == pytest.approx(1.0, abs=1e-5)


def test_nothing_to_compare_gives_no_figures() -> None:
    empty = face(np.zeros((0, 2)))
    assert all(value is None for value in score([Pair(empty, empty)]).values())
    assert all(value is None for value in score([]).values())


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
