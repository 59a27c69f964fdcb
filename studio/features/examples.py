"""Training examples: rows of sound and columns of motion of a take on one frame grid, with their cache."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
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
from studio.motion import Motion

PAD_SECONDS = 3.0
"""Silence whose rows are kept on both sides of a take, for windows that reach beyond it."""

LONGEST_GAP = 0.25
"""Seconds without a motion frame that may be filled by going straight from one to the next."""

STANDARD_RATES = (23.976, 24.0, 25.0, 29.97, 30.0, 48.0, 50.0, 60.0, 72.0, 75.0, 90.0, 100.0, 120.0)


@dataclass(frozen=True, eq=False)
class Grid:
    """Motion on even frames.

    Args:
        motion: T frames at i / fps.
        valid: 1 where the frame was captured and is not excluded, float32 (T,).
    """

    motion: Motion
    valid: Floats


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


def nominal_rate(fps: float) -> float:
    """The frame rate that was meant by a measured one: a standard rate within 1.5 %, else as measured."""
    nearest = min(STANDARD_RATES, key=lambda rate: abs(rate - fps))
    return nearest if abs(nearest - fps) <= 0.015 * fps else round(fps, 2)


def learnt_rate(fps: float, most_fps: float) -> Fraction:
    """The rate learnt for takes of a rate: a whole fraction of it, not above most_fps (where possible)."""
    rate = Fraction(nominal_rate(fps)).limit_denominator(1001)
    divisor = 1
    while rate / divisor > most_fps * 1.001:
        divisor += 1
    return rate / divisor


def on_grid(
    motion: Motion, duration: float, fps: Fraction, excluded: Sequence[tuple[float, float]] = ()
) -> Grid:
    """A motion on the frames i / fps from 0 to its end or the sound's, whichever is first.

    Args:
        motion: times from the in point, seconds.
        duration: of the sound, seconds.
        fps: frames a second.
        excluded: spans left out, seconds from the in point.
    """
    end = min(float(motion.times[-1]), duration + LONGEST_GAP) if len(motion) else 0.0
    count = max(0, int(np.floor(end * float(fps) + 1e-6)) + 1) if len(motion) else 0
    times = np.arange(count) * fps.denominator / fps.numerator
    half = 0.5 / float(fps)
    valid = np.ones(count, dtype=np.float32)
    if count:
        valid[(times < motion.times[0] - half) | (times > motion.times[-1] + half)] = 0
        for gap in np.flatnonzero(np.diff(motion.times) > LONGEST_GAP):
            valid[(times > motion.times[gap] + half) & (times < motion.times[gap + 1] - half)] = 0
    for start, stop in excluded:
        valid[(times >= start) & (times < stop)] = 0
    return Grid(motion.at(times), valid)


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
