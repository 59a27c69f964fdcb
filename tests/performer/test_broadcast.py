"""The performer over real UDP and a real (virtual) sound device."""

from __future__ import annotations

import math
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from studio.errors import RequestError
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.performer import Broadcast, Script, perform_script
from studio.performer.loudspeaker import Loudspeaker
from studio.performer.performance import ScriptedScene, scenes
from studio.vmc.assemble import Frame, FrameAssembler
from studio.vmc.udp import bind
from tests.patience import nearest, until


@dataclass
class Listener:
    """A receiver of its own: stamps datagrams on arrival, decodes them when asked."""

    channel: socket.socket
    heard: list[tuple[float, bytes]] = field(default_factory=list)
    stopping: threading.Event = field(default_factory=threading.Event)

    @property
    def port(self) -> int:
        return int(self.channel.getsockname()[1])

    def listen(self) -> None:
        while not self.stopping.is_set():
            try:
                data = self.channel.recv(65536)
            except TimeoutError:
                continue
            self.heard.append((time.monotonic(), data))

    def frames(self) -> list[Frame]:
        """Put together by their marks alone, since a pause of this listener's must tear none."""
        assembler, heard, tick = FrameAssembler(), list(self.heard), 1e-6
        found = [frame for i, (_, data) in enumerate(heard) for frame in assembler.feed(i * tick, data)]
        found += assembler.flush(99.0)
        assert assembler.packets_bad == 0
        return [replace(frame, arrival=heard[round(frame.arrival / tick)][0]) for frame in found]


@pytest.fixture
def listener() -> Iterator[Listener]:
    with bind(0) as channel:
        channel.settimeout(0.05)
        made = Listener(channel)
        thread = threading.Thread(target=made.listen)
        thread.start()
        yield made
        made.stopping.set()
        thread.join()


def performed(listener: Listener, seconds: float = 1.5, **options: object) -> tuple[Broadcast, list[Frame]]:
    """A silent performance, whole, as it was received; the way to rest behind it left out."""
    asked = {"device": "none", "voice_source": "bundled", "seconds": seconds} | options
    broadcast = Broadcast("127.0.0.1", listener.port, **asked)  # type: ignore[arg-type]
    broadcast.start()
    assert broadcast.wait(seconds + 120)
    assert broadcast.error is None
    until(lambda: len(listener.heard) >= broadcast.datagrams_sent)
    return broadcast, listener.frames()[: broadcast.frames_sent]


@pytest.mark.slow
@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
def test_frames_arrive_whole_at_the_rate_asked_for(listener: Listener, fps: float) -> None:
    before = time.monotonic()
    broadcast, frames = performed(listener, fps=fps)
    assert broadcast.frames_sent + broadcast.frames_dropped == round(1.5 * fps)
    assert len(listener.frames()) == broadcast.frames_sent + round(0.5 * fps), "the way to rest comes last"
    for frame in frames:
        assert set(frame.bones) == set(BONES)
        assert set(frame.shapes) == set(VRM0_SHAPES)
    stamps = np.array([frame.sender_time for frame in frames], dtype=float)
    beats = stamps * fps
    assert beats == pytest.approx(np.round(beats), abs=1e-3), "a busy machine drops some, and moves none"
    assert (np.diff(beats) > 0.5).all()
    assert all(frame.arrival > before + t for frame, t in zip(frames, stamps, strict=True)), "none is early"


@pytest.mark.slow
def test_what_arrives_is_what_was_performed(listener: Listener) -> None:
    _, frames = performed(listener, seed=2)
    motion = perform_script(Script(2, voice_source="bundled"), 1.5, 60).motion
    for frame in frames:
        assert frame.sender_time is not None
        pose = motion.pose(frame.sender_time)
        for i, name in enumerate(VRM0_SHAPES):
            assert frame.shapes[name] == pytest.approx(float(pose.shapes[i]), abs=1e-3)
        for i, name in enumerate(BONES):
            sent = np.asarray(frame.bones[name][1])
            assert abs(float(sent @ pose.rotations[i])) > 1 - 1e-4


@pytest.mark.slow
def test_schedule_does_not_drift(listener: Listener) -> None:
    """Arrival less the frame's own time stays where it began, however long each frame took."""

    def drift() -> float:
        listener.heard.clear()
        _, frames = performed(listener, 3.0)
        late = np.array([frame.arrival - (frame.sender_time or 0.0) for frame in frames])
        half = len(late) // 2
        return float(late[half:].min() - late[:half].min())  # the least late: others were held up

    assert abs(nearest(drift, 0.0, good=0.008)) < 0.05


@pytest.mark.slow
def test_unbundled_sends_one_message_a_datagram(listener: Listener) -> None:
    _, frames = performed(listener, bundle=False)
    assert frames
    assert not any(data.startswith(b"#bundle") for _, data in listener.heard)
    assert all(set(frame.bones) == set(BONES) for frame in frames)


@pytest.mark.slow
def test_loss_loses_about_that_share(listener: Listener) -> None:
    broadcast, _ = performed(listener, loss=0.2)
    whole = broadcast.datagrams_sent + broadcast.datagrams_lost
    assert whole > 150, "the way to rest alone"
    assert broadcast.datagrams_lost / whole == pytest.approx(0.2, abs=0.15)
    assert len(listener.heard) == broadcast.datagrams_sent


@pytest.mark.slow
def test_jitter_delays_but_keeps_order(listener: Listener) -> None:
    _, frames = performed(listener, jitter_ms=25.0)
    stamps = [frame.sender_time or 0.0 for frame in frames]
    assert stamps == sorted(stamps)
    late = np.array([frame.arrival - t for frame, t in zip(frames, stamps, strict=True)])
    assert np.std(late) > 0.004  # how little more it is, only a quiet machine can tell


@pytest.mark.slow
def test_starts_at_once_stops_soon_and_says_what_it_says(listener: Listener) -> None:
    said: list[str] = []
    go = threading.Event()

    def slowly(script: Script, fps: float) -> Iterator[ScriptedScene]:
        go.wait(60)
        yield from scenes(script, fps)

    broadcast = Broadcast(
        "127.0.0.1", listener.port, device="none", voice_source="bundled", on_line=said.append,
        make_scenes=slowly,
    )  # fmt: skip
    assert not broadcast.alive
    broadcast.start()
    assert broadcast.position < 0, "speech is made after start has returned: the window must not wait"
    go.set()
    until(lambda: broadcast.speaking != "" and broadcast.speaking in said)
    assert broadcast.alive
    broadcast.stop(60)
    assert not broadcast.alive
    assert broadcast.speaking == ""
    until(lambda: len(listener.heard) >= broadcast.datagrams_sent)
    end = listener.frames()[-1]
    assert all(weight == 0.0 for weight in end.shapes.values())
    assert end.bones["Head"][1] == pytest.approx([0.0, 0.0, 0.0, 1.0], abs=1e-6)
    stamps = [frame.sender_time or 0.0 for frame in listener.frames()]
    assert stamps == sorted(stamps)
    count = len(listener.heard)
    assert broadcast.position > 0.2
    assert count >= broadcast.datagrams_sent - 10


def test_impossible_wishes_are_told() -> None:
    cases = {
        "0 is not a port. Choose a number from 1 to 65535.": {"port": 0},
        "0 frames a second cannot be sent. Choose a rate from 1 to 240.": {"fps": 0.0},
        "nan frames a second cannot be sent. Choose a rate from 1 to 240.": {"fps": float("nan")},
        "A loss of 2 is not a share. Choose a number from 0 to 1.": {"loss": 2.0},
        "A jitter of -1 ms cannot be made. Choose 0 to 1000 ms.": {"jitter_ms": -1.0},
        "A performance of -3 s cannot be given. Choose a time above 0.": {"seconds": -3.0},
    }
    for sentence, options in cases.items():
        with pytest.raises(RequestError) as caught:
            Broadcast(**({"host": "127.0.0.1", "port": 39539} | options))  # type: ignore[arg-type]
        assert str(caught.value) == sentence


def test_unknown_host_and_device_are_told(virtual_audio: str) -> None:
    lost = Broadcast("no.such.host.invalid", 39539, device="none", voice_source="bundled")
    lost.start()
    assert lost.wait(120)  # some name servers take their time to know nothing
    assert str(lost.error) == (
        "There is no computer called no.such.host.invalid. Write its name or number, such as 127.0.0.1."
    )
    deaf = Broadcast("127.0.0.1", 39539, device="Gramophone", voice_source="bundled")
    deaf.start()
    assert deaf.wait(60)
    assert str(deaf.error) == (
        "There is no output device called Gramophone. Choose a device that is plugged in, or none."
    )


@pytest.mark.slow
def test_sound_and_motion_are_in_time(virtual_audio: str, listener: Listener) -> None:
    """The voice recorded from the device and the frames received agree on when the performance began.

    To 40 ms, which a machine that stumbles spoils now and then.
    """
    apart = nearest(lambda: performed_apart(virtual_audio, listener), 0.0, good=0.04)
    print(f"motion later than sound by {1000 * apart:.1f} ms")
    assert abs(apart) < 0.08


def performed_apart(virtual_audio: str, listener: Listener) -> float:
    """How much later than its sound the motion of a performance is, seconds; NaN where it stumbled."""
    import sounddevice

    listener.heard.clear()
    blocks: list[tuple[float, np.ndarray]] = []

    def record(data: np.ndarray, _frames: int, info: object, _status: object) -> None:
        heard = time.monotonic() + info.inputBufferAdcTime - info.currentTime  # type: ignore[attr-defined]
        blocks.append((heard, data[:, 0].copy()))

    with sounddevice.InputStream(samplerate=48000, channels=1, device=virtual_audio, callback=record):
        broadcast = Broadcast(
            "127.0.0.1", listener.port, device=virtual_audio, seed=3, seconds=5.0, voice_source="bundled"
        )
        broadcast.start()
        until(lambda: broadcast.position > 4.5)
        audible = broadcast.audible
        broadcast.stop(60)
    if not audible or broadcast.problem:
        return math.nan
    sound = np.concatenate([data for _, data in blocks])
    ends = np.cumsum([0, *(len(data) for _, data in blocks)])[:-1]
    zero_heard = float(np.median([t - n / 48000 for (t, _), n in zip(blocks, ends, strict=True)]))
    wanted = perform_script(Script(3, voice_source="bundled"), 3.5, 60).samples
    size = 1 << int(np.ceil(np.log2(len(sound) + len(wanted))))
    match = np.fft.irfft(np.fft.rfft(sound, size) * np.conj(np.fft.rfft(wanted, size)), size)
    began_sound = zero_heard + int(match[: len(sound)].argmax()) / 48000
    late = [frame.arrival - (frame.sender_time or 0.0) for frame in listener.frames()]
    assert len(late) > 20
    return float(np.median(late)) - began_sound


@pytest.mark.slow
def test_goes_on_silently_when_the_device_stops(virtual_audio: str, listener: Listener) -> None:
    unplugged = threading.Event()

    class Speaker(Loudspeaker):
        """One that can be unplugged: its device asks for nothing any more."""

        def callback(self, out: NDArray[np.float32], frames: int, info: Any, status: object) -> None:
            if unplugged.is_set():
                out[:] = 0.0
            else:
                super().callback(out, frames, info, status)

    broadcast = Broadcast(
        "127.0.0.1", listener.port, device=virtual_audio, voice_source="bundled", open_speaker=Speaker
    )
    broadcast.start()
    until(lambda: broadcast.audible and broadcast.position > 0.3)
    unplugged.set()
    until(lambda: broadcast.problem != "")
    assert broadcast.problem == "The sound device stopped. The performer goes on without a voice."
    assert not broadcast.audible
    sent, position = broadcast.frames_sent, broadcast.position
    until(lambda: broadcast.frames_sent > sent + 30)
    assert broadcast.position > position
    broadcast.stop()
    # A frame that a stalled machine tore in two has its T in one half only.
    stamps = [frame.sender_time for frame in listener.frames() if frame.sender_time is not None]
    assert stamps == sorted(stamps)
    assert stamps[-1] >= position
