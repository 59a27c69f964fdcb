"""Offsets between sound and motion, as a choice: where the mouth opens with the voice, take by take."""

from __future__ import annotations

from collections.abc import Iterable

from studio.dataset import edits
from studio.dataset.dataset import Dataset
from studio.take.lag import Alignment, find_offset
from studio.take.motion_file import read_motion
from studio.take.sound import read_sound
from studio.take.take import Take

__all__ = ["SURE", "Alignment", "align_takes", "find_offset", "take_offset"]

SURE = 0.5
"""Confidence from which an offset is set without asking."""


def take_offset(take: Take) -> Alignment | None:
    """The alignment of a saved take; None where it lacks sound or motion.

    Raises:
        StudioError: a file is missing or damaged.
    """
    if take.audio_path is None or take.motion_path is None:
        return None
    return find_offset(read_sound(take.audio_path), read_motion(take.motion_path))


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
