from __future__ import annotations

import pytest

from studio.render.face import FaceShape, face_shape


def test_no_shapes_are_a_resting_face() -> None:
    assert face_shape({}) == FaceShape()


@pytest.mark.parametrize(
    "values",
    [{"A": 1.0}, {"aa": 1.0}, {"JawOpen": 1.0}, {"jawOpen": 1.0}, {"mouth_oh_c": 1.0}, {"O": 1.0}],
)
def test_every_set_can_open_the_mouth(values: dict[str, float]) -> None:
    assert face_shape(values).open > 0.4


@pytest.mark.parametrize("values", [{"U": 1.0}, {"ou": 1.0}, {"MouthPucker": 1.0}, {"mouth_oo_c": 1.0}])
def test_every_set_can_round_the_lips(values: dict[str, float]) -> None:
    assert face_shape(values).round > 0.5


@pytest.mark.parametrize(
    "values", [{"Blink": 1.0}, {"EyeBlinkLeft": 1.0, "EyeBlinkRight": 1.0}, {"blink": 1.0}]
)
def test_every_set_can_blink(values: dict[str, float]) -> None:
    face = face_shape(values)
    assert (face.blink_left, face.blink_right) == (1.0, 1.0)


@pytest.mark.parametrize("name", ["Blink_L", "blinkLeft", "EyeBlinkLeft"])
def test_a_wink_closes_one_eye(name: str) -> None:
    face = face_shape({name: 1.0})
    assert (face.blink_left, face.blink_right) == (1.0, 0.0)


def test_joy_smiles_and_sorrow_does_not() -> None:
    assert face_shape({"Joy": 1.0}).smile > 0.5
    assert face_shape({"MouthSmileLeft": 1.0, "MouthSmileRight": 1.0}).smile > 0.5
    assert face_shape({"Sorrow": 1.0}).smile < -0.5


def test_the_faces_own_left_is_the_viewers_right() -> None:
    assert face_shape({"LookLeft": 1.0}).look[0] > 0
    assert face_shape({"EyeLookOutLeft": 1.0, "EyeLookInRight": 1.0}).look[0] > 0


def test_mouth_close_shuts_an_open_jaw() -> None:
    assert face_shape({"JawOpen": 0.5, "MouthClose": 0.5}).open < 0.1


def test_huge_values_stay_a_face() -> None:
    face = face_shape({"A": 50.0, "Joy": 50.0, "LookUp": -9.0})
    assert 0 <= face.open <= 1
    assert -1 <= face.smile <= 1
    assert face.look[1] == -1.0
