from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.motion.curve_channels import channels, first_choice, values


def _motion() -> Motion:
    t = np.arange(300) / 60
    shapes = np.stack([np.sin(t) ** 2, np.zeros(len(t)), (np.sin(9 * t) > 0.9).astype(float)], 1)
    turns = np.tile(rotation.IDENTITY, (len(t), 2, 1))
    turns[:, 1] = rotation.from_euler_yxz(0.5 * np.sin(t), 0 * t, 0 * t)
    return Motion.build(t, ("A", "Joy", "Blink"), shapes, ("Hips", "Head"), None, turns)


def test_what_moves_is_known_from_what_rests() -> None:
    moving = {channel.key for channel in channels(_motion()) if channel.moves}
    assert moving == {"A", "Blink", "Head turn"}


def test_mouth_blink_and_head_are_shown_unasked() -> None:
    assert first_choice(channels(_motion())) == ("A", "Blink", "Head turn")


def test_values_are_weights_and_degrees() -> None:
    motion = _motion()
    turn = values(motion, "Head turn")
    assert turn is not None
    np.testing.assert_allclose(turn, np.degrees(0.5 * np.sin(motion.times)), atol=1e-3)
    weight = values(motion, "A")
    assert weight is not None
    np.testing.assert_allclose(weight, motion.shapes[:, 0])


@pytest.mark.parametrize("key", ["Nose", "Head", "Head spin", "", "Hips.turn"])
def test_an_unknown_channel_has_no_values(key: str) -> None:
    assert values(_motion(), key) is None


def test_an_empty_motion_has_no_channels() -> None:
    assert channels(Motion.build([], ("A",))) == ()
