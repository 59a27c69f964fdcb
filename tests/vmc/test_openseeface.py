"""OpenSeeFace's packets, made here from their facts: its tracker's block, and its model of a face."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from studio.motion import rotation
from studio.vmc import decode
from studio.vmc.assemble import FrameAssembler
from studio.vmc.openseeface import OPENSEEFACE, recognises

# Rows, columns, depth of OpenSeeFace's camera for the right, up and forward of a face that looks into it, in
# the solution that it starts from: behind the camera, and so turned by half about the line of sight.
AT_REST = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def raw_of(yaw: float, pitch: float, roll: float) -> np.ndarray:
    """The quaternion that the tracker sends for a head's own turn, degrees about Unity's axes."""
    turn = rotation.to_matrix(rotation.from_euler_yxz(*np.radians([yaw, pitch, roll])))
    # Its function for quaternions takes the matrix for its transpose.
    return rotation.inverse(rotation.from_matrix(AT_REST @ turn))


def packet(
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0),
    eyes: tuple[float, float] = (1.0, 1.0),
    mouth: tuple[float, float] = (0.0, 0.0),
    found: int = 1,
    t: float = 1234.5,
) -> bytes:
    head = struct.pack("<diffffBf", t, 0, 640.0, 480.0, eyes[1], eyes[0], found, 20.0)
    rest = struct.pack("<6f", 180.0, 0.0, 90.0, 0.1, 0.2, -6.0) + struct.pack("<414f", *[0.5] * 414)
    features = struct.pack("<14f", *[0.0] * 12, *mouth)
    return head + struct.pack("<4f", *raw_of(*turn)) + rest + features


def test_a_packet_is_a_frame_of_eyes_mouth_and_head() -> None:
    assembler = FrameAssembler()
    sent = packet((0, 0, 0), eyes=(0.1, 0.9), mouth=(0.6, -0.3))
    assert len(sent) == 1785
    (frame,) = assembler.feed(0.0, sent, "127.0.0.1:50000", 11573)
    assert frame.shapes["EyeBlinkLeft"] == pytest.approx(0.9)
    assert frame.shapes["Blink_R"] == pytest.approx(0.1)
    assert frame.shapes["Blink"] == pytest.approx(0.1)
    assert frame.shapes["JawOpen"] == frame.shapes["A"] == pytest.approx(0.6)
    assert (frame.shapes["MouthPucker"], frame.shapes["MouthStretchLeft"]) == pytest.approx((0.3, 0.0))
    assert set(frame.bones) == {"Head"}
    assert assembler.sources[0].kind == OPENSEEFACE
    assert assembler.packets_bad == 0


@pytest.mark.parametrize("turn", [(0, 0, 0), (20, 0, 0), (0, -15, 0), (0, 0, 12), (-25, 10, -8)])
def test_the_head_turns_as_the_performers_does(turn: tuple[float, float, float]) -> None:
    _, bones, _ = decode.read_face(OPENSEEFACE, packet(turn))
    found = np.degrees(rotation.to_euler_yxz(np.array(bones["Head"][1])))
    assert found == pytest.approx(turn, abs=1e-3)


def test_without_a_pose_the_face_still_counts() -> None:
    shapes, bones, _ = decode.read_face(OPENSEEFACE, packet(found=0, mouth=(0.4, 0.0)))
    assert bones == {}
    assert shapes["JawOpen"] == pytest.approx(0.4)


def test_of_several_faces_the_first_counts() -> None:
    both = packet(mouth=(0.2, 0.0)) + packet(mouth=(0.9, 0.0))
    assert decode.face_app(both) == OPENSEEFACE
    assert decode.read_face(OPENSEEFACE, both)[0]["JawOpen"] == pytest.approx(0.2)


def test_a_number_that_is_none_is_counted_and_changes_nothing() -> None:
    assembler = FrameAssembler()
    assert assembler.feed(0.0, packet(mouth=(float("nan"), 0.0)), "a:1", 11573) == []
    assert assembler.packets_bad == 1


def test_other_packets_are_not_taken_for_it() -> None:
    assert not recognises(b"")
    assert not recognises(packet()[:-1])
    assert not recognises(bytes(1785))
    assert not recognises(b"#bundle\0" + bytes(1777))
    assert not recognises(packet(t=float("nan")))
