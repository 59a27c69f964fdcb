"""Levels as a performer reads them."""

import numpy as np
import pytest

from studio.sound.level import FLOOR_DBFS, LevelMeter, clips, dbfs


def tone(amplitude: float, seconds: float = 0.5, rate: int = 48_000) -> np.ndarray:
    return (amplitude * np.sin(2 * np.pi * 440 * np.arange(int(seconds * rate)) / rate)).astype(np.float32)


def test_a_full_scale_sine_reads_zero_and_minus_three() -> None:
    meter = LevelMeter()
    for _ in range(6):
        meter.feed(tone(1.0))
    assert meter.peak_dbfs == pytest.approx(0.0, abs=0.01)
    assert meter.rms_dbfs == pytest.approx(-3.01, abs=0.1)


def test_silence_is_the_floor() -> None:
    meter = LevelMeter()
    meter.feed(np.zeros(480, dtype=np.float32))
    assert (meter.peak_dbfs, meter.rms_dbfs, meter.hold_dbfs) == (FLOOR_DBFS,) * 3
    assert dbfs(0.0) == FLOOR_DBFS


def test_the_loudest_channel_counts() -> None:
    meter = LevelMeter()
    meter.feed(np.stack([np.zeros(480), tone(0.5, 0.01)], axis=1).astype(np.float32))
    assert meter.peak_dbfs == pytest.approx(-6.02, abs=0.1)


def test_the_peak_falls_and_the_hold_stays_a_while() -> None:
    meter = LevelMeter()
    meter.feed(tone(1.0, 0.1))
    meter.feed(np.zeros(48_000, dtype=np.float32))
    assert meter.peak_dbfs == pytest.approx(-20.0, abs=0.5)
    assert meter.hold_dbfs == pytest.approx(0.0, abs=0.01)
    meter.feed(np.zeros(48_000, dtype=np.float32))
    assert meter.hold_dbfs == FLOOR_DBFS


def test_clipping_is_latched_until_reset() -> None:
    meter = LevelMeter()
    meter.feed(np.clip(tone(2.0), -1, 1))
    meter.feed(tone(0.1))
    assert meter.clipped
    meter.reset()
    assert not meter.clipped


def test_one_full_sample_is_no_clipping() -> None:
    samples = tone(0.5)
    samples[100] = 1.0
    assert not clips(samples)
    samples[100:103] = -1.0
    assert clips(samples)


def test_damaged_and_empty_blocks_do_no_harm() -> None:
    meter = LevelMeter()
    meter.feed(np.zeros((0, 2), dtype=np.float32))
    meter.feed(np.array([np.nan, np.inf, -np.inf, 0.5], dtype=np.float32))
    assert meter.peak_dbfs == 0.0
