"""The last minutes of a performance: bounded, in sync on a drifting device, without what was said muted."""

from __future__ import annotations

import numpy as np
import pytest

from studio.errors import StudioError
from studio.inference.live.audio_source import AudioBlock
from studio.inference.live.last_minutes import LastMinutes
from studio.motion import Pose

RATE, BLOCK, FPS = 8_000, 160, 30.0
REST = {"Hips": np.array([0, 1, 0], np.float32), "Head": np.array([0, 0.6, 0], np.float32)}
BONES = ("Hips", "Head")


def click(t: float) -> float:
    """Where mouth and voice are both open: the first tenth of each second."""
    return float(t % 1.0 < 0.1)


def perform(
    ring: LastMinutes,
    seconds: float,
    drift: float = 1.0,
    names: tuple[str, ...] = ("A",),
    began: float = 50.0,
) -> None:
    """A device whose second is `drift` of ours, with clicks by our clock in the sound and in the shapes."""
    rng = np.random.default_rng(3)
    for i in range(round(seconds * RATE / BLOCK / drift)):
        t = began + i * BLOCK / RATE * drift
        samples = np.array([click(t + n / RATE * drift) for n in range(BLOCK)], np.float32) * 0.5
        ring.add_sound(AudioBlock(samples, RATE, t + rng.uniform(-0.003, 0.003), i == 0), muted=False)
        shapes = np.full(len(names), click(t), np.float32)
        turns = np.tile(np.array([0, 0, 0, 1], np.float32), (2, 1))
        pose = Pose(shapes, np.array(list(REST.values())), turns, np.zeros(3), turns[0])
        ring.note_pose(t, pose, names, BONES)


def test_sound_and_motion_agree_to_the_end_on_a_device_that_drifts() -> None:
    ring = LastMinutes(FPS, REST, seconds=120.0)
    perform(ring, 150.0, drift=1 + 400e-6)  # 48 ms in two minutes, if nobody looked
    kept = ring.kept()
    assert kept.sound.duration == pytest.approx(120.0, abs=0.5)
    assert kept.motion.times[-1] == pytest.approx(kept.sound.duration, abs=0.05)
    assert kept.motion.fps == pytest.approx(FPS)
    loud = np.flatnonzero(np.diff((kept.sound.samples[:, 0] > 0.2).astype(int)) == 1) / RATE
    opened = np.flatnonzero(np.diff((kept.motion.shapes[:, 0] > 0.5).astype(int)) == 1) / FPS
    for t in (*loud[:2], *loud[-2:]):
        assert np.abs(opened - t).min() < 1.5 / FPS
    assert kept.motion.positions[0, 1] == pytest.approx(REST["Head"])
    assert kept.info("toy_001", "Mic").predicted


def test_it_holds_no_more_than_its_minutes_and_lost_sound_is_silence() -> None:
    ring = LastMinutes(FPS, REST, seconds=4.0)
    perform(ring, 6.0)
    assert ring.seconds == pytest.approx(4.0, abs=BLOCK / RATE)
    perform(ring, 1.0, began=57.0)  # a second was lost
    assert ring.kept().sound.duration == pytest.approx(4.0, abs=0.1)
    assert ring.seconds == pytest.approx(4.0, abs=BLOCK / RATE)


def test_what_is_said_muted_is_not_kept_and_other_channels_join() -> None:
    ring = LastMinutes(FPS, REST)
    with pytest.raises(StudioError, match="nothing to keep yet"):
        ring.kept()
    perform(ring, 2.0)
    perform(ring, 2.0, names=("A", "Joy"), began=52.0)
    for i in range(100):
        ring.add_sound(
            AudioBlock(np.ones(BLOCK, np.float32), RATE, 54.0 + i * BLOCK / RATE, False), muted=True
        )
    perform(ring, 1.0, began=56.0)
    kept = ring.kept()
    assert kept.motion.shape_names == ("A", "Joy")
    muted = kept.sound.samples[round(4.05 * RATE) : round(5.95 * RATE)]
    assert len(muted)
    assert not muted.any()
