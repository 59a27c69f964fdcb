"""What is wrong with the sound of a take."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.motion import lag
from studio.sound.sound_file import sound_blocks, sound_info
from studio.take.take import Finding

FLOOR_DBFS = -100.0
_BLOCK = 10.0
_FULL_SCALE = 0.9985
_CLIPPED_RUN = 3
"""Samples in a row at full scale that make a clip: one alone may be a true peak."""


@dataclass(frozen=True, eq=False)
class SoundStats:
    """What one pass over a sound file tells.

    Args:
        duration, sample_rate: of the file.
        power: mean square, lag.RATE values a second (K,).
        peak_dbfs: highest sample.
        clipped: samples at full scale in runs; first_clip is where the first stands, seconds.
        dc: mean of all samples.
    """

    duration: float
    sample_rate: int
    power: NDArray[np.float64]
    peak_dbfs: float
    clipped: int
    first_clip: float
    dc: float

    @property
    def levels_dbfs(self) -> NDArray[np.float64]:
        """Level of each moment."""
        return 10 * np.log10(np.maximum(self.power, 10 ** (FLOOR_DBFS / 10)))

    @property
    def noise_dbfs(self) -> float:
        """Level of the quietest tenth."""
        return float(np.percentile(self.levels_dbfs, 10)) if len(self.power) else FLOOR_DBFS

    @property
    def speech_dbfs(self) -> float:
        """Level of the loudest twentieth."""
        return float(np.percentile(self.levels_dbfs, 95)) if len(self.power) else FLOOR_DBFS

    @property
    def speech(self) -> float:
        """Part of the moments that are loud enough for a voice."""
        if not len(self.power) or self.speech_dbfs < -60:
            return 0.0
        bar = max(self.speech_dbfs - 25, min(self.noise_dbfs + 10, self.speech_dbfs - 6))
        return float((self.levels_dbfs > bar).mean())


def measure_sound(path: Path) -> SoundStats:
    """Go over a sound file once, in bounded memory.

    Raises:
        StudioError: it is missing or damaged.
    """
    info = sound_info(path)
    powers, peak, clipped, first_clip, total, count = [], 0.0, 0, 0.0, 0.0, 0
    for block in sound_blocks(path, None, _BLOCK):
        powers.append(lag.power(block, info.sample_rate))
        loud = np.abs(block)
        peak = max(peak, float(loud.max(initial=0.0)))
        runs = _runs(loud >= _FULL_SCALE)
        if len(runs) and not clipped:
            first_clip = (count + int(runs[0, 0])) / info.sample_rate
        clipped += int((runs[:, 1] - runs[:, 0]).sum())
        total += float(block.sum(dtype=np.float64))
        count += len(block)
    power = np.concatenate(powers) if powers else np.zeros(0)
    peak_dbfs = max(20 * np.log10(max(peak, 1e-9)), FLOOR_DBFS)
    return SoundStats(
        info.duration, info.sample_rate, power, float(peak_dbfs), clipped, first_clip, total / max(count, 1)
    )


def sound_findings(stats: SoundStats) -> Iterator[Finding]:
    """Clipping, levels, noise, silence and rate."""
    if stats.duration <= 0 or stats.speech_dbfs < -60:
        what = "The sound is silent." if stats.duration > 0 else "The sound is empty."
        yield Finding(
            "silence", "fatal", what, "Check the microphone and its mute switch, then record again."
        )
        return
    if stats.clipped:
        part = stats.clipped / max(stats.duration * stats.sample_rate, 1)
        what = f"The sound is clipped in {stats.clipped} samples."
        remedy = "Turn the microphone's gain down and record again."
        yield Finding("clipping", "major" if part > 0.001 else "minor", what, remedy, stats.first_clip)
    if stats.peak_dbfs < -30:
        what = f"The sound is quiet: its peak is {stats.peak_dbfs:.0f} dBFS."
        yield Finding("quiet", "minor", what, "Turn the microphone's gain up or come closer.")
    distance = stats.speech_dbfs - stats.noise_dbfs
    if stats.noise_dbfs > -50 and distance < 25:
        what = f"The background noise is only {distance:.0f} dB below the voice."
        remedy = "Record in a quieter room, closer to the microphone."
        yield Finding("noise", "major" if distance < 12 else "minor", what, remedy)
    if stats.speech < 0.2:
        what = f"There is voice in only {stats.speech:.0%} of the take."
        yield Finding("silence", "note", what, "Trim the silence, or leave it for a resting face.")
    if stats.sample_rate < 16000:
        what = f"The sound was recorded at {stats.sample_rate} Hz, too low for clear consonants."
        yield Finding("rate", "minor", what, "Record at 44100 or 48000 Hz.")
    if abs(stats.dc) > 0.02:
        what = "The sound does not swing around zero (DC offset)."
        yield Finding("dc", "note", what, "Check the microphone's cable or interface.")


def _runs(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(first, one past last) of each run of at least _CLIPPED_RUN true values, (K, 2)."""
    if not mask.any():
        return np.zeros((0, 2), dtype=np.intp)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    runs = edges.reshape(-1, 2)
    return runs[runs[:, 1] - runs[:, 0] >= _CLIPPED_RUN]
