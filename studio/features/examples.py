"""Training examples: a take's rows of sound and columns of motion on one frame grid, and crops of them.

Rows are cached. Crops are varied as the recipe says: tempo, loudness, tone, voice, noise, masked spans and
bands.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.features.audio import rows
from studio.features.audio_spec import AudioSpec, Floats, between, warped_bands
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
        moods: 1 where a mood's label stands, (T, moods); None where no moods are told.
    """

    id: str
    sound: Floats
    lead: int
    values: Floats
    mask: Floats
    grid: Grid
    style: int = 0
    moods: Floats | None = None

    @property
    def frames(self) -> int:
        """Motion frames, T."""
        return len(self.values)

    def rows(self, first: int, count: int) -> Floats:
        """Rows from index `first` on (0 is the first frame's first row); ends held."""
        wanted = np.arange(first + self.lead, first + self.lead + count)
        # Held and not zero: a zero is a level in dB, and a loud one.
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
    # Whole frames, so that row 0 stays the first frame's first row.
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
    # Checked although the key names it all: a damaged file may still be readable.
    if cached is not None and cached.shape == (count, spec.width) and cached.dtype == np.float32:
        used(path)
        return cached
    made = rows(samples, spec, fps, first, count)
    with suppress(StudioError), atomic.written(path) as temporary, temporary.open("wb") as file:
        # A full disk costs time, not the training.
        np.save(file, made, allow_pickle=False)
    return made


@dataclass(frozen=True)
class Augmentation:
    """How crops are varied while learning, a recipe's section [augment]; 0 turns a kind off.

    Args:
        stretch: tempo varies by up to this fraction.
        gain_db: loudness varies by up to this.
        tilt_db: treble against bass varies by up to this.
        warp: frequencies vary by up to this fraction, like voices of other lengths of throat.
        noise_db: the noise floor rises up to this far above the take's quietest rows.
        time_masks, time_mask_frames: silenced spans and their longest length in motion frames.
        band_masks, band_mask_width: silenced bands and their largest width.
        token_noise: what a speech encoder heard is shifted and shaken by this share of its deviation.
        token_drop: this share of an encoder's numbers is not heard in a crop.
    """

    stretch: float = 0.0
    gain_db: float = 0.0
    tilt_db: float = 0.0
    warp: float = 0.0
    noise_db: float = 0.0
    time_masks: int = 0
    time_mask_frames: int = 0
    band_masks: int = 0
    band_mask_width: int = 0
    token_noise: float = 0.0
    token_drop: float = 0.0


@dataclass(frozen=True)
class CropShape:
    """What is cut: frames in a crop, rows needed before and after them, and what the rows are."""

    frames: int
    before: int
    after: int
    sound: AudioSpec

    @property
    def steps_per_frame(self) -> int:
        """Rows a frame."""
        return self.sound.steps_per_frame


@dataclass(frozen=True, eq=False)
class Crop:
    """A piece of an example: rows (n K + before + after, F), values, their weights (n, C), moods (n, M)."""

    rows: Floats
    values: Floats
    weight: Floats
    moods: Floats | None = None


def cut(
    example: Example,
    first: int,
    crop_shape: CropShape,
    augment: Augmentation,
    rng: np.random.Generator | None,
) -> Crop:
    """One crop from frame `first` on; frames beyond the take's end weigh nothing.

    Args:
        example: where from.
        first: index of its first frame.
        crop_shape: how much.
        augment: how it may vary; loudness, tone, voice, noise and bands only make sense for "log_mel" rows.
        rng: chance; None varies nothing.
    """
    tempo = (
        1.0
        if rng is None or not augment.stretch
        else float(rng.uniform(1 - augment.stretch, 1 + augment.stretch))
    )
    frames = first + np.arange(crop_shape.frames) * tempo
    values, valid = between(example.values, frames), _held(example.grid.valid, frames)
    weight = valid[:, None] * example.mask[None, :]
    count = crop_shape.frames * crop_shape.steps_per_frame + crop_shape.before + crop_shape.after
    rows = _stretched_rows(example, first, count, crop_shape, tempo)
    bands = crop_shape.sound.mel_width if crop_shape.sound.uses_encoder else rows.shape[1]
    if rng is not None and bands:
        rows[:, :bands] = _augmented(rows[:, :bands], augment, crop_shape, rng)
    if rng is not None and bands < rows.shape[1]:  # an encoder's numbers are no dB
        rows[:, bands:] = _shaken(rows[:, bands:], augment, rng)
    moods = None if example.moods is None else between(example.moods, frames)
    return Crop(rows, values, weight.astype(np.float32), moods)


def _stretched_rows(example: Example, first: int, count: int, crop_shape: CropShape, tempo: float) -> Floats:
    k = crop_shape.steps_per_frame
    if tempo == 1.0:
        return example.rows(first * k - crop_shape.before, count).copy()
    # Row m of frame i lies (m - (k - 1) / 2) / k frames from it: stretching turns about frame centres.
    middle = (k - 1) / 2
    wanted = first * k + middle + (np.arange(count) - crop_shape.before - middle) * tempo + example.lead
    return between(example.sound, wanted)


def _read_at(rows: Floats, bands: NDArray[np.float64]) -> Floats:
    """Each row read at fractional band indices (F,)."""
    left = np.minimum(bands.astype(np.int64), max(rows.shape[1] - 2, 0))
    part = (bands - left).astype(np.float32)
    return rows[:, left] * (1 - part) + rows[:, np.minimum(left + 1, rows.shape[1] - 1)] * part


def _held(valid: Floats, frames: NDArray[np.floating]) -> Floats:
    """1 where both neighbours of a fractional frame are valid and inside."""
    inside = (frames >= 0) & (frames <= len(valid) - 1)
    low = np.clip(np.floor(frames).astype(np.int64), 0, len(valid) - 1)
    high = np.clip(np.ceil(frames).astype(np.int64), 0, len(valid) - 1)
    return (inside * valid[low] * valid[high]).astype(np.float32)


def _augmented(
    rows: Floats, augment: Augmentation, crop_shape: CropShape, rng: np.random.Generator
) -> Floats:
    features, quiet = rows.shape[1], float(np.percentile(rows.mean(axis=1), 5))
    change = np.zeros(features, dtype=np.float32)
    if augment.gain_db:
        change += rng.uniform(-augment.gain_db, augment.gain_db)
    if augment.tilt_db:
        tilt = np.linspace(-1, 1, features, dtype=np.float32)
        change += np.float32(rng.uniform(-augment.tilt_db, augment.tilt_db)) * tilt
    if augment.warp:
        rows = _read_at(
            rows, warped_bands(crop_shape.sound, float(rng.uniform(1 - augment.warp, 1 + augment.warp)))
        )
    heard = rows + change
    if augment.noise_db:
        floor = quiet + rng.uniform(0, augment.noise_db) + rng.normal(0, 3, features)
        # Powers add: 10 log10(10^(a/10) + 10^(b/10)). Plain exp in float32 is ten times as fast as
        # logaddexp, and safe: FLOOR_POWER keeps rows far from where it underflows.
        power = np.exp(heard * _NATURAL) + np.exp(floor * _NATURAL).astype(np.float32)
        heard = np.log(power) / _NATURAL
    rows = heard.astype(np.float32)
    for _ in range(augment.time_masks if augment.time_mask_frames else 0):
        length = int(rng.integers(0, augment.time_mask_frames + 1)) * crop_shape.steps_per_frame
        start = int(rng.integers(0, max(len(rows) - length, 1)))
        rows[start : start + length] = quiet
    for _ in range(augment.band_masks if augment.band_mask_width else 0):
        width = min(int(rng.integers(0, augment.band_mask_width + 1)), features)
        start = int(rng.integers(0, features - width + 1))
        rows[:, start : start + width] = quiet
    return rows


def _shaken(tokens: Floats, augment: Augmentation, rng: np.random.Generator) -> Floats:
    """An encoder's numbers (R, W) of a crop: all shifted, each shaken, some at their mean throughout."""
    mean, width = tokens.mean(axis=0), tokens.shape[1]
    if augment.token_noise:
        share = np.float32(augment.token_noise) * tokens.std(axis=0)
        shift = rng.standard_normal(width, dtype=np.float32) + rng.standard_normal(tokens.shape, np.float32)
        tokens = tokens + share * shift
    if augment.token_drop:
        # At their mean rather than 0: zeros would be values that no speech has.
        gone = rng.random(width) < augment.token_drop
        tokens = np.where(gone, mean, tokens)
    return tokens


_NATURAL = np.float32(np.log(10.0) / 10.0)
