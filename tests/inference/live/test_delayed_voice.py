"""The voice as late as the avatar: which moment is heard when, whatever the two sound cards' clocks do."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from studio import clock, virtual_devices
from studio.capture.microphone import AudioInput
from studio.errors import StudioError
from studio.inference.live.audio_source import AudioBlock
from studio.inference.live.delayed_voice import DelayedVoiceOutput, DelayLine
from tests.patience import until

RATE, BLOCK = 48_000, 480


def passed(
    line: DelayLine,
    late: float,
    seconds: float = 12.0,
    rate: int = RATE,
    in_ppm: float = 0.0,
    out_ppm: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """A voice whose values are its moments, in and out by blocks; what came out, and when it was heard."""
    out, when, given, t, restarted = [], [], 0, 100.0, True
    block, step = rate * BLOCK // RATE, BLOCK / RATE
    for i in range(round(seconds / step)):
        captured = 100.0 + i * step * (1 + in_ppm * 1e-6)
        line.put(
            AudioBlock(
                (i * block + np.arange(block, dtype=np.float32)) / rate / 10, rate, captured, restarted
            )
        )
        restarted, t = False, captured + step
        while 100.0 + given / line.rate * (1 + out_ppm * 1e-6) < t:
            heard_at = 100.02 + (given + np.arange(BLOCK)) / line.rate * (1 + out_ppm * 1e-6)
            out.append(line.take(BLOCK, heard_at[0] - late))
            when.append(heard_at)
            given += BLOCK
    return np.concatenate(out), np.concatenate(when)


@pytest.mark.parametrize(("rate", "out_rate"), [(48_000, 48_000), (44_100, 48_000), (16_000, 44_100)])
def test_each_moment_is_heard_as_late_as_the_avatar_is(rate: int, out_rate: int) -> None:
    out, when = passed(DelayLine(out_rate), 0.12, rate=rate)
    later = when > 101.0
    behind = when[later] - 100.0 - 10 * out[later]
    assert np.median(behind) == pytest.approx(0.12, abs=0.001)
    assert np.abs(behind - 0.12).max() < 0.004


def test_two_clocks_that_drift_apart_are_followed_without_a_jump() -> None:
    out, when = passed(DelayLine(RATE), 0.12, 60.0, in_ppm=80.0, out_ppm=-80.0)
    later = when > 105.0
    behind = when[later] - 100.0 - 10 * out[later]
    assert np.abs(behind - 0.12).max() < 0.02
    assert np.abs(np.diff(out[later])).max() < 3 / RATE / 10


def test_a_delay_shorter_than_the_way_of_the_sound_is_as_short_as_can_be_without_holes() -> None:
    out, when = passed(DelayLine(RATE), 0.0)
    later = when > 101.0
    behind = when[later] - 100.0 - 10 * out[later]
    assert 0 < behind.max() < 0.06
    assert np.diff(out[later]).min() > 0  # no hole


class Line:
    """A delay line with a microphone and an output that go on block by block; values are moments."""

    def __init__(self, late: float) -> None:
        self.line, self.late, self.i, self.held = DelayLine(RATE), late, 0, []

    def go(self, blocks: int, held_up: bool = False) -> np.ndarray:
        """What comes out, (blocks, BLOCK), and stays out of it while the microphone is held up."""
        out = []
        for _ in range(blocks):
            moment = 100.0 + self.i * BLOCK / RATE
            samples = 1.0 + (self.i * BLOCK + np.arange(BLOCK, dtype=np.float32)) / RATE / 10
            self.held.append(AudioBlock(samples, RATE, moment, self.i == 0))
            if not held_up:
                for heard in self.held:
                    self.line.put(heard)
                self.held = []
            out.append(self.line.take(BLOCK, moment + 0.03 - self.late))
            self.i += 1
        return np.array(out)

    def behind(self, block: np.ndarray) -> float:
        """Seconds by which a block just taken lies behind the moment it was heard at."""
        return (self.i - 1) * BLOCK / RATE + 0.03 - 10 * (float(block[0]) - 1.0)


def test_a_voice_that_stops_is_silence_and_not_the_same_again() -> None:
    line = Line(0.12)
    line.go(300)
    rest = line.go(100, held_up=True)
    assert (np.diff(rest[:8].ravel()) >= 0).all()  # what was there is played once
    assert not rest[12:].any()


def test_a_microphone_that_was_held_up_does_not_make_the_voice_late_for_good() -> None:
    line = Line(0.12)
    line.go(300)
    line.go(50, held_up=True)
    assert line.behind(line.go(100)[-1]) == pytest.approx(0.12, abs=0.005)


def test_hiccups_make_the_voice_later_for_as_long_as_they_go_on() -> None:
    line = Line(0.05)
    line.go(300)
    for _ in range(6):
        line.go(6, held_up=True)
        line.go(60)
    hiccup, after = line.go(6, held_up=True), line.go(60)
    assert hiccup.all()  # no hole any more
    assert 0.06 < line.behind(after[-1]) < 0.13
    assert line.behind(line.go(2000)[-1]) == pytest.approx(0.05, abs=0.005)


def test_another_delay_is_gone_over_to_without_a_click() -> None:
    line, rng = DelayLine(RATE), np.random.default_rng(2)
    tone = 0.5 * np.sin(2 * np.pi * 200 * np.arange(4 * RATE) / RATE + rng.uniform()).astype(np.float32)
    out = []
    for i in range(380):
        line.put(AudioBlock(tone[i * BLOCK : (i + 1) * BLOCK], RATE, 100.0 + i * 0.01, i == 0))
        out.append(line.take(BLOCK, 100.0 + i * 0.01 - (0.12 if i < 200 else 0.52)))
    steps = np.abs(np.diff(np.concatenate(out)[RATE:]))
    assert steps.max() < 0.03  # a tone of 200 Hz and that level moves by 0.013 a sample


pytestmark = pytest.mark.slow


class Voice:
    """Somebody who hums without end, in blocks as a microphone gives them."""

    def __init__(self, output: DelayedVoiceOutput) -> None:
        self._output, self.muted, self._ended = output, False, threading.Event()
        self._thread = threading.Thread(target=self._hum)
        self._thread.start()

    def _hum(self) -> None:
        begun, given = clock.now(), 0
        while not self._ended.wait(0.005):
            while begun + (given + BLOCK) / RATE < clock.now():
                t = (given + np.arange(BLOCK)) / RATE
                hum = (0.3 * np.sin(2 * np.pi * 220 * t)).astype(np.float32)
                self._output.feed(AudioBlock(hum, RATE, begun + given / RATE, given == 0), self.muted)
                given += BLOCK

    def end(self) -> None:
        self._ended.set()
        self._thread.join()


class Ear:
    """What comes out of the second output."""

    def __init__(self) -> None:
        self._input = AudioInput("default", RATE, 1)
        self._input.start()

    def loudest(self) -> float:
        """Of what was heard since the last call; -1 where nothing was."""
        return max((float(np.abs(block.samples).max()) for block in self._input.drain()), default=-1.0)

    def close(self) -> None:
        self._input.stop()


@pytest.fixture
def ear(virtual_audio: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Ear]:
    monkeypatch.setenv("PULSE_SINK", virtual_devices.SECOND)
    monkeypatch.setenv("PULSE_SOURCE", f"{virtual_devices.SECOND}.monitor")
    ear = Ear()
    yield ear
    ear.close()


def test_it_is_heard_and_silent_while_muted_and_comes_back_after_a_rest(ear: Ear) -> None:
    output = DelayedVoiceOutput("default", lambda: 0.1)
    output.start()
    voice = Voice(output)
    try:
        until(lambda: ear.loudest() > 0.25)
        voice.muted = True
        until(lambda: ear.loudest() == 0.0)
        voice.muted = False
        until(lambda: ear.loudest() > 0.25)
        output.rest()  # as while a microphone is looked for
        said: list[str] = []

        def told() -> bool:
            said.extend(map(str, output.problems()))
            return "default takes your voice again. Nothing to do." in said

        until(told)
        ear.loudest()
        until(lambda: ear.loudest() > 0.25)
    finally:
        voice.end()
        output.stop()
    until(lambda: ear.loudest() == 0.0)


def test_an_output_there_is_not_is_a_sentence(virtual_audio: str) -> None:
    output = DelayedVoiceOutput("Headphones of Mars", lambda: 0.1)
    with pytest.raises(StudioError, match="There is no sound output called Headphones of Mars"):
        output.start()
    output.stop()
