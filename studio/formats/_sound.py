"""The sound that goes beside a motion, as a WAV."""

from __future__ import annotations

import shutil
from pathlib import Path

from studio.take.sound import put_sound, read_sound, sound_info

_ALIKE_SECONDS = 0.01


def put(path: Path, audio: Path) -> None:
    """Write a sound: the same bytes where it is a WAV, else decoded to one."""
    info = sound_info(audio)
    if info.container in ("WAV", "WAVEX"):
        shutil.copyfile(audio, path)
    else:
        put_sound(path, read_sound(audio), "PCM_24" if "24" in info.encoding else "PCM_16", "WAV")


def fits(path: Path, audio: Path) -> bool:
    """Whether a file holds as much sound as another, at its rate and with its channels."""
    got, wanted = sound_info(path), sound_info(audio)
    same = (got.sample_rate, got.channels) == (wanted.sample_rate, wanted.channels)
    if got.container != wanted.container:  # where it was decoded, its length was only an estimate before
        return same and got.duration > 0
    return same and abs(got.duration - wanted.duration) < _ALIKE_SECONDS
