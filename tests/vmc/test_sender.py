"""The VMC sender, heard by a real UDP listener."""

from __future__ import annotations

import math
import socket
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from pythonosc.osc_packet import OscPacket

from studio.errors import StudioError
from studio.motion import Motion, rotation
from studio.motion.neutral import WAVE_SECONDS
from studio.playback.player import Player
from studio.vmc.sender import PRESETS, Destination, PoseSource, TargetState, TargetStatus, VmcTarget
from tests.patience import PATIENCE, nearest, until

SECONDS = 2.0


class _Listener:
    """A socket that remembers what arrived and when."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.02)
        self.port: int = self.socket.getsockname()[1]
        self.heard: list[tuple[float, bytes]] = []

    def listen(self, until: Callable[[], bool], timeout: float = PATIENCE) -> None:
        end = time.monotonic() + timeout
        while not until():
            assert time.monotonic() < end, "it did not happen in time"
            try:
                data = self.socket.recv(65536)
            except TimeoutError:
                continue
            self.heard.append((time.monotonic(), data))

    def messages(self) -> list[tuple[float, str, list[object]]]:
        return [
            (at, timed.message.address, timed.message.params)
            for at, data in self.heard
            for timed in OscPacket(data).messages
        ]

    def values(self, address: str, name: str | None = None) -> list[tuple[float, list[object]]]:
        return [
            (at, params)
            for at, where, params in self.messages()
            if where == address and (name is None or params[0] == name)
        ]


@pytest.fixture
def listener() -> Iterator[_Listener]:
    made = _Listener()
    yield made
    made.socket.close()


@pytest.fixture
def target() -> Iterator[VmcTarget]:
    made = VmcTarget()
    yield made
    made.stop(fade=False)


def _motion() -> Motion:
    """A mouth that opens evenly from 0 to 1, and a turning head."""
    times = np.arange(int(SECONDS * 60) + 1) / 60
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), times)
    rotations = np.stack([np.tile(rotation.IDENTITY, (len(times), 1)), turn], axis=1)
    return Motion.build(
        times, ("A", "Joy"), np.stack([times / SECONDS, 0 * times], 1), ("Hips", "Head"), None, rotations
    )


def _source(motion: Motion, position: Callable[[], float]) -> PoseSource:
    return PoseSource(motion.named_pose, position)


def test_frames_follow_the_position_in_time(listener: _Listener, target: VmcTarget) -> None:
    """To 10 ms, which a machine that stumbles spoils now and then; how true it is, the benchmark measures."""
    assert abs(nearest(lambda: _behind(listener, target), 0.0, good=0.010)) < 0.05


def _behind(listener: _Listener, target: VmcTarget) -> float:
    """How far frames are from the player's position when they arrive, seconds; NaN where too few did."""
    listener.heard.clear()
    player = Player(None, SECONDS)
    target.start(Destination(port=listener.port), _source(_motion(), lambda: player.position))
    log = []
    player.play()
    listener.listen(lambda: bool(log.append((time.monotonic(), player.position))) or player.position > 0.8)
    player.close()
    target.stop(fade=False)
    mouth = [(at, float(params[1])) for at, params in listener.values("/VMC/Ext/Blend/Val", "A")]
    moving = [(at, value) for at, value in mouth if 0.1 < value < 0.4]
    if len(moving) < 5:
        return math.nan
    times, positions = np.array(log).T
    error = [value * SECONDS - np.interp(at, times, positions) for at, value in moving]
    return float(np.median(error))


def test_the_senders_time_only_rises_across_loops_and_seeks(listener: _Listener, target: VmcTarget) -> None:
    player = Player(None, SECONDS)
    player.set_loop((0.0, 0.2))
    player.play()
    target.start(Destination(port=listener.port), _source(_motion(), lambda: player.position))
    listener.listen(lambda: target.state.sent > 40)
    player.seek(0.05)
    listener.listen(lambda: target.state.sent > 60)
    player.close()
    clock = [params[0] for _, params in listener.values("/VMC/Ext/T")]
    assert len(clock) > 40
    assert np.all(np.diff(np.array(clock, dtype=float)) > 0)


def test_stopping_fades_to_neutral_once(listener: _Listener, target: VmcTarget) -> None:
    target.start(Destination(port=listener.port), _source(_motion(), lambda: SECONDS))
    listener.listen(lambda: target.state.sent > 5)
    target.stop(wait=False)
    listener.listen(lambda: not target.running)
    quiet = time.monotonic() + 0.1
    listener.listen(lambda: time.monotonic() > quiet)
    values = [float(params[1]) for _, params in listener.values("/VMC/Ext/Blend/Val", "A")]
    assert values[0] == pytest.approx(1.0)
    assert values[-1] == 0.0
    falling = np.array(values[values.index(1.0) :])
    assert np.all(np.diff(falling) <= 1e-6)
    assert values.count(0.0) == 1


def test_thirty_frames_are_half_of_sixty(listener: _Listener, target: VmcTarget) -> None:
    target.start(Destination(port=listener.port, fps=30.0), _source(_motion(), lambda: 0.0))
    listener.listen(lambda: len(listener.values("/VMC/Ext/T")) >= 16)
    # By the sender's own clock: a busy machine may drop a frame, but never moves one off the beat.
    steps = np.diff([float(params[0]) for _, params in listener.values("/VMC/Ext/T")]) * 30.0
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)
    assert np.all(steps > 0.5)
    assert np.min(steps) == pytest.approx(1.0, abs=1e-3)


def test_a_late_frame_is_dropped_not_queued(listener: _Listener, target: VmcTarget) -> None:
    motion, slow = _motion(), [True]

    def pose_at(t: float) -> object:
        if slow and slow.pop():
            time.sleep(0.2)
        return motion.named_pose(t)

    source = PoseSource(pose_at, lambda: 0.0)  # type: ignore[arg-type]
    target.start(Destination(port=listener.port), source)
    listener.listen(lambda: target.state.sent >= 20)
    assert target.state.dropped >= 10
    steps = np.diff([float(params[0]) for _, params in listener.values("/VMC/Ext/T")]) * 60.0
    assert np.all(steps > 0.99)  # every beat once: nothing catches up


def test_a_machine_too_slow_for_every_frame_still_sends(listener: _Listener, target: VmcTarget) -> None:
    motion = _motion()

    def pose_at(t: float) -> object:
        time.sleep(0.05)  # three beats: no frame is ever in time
        return motion.named_pose(t)

    source = PoseSource(pose_at, lambda: 0.0)  # type: ignore[arg-type]
    target.start(Destination(port=listener.port), source)
    listener.listen(lambda: target.state.sent >= 5)
    steps = np.diff([float(params[0]) for _, params in listener.values("/VMC/Ext/T")]) * 60.0
    assert np.all(steps > 0.99)


def test_two_targets_hear_the_same(listener: _Listener) -> None:
    other, targets = _Listener(), [VmcTarget(), VmcTarget()]
    for one, where in zip(targets, (listener, other), strict=True):
        one.start(Destination(port=where.port), _source(_motion(), lambda: 1.0))
    listener.listen(lambda: len(listener.heard) > 5)
    other.listen(lambda: len(other.heard) > 5)
    for one in targets:
        one.stop(fade=False)
    other.socket.close()
    first, second = (w.values("/VMC/Ext/Blend/Val", "A")[0][1][1] for w in (listener, other))
    assert first == second == pytest.approx(0.5, abs=1e-3)


def test_a_closed_port_turns_the_light_to_refused(target: VmcTarget) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    target.start(Destination(port=port), _source(_motion(), lambda: 0.0))
    seen: list[TargetState] = []
    until(lambda: bool(seen.append(target.state)) or seen[-1].status is TargetStatus.REFUSED)
    problem = seen[-1].problem
    assert problem is not None
    assert problem.what == f"Nothing is receiving on 127.0.0.1 port {port}."
    assert problem.remedy == ("Start the avatar program and turn on its VMC receiver, or choose its port.")


def test_a_receiver_that_starts_later_is_found(listener: _Listener, target: VmcTarget) -> None:
    port = listener.port
    listener.socket.close()
    target.start(Destination(port=port), _source(_motion(), lambda: 0.0))
    until(lambda: target.state.status is TargetStatus.REFUSED)
    later = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with later:
        later.bind(("127.0.0.1", port))
        later.settimeout(PATIENCE)
        assert later.recv(65536)
        until(lambda: target.state.status is TargetStatus.SENDING)


def test_an_unknown_host_is_named(target: VmcTarget) -> None:
    with pytest.raises(StudioError) as caught:
        target.start(Destination(host="no such host.invalid"))
    assert caught.value.what == "There is no computer called no such host.invalid."
    assert caught.value.remedy == "Check the spelling; on this computer it is 127.0.0.1."
    assert not target.running


def test_an_impossible_port_is_named(target: VmcTarget) -> None:
    with pytest.raises(StudioError) as caught:
        target.start(Destination(port=0))
    assert str(caught.value) == "Port 0 is not possible. Choose a port from 1 to 65535."


def test_the_wave_needs_no_motion(listener: _Listener, target: VmcTarget) -> None:
    target.start(Destination(port=listener.port))

    def swing() -> float:
        """Degrees between two of the hand's poses, once there are some."""
        values = listener.values("/VMC/Ext/Bone/Pos", "RightUpperArm")
        hand = np.array([params[4:] for _, params in values], float)
        return float(np.degrees(rotation.angle_between(hand, hand[-1])).max()) if len(hand) > 10 else 0.0

    for _ in range(5):  # a machine that is stopped for the length of a wave misses it
        target.wave()
        over = time.monotonic() + WAVE_SECONDS
        listener.listen(lambda over=over: time.monotonic() > over)
        if swing() > 40:
            break
    assert swing() > 40
    assert len({params[0] for _, params in listener.values("/VMC/Ext/Bone/Pos")}) == 54


def test_presets_name_programs_and_their_ports() -> None:
    assert [p.title for p in PRESETS] == [
        "VSeeFace",
        "Warudo",
        "VNyan",
        "VMagicMirror",
        "EVMC4U",
        "VirtualMotionCapture",
    ]
    assert [p.port for p in PRESETS] == [39540, 39539, 39539, 39539, 39539, 39540]
    assert PRESETS[0].hint == "In VSeeFace, turn on VMC receiving and set the same port as here."
