from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studio.metrics.comparison import all_figures, compare, pair_on_frames
from studio.motion import Motion, rotation
from tests.formats.examples import a_motion

WHOLE = (0.0, None, ())
"""All of a take: from its first moment to its end, nothing left out."""


def _motion(gain: float = 1.0, start: float = 0.0, names: tuple[str, ...] = ("A",)) -> Motion:
    t = start + np.arange(120) / 60
    mouth = gain * (0.5 + 0.5 * np.sin(2 * np.pi * t))
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.full(len(t), gain * 0.1))[:, None]
    return Motion.build(t, names, np.repeat(mouth[:, None], len(names), 1), ("Head",), None, turn)


def test_a_motion_against_itself_is_perfect() -> None:
    found = compare(_motion(), _motion(), *WHOLE)
    assert found is not None
    assert found.rmse == 0.0
    assert found.pearson == pytest.approx(1.0)
    assert found.motion_ratio == pytest.approx(1.0)
    assert found.degrees == pytest.approx(0.0, abs=1e-4)
    assert found.heat.max() < 1e-3


def test_closed_lips_are_counted() -> None:
    found = compare(_motion(), _motion(), *WHOLE)
    assert found is not None
    assert found.closings == (2, 2, 0)


def test_half_the_motion_has_half_the_ratio() -> None:
    found = compare(_motion(), _motion(0.5), *WHOLE)
    assert found is not None
    assert found.motion_ratio == pytest.approx(0.5, rel=1e-3)
    assert found.pearson == pytest.approx(1.0)
    assert found.degrees == pytest.approx(np.degrees(0.05), rel=1e-2)


def test_a_still_face_follows_nothing() -> None:
    found = compare(_motion(), _motion(0.0), *WHOLE)
    assert found is not None
    assert found.pearson == 0.0
    assert found.motion_ratio == 0.0


def test_only_the_time_both_have_counts() -> None:
    found = compare(_motion(), _motion(start=1.0), *WHOLE)
    assert found is not None
    assert found.times[0] == pytest.approx(1.0)
    assert found.times[-1] <= 119 / 60


def test_nothing_in_common_is_no_comparison() -> None:
    other = Motion.build(np.arange(10) / 10, ("JawOpen",), np.zeros((10, 1)))
    assert compare(_motion(), other, *WHOLE) is None
    assert compare(_motion(), _motion(start=100.0), *WHOLE) is None


def test_review_calls_error_what_an_evaluation_calls_rmse_of_the_blend_shapes() -> None:
    truth = a_motion(60)
    guess = replace(truth, shapes=truth.shapes * 0.7, rotations=np.roll(truth.rotations, 20, axis=0))
    seen, figures = compare(truth, guess, *WHOLE), all_figures([pair_on_frames(guess, truth, truth.duration)])
    assert seen is not None
    assert seen.rmse == pytest.approx(figures["rmse_face"], rel=1e-5)
    assert seen.rmse != pytest.approx(figures["rmse"], rel=0.05), "that one counts the body, too"


def test_review_shows_the_figures_of_an_evaluation_of_the_same_span() -> None:
    t = np.arange(600) / 60
    mouth = 0.5 + 0.4 * np.stack([np.sin(3 * t), np.cos(5 * t)], axis=1)
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), 0.3 * np.sin(2 * t))[:, None]
    truth = Motion.build(t, ("JawOpen", "A"), mouth, ("Head",), None, turn)
    guess = truth.at(t[::2] + 0.1)
    guess = replace(guess, times=t[::2], shapes=(guess.shapes * 0.8).astype(np.float32))
    start, end, excluded = 2.0, 7.0, [(3.0, 4.0)]
    pair = pair_on_frames(
        guess.cut(start, np.inf), truth.cut(start, end), 8.0, [(a - start, b - start) for a, b in excluded]
    )
    figures, seen = all_figures([pair]), compare(truth, guess, start, end, excluded)
    assert seen is not None
    shown = [seen.rmse, seen.pearson, seen.motion_ratio, seen.degrees]
    named = [figures[name] for name in ("rmse_face", "pearson_face", "motion_ratio_face", "geodesic_deg")]
    assert shown == pytest.approx(named, rel=1e-6)
    outside = (seen.times < start) | (seen.times > end) | ((seen.times >= 3.0) & (seen.times < 4.0))
    assert not seen.heat[outside].any()
