from __future__ import annotations

import pytest

from studio.motion.channels import ALL_BONES, ARKIT_SHAPES, VRM0_SHAPES, VRM1_SHAPES
from studio.playback.layers.regions import REGIONS, bone_region, lid_sides, shape_region, vowel


@pytest.mark.parametrize(
    ("region", "names"),
    [
        ("mouth", "A aa oh JawOpen mouthSmileLeft TongueOut Fcl_MTH_A あ"),
        ("brows", "BrowDownLeft browInnerUp Fcl_BRW_Joy"),
        ("eyes", "Blink blinkLeft Blink_R EyeBlinkRight EyeWideLeft LookUp lookLeft Fcl_EYE_Close まばたき"),
        ("face", "Joy happy Neutral CheekPuff NoseSneerLeft Surprised MyOwnShape"),
    ],
)
def test_shapes_of_every_set_have_their_region(region: str, names: str) -> None:
    assert {name: shape_region(name) for name in names.split()} == dict.fromkeys(names.split(), region)


def test_every_bone_has_a_region() -> None:
    regions = {name: bone_region(name) for name in ALL_BONES}
    assert set(regions.values()) <= set(REGIONS)
    assert regions["Neck"] == "head"
    assert regions["LeftEye"] == "eyes"
    assert regions["Jaw"] == "mouth"
    assert regions["Hips"] == regions["UpperChest"] == "torso"
    assert regions["RightShoulder"] == regions["LeftLowerArm"] == "arms"
    assert regions["LeftHand"] == regions["RightThumbDistal"] == "hands"
    assert regions["LeftToes"] == "legs"


@pytest.mark.parametrize(
    ("names", "both", "single"),
    [
        (VRM0_SHAPES, {"Blink"}, {"Blink_L", "Blink_R"}),
        (VRM1_SHAPES, {"blink"}, {"blinkLeft", "blinkRight"}),
        (ARKIT_SHAPES, set(), {"EyeBlinkLeft", "EyeBlinkRight"}),
        (("まばたき", "ウィンク", "A"), {"まばたき"}, {"ウィンク"}),
    ],
)
def test_lids_of_one_eye_are_told_from_those_of_both(
    names: tuple[str, ...], both: set[str], single: set[str]
) -> None:
    found = lid_sides(names)
    assert ({names[i] for i in found[0]}, {names[i] for i in found[1]}) == (both, single)


def test_the_vowels_of_both_sets_are_the_same_five() -> None:
    assert [vowel(name) for name in ("A", "ih", "U", "ee", "oh", "Joy")] == ["a", "i", "u", "e", "o", None]
