"""Sound brought to another rate in a stream: the same whatever the blocks are, at once, and true."""

from __future__ import annotations

import numpy as np
import pytest

from studio.live.resample import Resampler


def sine(rate: int, hz: float, seconds: float = 0.5) -> np.ndarray:
    return np.sin(2 * np.pi * hz * np.arange(int(rate * seconds)) / rate).astype(np.float32)


@pytest.mark.parametrize("rate", [48_000, 44_100, 22_050, 8_000, 192_000, 11_025])
def test_blocks_do_not_matter(rate: int) -> None:
    sound, rng = sine(rate, 700.0), np.random.default_rng(1)
    whole = Resampler(rate, 16_000).feed(sound)
    stream, parts, first = Resampler(rate, 16_000), [], 0
    while first < len(sound):
        size = int(rng.integers(1, 900))
        parts.append(stream.feed(sound[first : first + size]))
        first += size
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-6)


@pytest.mark.parametrize("rate", [48_000, 44_100, 96_000, 8_000])
def test_every_sample_lies_at_its_own_moment(rate: int) -> None:
    given = Resampler(rate, 16_000).feed(sine(rate, 1000.0))
    expected = np.sin(2 * np.pi * 1000.0 * np.arange(len(given)) / 16_000)
    np.testing.assert_allclose(given[200:], expected[200:], atol=1e-3)


@pytest.mark.parametrize("rate", [48_000, 44_100])
def test_what_the_lower_rate_cannot_hold_is_left_out(rate: int) -> None:
    given = Resampler(rate, 16_000).feed(sine(rate, 9_000.0))
    assert np.abs(given[200:]).max() < 10 ** (-60 / 20)


def test_it_answers_within_two_milliseconds() -> None:
    given = Resampler(48_000, 16_000).feed(np.zeros(4_800, np.float32))
    assert 0.1 - len(given) / 16_000 < 0.002
    assert Resampler(48_000, 16_000).delay < 0.002


def test_the_same_rate_passes_as_it_is() -> None:
    block = sine(16_000, 300.0)
    assert Resampler(16_000, 16_000).feed(block) is block
