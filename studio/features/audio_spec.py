"""Which numbers describe the sound: kind and size of a row, where each row lies, and the mel bands.

Row times follow from whole-number arithmetic on the row's index, never from adding up hops, so a click
in minute 29 lies as exactly as one in the first second, whatever the sample and frame rates are.
Source: Slaney's Auditory Toolbox for the mel scale, as librosa uses it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, say

Floats = NDArray[np.float32]

KINDS = ("log_mel", "mfcc", "speech", "log_mel_speech")
WHISPER, WHISPER_WIDTH = "whisper", 384
"""The speech encoder that comes with a package, and the numbers of its tokens."""
WHISPER_LIVE = "whisper_live"
"""Its first blocks as a stream (features.streaming_encoder), which can follow a microphone."""

_LIMITS = {
    "bands": (1, 512), "coefficients": (1, 512), "sample_rate": (1000, 192_000), "window_ms": (1, 500),
    "low_hz": (0, 96_000), "high_hz": (0, 96_000), "steps_per_frame": (1, 64), "window": (1, 1024),
    "encoder_width": (0, 8192),
}  # fmt: skip
"""What a spec may say. A run comes from anybody: beyond these it asks for any amount of time and memory."""
_LONGEST_WINDOW = 16_384
"""Samples under a row's window; the longest FFT there is need for."""
_MOST_A_FRAME, _MOST_A_WINDOW = 16_384, 32_768
"""Numbers of a motion frame's rows, and of the rows that a model looks at for one."""


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
        encoder: of "speech": "whisper", "whisper_live" (which can follow a microphone), or the name or
            folder of a wav2vec 2.0 (features.encoders).
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
    encoder: str = WHISPER
    encoder_width: int = 0
    encoder_digest: str = ""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise RequestError(
                say("There is no sound feature called {kind}.", kind=self.kind),
                say("Use {kinds} or {last}.", kinds=", ".join(KINDS[:-1]), last=KINDS[-1]),
            )
        for name, (low, high) in _LIMITS.items():
            value = getattr(self, name)
            kinds = (int, float) if name in ("window_ms", "low_hz", "high_hz") else (int,)
            # Python counts True as the number 1; a recipe that says bands = true is a mistake.
            if isinstance(value, bool) or not isinstance(value, kinds) or not low <= value <= high:
                raise RequestError(
                    say("{value} is not possible for sound.{name}.", value=repr(value), name=name),
                    say("Choose {low} to {high}.", low=low, high=high),
                )
        for name in ("encoder", "encoder_digest"):
            if not isinstance(getattr(self, name), str):
                raise RequestError(
                    say(
                        "{value} is not possible for sound.{name}.",
                        value=repr(getattr(self, name)),
                        name=name,
                    ),
                    "Give a name.",
                )
        self._must_fit()

    def _must_fit(self) -> None:
        """RequestError for values that are possible each, but not together."""
        if self.uses_encoder and self.sample_rate != 16000:
            raise RequestError(
                say(
                    "Speech encoders do not hear {rate} samples a second.",
                    rate=self.sample_rate,
                ),
                "Leave sound.sample_rate at 16000.",
            )
        if self.encoder in (WHISPER, WHISPER_LIVE) and self.encoder_width not in (0, WHISPER_WIDTH):
            what = say(
                "Whisper's tokens are {width} numbers wide, not {asked}.",
                width=WHISPER_WIDTH,
                asked=self.encoder_width,
            )
            raise RequestError(what, "Leave sound.encoder_width out.")
        if self.kind == "mfcc" and self.coefficients > self.bands:
            raise RequestError(
                say(
                    "{coefficients} MFCC cannot come from {bands} mel bands.",
                    coefficients=self.coefficients,
                    bands=self.bands,
                ),
                "Raise sound.bands or lower sound.coefficients.",
            )
        if self.low_hz >= self.highest_hz:
            raise RequestError(
                say(
                    "Mel bands cannot reach from {low} to {high} Hz.",
                    low=f"{self.low_hz:g}",
                    high=f"{self.highest_hz:g}",
                ),
                "Lower sound.low_hz.",
            )
        # Each value is in its limits, yet together they ask for gigabytes; a run may come from anybody.
        if self.window_samples > _LONGEST_WINDOW:
            what = say(
                "A window of {window} ms at {rate} Hz is too long.",
                window=f"{self.window_ms:g}",
                rate=self.sample_rate,
            )
            raise RequestError(what, "Lower sound.window_ms or sound.sample_rate.")
        if self.width * self.steps_per_frame > _MOST_A_FRAME or self.width * self.window > _MOST_A_WINDOW:
            what = say(
                "{width} numbers a row are too many for sound.steps_per_frame and sound.window.",
                width=self.width,
            )
            raise RequestError(what, "Lower one of the three.")

    @property
    def cache_key(self) -> str:
        """All that decides the rows of a sound, as text: "kind=log_mel bands=40 ..."; names cached rows.

        What a kind does not use is left out, so that changing it does not compute the same rows again.
        """
        unused = set() if self.kind == "mfcc" else {"coefficients"}
        # The encoder hears the sound itself; mel bands are not in its rows.
        if self.kind == "speech":
            unused |= {"bands", "window_ms", "low_hz", "high_hz"}
        if not self.uses_encoder:
            unused |= {"encoder", "encoder_width", "encoder_digest"}
        return " ".join(
            f"{one.name}={getattr(self, one.name)}" for one in fields(self) if one.name not in unused
        )

    @property
    def width(self) -> int:
        """Numbers in a row, F."""
        if self.kind == "mfcc":
            return self.coefficients
        return self.mel_width + (self.speech_width if self.uses_encoder else 0)

    @property
    def uses_encoder(self) -> bool:
        """Whether a pretrained speech encoder gives some of the numbers."""
        return self.kind in ("speech", "log_mel_speech")

    @property
    def mel_width(self) -> int:
        """How many numbers of a row, the first ones, are dB of mel bands."""
        return self.bands if self.kind in ("log_mel", "log_mel_speech") else 0

    @property
    def speech_width(self) -> int:
        """Numbers of the encoder's tokens."""
        return self.encoder_width or (WHISPER_WIDTH if self.encoder in (WHISPER, WHISPER_LIVE) else 0)

    @property
    def streams(self) -> bool:
        """Whether rows can be made of live sound: all but an encoder's that hears half a minute at once."""
        return not self.uses_encoder or self.encoder == WHISPER_LIVE

    @property
    def window_samples(self) -> int:
        """Samples under a row's window."""
        return max(2, round(self.sample_rate * self.window_ms / 1000))

    @property
    def highest_hz(self) -> float:
        """The upper end of the bands."""
        nyquist = self.sample_rate / 2
        return self.high_hz if 0 < self.high_hz <= nyquist else nyquist

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
    # Half a row's shift: with an odd difference no row would lie on the frame's own moment.
    odd = (k - spec.window) % 2
    m = np.arange(first, first + count, dtype=np.int64)
    top = (2 * m + 1 - k + odd) * (spec.sample_rate * fps.denominator)
    bottom = 2 * k * fps.numerator
    return (2 * top + bottom) // (2 * bottom)


def between(values: Floats, where: NDArray[np.floating]) -> Floats:
    """Rows (R, F) of values (T, F) at fractional indices (R,), straight lines between them, ends held."""
    where = np.clip(where, 0, len(values) - 1)
    left = np.minimum(where.astype(np.int64), max(len(values) - 2, 0))
    part = (where - left).astype(np.float32)[:, None]
    right = np.minimum(left + 1, len(values) - 1)
    return values[left] * (1 - part) + values[right] * part


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
    # Doubled until every band has a bin of its own; an empty band would be silent for ever.
    while size < 16384 and (filters_of(spec, size).max(axis=1) <= 0).any():
        size *= 2
    return size


def filters_of(spec: AudioSpec, n_fft: int) -> Floats:
    """The mel filters of a spec for an FFT of a length, float32 (bands, n_fft / 2 + 1)."""
    return mel_filters(spec.bands, n_fft, spec.sample_rate, spec.low_hz, spec.highest_hz)


def warped_bands(spec: AudioSpec, factor: float) -> NDArray[np.float64]:
    """Where each mel band's content lies once all frequencies are multiplied by a factor.

    Args:
        spec: features of the kind "log_mel".
        factor: above 1 a longer throat's bands are read, below 1 a shorter one's.

    Returns:
        Fractional band indices (F,), ends held.
    """
    low, high = _hz_to_mel(np.array([spec.low_hz, spec.highest_hz], dtype=np.float64)).tolist()
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
