from __future__ import annotations

import math

import numpy as np
import pytest

from studio.playback.sound_output import PlayedSpans, Span, StreamClock

RATE = 48_000


def _reported(jitter: float, seconds: float = 8.0, rate: float = RATE) -> StreamClock:
    """A clock fed with blocks of 15 ms whose reports are off by up to `jitter` seconds."""
    random = np.random.default_rng(7)
    clock = StreamClock(RATE)
    for frame in range(0, int(seconds * RATE), 720):
        clock.report(frame, 100.0 + frame / rate + random.uniform(-jitter, jitter))
    return clock


def test_before_any_report_nothing_is_heard() -> None:
    assert StreamClock(RATE).frame_at(5.0) == -math.inf


def test_even_reports_are_taken_as_they_are() -> None:
    assert _reported(0.0).frame_at(108.5) == pytest.approx(8.5 * RATE, abs=1)


def test_uneven_reports_are_smoothed() -> None:
    error = _reported(0.010).frame_at(108.0) / RATE - 8.0
    assert abs(error) < 0.003


def test_a_device_that_runs_fast_is_followed() -> None:
    error = _reported(0.0, rate=RATE * 1.0002).frame_at(100.0 + 8.0 / 1.0002) / RATE - 8.0
    assert abs(error) < 0.001


def test_a_jump_starts_the_estimate_anew() -> None:
    clock = _reported(0.0)
    clock.report(8 * RATE, 120.0)
    assert clock.frame_at(120.0) == pytest.approx(8 * RATE)


def test_positions_follow_spans_across_a_loop() -> None:
    spans = PlayedSpans()
    spans.add(Span(0, 480, 1.0, 1 / RATE, 1))
    spans.add(Span(480, 480, 0.5, 1 / RATE, 1))
    assert spans.position(240, 1) == pytest.approx(1.005)
    assert spans.position(720, 1) == pytest.approx(0.505)


def test_a_position_never_runs_past_what_was_played() -> None:
    spans = PlayedSpans()
    spans.add(Span(0, 480, 1.0, 1 / RATE, 1))
    assert spans.position(48_000, 1) == pytest.approx(1.01)


def test_what_was_played_before_a_seek_is_not_asked() -> None:
    spans = PlayedSpans()
    spans.add(Span(0, 480, 1.0, 1 / RATE, 1))
    assert spans.position(100, 2) is None
    spans.add(Span(480, 480, 5.0, 1 / RATE, 2))
    assert spans.position(100, 2) is None  # given to the device, not yet in the ear
    assert spans.position(500, 2) == pytest.approx(5.0, abs=0.001)
