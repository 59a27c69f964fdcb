"""VTube Studio's packets, made here from their facts, asked for and received over real UDP."""

from __future__ import annotations

import json
import socket

import numpy as np
import pytest

from studio import clock
from studio.capture.receiver import Receiver
from studio.motion import rotation
from studio.motion.channels import ARKIT_SHAPES
from studio.vmc import decode
from studio.vmc.assemble import FrameAssembler
from studio.vmc.osc import MalformedError
from studio.vmc.udp import bind
from studio.vmc.vtube_studio import VTUBE_STUDIO, read, recognises, request


def packet(turn: tuple[float, float, float] = (0.0, 0.0, 0.0), found: bool = True, **shapes: float) -> bytes:
    """What the app sends; the turn is (x, y, z) as it is written there."""

    def vector(x: float, y: float, z: float) -> dict[str, float]:
        return {"x": x, "y": y, "z": z}

    content = {
        "Timestamp": 1724000000123,
        "Hotkey": -1,
        "FaceFound": found,
        "Rotation": vector(*turn),
        "Position": vector(0.01, -0.02, 0.4),
        "BlendShapes": [{"k": name, "v": shapes.get(name, 0.0)} for name in ARKIT_SHAPES],
        "EyeLeft": vector(-3.6, 1.2, 0.0),
        "EyeRight": vector(-3.6, 0.8, 0.0),
    }
    return json.dumps(content, separators=(",", ":")).encode()


def test_a_packet_is_a_frame_of_arkit_shapes_and_the_head() -> None:
    assembler = FrameAssembler()
    (frame,) = assembler.feed(0.0, packet(JawOpen=0.4, EyeBlinkLeft=1.2), "10.0.0.7:50000", 11125)
    assert set(frame.shapes) == set(ARKIT_SHAPES)
    assert (frame.shapes["JawOpen"], frame.shapes["EyeBlinkLeft"]) == (0.4, 1.0)
    assert set(frame.bones) == {"Head"}
    assert assembler.sources[0].title == "VTube Studio :11125 10.0.0.7"
    assert assembler.packets_bad == 0


@pytest.mark.parametrize(
    ("sent", "yaw", "pitch", "roll"),
    [((10, 0, 0), 10, 0, 0), ((0, 350, 0), 0, -10, 0), ((0, 0, -6), 0, 0, -6), ((-20, 12, 5), -20, 12, 5)],
)
def test_its_x_is_yaw_and_its_y_pitch(
    sent: tuple[float, float, float], yaw: float, pitch: float, roll: float
) -> None:
    _, bones, _ = decode.read_face(VTUBE_STUDIO, packet(sent))
    found = np.degrees(rotation.to_euler_yxz(np.array(bones["Head"][1])))
    assert found == pytest.approx((yaw, pitch, roll), abs=1e-3)


def test_a_packet_without_a_face_is_no_fault_and_no_frame() -> None:
    assembler = FrameAssembler()
    assert assembler.feed(0.0, packet(found=False), "10.0.0.7:50000", 11125) == []
    assert (assembler.packets_bad, assembler.absurd) == (0, 0)
    assert assembler.no_face == 0.0
    assert len(assembler.feed(0.1, packet(), "10.0.0.7:50000", 11125)) == 1


@pytest.mark.parametrize(
    "datagram",
    [
        b'{"BlendShapes":[',
        b'{"BlendShapes":' + b"[" * 4000,
        b'{"BlendShapes": 3}',
        packet().replace(b'"Rotation"', b'"Rotatioff"'),
        packet().replace(b'"v":0.0', b'"v":NaN', 1),
        packet().replace(b'"v":0.0', b'"v":"x"', 1),
        packet().replace(b'"v":0.0', b'"v":1' + b"0" * 400, 1),
        packet().replace(b'"Rotation":{"x":0.0', b'"Rotation":{"x":1' + b"0" * 400),
        packet((1e9, 0, 0)),
    ],
)
def test_what_is_damaged_is_refused_and_never_raises(datagram: bytes) -> None:
    assert recognises(datagram)
    assembler = FrameAssembler()
    assert assembler.feed(0.0, datagram, "10.0.0.7:50000", 11125) == []
    assert assembler.packets_bad == 1
    with pytest.raises(MalformedError):
        decode.read_face(VTUBE_STUDIO, datagram)


def test_names_that_are_none_of_arkits_are_passed_over() -> None:
    shapes, _ = read(packet().replace(b'"k":"JawOpen"', b'"k":"Hapi"'))
    assert "Hapi" in shapes
    known, _, unknown = decode.read_face(VTUBE_STUDIO, packet().replace(b'"k":"JawOpen"', b'"k":"Hapi"'))
    assert (len(known), unknown) == (len(ARKIT_SHAPES) - 1, 1)


def flood(number: int, beside: bytes = b"") -> bytes:
    """A packet of fifty names that nobody has met before."""
    strange = b",".join(b'{"k":"Strange%d_%d","v":0.5}' % (number, i) for i in range(50))
    return (
        packet().replace(b'"BlendShapes":[', b'"BlendShapes":[' + strange + b",", 1)
        if beside
        else (b'{"FaceFound":true,"Rotation":{"x":0,"y":0,"z":0},"BlendShapes":[' + strange + b"]}")
    )


@pytest.mark.parametrize("beside", [b"", b"a face"])
def test_a_flood_of_strange_names_is_no_motion(beside: bytes) -> None:
    assembler = FrameAssembler()
    for number in range(20):
        assert assembler.feed(number / 60, flood(number, beside), "10.0.0.7:50000", 11125) == []
    assert (assembler.packets_bad, assembler.absurd, assembler.unknown) == (20, 20, 0)
    assert assembler.sources == ()


def test_a_flood_over_udp_is_shut_out_and_a_phone_beside_it_is_heard() -> None:
    here = bind(0, "127.0.0.1")
    receiver = Receiver([here])
    to = here.getsockname()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flooding,
    ):
        rows = number = 0
        ends = clock.now() + 30
        while (rows < 20 or not receiver.stats(clock.now()).packets_refused) and clock.now() < ends:
            for _ in range(40):
                number += 1
                flooding.sendto(flood(number), to)
            phone.sendto(packet(JawOpen=number % 7 / 7).replace(b'"k":"JawLeft"', b'"k":"Newer"'), to)
            receiver.wait(0.01)
            rows += sum(map(len, receiver.poll(clock.now())))
        stats = receiver.stats(clock.now())
    receiver.close()
    assert rows >= 20
    assert stats.packets_refused > 0
    # The phone's new name is left out and counted apart; the packet is a good one.
    assert stats.values_unknown >= rows
    (source,) = stats.sources
    assert set(source.shapes) == set(ARKIT_SHAPES) - {"JawLeft"}


def test_a_phone_that_is_asked_is_received() -> None:
    """A phone that sends, to whom and where the request says, for as long as it says."""
    here = bind(0, "127.0.0.1")
    receiver = Receiver([here])
    port = int(here.getsockname()[1])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone:
        phone.bind(("127.0.0.1", 0))
        phone.settimeout(30)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as studio:
            studio.sendto(request(port), phone.getsockname())
            data, who = phone.recvfrom(1000)
        asked = json.loads(data)
        assert asked["messageType"] == "iOSTrackingDataRequest"
        assert 0.5 <= asked["time"] <= 10
        assert 1 <= len(asked["sentBy"]) <= 32
        rows = 0
        ends = clock.now() + 30
        while rows < 5 and clock.now() < ends:
            for to in asked["ports"]:
                phone.sendto(packet(JawOpen=0.5), (who[0], to))
            receiver.wait(0.05)
            rows += sum(map(len, receiver.poll(clock.now())))
    stats = receiver.stats(clock.now())
    receiver.close()
    assert rows >= 5
    assert [one.kind for one in stats.sources] == [VTUBE_STUDIO]
    assert stats.packets_bad == 0
