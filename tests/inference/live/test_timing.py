"""Moments of samples on a trembling, drifting device, and the delay that makes motion even."""

from __future__ import annotations

import numpy as np
import pytest

from studio.inference.live.timing import GUESSED, SPARE_S, Delay, SampleClock

RATE, BLOCK = 48_000, 240


def test_a_trembling_device_gives_a_steady_line() -> None:
    rng, clock = np.random.default_rng(1), SampleClock(RATE)
    errors, gaps = [], 0
    for i in range(20_000):
        gaps += clock.follow(i * BLOCK, 100.0 + i * BLOCK / RATE + rng.uniform(-0.004, 0.004))
        errors.append(clock.moment(i * BLOCK) - 100.0 - i * BLOCK / RATE)
    assert np.abs(errors[2000:]).max() < 0.0015
    assert not gaps


def test_a_device_that_drifts_is_followed_for_hours() -> None:
    clock, slow = SampleClock(RATE), 1 + 100e-6
    for i in range(120_000):  # ten minutes, in which 100 ppm are 60 ms
        clock.follow(i * BLOCK, i * BLOCK / RATE * slow)
    assert clock.moment(i * BLOCK) == pytest.approx(i * BLOCK / RATE * slow, abs=1e-3)
    assert clock.drift_ppm == pytest.approx(100.0, abs=10.0)


def test_a_gap_is_told_and_jumped_over() -> None:
    clock = SampleClock(RATE)
    assert not clock.follow(0, 5.0)
    assert not clock.follow(BLOCK, 5.005)
    assert clock.follow(2 * BLOCK, 65.0)
    assert clock.moment(2 * BLOCK) == 65.0
    assert not clock.follow(3 * BLOCK, 65.005)


def test_the_delay_is_what_nearly_all_poses_need_and_part_of_a_step() -> None:
    rng, delay = np.random.default_rng(2), Delay(1 / 30)
    for i in range(400):
        delay.add(i / 30, 0.125 + rng.uniform(0.0, 0.01))
    assert delay.value == pytest.approx(0.135 + (1 - GUESSED) / 30 + SPARE_S, abs=0.003)


def test_poses_that_are_shown_when_they_are_made_need_no_time_to_glide() -> None:
    rng, delay = np.random.default_rng(2), Delay(1 / 30, prompt=True)
    for i in range(400):
        delay.add(i / 30, 0.07 + rng.uniform(0.0, 0.01))
    assert delay.value == pytest.approx(0.08 + SPARE_S, abs=0.003)


def test_the_delay_moves_so_slowly_that_motion_only_runs_a_little_slower_or_faster() -> None:
    delay = Delay(1 / 30)
    for i in range(300):
        delay.add(i / 30, 0.1)
    values = [delay.value]
    for i in range(300, 1500):
        delay.add(i / 30, 0.3 if i < 700 else 0.1)
        values.append(delay.value)
    speed = np.diff(values) * 30
    assert max(values) > 0.3
    assert speed.max() <= 0.26
    assert speed.min() >= -0.05
    assert values[-1] < 0.25


def test_what_is_known_ahead_needs_no_delay() -> None:
    delay = Delay(1 / 30)
    for i in range(100):
        delay.add(i / 30, -0.2)
    assert delay.value == 0.0


def test_after_forgetting_the_next_poses_say_it_anew() -> None:
    delay = Delay(1 / 30)
    delay.add(0.0, 1.0)
    before = delay.value
    delay.reset()
    assert delay.value == before  # until then an avatar must not run ahead
    delay.add(1.0, 0.1)
    assert delay.value < 0.2


def test_the_delay_has_settled_once_the_slow_first_poses_are_out_of_it() -> None:
    """What is typed into OBS in the first seconds would be wrong a minute later."""
    delay, settled = Delay(1 / 30), []
    for i in range(900):
        delay.add(i / 30, 0.22 if i < 60 else 0.14)
        settled.append((i / 30, delay.settled, delay.value))
    first = next(t for t, on, _ in settled if on)
    offered = next(value for _, on, value in settled if on)
    assert first > 10.0
    assert offered == pytest.approx(settled[-1][2], abs=0.01)
    delay.reset()
    assert not delay.settled
