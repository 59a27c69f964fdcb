"""One clock from two that disagree."""

import time

import numpy as np
import pytest

from studio import clock


def blocks(
    seconds: float, ppm: float, noise: float = 0.0, late: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Sound times and capture times of 80 blocks a second of a device that runs slow by some ppm."""
    rng = np.random.default_rng(1)
    sound = np.arange(0, seconds, 0.0125)
    arrival = 5000.0 + sound * (1 + ppm * 1e-6) + rng.normal(0, noise, len(sound))
    stragglers = rng.random(len(sound)) < 0.05
    return sound, arrival + stragglers * late


def error_ms(fit: clock.ClockFit, t: float, ppm: float) -> float:
    """How wrong the fit places the moment at which second t of the sound was captured."""
    return abs(fit.to_audio(5000.0 + t * (1 + ppm * 1e-6)) - t) * 1e3


@pytest.mark.parametrize("ppm", [-100.0, 0.0, 100.0])
def test_ten_minutes_line_up_at_both_ends(ppm: float) -> None:
    fit = clock.fit(*blocks(600, ppm, noise=0.002, late=0.08))
    assert fit.drift_ppm == pytest.approx(ppm, abs=3)
    assert max(error_ms(fit, t, ppm) for t in (0.0, 300.0, 600.0)) < 1.0


def test_stragglers_do_not_move_the_fit() -> None:
    clean, late = clock.fit(*blocks(60, 20)), clock.fit(*blocks(60, 20, late=0.5))
    assert late.offset == pytest.approx(clean.offset, abs=1e-3)


def test_a_short_noisy_take_does_not_invent_drift() -> None:
    fit = clock.fit(*blocks(2, 0, noise=0.01))
    assert abs(fit.drift_ppm) < 30
    assert max(error_ms(fit, t, 0) for t in (0.0, 2.0)) < 2.0


def test_no_blocks_give_the_identity_and_one_gives_a_shift() -> None:
    assert clock.fit([], []) == clock.ClockFit()
    fit = clock.fit([0.0], [7.0])
    assert fit.to_audio(7.5) == pytest.approx(0.5)


def test_damaged_stamps_are_left_out() -> None:
    sound, arrival = blocks(10, 0)
    arrival[::7] = np.nan
    assert error_ms(clock.fit(sound, arrival), 5.0, 0) < 0.1


def test_arrays_and_numbers_are_mapped_alike() -> None:
    fit = clock.ClockFit(scale=2.0, offset=1.0)
    np.testing.assert_allclose(fit.to_audio(np.array([0.0, 1.0])), [fit.to_audio(0.0), fit.to_audio(1.0)])


def test_wall_clock_stamps_land_on_the_monotonic_clock() -> None:
    before = clock.now()
    stamp = time.time() - clock.WallClock().ahead()
    assert before - 0.01 <= stamp <= clock.now() + 0.01


def test_one_reading_of_the_wall_clock_moves_the_next_stamps_little() -> None:
    wall = clock.WallClock()
    readings = [wall.ahead() for _ in range(200)]
    assert np.ptp(readings) < 0.1
    wall._ahead = readings[-1] + 3600.0  # as if it had been set
    assert wall.ahead() == pytest.approx(readings[-1], abs=0.1)
