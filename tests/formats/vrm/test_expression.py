"""Faces of VRM 0 and 1 files: what they make of materials, and how the eyes look."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from studio import formats
from studio.formats._vrm.expression import read_look_at
from studio.motion.avatar import Avatar
from studio.motion.look_at import LookAt
from studio.motion.material import MaterialBind
from tests.formats.avatars import Maker
from tests.formats.test_vrma import document_of, with_document

Document = dict[str, Any]


def an_avatar(tmp_path: Path, version: int, change: Any) -> Avatar:
    file = Maker(version).write(tmp_path / "x.vrm")
    document = document_of(file)
    change(document)
    with_document(file, document)
    return formats.read_avatar(file)


def joy_of(document: Document) -> Document:
    if "VRM" in document["extensions"]:
        groups = document["extensions"]["VRM"]["blendShapeMaster"]["blendShapeGroups"]
        found: Document = next(group for group in groups if group["presetName"] == "joy")
    else:
        found = document["extensions"]["VRMC_vrm"]["expressions"]["preset"]["happy"]
    return found


def test_vrm1_binds_colours_and_textures(tmp_path: Path) -> None:
    def bind(document: Document) -> None:
        document["materials"][0]["extensions"] = {
            "KHR_materials_emissive_strength": {"emissiveStrength": 4.0}
        }
        joy_of(document)["materialColorBinds"] = [
            {"material": 0, "type": "color", "targetValue": [1, 0.5, 0, 0.25]},
            {"material": 0, "type": "emissionColor", "targetValue": [0.5, 0, 0, 1]},
        ]
        joy_of(document)["textureTransformBinds"] = [{"material": 1, "offset": [0.5, 0.25]}]

    avatar = an_avatar(tmp_path, 1, bind)
    assert avatar.face.moved_by("joy")[0].looks == (
        MaterialBind(0, "colour", (1.0, 0.5, 0.0, 0.25)),
        MaterialBind(0, "glow", (2.0, 0.0, 0.0)),
        MaterialBind(1, "scale", (1.0, 1.0)),
        MaterialBind(1, "offset", (0.5, 0.25)),
    )
    assert avatar.changing_parts == {0: {"colour", "glow"}, 1: {"scale", "offset"}}
    half = avatar.material_values({"happy": 0.5})
    assert half[0]["colour"] == pytest.approx((0.56, 0.4, 0.3, 0.625))
    assert half[0]["glow"] == pytest.approx((1.0, 0.0, 0.0))
    assert half[1] == {"offset": (0.25, 0.125), "scale": (1.0, 1.0)}
    assert avatar.material_values({})[0]["colour"] == pytest.approx((0.12, 0.3, 0.6, 1.0))


def test_vrm0_values_are_unitys(tmp_path: Path) -> None:
    def bind(document: Document) -> None:
        joy_of(document)["materialValues"] = [
            {"materialName": "cloth", "propertyName": "_Color", "targetValue": [1, 0.5, 0, 0.5]},
            {"materialName": "skin", "propertyName": "_MainTex_ST", "targetValue": [0.5, 0.5, 0.25, 0.0]},
        ]

    looks = an_avatar(tmp_path, 0, bind).face.moved_by("joy")[0].looks
    assert looks[0] == MaterialBind(0, "colour", (1.0, pytest.approx(0.2140411), 0.0, 0.5))
    # v counts from the top here.
    assert looks[1:] == (MaterialBind(1, "scale", (0.5, 0.5)), MaterialBind(1, "offset", (0.25, 0.5)))


def test_vrm0_may_move_a_picture_along_one_axis(tmp_path: Path) -> None:
    def bind(document: Document) -> None:
        joy_of(document)["materialValues"] = [
            {"materialName": "skin", "propertyName": "_MainTex_ST_T", "targetValue": [9, 1, 9, 0.25]},
        ]

    looks = an_avatar(tmp_path, 0, bind).face.moved_by("joy")[0].looks
    assert looks == (MaterialBind(1, "scale", (1.0, 1.0)), MaterialBind(1, "offset", (0.0, -0.25)))


@pytest.mark.parametrize("bind", [
    {"material": 99, "type": "color", "targetValue": [1, 1, 1, 1]},
    {"material": 0, "type": "color", "targetValue": [float("nan"), 1, 1, 1]},
    {"material": 0, "type": "rimColor", "targetValue": [1, 1, 1, 1]},  # it is no MToon
    {"material": 0, "type": "smell", "targetValue": [1, 1, 1, 1]},
    {"material": 0, "type": "color", "targetValue": "red"},
    {}, None,
])  # fmt: skip
def test_a_bind_that_makes_no_sense_is_left_out(tmp_path: Path, bind: Any) -> None:
    avatar = an_avatar(tmp_path, 1, lambda document: joy_of(document).update(materialColorBinds=[bind]))
    assert avatar.face.moved_by("joy")[0].looks == ()
    assert avatar.face.moved_by("joy")[0].binds


def test_looking_is_as_vrm1_says() -> None:
    table = {"type": "expression", "rangeMapHorizontalOuter": {"inputMaxValue": 30, "outputScale": 0.5}}
    look_at = read_look_at({"lookAt": table}, old=False)
    assert look_at == LookAt(False, (90.0, 1.0), (30.0, 0.5), (90.0, 1.0), (90.0, 1.0))


def test_looking_is_as_vrm0_says() -> None:
    table = {"lookAtTypeName": "Bone", "lookAtVerticalUp": {"xRange": 60, "yRange": 20, "curve": [0] * 8}}
    assert read_look_at({"firstPerson": table}, old=True) == LookAt(True, up=(60.0, 20.0))
    by_shape = read_look_at({"firstPerson": {"lookAtTypeName": "BlendShape"}}, old=True)
    assert (by_shape.by_bones, by_shape.inner) == (False, (90.0, 1.0))


@pytest.mark.parametrize("table", [None, 3, {"rangeMapVerticalUp": "much"},
                                   {"rangeMapVerticalUp": {"inputMaxValue": float("nan")}}])  # fmt: skip
def test_looking_that_makes_no_sense_is_as_usual(table: Any) -> None:
    assert read_look_at({"lookAt": table}, old=False) == LookAt()


def test_a_binary_face_is_off_where_another_takes_its_place(tmp_path: Path) -> None:
    avatar = an_avatar(tmp_path, 1, lambda document: joy_of(document).update(overrideMouth="blend"))
    faces = tuple(replace(one, binary=one.name == "aa") for one in avatar.expressions)
    avatar = replace(avatar, expressions=faces)
    joy, open_mouth = avatar.face.moved_by("joy")[0].binds[0][1], avatar.face.moved_by("a")[0].binds[0][1]
    alone, beside = (avatar.morph_weights({"aa": 1.0, "happy": joyful})[1] for joyful in (0.0, 0.1))
    assert (alone[open_mouth], beside[open_mouth], beside[joy]) == pytest.approx((1.0, 0.0, 0.1))


def test_two_faces_together_leave_less_than_nothing_of_the_mouth(tmp_path: Path) -> None:
    def override(document: Document) -> None:
        for name in ("happy", "angry"):
            document["extensions"]["VRMC_vrm"]["expressions"]["preset"][name]["overrideMouth"] = "blend"

    avatar = an_avatar(tmp_path, 1, override)
    mouth = avatar.face.moved_by("a")[0].binds[0][1]
    weights = [avatar.morph_weights({"aa": 1.0, "happy": w, "angry": w})[1][mouth] for w in (0.25, 0.75)]
    # Their sum counts.
    assert weights == pytest.approx([0.5, 0.0])


def test_morph_targets_of_known_names_are_faces_too(tmp_path: Path) -> None:
    def rename(document: Document) -> None:
        names = document["meshes"][1]["extras"]["targetNames"]
        names[:3] = ["jawOpen", "EyeBlink_L", "nobody knows"]
        presets = document["extensions"]["VRMC_vrm"]["expressions"]["preset"]
        # One preset is gone, and one is left empty.
        del presets["angry"]
        presets["sad"]["morphTargetBinds"] = []

    avatar = an_avatar(tmp_path, 1, rename)
    found = {
        name: avatar.face.moved_by(name)[0].binds for name in ("JawOpen", "EyeBlinkLeft", "Angry", "sad")
    }
    places = [10, 9]  # of "sorrow" and "angry" among the targets
    assert found == {
        "JawOpen": ((1, 0, 1.0),), "EyeBlinkLeft": ((1, 1, 1.0),),
        "Angry": ((1, places[1], 1.0),), "sad": ((1, places[0], 1.0),),
    }  # fmt: skip
    assert avatar.face.moved_by("nobody knows") == ()
    # The vowel that the file has itself stays what it is.
    assert avatar.face.moved_by("aa")[0].binds == ((1, 0, 1.0),)
