"""Names and their order."""

import pytest

from studio.motion import channels


def test_the_saia_layout_is_396_wide() -> None:
    assert channels.SAIA_WIDTH == 396
    assert len(channels.BONES) == 54
    assert "Jaw" not in channels.BONES
    assert list(channels.BONES) == sorted(channels.BONES)
    assert len(channels.VRM0_SHAPES) == 18
    assert len(channels.ARKIT_SHAPES) == 52


@pytest.mark.parametrize(
    "names", [channels.VRM0_SHAPES, channels.VRM1_SHAPES, channels.ARKIT_SHAPES, channels.ALL_BONES]
)
def test_no_name_is_there_twice(names: tuple[str, ...]) -> None:
    assert len({name.lower() for name in names}) == len(names)


def test_vrm0_and_vrm1_names_translate_both_ways() -> None:
    for old in channels.VRM0_SHAPES:
        assert channels.VRM1_TO_VRM0[channels.VRM0_TO_VRM1[old]] == old


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ((), "none"),
        (channels.VRM0_SHAPES, "vrm0"),
        (channels.VRM1_SHAPES, "vrm1"),
        (channels.ARKIT_SHAPES, "arkit"),
        (tuple(n.lower() for n in channels.ARKIT_SHAPES), "arkit"),
        ((*channels.VRM0_SHAPES, *channels.ARKIT_SHAPES), "arkit"),
        (channels.VRM0_SHAPES[:10], "vrm0"),
        (("Smile", "Frown"), "custom"),
        (("A",), "custom"),
    ],
)
def test_a_set_is_known_by_most_of_its_names(names: tuple[str, ...], expected: str) -> None:
    assert channels.shape_set(names) == expected


@pytest.mark.parametrize("name", ["A", "aa", "JawOpen", "mouthSmileLeft", "TongueOut", "LipPucker", "oh"])
def test_mouth_shapes(name: str) -> None:
    assert channels.is_mouth_shape(name)


@pytest.mark.parametrize("name", ["Blink", "Angry", "BrowInnerUp", "CheekPuff", "Neutral"])
def test_other_shapes(name: str) -> None:
    assert not channels.is_mouth_shape(name)


def test_names_in_any_case_get_their_known_spelling() -> None:
    assert channels.canonical_bone("leftUPPERarm") == "LeftUpperArm"
    assert channels.canonical_bone("Tail") == "Tail"
    assert channels.canonical_shape("jawopen") == "JawOpen"
    assert channels.canonical_shape("BLINK_l") == "Blink_L"
    assert channels.canonical_shape("MyShape") == "MyShape"


@pytest.mark.parametrize("names", [channels.VRM0_SHAPES, channels.VRM1_SHAPES, channels.ARKIT_SHAPES])
def test_a_name_spelled_as_its_set_spells_it_stays(names: tuple[str, ...]) -> None:
    assert tuple(channels.canonical_shape(name) for name in names) == names


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("LeftUpperArm", "leftUpperArm"),
        ("LeftThumbProximal", "leftThumbMetacarpal"),
        ("RightThumbIntermediate", "rightThumbProximal"),
        ("RightThumbDistal", "rightThumbDistal"),
        ("LeftIndexProximal", "leftIndexProximal"),
    ],
)
def test_vrm1_bones_shift_the_thumb(old: str, new: str) -> None:
    assert channels.vrm1_bone(old) == new


@pytest.mark.parametrize(("name", "is_blink"), [("Blink_L", True), ("eyeBlinkRight", True), ("A", False)])
def test_blink_shapes(name: str, is_blink: bool) -> None:
    assert channels.is_blink_shape(name) is is_blink
