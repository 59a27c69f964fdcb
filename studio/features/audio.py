"""Sound as rows of numbers: log-mel bands, MFCC or what a speech encoder hears, each at an exact place.

Row times follow from whole-number arithmetic on the row's index, never from adding up hops, so a click
in minute 29 lies as exactly as one in the first second, whatever the sample and frame rates are.
Source: Davis and Mermelstein 1980 (MFCC); Slaney's Auditory Toolbox for the mel scale, as librosa uses it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError

Floats = NDArray[np.float32]

FLOOR_POWER = 1e-10
"""Digital silence in a band; -100 dB. Fixed, not relative to a file's loudest moment, so that sound in
pieces gives the same rows as sound in one piece."""

HEARD_DB = 45.0
"""How far below the loud moments of a voice its quiet ones lie; what is lower is silence or the room."""

KINDS = ("log_mel", "mfcc", "speech", "log_mel_speech")
WHISPER, WHISPER_WIDTH = "whisper", 384
"""The speech encoder that comes with a package, and the numbers of its tokens."""

_ROWS_AT_ONCE = 4096


@dataclass(frozen=True)
class AudioSpec:
    """Which numbers describe the sound.

    Args:
        kind: "log_mel" (dB per band), "mfcc", "speech" (what a pretrained encoder hears) or
            "log_mel_speech" (both beside one another).
        bands: mel bands.
        coefficients: MFCC kept; not used by "log_mel".
        sample_rate: the sound is brought to this rate first, Hz.
        window_ms: length of sound under one row's Hann window.
        low_hz, high_hz: range of the bands; high_hz 0 is half the sample rate.
        steps_per_frame: rows per motion frame.
        window: rows a model looks at for one motion frame, centred on it.
        encoder: of "speech": "whisper", or the name or folder of a wav2vec 2.0 (features.encoders).
        encoder_width, encoder_digest: numbers of its tokens and digest of its weights, once it was found.
    """

    kind: str = "log_mel"
    bands: int = 40
    coefficients: int = 39
    sample_rate: int = 16000
    window_ms: float = 25.0
    low_hz: float = 0.0
    high_hz: float = 0.0
    steps_per_frame: int = 4
    window: int = 4
    # Not in the repr, which names kept features: those of other kinds were made before there were encoders.
    encoder: str = field(default=WHISPER, repr=False)
    encoder_width: int = field(default=0, repr=False)
    encoder_digest: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise StudioError(
                f"There is no sound feature called {self.kind}.",
                f"Use {', '.join(KINDS[:-1])} or {KINDS[-1]}.",
            )
        if self.speaks and self.sample_rate != 16000:
            raise StudioError(
                f"Speech encoders do not hear {self.sample_rate} samples a second.",
                "Leave sound.sample_rate at 16000.",
            )
        numbers = (self.bands, self.sample_rate, self.window_ms, self.steps_per_frame, self.window)
        if min(numbers) <= 0 or not self.coefficients > 0:
            raise StudioError(
                "A size of the sound features is zero or negative.", "Give whole numbers above zero."
            )
        if self.kind == "mfcc" and self.coefficients > self.bands:
            raise StudioError(
                f"{self.coefficients} MFCC cannot come from {self.bands} mel bands.",
                "Raise sound.bands or lower sound.coefficients.",
            )

    @property
    def width(self) -> int:
        """Numbers in a row, F."""
        if self.kind == "mfcc":
            return self.coefficients
        return self.mel_width + (self.speech_width if self.speaks else 0)

    @property
    def speaks(self) -> bool:
        """Whether a pretrained speech encoder gives some of the numbers."""
        return self.kind in ("speech", "log_mel_speech")

    @property
    def mel_width(self) -> int:
        """How many numbers of a row, the first ones, are dB of mel bands."""
        return self.bands if self.kind in ("log_mel", "log_mel_speech") else 0

    @property
    def speech_width(self) -> int:
        """Numbers of the encoder's tokens."""
        return self.encoder_width or (WHISPER_WIDTH if self.encoder == WHISPER else 0)

    @property
    def window_samples(self) -> int:
        """Samples under a row's window."""
        return max(2, round(self.sample_rate * self.window_ms / 1000))

    @property
    def fft_size(self) -> int:
        """The FFT's length: a power of two that holds the window and resolves every mel band.

        A short window under many bands would leave bands without a single FFT bin; the FFT is
        zero-padded until each band has one.
        """
        return _fft_size(self)


def frame_rate(fps: float) -> Fraction:
    """A frame rate as an exact fraction (29.97 is 30000/1001)."""
    return Fraction(fps).limit_denominator(1001)


def row_centres(spec: AudioSpec, fps: Fraction, first: int, count: int) -> NDArray[np.int64]:
    """The samples on which rows are centred.

    Row m lies at (2 m + 1 - K + odd) / (2 K fps) seconds, K rows a frame: the K rows of frame i are
    centred on i / fps, and so is its window (odd is 1 where K and the window differ by an odd number).

    Args:
        spec: the features.
        fps: motion frames a second.
        first: index of the first row; negative lies before the sound.
        count: how many rows.

    Returns:
        (count,) sample indices at spec.sample_rate.
    """
    k = spec.steps_per_frame
    odd = (k - spec.window) % 2
    m = np.arange(first, first + count, dtype=np.int64)
    top = (2 * m + 1 - k + odd) * (spec.sample_rate * fps.denominator)
    bottom = 2 * k * fps.numerator
    return (2 * top + bottom) // (2 * bottom)


def first_window_row(spec: AudioSpec, frame: int) -> int:
    """The first row of a frame's window."""
    return frame * spec.steps_per_frame + (spec.steps_per_frame - spec.window) // 2


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
    if not spec.speaks:
        return _spectral_rows(samples, spec, fps, first, count, start_sample)
    from studio.features.speech import speech_rows

    heard = speech_rows(samples, spec, fps, first, count, start_sample)
    if not spec.mel_width:
        return heard
    beside = _spectral_rows(samples, replace(spec, kind="log_mel"), fps, first, count, start_sample)
    return np.concatenate([beside, heard], axis=1)


def span(spec: AudioSpec, fps: Fraction, row: int) -> tuple[int, int]:
    """The samples [a, b) of the whole sound that a row may depend on."""
    centre = int(row_centres(spec, fps, row, 1)[0])
    a, b = centre - spec.window_samples, centre + spec.window_samples + 1
    if not spec.speaks:
        return a, b
    from studio.features.speech import span as of_speech

    first, last = of_speech(centre)
    return min(a, first), max(b, last)


def _spectral_rows(
    samples: Floats, spec: AudioSpec, fps: Fraction, first: int, count: int, start_sample: int
) -> Floats:
    """Rows of the kinds "log_mel" and "mfcc"."""
    from scipy.fft import dct, rfft

    centres = row_centres(spec, fps, first, count) - start_sample
    n_fft, window = spec.fft_size, spec.window_samples
    hann, filters = _hann(window), _filters(spec, n_fft).T
    lead = n_fft // 2 - (n_fft - window) // 2  # from the window's first sample to its centre
    out = np.empty((count, spec.width), dtype=np.float32)
    for a in range(0, count, _ROWS_AT_ONCE):
        part = centres[a : a + _ROWS_AT_ONCE] - lead
        spectrum = rfft(_cut(samples, part, window) * hann, n=n_fft, axis=1)
        power = spectrum.real**2 + spectrum.imag**2
        decibels = 10.0 * np.log10(np.maximum(power @ filters, FLOOR_POWER))
        if spec.kind == "mfcc":
            decibels = dct(decibels, axis=1, norm="ortho")[:, : spec.coefficients]
        out[a : a + len(part)] = decibels
    return out


def heard(rows_of_sound: Floats, spec: AudioSpec) -> Floats:
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
    span = np.zeros(high - low, dtype=np.float32)
    a, b = max(low, 0), min(high, len(samples))
    if b > a:
        span[a - low : b - low] = samples[a:b]
    pieces = np.lib.stride_tricks.sliding_window_view(span, length)
    return pieces[starts - low]


def _hz_to_mel(hz: NDArray[np.float64]) -> NDArray[np.float64]:
    # Slaney: 200/3 Hz a mel up to 1 kHz, then 27 mels for each factor of 6.4.
    above = 15.0 + np.log(np.maximum(hz, 1e-9) / 1000.0) * 27.0 / np.log(6.4)
    return np.where(hz < 1000.0, hz * 3.0 / 200.0, above)


def _mel_to_hz(mel: NDArray[np.float64]) -> NDArray[np.float64]:
    above = 1000.0 * np.exp((mel - 15.0) * np.log(6.4) / 27.0)
    return np.where(mel < 15.0, mel * 200.0 / 3.0, above)


@lru_cache(maxsize=32)
def _fft_size(spec: AudioSpec) -> int:
    size = 1 << (spec.window_samples - 1).bit_length()
    while size < 16384 and (_filters(spec, size).max(axis=1) <= 0).any():
        size *= 2
    return size


@lru_cache(maxsize=32)
def _hann(window: int) -> Floats:
    hann: Floats = (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(window) / window)).astype(np.float32)
    return hann


def _filters(spec: AudioSpec, n_fft: int) -> Floats:
    high = spec.high_hz if 0 < spec.high_hz <= spec.sample_rate / 2 else spec.sample_rate / 2
    return mel_filters(spec.bands, n_fft, spec.sample_rate, spec.low_hz, high)


def warped_bands(spec: AudioSpec, factor: float) -> NDArray[np.float64]:
    """Where each mel band's content lies once all frequencies are multiplied by a factor.

    Args:
        spec: features of the kind "log_mel".
        factor: above 1 a longer throat's bands are read, below 1 a shorter one's.

    Returns:
        Fractional band indices (F,), ends held.
    """
    high_hz = spec.high_hz if 0 < spec.high_hz <= spec.sample_rate / 2 else spec.sample_rate / 2
    low, high = _hz_to_mel(np.array([spec.low_hz, high_hz], dtype=np.float64)).tolist()
    step = (high - low) / (spec.bands + 1)
    centres = _mel_to_hz(low + step * np.arange(1, spec.bands + 1))
    return np.clip((_hz_to_mel(centres * factor) - low) / step - 1, 0, spec.bands - 1)


@lru_cache(maxsize=32)
def mel_filters(bands: int, n_fft: int, sample_rate: int, low_hz: float, high_hz: float) -> Floats:
    """Triangular mel filters of equal area, float32 (bands, n_fft / 2 + 1)."""
    low, high = _hz_to_mel(np.array([low_hz, high_hz], dtype=np.float64)).tolist()
    edges_mel = np.linspace(low, high, bands + 2)
    edges = _mel_to_hz(edges_mel)
    bins = np.arange(n_fft // 2 + 1) * sample_rate / n_fft
    rise = (bins - edges[:-2, None]) / (edges[1:-1] - edges[:-2])[:, None]
    fall = (edges[2:, None] - bins) / (edges[2:] - edges[1:-1])[:, None]
    weights = np.maximum(0.0, np.minimum(rise, fall))
    weights *= (2.0 / (edges[2:] - edges[:-2]))[:, None]
    return np.ascontiguousarray(weights, dtype=np.float32)
