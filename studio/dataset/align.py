"""Offsets between sound and motion, as a choice: by mouth and voice or by claps, take by take."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from studio.dataset import edits
from studio.dataset.dataset import Dataset
from studio.motion.lag import Alignment, level_of, power, voice_offset
from studio.sound.sound_file import sound_blocks
from studio.take.clap import clap_offset
from studio.take.motion_file import load_motion
from studio.take.take import Take

SURE = 0.5
"""Confidence from which an offset is set without asking."""
LISTEN_RATE = 16_000
"""Samples a second of what is listened to; a block of sound is a whole number of spans long."""

By = Literal["mouth", "clap"]
"""What sound and motion are brought together by."""


def take_offset(take: Take, by: By = "mouth") -> Alignment | None:
    """The alignment of a saved take, of any length; None where it lacks sound or motion.

    Raises:
        StudioError: a file is missing or damaged.
    """
    if take.audio_path is None or (motion := load_motion(take)) is None:
        return None
    audio_power = power_of_sound(take.audio_path)
    return clap_offset(audio_power, motion) if by == "clap" else voice_offset(level_of(audio_power), motion)


def power_of_sound(sound: Path) -> NDArray[np.float64]:
    """Mean square of a sound in each hundredth of a second (K,), in bounded memory."""
    rest = np.zeros(0, np.float32)
    parts: list[NDArray[np.float64]] = []
    for block in sound_blocks(sound, LISTEN_RATE):
        samples = np.concatenate([rest, block])
        whole = len(samples) // (LISTEN_RATE // 100) * (LISTEN_RATE // 100)
        rest = samples[whole:]
        parts.append(power(samples[:whole], LISTEN_RATE))
    return np.concatenate(parts) if parts else np.zeros(0)


def align_takes(
    dataset: Dataset, alignments: Iterable[tuple[str, Alignment]], sure: float = SURE
) -> tuple[Dataset, tuple[str, ...]]:
    """With the offsets found for takes, where the confidence allows it.

    Args:
        dataset: the choices.
        alignments: take ids with what was found for them.
        sure: confidence from which an offset is taken.

    Returns:
        The new choices, and the ids of the takes that were left as they are.
    """
    unsure = []
    for take, alignment in alignments:
        if alignment.confidence < sure:
            unsure.append(take)
            continue
        ids = [selection.id for selection in edits.selections_of(dataset, take)]
        dataset = edits.set_offset(dataset, ids, round(alignment.offset, 4))
    return dataset, tuple(unsure)
