"""What a selection gives to learn from: its sound and its motion, both from the in point on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Selection
from studio.motion import Motion
from studio.sound.sound_file import Sound, read_span
from studio.take.cleaned import cached_clean, clean
from studio.take.motion_file import load_motion
from studio.take.take import Take


@dataclass(frozen=True, eq=False)
class TrainingMaterial:
    """The used part of a take.

    Args:
        selection: the choices it was cut by.
        samples: mono sound, float32 (N,); empty without sound.
        sample_rate: of the samples.
        motion: frames with the offset applied, times from the in point; without frames where there is no
            motion.
        duration: seconds from in point to out point.
        excluded: (start, end) spans left out, seconds from the in point.
    """

    selection: Selection
    samples: NDArray[np.float32]
    sample_rate: int
    motion: Motion
    duration: float
    excluded: tuple[tuple[float, float], ...] = ()

    def heard_at(self, sample_rate: int) -> NDArray[np.float32]:
        """The samples at another rate, Hz: a take's own need not be the one that a model learnt at."""
        return Sound(self.samples[:, None], self.sample_rate).resampled(sample_rate).mono()


def load_material(
    selection: Selection,
    take: Take,
    sample_rate: int | None = None,
    on_cleaning: Callable[[float], None] = lambda done: None,
) -> TrainingMaterial:
    """Read the part of a take that a selection uses; cleaned sound that is not there yet is made first.

    Args:
        selection: in and out points, offset and excluded spans.
        take: the take it was made of.
        sample_rate: wanted rate of the sound; the file's own where None.
        on_cleaning: is told how much of the cleaned sound is made (0..1), where it has to be.

    Raises:
        StudioError: a file is missing or damaged.
    """
    start, end = selection.span(take.info.duration)
    heard = Sound(np.zeros((0, 1), dtype=np.float32), sample_rate or 16000)
    if take.audio_path is not None:
        made = cached_clean(take.audio_path, selection.clean)
        # Only the span: an hour's take with a minute in use is not read as a whole.
        heard = read_span(made or clean(take.audio_path, selection.clean, on_cleaning), start, end)
    # Cut before it is resampled, which takes most of the time.
    sound = heard if sample_rate is None else heard.resampled(sample_rate)
    motion = load_motion(take, selection.offset, (start, end)) or Motion.build([])
    excluded = tuple(
        (max(a, start) - start, min(b, end) - start) for a, b in selection.excluded if b > start and a < end
    )
    return TrainingMaterial(selection, sound.mono(), sound.sample_rate, motion, end - start, excluded)
