"""Frames from every habit of senders there is, and from what no sender should send."""

import math
import struct
import tracemalloc
from collections.abc import Iterable
from itertools import islice

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studio.motion.channels import ARKIT_SHAPES
from studio.motion.filmed import PictureFlag
from studio.vmc.assemble import Frame, FrameAssembler
from studio.vmc.decode import MAX_BONES, MAX_SHAPES
from studio.vmc.encode import encode_age, encode_picture, message
from studio.vmc.osc import MOST_MESSAGES
from tests.capture import floods

UNIT = (0.0, 0.0, 0.0, 1.0)
APPLY = message("/VMC/Ext/Blend/Apply")


def bone(name: str, x: float = 0.1, q: tuple[float, ...] = UNIT) -> bytes:
    return message("/VMC/Ext/Bone/Pos", name, x, 0.2, 0.3, *q)


def shape(name: str, weight: float) -> bytes:
    return message("/VMC/Ext/Blend/Val", name, weight)


def sender_time(t: float) -> bytes:
    return message("/VMC/Ext/T", t)


def root(name: str = "root") -> bytes:
    return message("/VMC/Ext/Root/Pos", name, 0.0, 0.0, 0.0, *UNIT)


def bundle(*parts: bytes, tag: int = 1) -> bytes:
    return b"#bundle\x00" + struct.pack(">Q", tag) + b"".join(struct.pack(">i", len(p)) + p for p in parts)


def run(
    frames: Iterable[list[bytes]], fps: float = 60.0, spread: float = 0.001
) -> tuple[FrameAssembler, list[Frame]]:
    """Feed frames of datagrams at a rate, each datagram some seconds after the one before."""
    assembler, found, k = FrameAssembler(), [], 0
    for k, datagrams in enumerate(frames):
        for i, datagram in enumerate(datagrams):
            found += assembler.feed(k / fps + i * spread, datagram)
    found += assembler.flush(k / fps + 1.0)
    return assembler, found


def check(found: list[Frame], count: int, fps: float = 60.0) -> None:
    """One frame a frame, none merged or torn, each with its own values, stamped with its first datagram."""
    assert len(found) == count
    for k, frame in enumerate(found):
        assert frame.arrival == pytest.approx(k / fps, abs=1e-9)
        if frame.shapes:
            assert frame.shapes["A"] == pytest.approx(k / 100, abs=1e-6)
        for position, _ in frame.bones.values():
            assert position[0] == pytest.approx(k / 10, abs=1e-6)


BODY = ("Hips", "Spine", "Head", "LeftHand")


def bones(k: int) -> list[bytes]:
    return [bone(name, k / 10) for name in BODY]


def owners(assembler: FrameAssembler) -> dict[str, str]:
    """Whose value each bone and shape has."""
    return {name: one.sender for one in assembler.sources for name in (*one.bones, *one.shapes)}


def shapes_of(assembler: FrameAssembler) -> tuple[str, ...]:
    return tuple(name for one in assembler.sources for name in one.shapes)


def bones_of(assembler: FrameAssembler) -> tuple[str, ...]:
    return tuple(name for one in assembler.sources for name in one.bones)


def test_virtual_motion_capture() -> None:
    """Bundles of bones, shapes with Apply, then Root, OK and T in the last bundle."""
    ok = message("/VMC/Ext/OK", 1, 3, 0, 1)
    frames = [
        [bundle(*bones(k)), bundle(shape("A", k / 100), APPLY), bundle(root(), ok, sender_time(k / 60))]
        for k in range(50)
    ]
    assembler, found = run(frames)
    check(found, 50)
    assert [f.sender_time for f in found] == pytest.approx([k / 60 for k in range(50)], abs=1e-6)
    assert assembler.ok == (1, 3, 0, 1)
    assert assembler.packets_bad == 0


def test_vmagicmirror() -> None:
    """The whole body in one bundle at 30 frames a second, a root without a name."""
    frames = [
        [bundle(root(""), *bones(k), shape("A", k / 100), APPLY, sender_time(k / 30))] for k in range(40)
    ]
    assembler, found = run(frames, fps=30)
    check(found, 40, fps=30)
    assert found[0].root is not None
    assert assembler.packets_bad == 0


def test_vseeface_with_time_going_backwards_on_a_loop() -> None:
    frames = [
        [bundle(sender_time((k % 20) / 60), *bones(k)), bundle(shape("A", k / 100), APPLY)] for k in range(60)
    ]
    _, found = run(frames)
    check(found, 60)
    assert found[19].sender_time == pytest.approx(19 / 60)
    assert found[20].sender_time == pytest.approx(0.0)


def test_saia_client_unbundled_without_time() -> None:
    _, found = run([[*bones(k), shape("A", k / 100), shape("I", 0.5), APPLY] for k in range(50)])
    check(found, 50)
    assert all(f.sender_time is None for f in found)


def test_perfect_sync_sends_the_52_shapes_of_arkit_beside_the_vowels() -> None:
    """Some write ARKit's names with a small letter first, some with a capital: both are one shape."""
    for spelt in (str, lambda name: name[0].lower() + name[1:]):
        faces = [
            [shape(spelt(name), k / 100) for name in ("A", *ARKIT_SHAPES)] + [APPLY, sender_time(k / 60)]
            for k in range(8)
        ]
        _, found = run([[bundle(*bones(k), *face)] for k, face in enumerate(faces)])
        check(found, 8)
        assert set(found[-1].shapes) == {"A", *ARKIT_SHAPES}
        assert found[-1].shapes["JawOpen"] == pytest.approx(0.07, abs=1e-6)
        assert [frame.sender_time for frame in found] == pytest.approx([k / 60 for k in range(8)])


def test_bones_after_apply_belong_to_the_same_frame() -> None:
    _, found = run([[shape("A", k / 100), APPLY, *bones(k)] for k in range(50)])
    check(found, 50)
    assert all(f.fresh_bones == 4 for f in found)


def test_a_body_without_shapes_ends_at_time() -> None:
    _, found = run([[*bones(k), sender_time(k / 60)] for k in range(50)])
    check(found, 50)
    assert [f.sender_time for f in found] == pytest.approx([k / 60 for k in range(50)], abs=1e-6)


def test_time_first_is_understood_too() -> None:
    _, found = run([[sender_time(k / 60), *bones(k)] for k in range(50)])
    check(found, 50)
    assert [f.sender_time for f in found] == pytest.approx([k / 60 for k in range(50)], abs=1e-6)


def test_without_any_mark_a_gap_ends_a_frame() -> None:
    _, found = run([bones(k) for k in range(50)])
    check(found, 50)


def test_without_any_mark_nor_gap_the_first_bone_begins_anew() -> None:
    _, found = run([bones(k) for k in range(50)], fps=250, spread=0.001)
    check(found, 50, fps=250)


def test_a_lost_apply_costs_no_frame() -> None:
    frames = [[*bones(k), shape("A", k / 100), *([] if k % 7 == 3 else [APPLY])] for k in range(50)]
    _, found = run(frames)
    check(found, 50)


def test_bundles_inside_bundles() -> None:
    frames = [
        [bundle(bundle(*bones(k)), bundle(bundle(shape("A", k / 100)), APPLY), tag=2**63)] for k in range(9)
    ]
    assembler, found = run(frames)
    check(found, 9)
    assert assembler.packets_bad == 0


def test_a_sender_that_pauses_goes_on() -> None:
    assembler = FrameAssembler()
    found = []
    for t in (0.0, 0.02, 5.0, 5.02):
        for part in (*bones(0), shape("A", 0.0), APPLY):
            found += assembler.feed(t, part)
    found += assembler.flush(6.0)
    assert [f.arrival for f in found] == [0.0, 0.02, 5.0, 5.02]


def test_a_sender_that_left_takes_along_what_nobody_else_sends() -> None:
    assembler = FrameAssembler()
    apply = message("/VMC/Ext/Blend/Apply")
    practice = bundle(bone("Head"), bone("LeftThumbProximal"), shape("A", 0.5), shape("Fun", 0.7), apply)
    tracker = bundle(bone("Head", 0.2), shape("A", 0.1), apply)
    found = [(t, assembler.feed(t, practice, "127.0.0.1:1")) for t in (0.0, 0.1, 0.2)]
    for k in range(150):
        t = 1.0 + k / 10
        found.append((t, [*assembler.feed(t, tracker, "127.0.0.1:2"), *assembler.flush(t + 0.05)]))
    early = [frame for t, frames in found for frame in frames if 3 < t < 9]
    late = [frame for t, frames in found for frame in frames if t > 12]
    assert all(set(frame.bones) == {"Head", "LeftThumbProximal"} for frame in early)
    assert all(frame.bones["Head"][0][0] == pytest.approx(0.2) for frame in early)
    assert len(late) > 30
    assert all((set(frame.bones), set(frame.shapes)) == ({"Head"}, {"A"}) for frame in late)


def test_a_sender_that_pauses_alone_keeps_all_it_sent() -> None:
    assembler = FrameAssembler()
    whole = bundle(bone("Head"), bone("Hips"), shape("A", 0.5), message("/VMC/Ext/Blend/Apply"))
    part = bundle(bone("Head"), message("/VMC/Ext/Blend/Apply"))
    assembler.feed(0.0, whole, "127.0.0.1:1")
    assembler.flush(60.0)
    (frame,) = [*assembler.feed(60.0, part, "127.0.0.1:1"), *assembler.flush(61.0)]
    assert set(frame.bones) == {"Head", "Hips"}
    assert set(frame.shapes) == {"A"}


def test_a_slow_frame_is_not_torn_by_a_gap_before_its_mark() -> None:
    """A busy sender may pause in mid-frame; one that marks its ends is waited for."""
    frames = [[*bones(k), shape("A", k / 100), APPLY] for k in range(20)]
    assembler, found = FrameAssembler(), []
    for k, datagrams in enumerate(frames):
        for i, datagram in enumerate(datagrams):
            slow = 0.012 if k > 3 and i >= 2 else 0.0
            found += assembler.feed(k / 30 + i * 0.0005 + slow, datagram)
    found += assembler.flush(9.0)
    check(found, 20, fps=30)


def stalled(frames: list[list[bytes]], at: int, part: int, seconds: float) -> list[Frame]:
    """Feed frames at 60 a second with silence looked for all the time; one frame stalls before a part."""
    assembler, found = FrameAssembler(), []
    for k, datagrams in enumerate(frames):
        for i, datagram in enumerate(datagrams):
            t = k / 60 + i * 0.0005 + (seconds if k == at and i >= part else 0.0)
            found += assembler.flush(t - 1e-4)
            found += assembler.feed(t, datagram)
        found += assembler.flush(k / 60 + 0.0165)
    return found + assembler.flush(99.0)


@pytest.mark.parametrize("part", [1, 3, 4, 5, 6])
def test_a_stall_in_mid_frame_tears_and_shifts_nothing(part: int) -> None:
    """A sender that is held up between two of its datagrams, wherever that is."""
    usual = [[*bones(k), shape("A", k / 100), APPLY, sender_time(k / 60)] for k in range(40)]
    found = stalled(usual, 20, part, 0.0125)
    check([f for f in found if f.arrival < 20 / 60], 20)
    assert len(found) == 40
    assert found[-1].shapes["A"] == pytest.approx(0.39)
    assert found[-1].bones["Hips"][0][0] == pytest.approx(3.9)
    assert found[-1].sender_time == pytest.approx(39 / 60)


@pytest.mark.parametrize("part", [1, 2, 3, 5])
def test_a_stall_before_trailing_bones_tears_and_shifts_nothing(part: int) -> None:
    found = stalled([[shape("A", k / 100), APPLY, *bones(k)] for k in range(40)], 20, part, 0.0125)
    assert 40 <= len(found) <= 41
    check([f for f in found if f.arrival < 20 / 60], 20)
    for frame in found[-15:]:
        assert frame.bones["Hips"][0][0] == pytest.approx(frame.shapes["A"] * 10, abs=1e-5)
        assert frame.bones["LeftHand"][0][0] == pytest.approx(frame.shapes["A"] * 10, abs=1e-5)


def held_up(frames: list[list[bytes]], at: int, part: int, seconds: float, fps: float = 60.0) -> list[Frame]:
    """Feed frames with silence looked for all the time; the sender stops before a part of one, and all that
    follows is later."""
    assembler, found, t = FrameAssembler(), [], 0.0
    for k, datagrams in enumerate(frames):
        for i, datagram in enumerate(datagrams):
            if k == at and i == part:
                for step in range(1, int(seconds / 0.004)):
                    found += assembler.flush(t + step * 0.004)
                t += seconds
            found += assembler.feed(t, datagram)
            t += 0.0002
        t += 1 / fps - len(datagrams) * 0.0002
        found += assembler.flush(t - 1e-4)
    return found + assembler.flush(t + 99.0)


OK = message("/VMC/Ext/OK", 1, 3, 0, 1)
HABITS = {
    "virtual motion capture": lambda k: [
        bundle(*bones(k)[:2]), bundle(*bones(k)[2:]), bundle(shape("A", k / 100), APPLY),
        bundle(root(), OK, sender_time(k / 60)),
    ],
    "unbundled": lambda k: [
        OK, root(), *bones(k), shape("A", k / 100), shape("I", 0.5), APPLY, sender_time(k / 60),
    ],
    "saia client": lambda k: [*bones(k), shape("A", k / 100), shape("I", 0.5), APPLY],
    "time first": lambda k: [sender_time(k / 60), *bones(k), shape("A", k / 100), APPLY],
    "time first, no apply": lambda k: [sender_time(k / 60), *bones(k)],
    "body alone": lambda k: [*bones(k), sender_time(k / 60)],
    "bones after apply": lambda k: [shape("A", k / 100), shape("I", 0.5), APPLY, *bones(k)],
}  # fmt: skip


@pytest.mark.parametrize("seconds", [0.02, 0.3, 3.0])
@pytest.mark.parametrize("habit", HABITS)
def test_a_sender_held_up_anywhere_in_a_frame_tears_none(habit: str, seconds: float) -> None:
    """Whole frames before, the held-up one and after; at most the T of the one is lost where it came last."""
    frames = [HABITS[habit](k) for k in range(30)]
    for part in range(1, len(frames[0])):
        found = held_up(frames, 15, part, seconds)
        assert len(found) == 30, part
        for k, frame in enumerate(found):
            places = {round(position[0] * 10) for position, _ in frame.bones.values()}
            assert places == {k}, (part, k)
            assert not frame.shapes or frame.shapes["A"] == pytest.approx(k / 100, abs=1e-6)
            assert frame.fresh_bones == 4
            if frame.sender_time is not None and k > 2:
                assert frame.sender_time == pytest.approx(k / 60, abs=1e-5)
        if "time" in habit or seconds < 0.25:
            timed = [frame.sender_time is not None for frame in found[3:]]
            assert all(timed) or habit in ("saia client", "bones after apply")


@pytest.mark.parametrize("part", [3, 5, 7])
def test_the_very_first_frame_of_a_sender_is_not_torn_either(part: int) -> None:
    """Nobody knows yet how it ends its frames."""
    found = held_up([HABITS["unbundled"](k) for k in range(20)], 0, part, 0.3)
    assert len(found) == 20
    assert found[0].fresh_bones == 4


def test_a_lost_apply_freezes_nothing() -> None:
    """What came is given as soon as the next frame begins; and soon where there is no next."""
    assembler, given = FrameAssembler(), []
    for k in range(40):
        frame = [*bones(k), shape("A", k / 100), *([] if k in (20, 39) else [APPLY])]
        for i, datagram in enumerate(frame):
            given += [(k, f) for f in assembler.feed(k / 60 + i * 1e-4, datagram)]
        given += [(k, f) for f in assembler.flush(k / 60 + 0.015)]
    assert [k for k, frame in given if frame.arrival == pytest.approx(20 / 60)] == [21]
    assert len(given) == 39
    (last,) = assembler.flush(39 / 60 + 0.3)
    assert last.arrival == pytest.approx(39 / 60)


def test_a_frame_whose_rest_never_comes_is_given_in_the_end() -> None:
    assembler = FrameAssembler()
    for k in range(5):
        for i, datagram in enumerate([*bones(k), shape("A", 0.1), APPLY]):
            assembler.feed(k / 60 + i * 1e-4, datagram)
        assembler.flush(k / 60 + 0.012)
    assembler.feed(1.0, bones(5)[0])
    assert assembler.flush(2.0) == []
    assert assembler.whole_until(1.1) == 1.0
    assert assembler.whole_until(2.0) == 2.0  # who is held up is not waited for at the end of a take
    (frame,) = assembler.flush(99.0)
    assert frame.fresh_bones == 1


def test_a_sender_that_marks_no_more_is_known_by_its_gaps_again() -> None:
    assembler, found = FrameAssembler(), []
    for k in range(300):
        for datagram in [*bones(k), *([APPLY] if k < 50 else [])]:
            found += assembler.feed(k / 60, datagram)
        found += assembler.flush(k / 60 + 0.012)
    assert len(found) == 300
    assert assembler.whole_until(6.0) == 6.0


def churning(steps: Iterable[tuple[float, bytes, str]]) -> tuple[FrameAssembler, list[Frame]]:
    assembler, found = FrameAssembler(), []
    for t, datagram, sender in steps:
        found += assembler.feed(t, datagram, sender, 39539)
    return assembler, found + assembler.flush(99.0)


def test_a_sender_with_a_new_socket_for_every_packet_is_one_sender() -> None:
    numbers = iter(range(30_000, 60_000))
    steps = [
        (k / 60 + i * 1e-4, datagram, f"192.168.0.7:{next(numbers)}")
        for k in range(200)
        for i, datagram in enumerate([*bones(k), shape("A", k / 1000), APPLY])
    ]
    assembler, found = churning(steps)
    assert assembler.packets_bad == 0
    assert assembler.senders == ("192.168.0.7:*",)
    assert 195 <= len(found) <= 202
    assert all(frame.fresh_bones == 4 for frame in found[5:])
    (source,) = assembler.sources
    assert source.title == "VMC :39539 192.168.0.7"
    assert set(source.bones) == set(BODY)


def test_two_programs_of_one_computer_stay_two() -> None:
    steps = []
    for k in range(200):
        steps.append((k / 60, bundle(*bones(k), sender_time(k / 60)), "127.0.0.1:5000"))
        steps.append((k / 60 + 0.003, bundle(shape("JawOpen", 0.1), APPLY), "127.0.0.1:5001"))
    assembler, found = churning(steps)
    assert assembler.senders == ("127.0.0.1:5000", "127.0.0.1:5001")
    assert len(found) == pytest.approx(200, abs=3)


def test_a_program_that_keeps_its_port_is_itself_again_beside_one_that_does_not() -> None:
    numbers = iter(range(30_000, 60_000))
    steps = []
    for k in range(240):
        steps.append((k / 60, bundle(*bones(k), sender_time(k / 60)), "127.0.0.1:5000"))
        for i, part in enumerate((shape("JawOpen", 0.1), APPLY)):
            steps.append((k / 60 + 0.003 + i * 1e-4, part, f"127.0.0.1:{next(numbers)}"))
    assembler, _ = churning(steps)
    assert assembler.packets_bad == 0
    assert set(assembler.senders) == {"127.0.0.1:5000", "127.0.0.1:*"}
    assert {source.sender: len(source.bones) for source in assembler.sources} == {
        "127.0.0.1:5000": 4, "127.0.0.1:*": 0,
    }  # fmt: skip


def test_bones_that_stop_coming_are_known() -> None:
    assembler = FrameAssembler()
    for k in range(240):
        for datagram in [*bones(k)[: 4 if k < 60 else 3], APPLY]:
            assembler.feed(k / 60, datagram)
        assembler.flush(k / 60 + 0.012)
        if k == 60:
            assert assembler.missing(1.0) == ()
    assert assembler.missing(4.0) == ("LeftHand",)
    assert assembler.missing(9.0) == ()  # when nothing comes at all, that is what is wrong


@pytest.mark.parametrize(
    ("sent", "kept"),
    [("hips", "Hips"), ("LEFTHAND", "LeftHand"), ("tail_01", "tail_01")],
)
def test_bone_names_match_in_any_case(sent: str, kept: str) -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, bone(sent))
    assert bones_of(assembler) == (kept,)


@pytest.mark.parametrize(
    ("sent", "kept"),
    [
        (("BLINK_L", "blink_l"), ("Blink_L",)),
        (("Angry", "Joy"), ("Angry", "Joy")),
        (("angry", "aa"), ("angry", "aa")),
        (("jawopen",), ("JawOpen",)),
        (("桜", "Custom", "custom"), ("桜", "Custom")),
    ],
)
def test_shape_names_match_in_any_case(sent: tuple[str, ...], kept: tuple[str, ...]) -> None:
    assembler = FrameAssembler()
    for name in sent:
        assembler.feed(0.0, shape(name, 1.0))
    assert shapes_of(assembler) == kept


def test_two_senders_become_one_performer() -> None:
    """A body from one program and a face from another: the body leads, the face is merged by name."""
    assembler, found = FrameAssembler(), []
    for k in range(60):
        found += assembler.feed(k / 60, bundle(shape("JawOpen", k / 100), APPLY), "face")
        found += assembler.feed(k / 60 + 0.004, bundle(*bones(k), sender_time(k / 60)), "body")
    found += assembler.flush(2.0)
    led = found[-50:]
    assert [f.arrival for f in led] == pytest.approx([k / 60 + 0.004 for k in range(10, 60)])
    assert led[-1].shapes["JawOpen"] == pytest.approx(0.59)
    assert owners(assembler)["JawOpen"] == "face"
    assert owners(assembler)["Hips"] == "body"
    assert assembler.senders == ("face", "body")


def test_where_the_body_falls_silent_the_face_leads() -> None:
    assembler, found = FrameAssembler(), []
    for k in range(60):
        if k < 20:
            found += assembler.feed(k / 60, bundle(*bones(k), sender_time(k / 60)), "body")
        found += assembler.feed(k / 60 + 0.004, bundle(shape("JawOpen", k / 100), APPLY), "face")
    found += assembler.flush(2.0)
    assert found[-1].arrival == pytest.approx(59 / 60 + 0.004)


def test_avatar_and_state_are_kept() -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, message("/VMC/Ext/VRM", "/a/桜.vrm", "桜", "abc"))
    assembler.feed(0.0, message("/VMC/Ext/OK", 1))
    assert assembler.avatar == ("/a/桜.vrm", "桜", "abc")
    assert assembler.ok == (1,)


def test_unknown_addresses_and_further_arguments_are_no_fault() -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, message("/VMC/Ext/Cam", "Camera", 0.0, 0.0, 0.0, *UNIT, 60.0))
    assembler.feed(0.0, message("/avatar/parameters/x", 1.0))
    assembler.feed(0.0, message("/VMC/Ext/Bone/Pos", "Hips", 1.0, 2.0, 3.0, *UNIT, 9.0, "more"))
    assembler.feed(0.0, message("/VMC/Ext/Blend/Val", "A", 1))
    assert assembler.packets_bad == 0
    assert bones_of(assembler) == ("Hips",)
    (frame,) = assembler.flush(1.0)
    assert frame.bones["Hips"][0] == (1.0, 2.0, 3.0)
    assert frame.shapes == {"A": 1.0}


@pytest.mark.parametrize(
    "datagram",
    [
        b"", b"\x00", b"hello", b"/VMC/Ext/Bone/Pos", b"#bundle", bundle(b"nonsense"),
        b"#bundle\x00" + bytes(8) + struct.pack(">i", -5),
        b"#bundle\x00" + bytes(8) + struct.pack(">i", 2**31 - 1),
        bone("Hips")[:-3], shape("A", 0.5)[:-4], message("/VMC/Ext/Bone/Pos", "Hips", 1.0),
        message("/VMC/Ext/Bone/Pos", 1, 2, 3), message("/VMC/Ext/Blend/Val", "A", "much"),
        bone("Hips", math.nan), bone("Hips", math.inf), bone("Hips", 1e9),
        bone("Hips", q=(0.0, 0.0, 0.0, 0.0)),
        bone("Hips", q=(math.nan, 0.0, 0.0, 1.0)), bone("Hips", q=(1e20, 0.0, 0.0, 1.0)),
        shape("A", math.nan), shape("A", -math.inf), shape("A", 1e6), bone(""),
        bone("x" * 500), shape("", 1.0),
        message("/VMC/Ext/T", "now"), message("/VMC/Ext/T", math.nan), message("/VMC/Ext/T"), root()[:-8],
        b"/VMC/Ext/OK\x00,[[[[[\x00\x00", b"/VMC/Ext/OK\x00,zz\x00",
        b"/\xff\xfe\x00\x00,i\x00\x00\x00\x00\x00\x01",
    ],
)  # fmt: skip
def test_a_bad_packet_is_counted_and_nothing_else(datagram: bytes) -> None:
    assembler = FrameAssembler()
    assert assembler.feed(0.0, datagram) == []
    assert assembler.packets_bad == 1
    assert assembler.flush(1.0) == []
    assert bones_of(assembler) == shapes_of(assembler) == ()


def test_what_is_good_in_a_bad_packet_is_used() -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, bundle(bone("Hips"), bone("Spine", math.nan), bone("Head")))
    assert bones_of(assembler) == ("Hips", "Head")
    assert assembler.packets_bad == 1


def test_a_known_bone_with_bad_values_keeps_its_last_good_ones() -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, bone("Hips", 0.5))
    assembler.feed(0.001, bone("Head", 0.5))
    assembler.feed(0.1, bone("Hips", math.nan))
    assembler.feed(0.1, bone("Head", 0.7))
    (frame,) = assembler.flush(1.0)
    assert frame.bones["Hips"][0][0] == pytest.approx(0.5)
    assert frame.bones["Head"][0][0] == pytest.approx(0.7)


def test_rotations_are_made_unit() -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, bone("Hips", q=(0.0, 0.0, 2.0, 2.0)))
    (frame,) = assembler.flush(1.0)
    assert frame.bones["Hips"][1] == pytest.approx((0.0, 0.0, 0.5**0.5, 0.5**0.5))
    assert assembler.packets_bad == 0


def test_weights_are_held_between_zero_and_one() -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, bundle(shape("A", 1.4), shape("I", -0.2)))
    (frame,) = assembler.flush(1.0)
    assert frame.shapes == {"A": 1.0, "I": 0.0}


def test_hostile_names_do_not_make_memory_grow() -> None:
    assembler = FrameAssembler()
    for i in range(5_000):
        assembler.feed(i * 1e-5, bundle(bone(f"b{i}"), shape(f"s{i}", 1.0)), f"sender{i % 1000}")
    assert len(bones_of(assembler)) <= 2 * MAX_BONES
    assert len(shapes_of(assembler)) <= 2 * MAX_SHAPES
    assert len(assembler.senders) <= 8
    assert assembler.packets_bad > 3_500


def test_names_in_every_case_do_not_make_memory_grow() -> None:
    assembler = FrameAssembler()
    name = "LeftThumbIntermediate"
    tracemalloc.start()
    for i in range(20_000):
        cased = "".join(c.upper() if i >> n & 1 else c.lower() for n, c in enumerate(name))
        assembler.feed(i * 1e-5, bone(cased))
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert bones_of(assembler) == (name,)
    assert held < 500_000, "all of them would be some megabytes"


def performing(frames: int, beside: Iterable[bytes]) -> tuple[FrameAssembler, list[Frame]]:
    """A body and a face at 60 Hz, and what somebody else sends after each frame."""
    assembler, found, other = FrameAssembler(), [], iter(beside)
    for k in range(frames):
        for datagram in (bundle(*bones(k)), bundle(shape("A", k / 100), APPLY), sender_time(k / 60)):
            found += assembler.feed(k / 60, datagram, "127.0.0.1:1")
        for i, datagram in enumerate(islice(other, 10)):
            found += assembler.feed(k / 60 + i * 1e-4, datagram, "127.0.0.1:2")
    return assembler, [*found, *assembler.flush(99.0)]


@pytest.mark.parametrize("kind", floods.KINDS)
def test_a_flood_adds_nothing_to_a_performer_and_ends_no_frame(kind: str) -> None:
    assembler, found = performing(60, floods.KINDS[kind](2))
    check(found, 60)
    assert (bones_of(assembler), shapes_of(assembler)) == (BODY, ("A",))


def test_names_that_one_sender_uses_up_are_left_to_the_others() -> None:
    flood, found = floods.KINDS["names"](3), []
    assembler = FrameAssembler()
    for k in range(3000):  # first of all, so that they count at once
        assembler.feed(k * 1e-4, next(flood), "127.0.0.1:2")
    for k in range(20):
        whole = bundle(*bones(k), *(shape(name, k / 100) for name in ("A", *ARKIT_SHAPES)), APPLY)
        found += assembler.feed(1 + k / 60, whole, "127.0.0.1:1")
    assert {*found[-1].shapes} >= {"A", *ARKIT_SHAPES}
    assert assembler.absurd == 3000 - MAX_SHAPES
    assembler.shut_out("127.0.0.1:2", 0)
    assert {*shapes_of(assembler)} == {"A", *ARKIT_SHAPES}


def test_a_clumsy_sender_is_not_taken_for_a_flood() -> None:
    """More names than a face has, each frame the same; something behind every bundle that is no message."""
    assembler = FrameAssembler()
    many = [shape(f"Shape{i}", 0.5) for i in range(MAX_SHAPES + 300)]
    for k in range(5):
        for i, part in enumerate((*many, APPLY)):
            assembler.feed(k + i * 1e-4, part)
        for i in range(300):
            assembler.feed(k + 0.5 + i * 1e-3, bundle(bone("Hips"), b"more"))
    assert len(shapes_of(assembler)) == MAX_SHAPES
    assert assembler.packets_bad == 5 * 600
    assert assembler.absurd <= 300  # the names beyond, when they were new


def test_a_second_sender_counts_from_its_first_frame_on() -> None:
    assembler = FrameAssembler()
    for k in range(3):
        assembler.feed(k / 60, bundle(*bones(k), APPLY), "127.0.0.1:1")
        assembler.feed(k / 60, shape("A", 0.5), "127.0.0.1:2")
        assembler.feed(k / 60, APPLY, "127.0.0.1:2")
        assert (owners(assembler)["A"], owners(assembler)["Hips"]) == ("127.0.0.1:2", "127.0.0.1:1")


@pytest.mark.parametrize(("messages", "used"), [(MOST_MESSAGES, True), (MOST_MESSAGES + 1, False)])
def test_a_bundle_of_more_messages_than_a_performer_has_is_not_read(messages: int, used: bool) -> None:
    part = shape("A", 0.5)
    for whole in (
        bundle(*[part] * messages),
        bundle(*[part] * (messages - 1), bundle(part)),
        bundle(bundle(bundle(*[part] * messages))),
    ):
        assembler = FrameAssembler()
        assembler.feed(0.0, whole)
        assert (shapes_of(assembler), assembler.packets_bad) == ((("A",), 0) if used else ((), 1))


def test_bundles_nested_without_end_are_refused_quickly() -> None:
    part = bone("Hips")
    for _ in range(1000):
        part = bundle(part)
    assembler = FrameAssembler()
    assembler.feed(0.0, part)
    assert assembler.packets_bad == 1


_texts = st.one_of(st.sampled_from(["Hips", "A", "", "x" * 200, "桜"]), st.text(max_size=20))
_numbers = st.one_of(
    st.floats(width=32), st.integers(-(2**31), 2**31 - 1), st.sampled_from([math.nan, math.inf, 0.5])
)
_addresses = st.sampled_from(
    ["/VMC/Ext/Bone/Pos", "/VMC/Ext/Blend/Val", "/VMC/Ext/Blend/Apply", "/VMC/Ext/T", "/VMC/Ext/OK",
     "/VMC/Ext/Root/Pos", "/VMC/Ext/VRM", "/VMC/Ext/Nothing", "/"]
)  # fmt: skip


@st.composite
def _messages(draw: st.DrawFn) -> bytes:
    arguments = draw(st.lists(st.one_of(_texts, _numbers), max_size=9))
    try:
        whole = message(draw(_addresses), *arguments)
    except UnicodeEncodeError:
        return b"/\xff"
    cut = draw(st.one_of(st.just(0), st.integers(0, len(whole))))
    return whole[: len(whole) - cut]


_parts = st.recursive(
    st.one_of(_messages(), st.binary(max_size=60)),
    lambda inner: st.lists(inner, max_size=4).map(lambda parts: bundle(*parts)),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 100), _parts, st.sampled_from(["a", "b"])), max_size=12))
def test_nothing_that_arrives_raises_or_leaves_bad_numbers(packets: list[tuple[float, bytes, str]]) -> None:
    assembler = FrameAssembler()
    frames = []
    for arrival, datagram, sender in packets:
        frames += assembler.feed(arrival, datagram, sender)
    frames += assembler.flush(1000.0)
    for frame in frames:
        assert all(0.0 <= weight <= 1.0 for weight in frame.shapes.values())
        for position, rotation in frame.bones.values():
            assert all(math.isfinite(p) for p in position)
            assert math.hypot(*rotation) == pytest.approx(1.0, abs=1e-5)


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=400))
def test_noise_never_raises(datagram: bytes) -> None:
    assembler = FrameAssembler()
    assembler.feed(0.0, datagram)
    assembler.feed(0.0, b"#bundle\x00" + datagram)
    assembler.feed(0.0, b"/VMC/Ext/Bone/Pos\x00\x00\x00" + datagram)
    assembler.flush(1.0)


def aged(k: int, age: float) -> list[bytes]:
    """A frame of a sender that says how old what it shows is, as the studio's webcam does."""
    return [encode_age(age), bundle(bone("Head", k / 10), shape("A", k / 100), APPLY, sender_time(k / 60))]


def test_a_frame_that_says_how_old_it_is_is_stamped_with_its_moment() -> None:
    _, found = run(aged(k, 0.03 + 0.002 * (k % 3)) for k in range(30))
    assert len(found) == 30
    for k, frame in enumerate(found):
        assert frame.arrival == pytest.approx(k / 60 + 0.001 - 0.03 - 0.002 * (k % 3), abs=1e-6)


@pytest.mark.parametrize("age", [-1.0, 3.0])
def test_an_age_that_cannot_be_changes_nothing(age: float) -> None:
    _, found = run(aged(k, age) for k in range(5))
    assert [frame.arrival for frame in found] == pytest.approx([k / 60 + 0.001 for k in range(5)])


def shown(flags: int = int(PictureFlag.FACE), age: float = 0.02) -> bytes:
    return encode_picture(age, flags, (0.5, 0.25, 1.0))


FACE = b"jawOpen-40|mouthLeft-20|eyeBlink_L-80|eyeBlink_R-80|=head#0,0,0,0,0,0|"


def test_what_a_camera_says_of_a_picture_is_a_row_of_its_moment_and_no_frame() -> None:
    assembler = FrameAssembler()
    assert assembler.feed(10.0, shown(), "127.0.0.1:5000", 39539) == []
    (row,) = assembler.poll_pictures()
    assert row[0] == pytest.approx(9.98, abs=1e-6)
    assert int(row[1]) == PictureFlag.FACE | PictureFlag.MERGED
    assert row[2:5] == (0.5, 0.25, 1.0)
    assert all(map(math.isnan, row[5:]))
    assert assembler.poll_pictures() == []
    assert (assembler.packets_bad, assembler.sources) == (0, ())


def test_beside_a_phone_a_picture_says_what_the_phone_saw_and_whose_the_face_is() -> None:
    assembler = FrameAssembler()
    assembler.feed(10.0, FACE, "10.0.0.7:49983", 49983)
    assembler.feed(10.01, shown(), "127.0.0.1:5000", 39539)
    (row,) = assembler.poll_pictures()
    # The phone gives the jaw, so the face of the motion is not these pictures'.
    assert int(row[1]) == PictureFlag.FACE | PictureFlag.PHONE
    assert row[5:] == pytest.approx((10.0, 0.4, 0.2, 0.8))
    assembler.feed(11.0, shown(), "127.0.0.1:5000", 39539)
    assert all(map(math.isnan, assembler.poll_pictures()[0][5:])), "the phone was not heard for a while"


def test_a_camera_that_sees_nobody_leaves_out_nothing_of_a_face_of_vowels() -> None:
    assembler = FrameAssembler()
    for k in range(5):
        datagrams = (*bones(k), shape("A", k / 10), APPLY)
        for datagram in datagrams:
            assembler.feed(10.0 + k / 60, datagram, "127.0.0.1:6000", 39539)
        assembler.feed(10.005 + k / 60, shown(flags=0), "127.0.0.1:5000", 39539)
    assert [int(row[1]) for row in assembler.poll_pictures()] == [0] * 5


@pytest.mark.parametrize(
    "datagram",
    [
        shown(age=-1.0),
        shown(age=9.0),
        encode_picture(math.nan, 1, (0, 0, 0)),
        encode_picture(0.0, 1, (math.inf, 0, 0)),
        shown()[:-4],
    ],
)
def test_a_picture_that_cannot_be_is_passed_over(datagram: bytes) -> None:
    assembler = FrameAssembler()
    assembler.feed(10.0, datagram, "127.0.0.1:5000", 39539)
    assert assembler.poll_pictures() == []


def test_nobody_can_fill_the_memory_with_pictures() -> None:
    assembler = FrameAssembler()
    for k in range(6000):
        assembler.feed(10.0 + k / 1000, shown(), "127.0.0.1:5000", 39539)
    assert len(assembler.poll_pictures()) == 4096
