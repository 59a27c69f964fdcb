"""The voice handed on through a real (virtual) output, heard by another input."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from studio import stage
from studio.capture import clock
from studio.capture.audio import AudioInput
from studio.errors import StudioError
from studio.live.handed_on import HandedOn
from studio.live.sources import Heard
from tests.patience import until

RATE, BLOCK = 48_000, 480
pytestmark = pytest.mark.slow


class Voice:
    """Somebody who hums without end, in blocks as a microphone gives them."""

    def __init__(self, output: HandedOn) -> None:
        self._output, self.muted, self._ended = output, False, threading.Event()
        self._thread = threading.Thread(target=self._hum)
        self._thread.start()

    def _hum(self) -> None:
        begun, given = clock.now(), 0
        while not self._ended.wait(0.005):
            while begun + (given + BLOCK) / RATE < clock.now():
                t = (given + np.arange(BLOCK)) / RATE
                hum = (0.3 * np.sin(2 * np.pi * 220 * t)).astype(np.float32)
                self._output.feed(Heard(hum, RATE, begun + given / RATE, given == 0), self.muted)
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
    monkeypatch.setenv("PULSE_SINK", stage.SECOND)
    monkeypatch.setenv("PULSE_SOURCE", f"{stage.SECOND}.monitor")
    ear = Ear()
    yield ear
    ear.close()


def test_it_is_heard_and_silent_while_muted_and_comes_back_after_a_rest(ear: Ear) -> None:
    output = HandedOn("default", lambda: 0.1)
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
    output = HandedOn("Headphones of Mars", lambda: 0.1)
    with pytest.raises(StudioError, match="There is no sound output called Headphones of Mars"):
        output.start()
    output.stop()
