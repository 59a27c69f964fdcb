"""Audio sources of a live performance: a microphone that reconnects by itself, or a sound file."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from studio import clock
from studio.capture.microphone import AudioInput, SoundBlock, SoundWatch, input_devices, opening
from studio.errors import StudioError, say
from studio.playback.player import Player
from studio.sound.sound_file import finite, sound_blocks, sound_info

Floats = NDArray[np.float32]

SHORT_S, SAFE_S = 0.02, 0.05
"""How much sound the system may gather at a time: little by default, more where it loses sound by that."""
_LOSSES, _LOSSES_S = 4, 10.0
REOPEN_S = 1.0
MERGED_S = 0.02
BLOCK_S = 0.01
"""How much of a file is given at a time."""
TAIL_S = 0.5
LEAD_S = 0.3
"""Seconds a file is heard by the network before a listener hears it, beyond the network's own reach."""


class AudioBlock(NamedTuple):
    """A block of sound.

    Args:
        samples: mono float32 (N,).
        rate: samples a second.
        captured: when its first sample was captured or is heard, seconds of `clock.now()`.
        restarted: a stream begins here: a device was opened.
    """

    samples: Floats
    rate: int
    captured: float
    restarted: bool


class AudioSource(Protocol):
    """What a performance asks of where its sound comes from."""

    @property
    def name(self) -> str:
        """What people call it."""

    @property
    def ended(self) -> bool:
        """Nothing more will come: a file is over."""

    @property
    def unheard(self) -> str:
        """Why what should be played is not heard, in a sentence; "" where it is, or nothing should be."""

    def start(self) -> None:
        """Open it; StudioError where it cannot be."""

    def wait(self, seconds: float) -> None:
        """Return as soon as there may be sound, or after so many seconds."""

    def blocks(self) -> list[AudioBlock]:
        """The blocks that have arrived since the last call."""

    def problems(self) -> list[StudioError]:
        """What went wrong or right again since the last call, as sentences."""

    def stop(self) -> None:
        """Let go of it."""


class Microphone:
    """A microphone; unplugged and back, at another rate or after a sleep, it goes on and says so.

    Args:
        device: a name, a number, or None for the default one.
        reopen_s: seconds between two tries to open it anew.

    Attributes:
        before_refresh: called before devices are looked for anew, which cuts off what is being played.
    """

    def __init__(self, device: str | int | None = None, reopen_s: float = REOPEN_S) -> None:
        self._device, self._reopen_s = device, reopen_s
        self._latency = SHORT_S
        self._input = AudioInput(device, latency=self._latency)
        self._watch: SoundWatch | None = None
        self._lost = self._restarted = False
        self._losses: deque[float] = deque(maxlen=_LOSSES)
        self._problems: deque[StudioError] = deque()
        self._lock = threading.Lock()
        self.before_refresh: Callable[[], None] = lambda: None

    @property
    def name(self) -> str:
        """The device's name."""
        device = self._input.device
        return device.name if device is not None else str(self._device or "")

    @property
    def ended(self) -> bool:
        """Never: it may come back."""
        return False

    @property
    def unheard(self) -> str:
        """Nothing of it is played here."""
        return ""

    def start(self) -> None:
        """Open it.

        Raises:
            StudioError: there is no such device, it is taken, or it refuses the format.
        """
        self._input.start()
        self._restarted = True
        self._watch = SoundWatch(lambda: self._lost, self._reopen, self._reopen_s)

    def wait(self, seconds: float) -> None:
        """Return as soon as the device has handed something over, or after so many seconds."""
        arrived = self._input.arrived
        arrived.wait(seconds)
        arrived.clear()

    def blocks(self) -> list[AudioBlock]:
        """The blocks that have arrived since the last call."""
        with self._lock:
            current = self._input
            if not self._lost and current.stalled:
                self._lose(current)
            found = []
            for blocks in _unbroken(current.drain()):
                if blocks[0].overflow:
                    self._lose_some(blocks[0].captured)
                samples = np.concatenate([block.samples for block in blocks])
                # Not `mean`, which takes ten times as long over two channels.
                share = np.full(samples.shape[1], 1 / samples.shape[1], dtype=np.float32)
                found.append(
                    AudioBlock(
                        finite(samples @ share),
                        current.sample_rate,
                        blocks[0].captured,
                        restarted=self._restarted,
                    )
                )
                self._restarted = False
            return found

    def problems(self) -> list[StudioError]:
        """What went wrong or right again since the last call."""
        problems = []
        while self._problems:
            problems.append(self._problems.popleft())
        return problems

    def stop(self) -> None:
        """Let go of it."""
        if self._watch is not None:
            self._watch.stop()
        self._input.stop()

    def _lose(self, current: AudioInput) -> None:
        self._lost = True
        self._problems.append(
            StudioError(
                say("{name} stopped giving sound.", name=self.name), "Plug it in again; it resumes by itself."
            )
        )
        # A device that is gone may take its time to be closed.
        threading.Thread(target=current.abandon, name="close lost microphone", daemon=True).start()

    def _lose_some(self, now: float) -> None:
        """Sound was dropped by the system: where that goes on, ask less of it."""
        self._losses.append(now)
        often = len(self._losses) == _LOSSES and now - self._losses[0] < _LOSSES_S
        if often and self._latency < SAFE_S:
            self._latency = SAFE_S
            self._losses.clear()
            self._lost = True  # opened anew with more patience
            what = say("This computer is too busy for short blocks of sound from {name}.", name=self.name)
            self._problems.append(
                StudioError(what, "Longer blocks are used from now on: 30 ms more latency.")
            )
            threading.Thread(target=self._input.abandon, name="close microphone", daemon=True).start()

    def _reopen(self, may_refresh: bool) -> None:
        """Runs on the watch's thread."""
        if may_refresh:
            with opening:  # nothing may be opened in between
                self.before_refresh()
                input_devices(refresh=True)
        fresh = AudioInput(self._device, latency=self._latency)
        fresh.start()
        with self._lock:
            before, name = self._input.sample_rate, self.name
            self._input, self._lost, self._restarted = fresh, False, True
        rate = fresh.sample_rate
        here, khz = self.name, f"{rate / 1000:g}"
        if here == name:
            what = say("{name} is back.", name=here)
            if rate != before:
                what = say("{name} is back at {khz} kHz.", name=here, khz=khz)
            self._problems.append(StudioError(what, "Nothing to do."))
        else:  # the system chose another one, or one of a similar name took its place
            what = say("{name} is heard now, for {other} is not back.", name=here, other=name)
            if rate != before:
                what = say(
                    "{name} is heard at {khz} kHz now, for {other} is not back.",
                    name=here,
                    khz=khz,
                    other=name,
                )
            self._problems.append(StudioError(what, "If you mean another one, stop and choose it."))


def _unbroken(blocks: list[SoundBlock]) -> list[list[SoundBlock]]:
    """Blocks that follow each other without a loss, together, up to MERGED_S: one step for all costs less."""
    together: list[list[SoundBlock]] = []
    for block in blocks:
        follows = together and not block.overflow
        if follows and block.captured - together[-1][0].captured < MERGED_S:
            together[-1].append(block)
        else:
            together.append([block])
    return together


class SoundFile:
    """A file performed as though it were spoken now, heard through the loudspeaker at the same time.

    A file is known ahead, so its motion needs no delay: blocks are given a little before they are heard.

    Args:
        path: any sound file.
        ahead: seconds it is given before it is heard.
        device: a sound output by name; None for the default one, "none" for no sound.
    """

    def __init__(self, path: Path, ahead: float, device: str | None = None) -> None:
        self._path, self._ahead = path, ahead
        info = sound_info(path)
        self._rate = info.sample_rate
        silent = device == "none"
        self._player = Player(None if silent else path, info.duration, device)
        quiet = np.zeros(round((ahead + TAIL_S) * self._rate), dtype=np.float32)
        self._stream = chain(sound_blocks(path, None, 1.0), [quiet])  # for the last poses
        self._rest = np.zeros(0, dtype=np.float32)
        self._given = 0
        self._begun: float | None = None
        self._over = False
        self._problems: deque[StudioError] = deque()

    @property
    def name(self) -> str:
        """The file's name."""
        return self._path.name

    @property
    def ended(self) -> bool:
        """Whether it was given and heard to its end."""
        return self._over and not self._player.playing

    @property
    def unheard(self) -> str:
        """Why the file is not heard while it is performed; "" where it is."""
        problem = self._player.problem
        return problem.what if problem is not None else ""

    def start(self) -> None:
        """Begin; it is heard `ahead` seconds from now."""
        self._begun = clock.now() + self._ahead

    def wait(self, seconds: float) -> None:
        """Return when the next block is due, or after so many seconds."""
        time.sleep(min(seconds, BLOCK_S))

    def blocks(self) -> list[AudioBlock]:
        """What is due."""
        assert self._begun is not None
        now = clock.now()
        if now >= self._begun and not self._player.playing and not self._over and not self._player.position:
            self._player.play()
            if self._player.problem is not None:
                self._problems.append(self._player.problem)
        began = self._origin(now)
        found: list[AudioBlock] = []
        due = int((now + self._ahead - began) * self._rate)
        size = max(1, round(BLOCK_S * self._rate))
        while not self._over and self._given + size <= due:
            samples = self._next(size)
            if not len(samples):
                self._over = True
                break
            moment = began + self._given / self._rate
            found.append(AudioBlock(samples, self._rate, moment, restarted=self._given == 0))
            self._given += len(samples)
        return found

    def problems(self) -> list[StudioError]:
        """Why it is not heard, once."""
        problems = list(self._problems)
        self._problems.clear()
        return problems

    def stop(self) -> None:
        """Silence it."""
        self._player.close()

    def _origin(self, now: float) -> float:
        """When its first sample is heard: what the loudspeaker says, else what was planned."""
        assert self._begun is not None
        position = self._player.position
        if self._player.playing and position > 0:
            self._begun = now - position
        return self._begun

    def _next(self, size: int) -> Floats:
        while len(self._rest) < size:
            block = next(self._stream, None)
            if block is None:
                break
            self._rest = np.concatenate([self._rest, block])
        taken, self._rest = self._rest[:size], self._rest[size:]
        return taken
