"""The practice performer as a microphone: real UDP, the real recorder, and no sound device anywhere."""

from __future__ import annotations

import itertools
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from studio import clock
from studio.capture.device_names import line_port, performer_device
from studio.capture.microphone import SoundBlock
from studio.capture.practice_voice import PracticeVoice
from studio.capture.recorder import Recorder
from studio.errors import StudioError
from studio.motion.lag import voice_offset
from studio.performer import Broadcast, Script, perform_script
from studio.sound import LINE_PORT
from studio.sound.sound_file import read_sound
from studio.sound.voice_line import BLOCK_SAMPLES, LINE_RATE, LineBlock, encode_block
from studio.take.alignment import level_of, power_of_sound, take_offset
from tests.patience import until
from tests.ports import free_port

SECONDS = 8.0


@pytest.fixture
def voice() -> Iterator[PracticeVoice]:
    made = PracticeVoice(free_port())
    made.start()
    yield made
    made.stop()
    made.stop()


@pytest.fixture
def speaker() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        yield channel


AHEAD_S = 2.0
"""Test voices speak this far ahead of the present, so that a machine that stumbles cuts nothing off them."""


def send(channel: socket.socket, voice: PracticeVoice, first: int, captured: float, level: float) -> None:
    block = LineBlock(first, captured, np.full(BLOCK_SAMPLES, level, np.float32))
    channel.sendto(encode_block(block), ("127.0.0.1", voice.port))


def drained(voice: PracticeVoice, enough: Callable[[list[SoundBlock]], bool]) -> list[SoundBlock]:
    blocks: list[SoundBlock] = []

    def look() -> bool:
        blocks.extend(voice.drain())
        return enough(blocks)

    until(look)
    return blocks


def loud(blocks: list[SoundBlock]) -> list[SoundBlock]:
    return [block for block in blocks if block.samples.any()]


def gaps(blocks: list[SoundBlock]) -> list[float]:
    """Seconds between the end of each block and the beginning of the next."""
    return [b.captured - a.captured - len(a.samples) / LINE_RATE for a, b in itertools.pairwise(blocks)]


def test_silence_runs_into_the_voice_and_on_behind_it(voice: PracticeVoice, speaker: socket.socket) -> None:
    begin = clock.now() + AHEAD_S
    for k in range(5):
        send(speaker, voice, k * BLOCK_SAMPLES, begin + k * BLOCK_SAMPLES / LINE_RATE, 0.5)
    blocks = drained(voice, lambda found: bool(loud(found)) and not found[-1].samples.any())
    spoken = loud(blocks)
    assert len(spoken) == 5
    assert spoken[0].captured == pytest.approx(begin, abs=1e-6)
    assert blocks[0] is not spoken[0], "silence comes first"
    assert max(map(abs, gaps(blocks))) < 1.5 / LINE_RATE, "the line never breaks off"
    assert not any(block.overflow for block in blocks)
    assert all(block.samples.shape[1] == 1 for block in blocks)
    assert not voice.stalled


def test_lost_blocks_are_counted_and_leave_their_gap(voice: PracticeVoice, speaker: socket.socket) -> None:
    begin = clock.now() + AHEAD_S
    for k in (0, 1, 4):
        send(speaker, voice, k * BLOCK_SAMPLES, begin + k * BLOCK_SAMPLES / LINE_RATE, 0.5)
    spoken = loud(drained(voice, lambda found: len(loud(found)) == 3))
    assert [block.overflow for block in spoken] == [False, False, True]
    assert gaps(spoken) == pytest.approx([0.0, 2 * BLOCK_SAMPLES / LINE_RATE], abs=1e-6)
    assert voice.overruns == 1


@pytest.mark.parametrize("captured", [1e300, -1e300, 1e6])
def test_a_voice_of_another_time_does_not_take_the_line(
    voice: PracticeVoice, speaker: socket.socket, captured: float
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stray:
        send(stray, voice, 0, captured, -0.9)
    begin = clock.now() + AHEAD_S
    for k in range(3):
        send(speaker, voice, k * BLOCK_SAMPLES, begin + k * BLOCK_SAMPLES / LINE_RATE, 0.5)
    blocks = drained(voice, lambda found: len(loud(found)) >= 3)
    assert {float(block.samples.min()) for block in loud(blocks)} == {0.5}
    assert max(map(abs, gaps(blocks))) < 1.5 / LINE_RATE


def test_what_comes_when_the_line_was_silent_already_is_counted_as_lost(
    voice: PracticeVoice, speaker: socket.socket
) -> None:
    begin = clock.now() + AHEAD_S
    send(speaker, voice, 0, begin, 0.5)
    blocks = drained(voice, lambda found: bool(loud(found)) and not found[-1].samples.any())
    assert voice.overruns == 0
    # It was held up: what it goes on with lies in the silence, up to the present and beyond.
    late = blocks[-1].captured - 0.005
    for k in range(200):
        send(speaker, voice, (k + 1) * BLOCK_SAMPLES, late + k * BLOCK_SAMPLES / LINE_RATE, 0.25)
    spoken = loud(drained(voice, lambda found: len(loud(found)) >= 3))
    assert [block.overflow for block in spoken[:3]] == [True, False, False]
    assert voice.overruns == 1


def test_a_second_voice_does_not_break_into_the_first(voice: PracticeVoice, speaker: socket.socket) -> None:
    begin = clock.now() + AHEAD_S
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        for k in range(3):
            at = begin + k * BLOCK_SAMPLES / LINE_RATE
            send(speaker, voice, k * BLOCK_SAMPLES, at, 0.5)
            send(other, voice, k * BLOCK_SAMPLES, at, -0.9)
        speaker.sendto(b"junk", ("127.0.0.1", voice.port))
        spoken = loud(drained(voice, lambda found: len(loud(found)) >= 3))
    assert {float(block.samples.min()) for block in spoken} == {0.5}


def test_names_of_its_device() -> None:
    assert line_port("performer") == LINE_PORT
    assert line_port(performer_device(40_001)) == 40_001
    assert [line_port(other) for other in ("Performer", "performer:", "performers", "", None, 3)] == [
        None
    ] * 6


def test_a_port_in_use_is_a_sentence_and_leaves_nothing_open(tmp_path: Path, voice: PracticeVoice) -> None:
    recorder = Recorder(tmp_path / "takes")
    try:
        with pytest.raises(StudioError) as caught:
            recorder.open_audio(performer_device(voice.port))
        assert caught.value.what == f"The practice performer's voice cannot be received on port {voice.port}."
        assert (
            caught.value.remedy
            == "Close the other program that uses it, or choose another port for the voice."
        )
        assert caught.value.in_window == "Stop the practice performer and start it again."
        assert recorder.snapshot().device is None
    finally:
        recorder.close()


@pytest.mark.slow
def test_a_practice_take_has_its_voice_in_time_without_any_sound_device(tmp_path: Path) -> None:
    """The whole way that the window goes: lips that fit the voice as well as in the performance itself."""
    recorder = Recorder(tmp_path / "takes")
    port = free_port()
    recorder.open_motion(0)
    recorder.open_audio(performer_device(port))
    motion_port = recorder.snapshot().port
    assert motion_port is not None
    broadcast = Broadcast(
        "127.0.0.1", motion_port, device="none", voice_source="bundled", voice_port=port, seed=3
    )
    try:
        broadcast.start()
        until(lambda: broadcast.position >= 0)
        recorder.start("Voice")
        until(lambda: recorder.snapshot().audio_seconds >= SECONDS)
        take = recorder.stop()
        assert recorder.cut_off is None
    finally:
        broadcast.stop()
        recorder.close()
    assert (take.info.device, take.info.sample_rate) == ("Practice performer", LINE_RATE)
    assert take.info.notes == ()
    assert take.audio_path is not None
    performed = perform_script(Script(3, voice_source="bundled"), SECONDS + 30, 60)
    recorded = read_sound(take.audio_path).samples.reshape(-1)
    at = found_at(recorded[LINE_RATE : 3 * LINE_RATE], performed.samples) - LINE_RATE
    np.testing.assert_allclose(
        recorded[LINE_RATE : 3 * LINE_RATE], performed.samples[at + LINE_RATE :][: 2 * LINE_RATE], atol=1e-4
    )
    measured = take_offset(take)
    motion = performed.motion.shifted(-at / LINE_RATE).between(0.0, take.info.duration)
    expected = voice_offset(level_of(power_of_sound(take.audio_path)), motion)
    assert measured is not None
    assert measured.confidence > 0.5
    print(f"lips later than in the performance by {1000 * (expected.offset - measured.offset):.1f} ms")
    assert abs(measured.offset - expected.offset) <= 0.020


def found_at(part: np.ndarray, whole: np.ndarray) -> int:
    """Sample of the whole at which a part of it begins."""
    size = len(whole) + len(part)
    spectrum = np.fft.rfft(whole, size) * np.conj(np.fft.rfft(part, size))
    return int(np.argmax(np.fft.irfft(spectrum, size)[: len(whole)]))


def test_a_take_of_a_silent_line_is_whole(tmp_path: Path) -> None:
    """Who records before the performer speaks, or after it was stopped, loses no microphone."""
    recorder = Recorder(tmp_path / "takes")
    recorder.open_audio(performer_device(free_port()))
    try:
        recorder.start("Silent")
        until(lambda: recorder.snapshot().audio_seconds > 0.5)
        take = recorder.stop()
        assert take.info.audio_seconds > 0.5
        assert (recorder.cut_off, take.info.notes) == (None, ("There is no motion in this take.",))
    finally:
        recorder.close()
