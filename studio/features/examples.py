"""Training examples: rows of sound and columns of motion of a take on one frame grid, with their cache."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.features.audio import rows
from studio.features.audio_spec import AudioSpec, Floats
from studio.features.motion import Layout
from studio.files import leftovers
from studio.files.cache import read_arrays, used
from studio.motion.grid import Grid

PAD_SECONDS = 3.0
"""Silence whose rows are kept on both sides of a take, for windows that reach beyond it."""


@dataclass(frozen=True, eq=False)
class Example:
    """One selection as a network sees it.

    Args:
        id: of the selection.
        sound: rows of features, float32 (R, F), beginning `lead` rows before the first frame's.
        lead: see above.
        values: scaled columns, float32 (T, C).
        mask: 1 for columns the take has, float32 (C,).
        grid: the captured motion they come from.
        style: index of its style, 0 where it has none of its own.
    """

    id: str
    sound: Floats
    lead: int
    values: Floats
    mask: Floats
    grid: Grid
    style: int = 0

    @property
    def frames(self) -> int:
        """Motion frames, T."""
        return len(self.values)

    def rows(self, first: int, count: int) -> Floats:
        """Rows from index `first` on (0 is the first frame's first row); ends held."""
        wanted = np.arange(first + self.lead, first + self.lead + count)
        return self.sound[np.clip(wanted, 0, len(self.sound) - 1)]


def make_example(
    name: str, samples: Floats, grid: Grid, layout: Layout, spec: AudioSpec, fps: Fraction, cache: Path | None
) -> Example:
    """An example of one selection.

    Args:
        name: the selection's id.
        samples: mono sound at spec.sample_rate from the in point on, (N,).
        grid: its motion.
        layout: the columns.
        spec: the sound features.
        fps: frames a second.
        cache: folder in which features are kept by content; None for none.
    """
    natural, mask = layout.columns(grid.motion)
    lead = round(PAD_SECONDS * float(fps)) * spec.steps_per_frame
    count = len(grid.valid) * spec.steps_per_frame + 2 * lead
    sound = cached_rows(samples, spec, fps, -lead, count, cache)
    return Example(name, sound, lead, layout.scaled(natural), mask, grid)


def cached_rows(
    samples: Floats, spec: AudioSpec, fps: Fraction, first: int, count: int, cache: Path | None
) -> Floats:
    """Rows as features.audio.rows gives them, from the cache where the same sound was seen before."""
    if cache is None:
        return rows(samples, spec, fps, first, count)
    digest = hashlib.blake2b(np.ascontiguousarray(samples).tobytes(), digest_size=16)
    digest.update(repr((spec, fps, first, count, "rows 1")).encode())
    if spec.uses_encoder:
        digest.update(repr((spec.encoder, spec.encoder_digest, "speech 2")).encode())
    path = cache / f"{digest.hexdigest()}.npy"
    kept = read_arrays(path).get("")
    if kept is not None and kept.shape == (count, spec.width) and kept.dtype == np.float32:
        used(path)
        return kept
    made = rows(samples, spec, fps, first, count)
    with suppress(OSError):  # a full disk costs time, not the training
        _keep(path, made)
    return made


def _keep(path: Path, values: NDArray[np.float32]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = leftovers.beside(path)
    try:
        with beside.open("wb") as file:
            np.save(file, values, allow_pickle=False)
        beside.replace(path)
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)
