"""One phrase spoken into a microphone: it ends by itself at a pause. Nothing is written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.capture.device_names import title_of
from studio.capture.microphone import AudioInput
from studio.errors import InputError, say
from studio.sound.level import FLOOR_DBFS, dbfs
from studio.sound.sound_file import Sound

LONGEST_S = 10.0
PAUSE_S = 1.2
"""Seconds of quiet behind speech that end a phrase: longer than a breath."""
SILENT_DBFS = -50.0
"""Below, nobody speaks, however quiet the room is."""
BELOW_VOICE_DB = 18.0
"""So far under the loudest moment nobody speaks: quiet sounds of speech are within it, rooms are not."""


@dataclass(frozen=True)
class PhraseState:
    """How a phrase stands.

    Args:
        duration: seconds listened.
        level_dbfs: of the newest sound.
        spoken: somebody has spoken.
        ended: nothing more is to come: there was a pause, it is as long as it may be, or the device is gone.
    """

    duration: float = 0.0
    level_dbfs: float = FLOOR_DBFS
    spoken: bool = False
    ended: bool = False


class PhraseEnd:
    """Finds where a phrase ends, from one block of sound after another. Pure."""

    def __init__(self, sample_rate: int) -> None:
        self._rate = sample_rate
        self._loudest = FLOOR_DBFS
        self._quiet_s = 0.0
        self.state = PhraseState()

    def feed(self, samples: NDArray[np.float32]) -> PhraseState:
        """The state after another block, float32 (N, C)."""
        if not len(samples):
            return self.state
        level, seconds = dbfs(float(np.sqrt(np.mean(np.square(samples))))), len(samples) / self._rate
        self._loudest = max(self._loudest, level)
        speaks = level > max(self._loudest - BELOW_VOICE_DB, SILENT_DBFS)
        self._quiet_s = 0.0 if speaks else self._quiet_s + seconds
        spoken, duration = self.state.spoken or speaks, self.state.duration + seconds
        ended = duration >= LONGEST_S or (spoken and self._quiet_s >= PAUSE_S)
        self.state = PhraseState(duration, level, spoken, ended)
        return self.state


class PhraseRecording:
    """Listens to a microphone until a phrase has ended.

    Args:
        device: a name; None for the default one.

    Raises:
        StudioError: there is no microphone, or it cannot be opened. Opening takes a moment: not for a thread
            that must not wait.
    """

    def __init__(self, device: str | None) -> None:
        self._input = AudioInput(device)
        self._input.start()
        self._end = PhraseEnd(self._input.sample_rate)
        self._blocks: list[NDArray[np.float32]] = []

    def poll(self) -> PhraseState:
        """Read what has arrived."""
        self._feed(block.samples for block in self._input.drain())
        state = self._end.state
        if self._input.stalled and not state.ended:
            return PhraseState(state.duration, FLOOR_DBFS, state.spoken, ended=True)
        return state

    def close(self) -> None:
        """Let go of the microphone; what was said stays."""
        self._input.stop()

    def sound(self) -> Sound:
        """What was said, mono.

        Raises:
            InputError: nobody spoke.
        """
        if not self._end.state.spoken:
            raise nothing_heard(self._input.device.name if self._input.device is not None else "default")
        return Sound(np.concatenate(self._blocks), self._input.sample_rate)

    def _feed(self, blocks: Iterable[NDArray[np.float32]]) -> None:
        for samples in blocks:
            self._end.feed(samples)
            self._blocks.append(samples.mean(axis=1, keepdims=True, dtype=np.float32))


def nothing_heard(device: str) -> InputError:
    """What is said where nobody spoke into a microphone, by its name as the sound system has it."""
    what = say("Nothing was heard from {device}.", device=title_of(device, say("the default microphone")))
    return InputError(what, "Check that it is switched on, or type a sentence.")
