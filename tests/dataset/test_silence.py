from __future__ import annotations

import numpy as np
import pytest

from studio.dataset.silence import cuts, levels_dbfs, pauses

RATE = 16_000


def _speech(*spans: tuple[float, float], seconds: float, noise: float = 1e-3) -> np.ndarray:
    random = np.random.default_rng(2)
    t = np.arange(int(seconds * RATE)) / RATE
    loud = sum(((t >= a) & (t < b)).astype(float) for a, b in spans)
    voice = loud * (0.6 + 0.4 * np.sin(2 * np.pi * 4 * t)) * random.normal(size=len(t)) * 0.1
    return (voice + noise * random.normal(size=len(t))).astype(np.float32)


def test_pauses_are_found_where_nobody_speaks() -> None:
    sound = _speech((0.0, 3.0), (4.0, 7.0), (7.1, 10.0), seconds=12.0)
    found = pauses(levels_dbfs([sound], RATE))
    assert len(found) == 2, "a tenth of a second is no pause"
    assert found[0] == pytest.approx((3.0, 4.0), abs=0.1)
    assert found[1] == pytest.approx((10.0, 12.0), abs=0.1)


def test_a_steady_hiss_is_still_a_pause() -> None:
    sound = _speech((0.0, 3.0), (4.0, 7.0), seconds=7.0, noise=0.01)
    assert pauses(levels_dbfs([sound], RATE)) == (pytest.approx((3.0, 4.0), abs=0.1),)


@pytest.mark.parametrize("seconds", [0.0, 0.01, 3.0])
def test_nothing_is_cut_in_silence_or_in_one_long_noise(seconds: float) -> None:
    quiet = np.zeros(int(seconds * RATE), np.float32)
    noise = np.random.default_rng(0).normal(size=int(seconds * RATE)).astype(np.float32) * 0.1
    assert cuts(levels_dbfs([quiet], RATE)) == ()
    assert cuts(levels_dbfs([noise], RATE)) == ()


def test_cuts_lie_in_pauses_and_leave_no_scraps() -> None:
    sound = _speech((0.5, 4.0), (5.0, 6.0), (6.6, 10.0), (11.0, 14.5), seconds=15.0)
    moments = cuts(levels_dbfs([sound], RATE))
    assert moments == (pytest.approx(4.5, abs=0.1), pytest.approx(10.5, abs=0.1)) or len(moments) == 2
    assert all(b - a >= 2.0 for a, b in zip((0.0, *moments), (*moments, 15.0), strict=True))


def test_blocks_of_any_size_give_the_same_levels() -> None:
    sound = _speech((0.0, 1.0), seconds=2.0)
    whole = levels_dbfs([sound], RATE)
    parts = levels_dbfs(np.array_split(sound, 17), RATE)
    np.testing.assert_allclose(parts, whole)
