"""Where sound meets motion in what is learnt: exact at any length, whatever the rates are."""

from __future__ import annotations

import numpy as np
import pytest

from studio.features.audio_spec import AudioSpec, frame_rate
from studio.features.examples import Augmentation, CropShape, cut, make_example
from studio.features.motion import fit
from studio.motion import Motion
from studio.motion.grid import on_grid

MINUTES = 30


@pytest.mark.parametrize("fps", [25.0, 29.97, 30.0])
@pytest.mark.parametrize("minute", [0.2, 15.0, 29.0])
def test_a_click_in_minute_29_is_learnt_with_the_frame_that_was_captured_then(
    fps: float, minute: float
) -> None:
    """SAIA's notebook was 18 s off after half an hour: it counted 896 samples a row where there are 905.2."""
    spec = AudioSpec(sample_rate=2000, bands=8, window_ms=50.0, steps_per_frame=2, window=2)
    rate = frame_rate(fps)
    frame = round(minute * 60 * rate)
    t = float(frame / rate)
    sound = np.zeros(MINUTES * 60 * spec.sample_rate, dtype=np.float32)
    sound[round(t * spec.sample_rate)] = 1.0
    # The tracker sends at a rate of its own, now and then a frame late; its times are true.
    times = np.arange(0, MINUTES * 60, 1 / 20.0) + np.random.default_rng(0).uniform(0, 0.01, MINUTES * 1200)
    motion = Motion.build(times, ("A",), np.clip(1 - np.abs(times - t) * 10, 0, 1)[:, None])
    layout = fit([motion])
    example = make_example("x", sound, on_grid(motion, MINUTES * 60, rate), layout, spec, rate, None)
    shape = CropShape(40, 0, 0, spec)
    crop = cut(example, frame - 20, shape, Augmentation(), np.random.default_rng(0))
    loudest = crop.rows.sum(axis=1).reshape(40, 2).max(axis=1)
    assert abs(int(np.argmax(loudest)) - 20) <= 1
    assert int(np.argmax(crop.values[:, 0])) == 20
