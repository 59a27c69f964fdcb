"""Blend shapes of any set move an avatar's faces, by name or as a person has it."""

from __future__ import annotations

import pytest

from studio.motion.channels import ARKIT_SHAPES, VRM0_SHAPES, VRM1_SHAPES
from studio.motion.expression import NOTHING, Expression, FaceMap, key, meaning

BIND = ((0, 0, 1.0),)


def a_map(*names: str, **drivers: str) -> FaceMap:
    return FaceMap([Expression(name, BIND) for name in names], drivers)


def moved(face: FaceMap, shape: str) -> list[str]:
    return [one.name for one in face.moved_by(shape)]


@pytest.mark.parametrize(("name", "known"), [
    ("eyeBlinkLeft", "eyeblinkleft"), ("eye_blink_left", "eyeblinkleft"), ("EyeBlink_L", "eyeblinkleft"),
    ("eyeBlink.R", "eyeblinkright"), ("blendShape1.jawOpen", "jawopen"), ("Jaw Open", "jawopen"),
    ("Blink_L", "blink_l"), ("Blink.L", "blink_l"), ("blinkRight", "blink_r"), ("wink_right", "blink_r"),
    ("aa", "a"), ("vrc.v_aa", "a"), ("viseme_E", "e"), ("あ", "a"), ("Fcl_MTH_O", "o"),
    ("Face.M_F00_000_00_Fcl_EYE_Close_L", "blink_l"), ("Fcl_ALL_Joy", "joy"), ("Fcl_BRW_Joy", "fcl_brw_joy"),
    ("まばたき", "blink"), ("Surprise", "surprised"), ("びっくり", "surprised"), ("relaxed", "fun"),
    ("Smug", "smug"), ("l", "l"), ("", ""), ("...", "..."),
])  # fmt: skip
def test_names_of_every_common_set_are_known(name: str, known: str) -> None:
    assert meaning(name) == known


def test_every_standard_name_means_itself() -> None:
    for name in (*ARKIT_SHAPES, *VRM0_SHAPES, *VRM1_SHAPES):
        assert meaning(name) == key(name), name


def test_a_name_itself_comes_before_what_another_stands_for() -> None:
    face = a_map("smile", "joy", "Jaw_Open")
    assert moved(face, "Joy") == moved(face, "happy") == ["joy"]
    assert moved(face, "smile") == ["smile"]
    assert moved(face, "jawOpen") == moved(face, "JAW_OPEN") == ["Jaw_Open"]
    assert moved(a_map("smile"), "Joy") == ["smile"]


def test_a_person_may_choose_what_drives_a_face() -> None:
    face = a_map("joy", "Smug", "angry", Smug="MouthSmileLeft", angry="Joy")
    assert moved(face, "mouthSmileLeft") == ["Smug"]
    assert moved(face, "Smug") == []
    # One shape may drive several, beside those of its own name.
    assert moved(face, "Joy") == ["joy", "angry"]
    assert moved(face, "Angry") == []
    assert [face.driver(i) for i in range(3)] == ["joy", "mouthsmileleft", "joy"]


def test_a_face_may_be_driven_by_nothing() -> None:
    face = a_map("joy", joy=NOTHING)
    assert moved(face, "Joy") == []
    assert face.driver(0) == NOTHING
    assert face.played({"Joy": 1.0}) == []


def test_what_drives_each_face_is_told() -> None:
    face = a_map("happy", "eye_blink_left", "Smug", "joy")
    # The last one never moves: another one has its name.
    assert [face.driver(i) for i in range(4)] == ["joy", "eyeblinkleft", "smug", NOTHING]


def test_a_driven_face_stays_of_its_kind() -> None:
    faces = [Expression("aa", BIND), Expression("happy", BIND, overrides={"mouth": "block"})]
    face = FaceMap(faces, {"aa": "JawOpen"})
    assert [one.name for one, _ in face.played({"JawOpen": 1.0})] == ["aa"]
    assert [one.name for one, _ in face.played({"JawOpen": 1.0, "Joy": 0.1})] == ["happy"]
