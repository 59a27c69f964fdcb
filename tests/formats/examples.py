"""Motions and files that the tests of formats share."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.motion import Motion, Skeleton, rotation
from studio.motion.channels import BONES, VRM0_SHAPES

DATA = Path(os.environ.get("SAIA_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))


def needs_data(part: str) -> Path:
    """A folder of the real recordings; skips the test where they are absent."""
    folder = DATA / part
    if not folder.is_dir():
        pytest.skip(f"the real recordings are not at {folder} (SAIA_DATA)")
    return folder


def a_motion(frames: int = 30, fps: float = 60.0, shapes: tuple[str, ...] = VRM0_SHAPES) -> Motion:
    """All bones swinging about axes of their own, hips wandering, shapes rising and falling."""
    rng = np.random.default_rng(7)
    t = np.arange(frames) / fps
    axes = rng.normal(size=(len(BONES), 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    angles = 0.6 * np.sin(2.0 * t[:, None] + rng.uniform(0, 6, len(BONES)))
    positions = np.tile(Skeleton.humanoid(BONES).rest_positions, (frames, 1, 1))
    positions[:, BONES.index("Hips")] += 0.05 * np.sin(t)[:, None]
    weights = 0.5 + 0.5 * np.sin(t[:, None] * 3 + np.arange(len(shapes)))
    turns = rotation.from_axis_angle(axes[None], angles)
    return Motion.build(t, shapes, weights, BONES, positions, turns)


def a_sound(path: Path, seconds: float = 0.5, rate: int = 16000, channels: int = 1) -> Path:
    """A tone in a sound file; the suffix says which kind."""
    t = np.arange(int(seconds * rate)) / rate
    tone = 0.3 * np.sin(2 * np.pi * 220 * t).astype(np.float32)
    path.parent.mkdir(parents=True, exist_ok=True)
    soundfile.write(path, np.tile(tone[:, None], (1, channels)), rate)
    return path


def assert_same_motion(got: Motion | None, wanted: Motion, atol: float = 1e-5) -> None:
    """Whether two motions stand alike, whatever the order of their channels."""
    assert got is not None
    np.testing.assert_allclose(got.times, wanted.times, atol=1e-6)
    shapes = [got.shape_names.index(name) for name in wanted.shape_names]
    np.testing.assert_allclose(got.shapes[:, shapes], wanted.shapes, atol=atol)
    bones = [got.bone_names.index(name) for name in wanted.bone_names]
    np.testing.assert_allclose(got.positions[:, bones], wanted.positions, atol=max(atol, 1e-5))
    assert rotation.angle_between(got.rotations[:, bones], wanted.rotations).max(initial=0.0) < 1e-3
