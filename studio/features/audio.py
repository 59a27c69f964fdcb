"""Sound as rows of numbers: log-mel bands, MFCC or what a speech encoder hears, each at an exact place.

Source: Davis and Mermelstein 1980 (MFCC).
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.features.audio_spec import AudioSpec, Floats, filters_of, row_centres

FLOOR_POWER = 1e-10
"""Digital silence in a band; -100 dB. Fixed, not relative to a file's loudest moment, so that sound in
pieces gives the same rows as sound in one piece."""

HEARD_DB = 45.0
"""How far below the loud moments of a voice its quiet ones lie; what is lower is silence or the room."""

_ROWS_AT_ONCE, _NUMBERS_AT_ONCE = 4096, 1 << 24


def rows(
    samples: Floats, spec: AudioSpec, fps: Fraction, first: int, count: int, start_sample: int = 0
) -> Floats:
    """Rows of features.

    Args:
        samples: mono sound at spec.sample_rate, float32 (N,); silence is taken to lie on both sides.
        spec: the features.
        fps: motion frames a second.
        first: index of the first row.
        count: how many rows.
        start_sample: which sample of the whole sound samples[0] is.

    Returns:
        float32 (count, F).

    Raises:
        StudioError: the speech encoder is not on this computer.
    """
    if not spec.uses_encoder:
        return _spectral_rows(samples, spec, fps, first, count, start_sample)
    from studio.features.encoders import speech_rows

    heard = speech_rows(samples, spec, fps, first, count, start_sample)
    if not spec.mel_width:
        return heard
    beside = _spectral_rows(samples, replace(spec, kind="log_mel"), fps, first, count, start_sample)
    return np.concatenate([beside, heard], axis=1)


def span(spec: AudioSpec, fps: Fraction, row: int) -> tuple[int, int]:
    """The samples [a, b) of the whole sound that a row may depend on."""
    centre = int(row_centres(spec, fps, row, 1)[0])
    a, b = centre - spec.window_samples, centre + spec.window_samples + 1
    if not spec.uses_encoder:
        return a, b
    if spec.streams:
        from studio.features import streaming_encoder

        first, _ = streaming_encoder.heard(streaming_encoder.chunk_of(centre), 1)
        last = int(streaming_encoder.ready_at(np.array([centre]))[0])
        return min(a, first - streaming_encoder.REACH_BACK), max(b, last)
    from studio.features.encoders import span as of_speech

    first, last = of_speech(centre)
    return min(a, first), max(b, last)


def ready_at(spec: AudioSpec, centres: NDArray[np.int64]) -> NDArray[np.int64]:
    """After how many samples of the whole sound rows centred on some samples (R,) are known; spec.streams."""
    lead = spec.fft_size // 2 - (spec.fft_size - spec.window_samples) // 2
    ready = centres + spec.window_samples - lead
    if not spec.uses_encoder:
        return ready
    from studio.features import streaming_encoder

    heard = streaming_encoder.ready_at(centres)
    return np.maximum(ready, heard) if spec.mel_width else heard


def _spectral_rows(
    samples: Floats, spec: AudioSpec, fps: Fraction, first: int, count: int, start_sample: int
) -> Floats:
    """Rows of the kinds "log_mel" and "mfcc"."""
    from scipy.fft import dct, rfft

    centres = row_centres(spec, fps, first, count) - start_sample
    n_fft, window = spec.fft_size, spec.window_samples
    hann, filters = _hann(window), filters_of(spec, n_fft).T
    lead = n_fft // 2 - (n_fft - window) // 2  # from the window's first sample to its centre
    out = np.empty((count, spec.width), dtype=np.float32)
    at_once = min(_ROWS_AT_ONCE, _NUMBERS_AT_ONCE // n_fft)
    # In pieces: the spectra of an hour at once would be gigabytes.
    for a in range(0, count, at_once):
        part = centres[a : a + at_once] - lead
        spectrum = rfft(_cut(samples, part, window) * hann, n=n_fft, axis=1)
        power = spectrum.real**2 + spectrum.imag**2
        # Decibels and not power: what is heard as equal steps is learnt as equal steps.
        decibels = 10.0 * np.log10(np.maximum(power @ filters, FLOOR_POWER))
        if spec.kind == "mfcc":
            decibels = dct(decibels, axis=1, norm="ortho")[:, : spec.coefficients]
        out[a : a + len(part)] = decibels
    return out


def non_silent_rows(rows_of_sound: Floats, spec: AudioSpec) -> Floats:
    """The rows (R, F) that are not silence: no more than HEARD_DB below the loud ones (95th percentile)."""
    if spec.kind == "speech":
        return rows_of_sound  # an encoder's numbers say nothing of loudness
    level = rows_of_sound[:, : spec.mel_width or None].mean(axis=1)
    if spec.kind == "mfcc":  # the first coefficient is the sum over the bands, by the square root of them
        level = rows_of_sound[:, 0] / np.sqrt(spec.bands)
    return rows_of_sound[level >= np.percentile(level, 95) - HEARD_DB]


def _cut(samples: Floats, starts: NDArray[np.int64], length: int) -> Floats:
    """Pieces (R, length) of the sound from given samples on, zeros outside of it."""
    if not len(starts):
        return np.zeros((0, length), dtype=np.float32)
    low, high = int(starts.min()), int(starts.max()) + length
    # Zeros outside: silence before and after, the same for a whole sound and for pieces of it.
    span = np.zeros(high - low, dtype=np.float32)
    a, b = max(low, 0), min(high, len(samples))
    if b > a:
        span[a - low : b - low] = samples[a:b]
    pieces = np.lib.stride_tricks.sliding_window_view(span, length)
    return pieces[starts - low]


@lru_cache(maxsize=32)
def _hann(window: int) -> Floats:
    hann: Floats = (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(window) / window)).astype(np.float32)
    return hann
