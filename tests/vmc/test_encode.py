"""What the sender puts on the wire, read by python-osc."""

import numpy as np
import pytest
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_message import OscMessage

from studio.motion import Pose, Skeleton
from studio.motion.channels import ARKIT_SHAPES, BONES, VRM0_SHAPES
from studio.vmc.assemble import FrameAssembler
from studio.vmc.encode import SendOptions, encode_frame, message

REST = Skeleton.humanoid(BONES).rest_positions


def a_pose(shapes: int = len(VRM0_SHAPES), seed: int = 0) -> Pose:
    rng = np.random.default_rng(seed)
    rotations = rng.normal(size=(len(BONES), 4))
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    return Pose(
        rng.random(shapes).astype(np.float32),
        REST.astype(np.float32),
        rotations.astype(np.float32),
        np.array([0.1, 0.2, 0.3], dtype=np.float32),
        np.array([0, 0, 0, 1], dtype=np.float32),
    )


def read(datagrams: list[bytes]) -> list[OscMessage]:
    """All messages in order, by the library other receivers use."""
    found: list[OscMessage] = []
    for datagram in datagrams:
        if OscBundle.dgram_is_bundle(datagram):
            found += list(OscBundle(datagram))
        else:
            found.append(OscMessage(datagram))
    return found


def test_a_bundled_frame_keeps_order_and_size() -> None:
    datagrams = encode_frame(a_pose(), VRM0_SHAPES, BONES, 12.5)
    addresses = [m.address for m in read(datagrams)]
    assert addresses == [
        "/VMC/Ext/OK", "/VMC/Ext/Root/Pos", *["/VMC/Ext/Bone/Pos"] * 54,
        *["/VMC/Ext/Blend/Val"] * 18, "/VMC/Ext/Blend/Apply", "/VMC/Ext/T",
    ]  # fmt: skip
    assert max(map(len, datagrams)) <= 1200
    assert all(sum(m.address.endswith("Bone/Pos") for m in OscBundle(d)) <= 13 for d in datagrams)


def test_the_largest_face_still_fits_small_datagrams() -> None:
    datagrams = encode_frame(a_pose(52), ARKIT_SHAPES, BONES, 0.0)
    assert max(map(len, datagrams)) <= 1200
    assert len(read(datagrams)) == 1 + 1 + 54 + 52 + 1 + 1


def test_state_says_loaded_and_calibrated() -> None:
    ok = read(encode_frame(a_pose(), VRM0_SHAPES, BONES, 0.0))[0]
    assert list(ok.params) == [1, 3, 0, 1]


def test_unbundled_sends_each_message_alone_and_only_what_was_asked_for() -> None:
    options = SendOptions(bundle=False, ok=False, root=False, sender_time=False)
    datagrams = encode_frame(a_pose(), VRM0_SHAPES, BONES, 0.0, options)
    assert len(datagrams) == 54 + 18 + 1
    assert OscMessage(datagrams[-1]).address == "/VMC/Ext/Blend/Apply"


def test_values_arrive_as_they_were() -> None:
    pose = a_pose(seed=3)
    messages = read(encode_frame(pose, VRM0_SHAPES, BONES, 1.0))
    bones = {m.params[0]: m.params[1:] for m in messages if m.address.endswith("Bone/Pos")}
    for index, name in enumerate(BONES):
        np.testing.assert_allclose(bones[name], [*pose.positions[index], *pose.rotations[index]], atol=1e-6)
    shapes = {m.params[0]: m.params[1] for m in messages if m.address.endswith("Blend/Val")}
    np.testing.assert_allclose([shapes[n] for n in VRM0_SHAPES], pose.shapes, atol=1e-6)


def test_positions_are_never_zero_nor_damaged() -> None:
    """EVMC4U applies positions as they come; a zero folds the avatar, NaN breaks it."""
    pose = a_pose()
    pose.positions[:10] = 0
    pose.positions[10] = np.nan
    messages = read(encode_frame(pose, VRM0_SHAPES, BONES, 0.0))
    sent = np.array([m.params[1:4] for m in messages if m.address.endswith("Bone/Pos")])
    np.testing.assert_allclose(sent, REST, atol=1e-6)


def test_damaged_values_are_made_harmless() -> None:
    pose = a_pose()
    pose.rotations[0] = np.nan
    pose.rotations[1] = 0
    pose.shapes[:3] = [np.nan, 7.0, -1.0]
    messages = read(encode_frame(pose, VRM0_SHAPES, BONES, 0.0))
    bones = [m.params[4:] for m in messages if m.address.endswith("Bone/Pos")]
    np.testing.assert_allclose(np.linalg.norm(bones, axis=1), 1.0, atol=1e-5)
    shapes = [m.params[1] for m in messages if m.address.endswith("Blend/Val")]
    assert shapes[:3] == [0.0, 1.0, 0.0]


def test_rotations_only_leaves_bones_and_root_at_rest() -> None:
    pose = a_pose()
    pose.positions[:] += 0.5
    messages = read(encode_frame(pose, VRM0_SHAPES, BONES, 0.0, SendOptions(rotations_only=True)))
    sent = np.array([m.params[1:4] for m in messages if m.address.endswith("Bone/Pos")])
    np.testing.assert_allclose(sent, REST, atol=1e-6)
    root = next(m for m in messages if m.address.endswith("Root/Pos"))
    assert list(root.params[1:4]) == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("given", "wanted", "sent"),
    [
        (("A", "Blink_L"), "vrm1", {"aa", "blinkLeft"}),
        (("aa", "happy"), "vrm0", {"A", "Joy"}),
        (("A", "Blink"), "arkit", {"JawOpen", "EyeBlinkLeft", "EyeBlinkRight"}),
        (("jawopen", "Wink"), "vrm0", {"JawOpen", "Wink"}),
        (("a", "WINK"), "as_is", {"a", "WINK"}),
    ],
)  # fmt: skip
def test_names_are_the_ones_the_target_knows(given: tuple[str, ...], wanted: str, sent: set[str]) -> None:
    pose = a_pose(len(given))
    messages = read(encode_frame(pose, given, BONES, 0.0, SendOptions(names=wanted)))
    assert {m.params[0] for m in messages if m.address.endswith("Blend/Val")} == sent


def test_a_face_without_a_body_is_a_frame() -> None:
    empty = np.zeros((0, 3), dtype=np.float32)
    pose = Pose(
        np.array([0.5], dtype=np.float32), empty, np.zeros((0, 4)), np.zeros(3), np.array([0, 0, 0, 1.0])
    )
    assembler = FrameAssembler()
    for datagram in encode_frame(pose, ("A",), (), 0.0):
        assert assembler.feed(0.0, datagram) == []
    (frame,) = assembler.flush(1.0)
    assert frame.shapes == {"A": 0.5}
    assert frame.bones == {}


def test_any_message_is_readable_by_others() -> None:
    sent = OscMessage(message("/VMC/Ext/VRM", "C:\\アバター.vrm", "桜", 3, 0.5))
    assert sent.address == "/VMC/Ext/VRM"
    assert list(sent.params) == ["C:\\アバター.vrm", "桜", 3, 0.5]
