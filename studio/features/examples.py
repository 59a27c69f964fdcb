"""Training examples: rows of sound and columns of motion of a take on one frame grid, with their cache."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from studio.errors import StudioError
from studio.features.audio import rows
from studio.features.audio_spec import AudioSpec, Floats
from studio.features.motion import Layout
from studio.files import atomic
from studio.files.cache import read_arrays, used
from studio.motion.grid import Grid

PAD_SECONDS = 3.0
"""Silence whose rows are kept on both sides of a take, for windows that reach beyond it."""
_ROWS_VERSION = 2
"""Raised whenever the same sound and spec give other rows than before; older cached rows then go unused."""


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
    key = f"rows {_ROWS_VERSION} {fps} {first} {count} {spec.cache_key}"
    digest = hashlib.blake2b(np.ascontiguousarray(samples).tobytes(), digest_size=16)
    digest.update(key.encode())
    path = cache / f"{digest.hexdigest()}.npy"
    cached = read_arrays(path).get("")
    if cached is not None and cached.shape == (count, spec.width) and cached.dtype == np.float32:
        used(path)
        return cached
    made = rows(samples, spec, fps, first, count)
    with suppress(StudioError), atomic.written(path) as temporary, temporary.open("wb") as file:
        # A full disk costs time, not the training.
        np.save(file, made, allow_pickle=False)
    return made
