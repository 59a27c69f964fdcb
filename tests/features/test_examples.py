"""Takes on one frame grid with their sound, and how crops of them vary."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from studio.features.audio_spec import AudioSpec
from studio.features.examples import Augmentation, CropShape, Example, cached_rows, cut, make_example
from studio.features.motion import fit
from studio.motion import Motion
from studio.motion.grid import learnt_rate, nominal_rate, on_grid
from tests.tolerance import LAST_BITS_DB

SPEC = AudioSpec()


def example(seconds: float = 4.0) -> Example:
    t = np.arange(int(seconds * 30)) / 30
    motion = Motion.build(t, ("A",), (t / seconds)[:, None])
    samples = np.random.default_rng(0).normal(0, 0.1, int(seconds * 16000)).astype(np.float32)
    return make_example(
        "a", samples, on_grid(motion, seconds, Fraction(30)), fit([motion]), SPEC, Fraction(30), None
    )


@pytest.mark.parametrize(
    ("measured", "learnt"),
    [(29.97, Fraction(30000, 1001)), (30.02, Fraction(30)), (59.9, Fraction(30)), (60.4, Fraction(30)),
     (90.0, Fraction(30)), (120.1, Fraction(30)), (25.0, Fraction(25)), (50.0, Fraction(25))],
)  # fmt: skip
def test_fast_takes_are_learnt_at_a_whole_fraction_of_their_rate(measured: float, learnt: Fraction) -> None:
    assert abs(float(learnt_rate(measured, 30.0) - learnt)) < 0.01
    assert abs(nominal_rate(measured) - measured) < 1


def test_true_times_are_kept_where_frames_are_uneven() -> None:
    """SAIA's notebook overwrote timestamps with row numbers."""
    t = np.sort(np.random.default_rng(1).uniform(0, 4, 200))
    motion = Motion.build(t, ("A",), (t / 4)[:, None])
    grid = on_grid(motion, 4.0, Fraction(30))
    inside = (grid.motion.times > t[0]) & (grid.motion.times < t[-1])
    np.testing.assert_allclose(grid.motion.shapes[inside, 0], grid.motion.times[inside] / 4, atol=1e-6)


def test_gaps_and_excluded_spans_do_not_count() -> None:
    t = np.concatenate([np.arange(0, 1, 1 / 30), np.arange(2, 3, 1 / 30)])
    grid = on_grid(Motion.build(t, ("A",), t[:, None] / 3), 3.0, Fraction(30), [(2.5, 2.6)])
    assert grid.valid[:29].all()
    assert not grid.valid[31:59].any()
    assert grid.valid[61:74].all()
    assert not grid.valid[75:77].any()


def test_features_are_kept_by_content(tmp_path: Path) -> None:
    sound = np.random.default_rng(2).normal(0, 0.1, 16000).astype(np.float32)
    first = cached_rows(sound, SPEC, Fraction(30), 0, 100, tmp_path)
    kept = list(tmp_path.iterdir())
    assert len(kept) == 1
    np.testing.assert_array_equal(cached_rows(sound, SPEC, Fraction(30), 0, 100, tmp_path), first)
    assert list(tmp_path.iterdir()) == kept
    cached_rows(sound * 0.5, SPEC, Fraction(30), 0, 100, tmp_path)
    assert len(list(tmp_path.iterdir())) == 2
    kept[0].write_bytes(b"damaged")
    np.testing.assert_allclose(
        cached_rows(sound, SPEC, Fraction(30), 0, 100, tmp_path), first, atol=LAST_BITS_DB
    )


def test_whatever_changes_the_rows_changes_their_key_and_nothing_else_does() -> None:
    plain = AudioSpec()
    speech = replace(plain, kind="speech", encoder="a/b", encoder_width=16, encoder_digest="1")
    others = [
        replace(plain, bands=41), replace(plain, window_ms=30.0), replace(plain, steps_per_frame=2),
        replace(plain, kind="mfcc"), speech, replace(speech, encoder_digest="2"),
        replace(speech, encoder="c"),
    ]  # fmt: skip
    assert len({one.cache_key for one in (plain, *others)}) == 8
    assert replace(plain, encoder="c").cache_key == plain.cache_key, "no encoder is asked"
    assert replace(speech, bands=41).cache_key == speech.cache_key, "no band is in its rows"


def test_a_plain_crop_is_the_take_itself() -> None:
    one, shape = example(), CropShape(20, 8, 4, SPEC)
    crop = cut(one, 30, shape, Augmentation(), None)
    np.testing.assert_array_equal(crop.rows, one.rows(30 * 4 - 8, 92))
    np.testing.assert_allclose(crop.values, one.values[30:50])
    assert crop.weight.all()


def test_stretching_keeps_sound_and_motion_together() -> None:
    """A ramp in both: wherever the crop is stretched to, rows and values tell the same moment."""
    one = example()
    ramp = (np.arange(len(one.sound)) - one.lead - 1.5)[:, None] / 4  # the frame each row belongs to
    moments = Example("r", np.tile(ramp, (1, 40)).astype(np.float32), one.lead,
                      np.arange(one.frames, dtype=np.float32)[:, None], one.mask, one.grid)  # fmt: skip
    crop = cut(moments, 20, CropShape(30, 0, 0, SPEC), Augmentation(stretch=0.3), np.random.default_rng(4))
    seen = crop.rows[:, 0].reshape(30, 4).mean(axis=1)
    np.testing.assert_allclose(seen, crop.values[:, 0], atol=1e-3)
    assert abs(np.diff(crop.values[:, 0]).mean() - 1) > 0.01


def test_frames_beyond_the_end_weigh_nothing() -> None:
    one = example()
    crop = cut(one, one.frames - 5, CropShape(20, 0, 0, SPEC), Augmentation(), None)
    assert crop.weight[:5].all()
    assert not crop.weight[5:].any()


def test_variation_follows_from_its_seed() -> None:
    vary = Augmentation(0.1, 6, 6, 20, 2, 5, 2, 5)
    shape = CropShape(20, 8, 4, SPEC)
    a, b = (cut(example(), 10, shape, vary, np.random.default_rng(9)) for _ in range(2))
    np.testing.assert_allclose(a.rows, b.rows, atol=LAST_BITS_DB)
    assert np.isfinite(a.rows).all()
