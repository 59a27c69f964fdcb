"""Tracked faces as channels: neutral taken off, the turn shared out, vowels and eyes made of shapes."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion import rotation
from studio.motion.channels import ARKIT_SHAPES, shape_set
from studio.motion.shape_sets import EXPRESSIONS, VRM_FACE, vrm_face
from studio.tracking.face import BONES, SHAPES, Calibration, channels, head_turn, neutral_of, usual_of


def weights(**values: float) -> np.ndarray:
    row = np.zeros((1, len(ARKIT_SHAPES)))
    for name, value in values.items():
        for place, known in enumerate(ARKIT_SHAPES):
            if known in (name, f"{name}Left", f"{name}Right"):
                row[0, place] = value
    return row


def turn(yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> np.ndarray:
    return np.atleast_2d(rotation.from_euler_yxz(*np.radians([yaw, pitch, roll])))


def test_the_channels_are_those_of_a_phone_with_vrms_vowels() -> None:
    shapes, turned = channels(weights(), turn(), Calibration())
    assert (shapes.shape, turned.shape) == ((1, len(SHAPES)), (1, len(BONES), 4))
    assert SHAPES[:52] == ARKIT_SHAPES
    assert shape_set(SHAPES) == "arkit"


def test_neck_and_head_together_make_the_turn() -> None:
    given = turn(20, -10, 15)
    turned = channels(weights(), given, Calibration())[1][0]
    whole = rotation.multiply(turned[0], turned[1])
    assert np.degrees(rotation.angle_between(whole, given[0])) < 1e-3
    assert rotation.angle_between(turned[0], rotation.IDENTITY) == pytest.approx(
        0.4 * rotation.angle_between(given[0], rotation.IDENTITY)
    )


def test_a_face_at_rest_is_calm_and_looks_ahead() -> None:
    rest, view = weights(BrowInnerUp=0.3, MouthShrugLower=0.2), turn(yaw=-18, pitch=9, roll=4)
    calibration = neutral_of(np.repeat(rest, 60, axis=0), np.repeat(view, 60, axis=0))
    shapes, turned = channels(rest, view, calibration)
    assert shapes.max() < 1e-6
    yaw, pitch, roll = np.degrees(rotation.to_euler_yxz(rotation.multiply(turned[0, 0], turned[0, 1])))
    assert abs(yaw) < 0.1
    assert abs(pitch) < 0.1
    assert roll == pytest.approx(4, abs=0.1)  # cameras stand upright: a tilt is the head's own
    full = channels(weights(BrowInnerUp=1.0), view, calibration)[0]
    assert full[0, ARKIT_SHAPES.index("BrowInnerUp")] == pytest.approx(1.0)


def test_gains_raise_what_a_camera_sees_too_little_of() -> None:
    shapes = channels(weights(JawOpen=0.4), turn(), Calibration(gains={"JawOpen": 1.5}))[0]
    assert shapes[0, ARKIT_SHAPES.index("JawOpen")] == pytest.approx(0.6)


def test_a_few_frames_tell_no_neutral() -> None:
    assert usual_of(np.ones((3, 52)), np.repeat(turn(), 3, axis=0), np.arange(3)).neutral.max() == 0.0


def test_what_the_camera_sees_is_mirrored_into_the_avatars_axes() -> None:
    """A head that leans and turns to its own left does so on the avatar, whose left is -X."""
    to_the_right_of_the_picture = rotation.to_matrix(rotation.from_euler_yxz(0.3, 0.1, -0.2))
    yaw, pitch, roll = rotation.to_euler_yxz(head_turn(to_the_right_of_the_picture))
    assert np.allclose([yaw, pitch, roll], [-0.3, 0.1, 0.2])


def test_eyes_turn_where_they_look() -> None:
    left = channels(weights(EyeLookOutLeft=1.0, EyeLookInRight=1.0), turn(), Calibration())[1][0, 2:]
    down = channels(weights(EyeLookDown=1.0), turn(), Calibration())[1][0, 2:]
    assert (rotation.to_euler_yxz(left)[0] < -0.4).all()  # the avatar's own left
    assert (rotation.to_euler_yxz(down)[1] > 0.3).all()


@pytest.mark.parametrize("vowel", ["A", "U", "O", "E"])
def test_a_pure_vowel_comes_back_as_itself(vowel: str) -> None:
    made = dict(zip(VRM_FACE, vrm_face(weights(**EXPRESSIONS[vowel]))[0], strict=True))
    assert made[vowel] > 0.95
    assert max(value for name, value in made.items() if name != vowel) < 0.1


def test_a_wide_mouth_is_mostly_i_and_a_blink_blinks() -> None:
    made = dict(zip(VRM_FACE, vrm_face(weights(**EXPRESSIONS["I"], EyeBlinkLeft=0.9))[0], strict=True))
    assert made["I"] == max(made[name] for name in "AIUEO")
    assert (made["Blink_L"], made["Blink_R"], made["Blink"]) == (0.9, 0.0, 0.0)
