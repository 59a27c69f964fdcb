"""Avatars that are broken or mean harm: one sentence, no crash, no fetching, no memory without bounds."""

from __future__ import annotations

import io
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio import formats
from studio.errors import StudioError
from studio.formats import _glb
from tests.formats.avatars import Maker
from tests.formats.test_vrma import document_of, with_document

Document = dict[str, Any]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Maker(1).write(tmp_path_factory.mktemp("avatar") / "good.vrm")


def changed(good: Path, tmp_path: Path, change: Callable[[Document], None]) -> Path:
    file = tmp_path / "x.vrm"
    file.write_bytes(good.read_bytes())
    document = document_of(file)
    change(document)
    with_document(file, document)
    return file


def positions_of(document: Document) -> Document:
    index = document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    found: Document = document["accessors"][index]
    return found


def claim_four_billion(document: Document) -> None:
    positions_of(document)["count"] = 2**32


def claim_four_billion_zeros(document: Document) -> None:
    accessor = positions_of(document)
    accessor["count"] = 2**32
    del accessor["bufferView"]


def reach_beyond_the_file(document: Document) -> None:
    document["bufferViews"][positions_of(document)["bufferView"]]["byteOffset"] = 2**40


def hang_in_a_circle(document: Document) -> None:
    document["nodes"][2]["children"] = [1]


def have_a_child_that_is_not_there(document: Document) -> None:
    document["nodes"][0]["children"] = [10**9]


def stand_nowhere(document: Document) -> None:
    document["nodes"][1]["translation"] = [float("nan"), 0, 0]


def scale_beyond_numbers(document: Document) -> None:
    document["nodes"][1]["scale"] = [1e308, 1e308, 1e308]
    document["nodes"][0]["scale"] = [1e308, 1e308, 1e308]


def hold_text_for_numbers(document: Document) -> None:
    document["nodes"][1]["translation"] = ["a", "b", "c"]


def have_no_bones(document: Document) -> None:
    document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"] = {}


def have_bones_nowhere(document: Document) -> None:
    document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]["hips"]["node"] = 10**6


def be_no_avatar(document: Document) -> None:
    del document["extensions"]


def lie_elsewhere(document: Document) -> None:
    document["buffers"][0]["uri"] = "http://example.invalid/body.bin"


def hang_from_no_joint(document: Document) -> None:
    document["skins"][0]["joints"] = [1]


def name_a_morph_by_text(document: Document) -> None:
    document["extensions"]["VRMC_vrm"]["expressions"]["preset"]["aa"]["morphTargetBinds"][0]["index"] = "x"


def name_one_array_often(document: Document) -> None:
    primitive = document["meshes"][1]["primitives"][0]
    del primitive["targets"]
    document["meshes"][1]["primitives"] = [primitive] * 5000


def name_one_morph_often(document: Document) -> None:
    primitive = document["meshes"][1]["primitives"][0]
    primitive["targets"] = primitive["targets"][:1] * 100_000


def be_in_a_thousand_and_one_parts(document: Document) -> None:
    """Each of one triangle."""
    document["accessors"].append(positions_of(document) | {"count": 3})
    primitive = {"attributes": {"POSITION": len(document["accessors"]) - 1}}
    document["meshes"].append({"primitives": [primitive] * 1001})
    document["nodes"][1]["mesh"] = len(document["meshes"]) - 1


def have_a_million_vertices(document: Document) -> None:
    primitive = document["meshes"][0]["primitives"][0]
    accessor = positions_of(document)
    accessor["count"] = 500_000
    del accessor["bufferView"], primitive["indices"]
    primitive["attributes"] = {"POSITION": primitive["attributes"]["POSITION"]}
    document["meshes"][0]["primitives"] = [primitive] * 2


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (have_a_million_vertices, "x.vrm is too large to show."),
        (claim_four_billion, "x.vrm is cut short or damaged."),
        (claim_four_billion_zeros, "x.vrm is cut short or damaged."),
        (reach_beyond_the_file, "x.vrm is cut short or damaged."),
        (hang_in_a_circle, "x.vrm is damaged."),
        (have_a_child_that_is_not_there, "x.vrm is damaged."),
        (stand_nowhere, "x.vrm is damaged."),
        (scale_beyond_numbers, "x.vrm is damaged."),
        (hold_text_for_numbers, "x.vrm is damaged."),
        (have_no_bones, "x.vrm has no humanoid skeleton."),
        (have_bones_nowhere, "x.vrm is damaged."),
        (be_no_avatar, "x.vrm is not a VRM avatar."),
        (lie_elsewhere, "x.vrm stores its numbers in a way the studio cannot read."),
        (hang_from_no_joint, "x.vrm is damaged."),
        (name_a_morph_by_text, "x.vrm is damaged."),
        (name_one_array_often, "x.vrm is too large to show."),
        (be_in_a_thousand_and_one_parts, "x.vrm is too large to show."),
        (name_one_morph_often, "x.vrm is too large to show."),
    ],
)
def test_a_hostile_avatar_is_one_sentence(
    good: Path, tmp_path: Path, change: Callable[[Document], None], what: str
) -> None:
    file = changed(good, tmp_path, change)
    with pytest.raises(StudioError) as error:
        formats.read_avatar(file)
    assert error.value.what == what
    assert error.value.remedy.endswith(".")


@pytest.mark.parametrize("change", [claim_four_billion, claim_four_billion_zeros, reach_beyond_the_file])
def test_memory_follows_the_file_not_what_it_claims(
    good: Path, tmp_path: Path, change: Callable[[Document], None]
) -> None:
    file = changed(good, tmp_path, change)
    tracemalloc.start()
    with pytest.raises(StudioError):
        formats.read_avatar(file)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6


def name_one_group_often(document: Document) -> None:
    """15,000 colliders, and each spring names their group 15,000 times: 225 million pairs."""
    ball = {"offset": {"x": 0, "y": 0, "z": 0}, "radius": 0.1}
    document["extensions"]["VRM"]["secondaryAnimation"] = {
        "colliderGroups": [{"node": 0, "colliders": [ball] * 15_000}],
        "boneGroups": [{"bones": [1], "colliderGroups": [0] * 15_000}],
    }


def name_one_collider_often(document: Document) -> None:
    document["extensions"]["VRMC_springBone"] = {
        "colliders": [{"node": 0, "shape": {"sphere": {"radius": 0.1}}}],
        "colliderGroups": [{"colliders": [0] * 15_000}],
        "springs": [{"joints": [{"node": 1}, {"node": 2}], "colliderGroups": [0] * 15_000}],
    }


def touch_all_from_everywhere(document: Document) -> None:
    """A thousand groups of all colliders, and springs that name all of them."""
    document["extensions"]["VRMC_springBone"] = {
        "colliders": [{"node": 0, "shape": {"sphere": {"radius": 0.1}}}] * 300,
        "colliderGroups": [{"colliders": list(range(300))}] * 300,
        "springs": [{"joints": [{"node": 1}, {"node": 2}], "colliderGroups": list(range(300))}] * 300,
    }


@pytest.mark.parametrize(
    ("version", "change", "swinging"),
    [
        (0, name_one_group_often, 0),
        (1, name_one_collider_often, 1),
        (1, touch_all_from_everywhere, 0),
    ],
)
def test_memory_does_not_grow_with_what_springs_name_again_and_again(
    tmp_path: Path, version: int, change: Callable[[Document], None], swinging: int
) -> None:
    file = changed(Maker(version).write(tmp_path / "good.vrm"), tmp_path, change)
    tracemalloc.start()
    avatar = formats.read_avatar(file)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6
    assert len(avatar.rig.joints) == swinging
    assert len(avatar.rig.colliders) <= 1
    too_many = "Its hair and clothes stay still: they have more springs than the studio can move."
    assert avatar.notes == (() if swinging else (too_many,))


def test_what_hangs_from_a_spring_is_walked_once_however_often_its_root_is_named(tmp_path: Path) -> None:
    """A walk of 8,000 nodes takes milliseconds, 300,000 of them the better part of an hour."""

    def hang(document: Document) -> None:
        first = len(document["nodes"])
        document["nodes"] += [{} for _ in range(8_000)]
        document["nodes"][0].setdefault("children", []).append(first)
        document["nodes"][first]["children"] = list(range(first + 1, first + 8_000))
        group = {"bones": [first] * 300_000}
        document["extensions"]["VRM"]["secondaryAnimation"] = {"boneGroups": [group], "colliderGroups": []}

    avatar = formats.read_avatar(changed(Maker(0).write(tmp_path / "good.vrm"), tmp_path, hang))
    assert not avatar.rig.joints
    assert len(avatar.notes) == 1


@pytest.mark.parametrize("share", [0.0, 0.0001, 0.3, 0.9, 0.999])
def test_a_file_cut_anywhere_is_one_sentence(good: Path, tmp_path: Path, share: float) -> None:
    file = tmp_path / "x.vrm"
    data = good.read_bytes()
    file.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(StudioError) as error:
        formats.read_avatar(file)
    assert error.value.what in (
        "x.vrm is cut short or damaged.",
        "x.vrm holds no avatar.",
    )


def test_numbers_that_are_none_are_one_sentence(good: Path, tmp_path: Path) -> None:
    file = changed(good, tmp_path, lambda document: None)
    view = document_of(file)["bufferViews"][positions_of(document_of(file))["bufferView"]]
    data = bytearray(file.read_bytes())
    start = len(data) - len(_glb.read(file).data) + view["byteOffset"]
    data[start : start + 4] = np.float32(np.nan).tobytes()
    file.write_bytes(data)
    with pytest.raises(StudioError) as error:
        formats.read_avatar(file)
    assert error.value.what == "x.vrm is damaged."


def test_random_damage_never_gets_further_than_a_sentence(good: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    whole = good.read_bytes()
    file, told = tmp_path / "x.vrm", ["x.vrm "]
    for _ in range(60):
        data = bytearray(whole)
        for place in rng.integers(12, 30_000, size=6):
            data[place] = rng.integers(256)
        file.write_bytes(data)
        try:
            formats.read_avatar(file)
        except StudioError as error:
            told.append(error.what)
    assert len(told) > 5
    assert all(sentence.startswith("x.vrm ") for sentence in told)


@pytest.mark.parametrize("uri", ["http://example.invalid/face.png", "file:///etc/passwd", "../face.png"])
def test_pictures_that_lie_elsewhere_are_never_fetched(good: Path, tmp_path: Path, uri: str) -> None:
    def point(document: Document) -> None:
        document["images"] = [{"uri": uri}]

    avatar = formats.read_avatar(changed(good, tmp_path, point))
    assert all(material.picture is None for material in avatar.materials)
    assert avatar.notes == ("Some of its textures cannot be shown; plain colours are used instead.",)


@pytest.mark.parametrize("lost", ["textures", "images"])
def test_pictures_that_are_missing_leave_plain_colours(good: Path, tmp_path: Path, lost: str) -> None:
    avatar = formats.read_avatar(changed(good, tmp_path, lambda document: document.pop(lost)))
    assert all(material.picture is None for material in avatar.materials)
    assert avatar.notes == ("Some of its textures cannot be shown; plain colours are used instead.",)


@pytest.mark.parametrize("values", [{"WEIGHTS_0": np.nan}, {"WEIGHTS_0": np.inf}, {"POSITION": np.nan}])
def test_weights_that_are_no_numbers_are_one_sentence(
    good: Path, tmp_path: Path, values: dict[str, float]
) -> None:
    ((name, value),) = values.items()
    document = document_of(good)
    accessor = document["accessors"][document["meshes"][1]["primitives"][0]["attributes"][name]]
    start = len(good.read_bytes()) - len(_glb.read(good).data)
    start += document["bufferViews"][accessor["bufferView"]]["byteOffset"]
    data = bytearray(good.read_bytes())
    data[start : start + 4] = np.float32(value).tobytes()
    file = tmp_path / "x.vrm"
    file.write_bytes(data)
    with pytest.raises(StudioError) as error:
        formats.read_avatar(file)
    assert error.value.what == "x.vrm is damaged."


def test_a_picture_that_claims_to_be_huge_is_left_out(tmp_path: Path) -> None:
    class Huge(Maker):
        def _picture(self) -> bytes:
            from PIL import Image

            data = io.BytesIO()
            Image.new("1", (9000, 9000)).save(data, "PNG")  # small in the file, 324 MB in colour
            return data.getvalue()

    avatar = formats.read_avatar(Huge(0).write(tmp_path / "x.vrm"))
    assert all(material.picture is None for material in avatar.materials)


def test_a_picture_is_made_small(tmp_path: Path) -> None:
    class Large(Maker):
        def _picture(self) -> bytes:
            from PIL import Image

            data = io.BytesIO()
            Image.new("RGB", (3000, 1500), "red").save(data, "JPEG")
            return data.getvalue()

    avatar = formats.read_avatar(Large(0).write(tmp_path / "x.vrm"))
    pictures = [material.picture for material in avatar.materials if material.picture is not None]
    assert [picture.shape for picture in pictures] == [(512, 1024, 4)]
    assert pictures[0][0, 0, 0] > 240


def test_what_only_the_wearer_sees_is_not_shown(good: Path, tmp_path: Path) -> None:
    def hide(document: Document) -> None:
        face = len(document["nodes"]) - 1
        annotation = {"node": face, "type": "firstPersonOnly"}
        document["extensions"]["VRMC_vrm"]["firstPerson"] = {"meshAnnotations": [annotation]}

    avatar = formats.read_avatar(changed(good, tmp_path, hide))
    assert [surface.name for surface in avatar.surfaces] == ["からだ"]
    assert not avatar.has_face


def test_what_the_file_allows_is_told(tmp_path: Path) -> None:
    avatar = formats.read_avatar(Maker(0).write(tmp_path / "私の アバター.vrm"))
    assert avatar.name == "小さな Test"
    said = "By Saia Studio. Everyone may use it. Commercial use is allowed. Licence: CC0"
    assert avatar.licence.line == said


@pytest.mark.parametrize(
    ("name", "packer"),
    [("KHR_draco_mesh_compression", "Draco"), ("EXT_meshopt_compression", "meshoptimizer")],
)
def test_a_compressed_avatar_says_what_it_was_compressed_by(
    good: Path, tmp_path: Path, name: str, packer: str
) -> None:
    file = changed(good, tmp_path, lambda document: document.update(extensionsRequired=[name]))
    with pytest.raises(StudioError) as refused:
        formats.read_avatar(file)
    assert refused.value.what == f"x.vrm is compressed by {packer}, which the studio cannot unpack."
    assert refused.value.remedy == "Export the avatar again without mesh compression."
