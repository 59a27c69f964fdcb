"""Phones that track a face: iFacialMocap's text and Live Link Face's packets, made here from their facts."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.motion import Motion
from studio.motion.channels import ARKIT_SHAPES, BONES
from studio.vmc import decode
from studio.vmc.assemble import Frame, FrameAssembler
from studio.vmc.encode import SendOptions, encode_frame, message

FACE = (
    b"mouthSmile_R-35|eyeBlink_L-100|jawOpen-12|mouthLeft-7|browDown_L--3|hapihapi-0|trackingStatus-1|"
    b"=head#-21.5,-6.0,-6.6,-0.03,-0.10,-0.65|rightEye#6.0,2.4,0.25|leftEye#6.0,-90,-0.17|"
)


def live_link(values: list[float], device: bytes = b"6B5A0D43-0000-4000-8000-000000000000") -> bytes:
    name = "桜のiPhone".encode()
    texts = b"".join(struct.pack(">i", len(text)) + text for text in (device, name))
    return b"\x06" + texts + struct.pack(">ifii", 100, 0.5, 60, 1) + b"\x3d" + struct.pack(">61f", *values)


def heard(*datagrams: bytes) -> tuple[list[Frame], FrameAssembler]:
    assembler = FrameAssembler()
    frames = [
        f for k, one in enumerate(datagrams) for f in assembler.feed(k / 60, one, "10.0.0.7:49983", 49983)
    ]
    return frames, assembler


def test_ifacialmocap_is_a_frame_of_arkit_shapes_and_turns() -> None:
    (frame,), assembler = heard(FACE)
    assert frame.shapes == pytest.approx(
        {
            "MouthSmileRight": 0.35,
            "EyeBlinkLeft": 1.0,
            "JawOpen": 0.12,
            "MouthLeft": 0.07,
            "BrowDownLeft": 0.0,
        }
    )
    assert set(frame.bones) == {"Head", "RightEye", "LeftEye"}
    (x, y, z, w) = frame.bones["LeftEye"][1]
    assert math.degrees(2 * math.asin(y)) == pytest.approx(-90, abs=5)
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)
    assert frame.bones["Head"][1][0] < -0.15  # it looks up or down by 21.5 degrees
    assert assembler.packets_bad == 0
    assert assembler.sources[0].title == "iFacialMocap :49983 10.0.0.7"


def test_the_second_version_separates_with_an_ampersand() -> None:
    (frame,), _ = heard(b"mouthSmile_L&80|tongueOut&-5|=head#1,2,3|")
    assert frame.shapes == {"MouthSmileLeft": 0.8, "TongueOut": 0.0}
    assert set(frame.bones) == {"Head"}


def test_every_datagram_is_a_frame_at_once() -> None:
    frames, assembler = heard(*[FACE] * 5)
    assert [frame.arrival for frame in frames] == [k / 60 for k in range(5)]
    assert assembler.flush(10.0) == []


def test_live_link_face_is_a_frame_of_52_shapes_and_turns() -> None:
    values = [k / 100 for k in range(52)] + [0.5, -0.1, 0.0, 0.1, 0.0, 0.0, -0.1, 0.0, 0.0]
    (frame,), assembler = heard(live_link(values))
    assert set(frame.shapes) == set(ARKIT_SHAPES)
    assert frame.shapes["JawOpen"] == pytest.approx(0.17)
    # Unreal's order: JawForward, JawLeft, JawRight, ... MouthPucker, MouthLeft, MouthRight.
    assert [frame.shapes[name] for name in ("JawLeft", "JawRight", "MouthLeft", "MouthRight")] == (
        pytest.approx([0.15, 0.16, 0.21, 0.22])
    )
    x, y, z, w = frame.bones["Head"][1]
    assert math.atan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y)) == pytest.approx(0.5, abs=1e-6)
    assert math.asin(2 * (w * x - y * z)) == pytest.approx(-0.1, abs=1e-6)
    assert assembler.sources[0].kind == "Live Link Face"


@pytest.mark.parametrize(
    "bad",
    [
        b"|",
        b"nothing-0|of-1|ours-2|",
        b"jawOpen-abc|",
        b"jawOpen-nan|",
        b"jawOpen-1e99|",
        b"jawOpen-5|=head#1,2|",
        b"jawOpen-5|=head#1,2,inf|",
        b"\xff\xfe|jawOpen-5|",
        decode.HELLO + b"|sendDataVersion=v2",
        live_link([float("nan")] * 61),
        live_link([0.0] * 61)[:-8],
        b"\x06" + struct.pack(">i", 2**31 - 1) + bytes(300),
        b"\x06" + struct.pack(">i", -5) + bytes(300),
        b"|" * 9000,
    ],
)
def test_what_is_damaged_is_counted_and_changes_nothing(bad: bytes) -> None:
    frames, assembler = heard(FACE, bad, FACE)
    assert len(frames) == 2
    assert frames[0].shapes == frames[1].shapes
    assert assembler.packets_bad == 1


@given(
    st.one_of(
        st.binary(max_size=600),
        st.binary(max_size=300).map(lambda tail: b"\x06" + tail),
        st.text("jawOpen_LR-&|=#,.0123456789einf ", max_size=300).map(lambda text: text.encode()),
        st.tuples(st.integers(0, len(FACE)), st.binary(max_size=9)).map(
            lambda cut: FACE[: cut[0]] + cut[1] + FACE[cut[0] :]
        ),
        st.integers(0, 310).map(lambda end: live_link([0.1] * 61)[:end]),
    )
)
def test_whatever_arrives_never_raises(datagram: bytes) -> None:
    frames, assembler = heard(FACE, datagram, FACE)
    assert len(frames) >= 2
    assert sum(len(one.shapes) for one in assembler.sources) <= 1024
    for frame in frames:
        assert all(0.0 <= weight <= 1.0 for weight in frame.shapes.values())
        for _, turn in frame.bones.values():
            assert math.hypot(*turn) == pytest.approx(1.0, abs=1e-5)


def test_a_body_leads_and_a_phone_gives_the_face() -> None:
    """Both say where the head is and how open the jaw: the body keeps its bones, the face its shapes."""
    body = Motion.build([0.0], ("JawOpen", "Joy"), [[0.9, 0.4]], BONES).pose(0.0)
    assembler = FrameAssembler()
    frames = []
    for k in range(20):
        assembler.feed(k / 60 - 0.004, FACE, "10.0.0.7:1", 49983)
        for datagram in encode_frame(body, ("JawOpen", "Joy"), BONES, k / 60, SendOptions(names="as_is")):
            frames += assembler.feed(k / 60, datagram, "127.0.0.1:2", 39539)
    last = frames[-1]
    assert len(frames) >= 18
    assert len(last.bones) == 54
    assert last.bones["Head"][1] == (0.0, 0.0, 0.0, 1.0)
    assert last.shapes["JawOpen"] == pytest.approx(0.12)
    assert last.shapes["Joy"] == pytest.approx(0.4)
    by_kind = {source.kind: source for source in assembler.sources}
    assert len(by_kind["VMC"].bones) == 54
    assert by_kind["VMC"].shapes == ("Joy",)
    assert "JawOpen" in by_kind["iFacialMocap"].shapes


def test_a_channel_goes_to_the_other_sender_when_its_own_falls_silent() -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, FACE, "10.0.0.7:1", 49983)
    other = message("/VMC/Ext/Blend/Val", "JawOpen", 0.9)
    assembler.feed(0.1, other, "127.0.0.1:2", 39539)
    assert [one.sender for one in assembler.sources if "JawOpen" in one.shapes] == ["10.0.0.7:1"]
    assembler.feed(1.0, other, "127.0.0.1:2", 39539)
    assert [one.sender for one in assembler.sources if "JawOpen" in one.shapes] == ["127.0.0.1:2"]
