"""How much later the mouth moves than the voice sounds: mouth opening against speech energy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion.channels import is_mouth_shape
from studio.motion.motion import Motion

RATE = 100.0
"""Both curves are compared at this many points a second."""
REACH = 1.0
"""Seconds looked at either way."""
BLOCK = 20.0
"""Seconds of the blocks whose offsets must agree."""
_CLOSING = ("press", "close", "suck", "rolllower", "rollupper", "pucker", "shrug", "funnel")

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Alignment:
    """How sound and motion fit.

    Args:
        offset: seconds by which motion has to be moved later to fit the sound; negative where it is late.
        confidence: 0 (a guess) to 1 (sure).
        offsets: tried offsets in seconds, rising (K,).
        curve: correlation of mouth and voice at each of them, -1 to 1 (K,).
        correlation: the curve's value at the offset.
    """

    offset: float
    confidence: float
    offsets: Array
    curve: Array
    correlation: float


def voice_offset(level: Array, motion: Motion) -> Alignment:
    """The offset at which the mouth opens with the voice.

    Args:
        level: loudness (K,), RATE values a second: of a sound that may be too long for memory.
        motion: shapes named as a mouth's are used, or all where none is.

    Returns:
        The best offset within REACH; confidence 0 and offset 0 where there is no voice or no mouth.
    """
    end = float(motion.times[-1]) if len(motion) else 0.0
    voice = level[: min(len(level), int(end * RATE))]
    if len(voice) < 4 * REACH * RATE:
        return curve_offset(voice, voice)
    return curve_offset(voice, mouth_opening(motion, np.arange(len(voice)) / RATE, voice))


def curve_offset(voice: Array, mouth: Array) -> Alignment:
    """The offset at which a curve follows the loudness, both of RATE values a second (K,).

    Returns:
        Confidence 0 and offset 0 where they are too short or do not move.
    """
    lags = int(REACH * RATE)
    offsets = np.arange(-lags, lags + 1) / RATE
    nothing = Alignment(0.0, 0.0, offsets, np.zeros(len(offsets)), 0.0)
    if len(voice) < 4 * lags:
        return nothing
    if voice.std() < 1e-3 or mouth.std() < 1e-3:
        return nothing
    curve = _correlation(voice, mouth[:, None], lags)[:, 0]
    confidence = _confidence(voice, mouth, lags, offsets, curve)
    return Alignment(_peak(offsets, curve), confidence, offsets, curve, float(curve.max()))


def speech_level(samples: NDArray[np.float32], sample_rate: int) -> Array:
    """Amplitude of a voice (root mean square) in mono samples (N,), 1 at its loudest hundredth, (K,)."""
    return level_of(power(samples, sample_rate))


def power(samples: NDArray[np.float32], sample_rate: int) -> Array:
    """Mean square of mono samples (N,) in each of RATE spans a second."""
    hop = sample_rate / RATE
    edges = np.round(np.arange(int(len(samples) / hop) + 1) * hop).astype(int)
    edges = edges[edges < len(samples)]
    if len(edges) == 0:
        return np.zeros(0)
    squares = samples.astype(np.float64) ** 2
    result: Array = np.add.reduceat(squares, edges) / np.diff(np.append(edges, len(samples)))
    return result


def level_of(power: Array) -> Array:
    """Amplitude from power, 1 at its loudest hundredth."""
    # Half from the span before and half from the one after: each value then stands for its own moment.
    level = np.sqrt(0.5 * (power + np.concatenate([power[:1], power[:-1]])))
    top = float(np.percentile(level, 99)) if len(level) else 0.0
    return np.clip(level / top, 0.0, 1.5) if top > 1e-6 else np.zeros(len(level))


def mouth_opening(motion: Motion, times: Array, voice: Array | None = None) -> Array:
    """How far the mouth is open, arbitrary unit, at some moments (seconds).

    Args:
        motion: shapes named as a mouth's are used, or all but the eyes where none is.
        times: seconds (K,).
        voice: loudness at those times (K,); where given, only the shapes that follow it best count, as the
            jaw does and the corners of the mouth do not.
    """
    names = motion.shape_names
    chosen = [i for i, n in enumerate(names) if is_mouth_shape(n) and not _closes(n)]
    chosen = chosen or [i for i, n in enumerate(names) if "blink" not in n.lower() and "eye" not in n.lower()]
    if not chosen or not len(motion):
        return np.zeros(len(times))
    curves = np.stack([np.interp(times, motion.times, motion.shapes[:, i]) for i in chosen], axis=1)
    if voice is not None and len(voice) == len(times):
        best = _correlation(voice, curves, int(REACH * RATE)).max(axis=0)
        curves = curves[:, best >= 0.9 * best.max(initial=0.0)]
    # A shape that is stuck open must not hide the others.
    return np.clip(curves - np.median(curves, axis=0), 0.0, None).sum(axis=1)


def _closes(name: str) -> bool:
    return any(word in name.lower() for word in _CLOSING)


def _correlation(voice: Array, curves: Array, lags: int) -> Array:
    """Pearson's r of the voice (K,) with curves (K, S) moved later by -lags..lags points, (2 lags + 1, S)."""
    size = len(voice)
    a = voice - voice.mean()
    b = curves - curves.mean(axis=0)
    spread = a.std() * b.std(axis=0)
    length = 1 << int(np.ceil(np.log2(size + lags + 1)))
    product = np.fft.rfft(a, length)[:, None] * np.conj(np.fft.rfft(b, length, axis=0))
    every = np.fft.irfft(product, length, axis=0)
    near = np.concatenate([every[-lags:], every[: lags + 1]])
    overlap = size - np.abs(np.arange(-lags, lags + 1))
    return np.where(spread > 1e-9, near / overlap[:, None] / np.maximum(spread, 1e-9), 0.0)


def _peak(offsets: Array, curve: Array) -> float:
    """Where the curve is highest, between points by a parabola."""
    at = int(np.argmax(curve))
    if at in (0, len(curve) - 1):
        return float(offsets[at])
    left, top, right = curve[at - 1 : at + 2]
    bend = left - 2 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(offsets[at] + shift / RATE)


def _confidence(voice: Array, mouth: Array, lags: int, offsets: Array, curve: Array) -> float:
    """High where the peak is high, stands out from what is 0.25 s away, and blocks of the take agree."""
    best = int(np.argmax(curve))
    far = np.abs(offsets - offsets[best]) > 0.25
    rise = float(curve[best] - np.percentile(curve[far], 90)) if far.any() else 0.0
    size = int(BLOCK * RATE)
    peaks = []
    for first in range(0, len(voice) - size // 2, size):
        a, b = voice[first : first + size], mouth[first : first + size]
        if len(a) > 4 * lags and a.std() > 1e-3 and b.std() > 1e-3:
            peaks.append(_peak(offsets, _correlation(a, b[:, None], lags)[:, 0]))
    spread = float(np.median(np.abs(np.array(peaks) - np.median(peaks)))) if len(peaks) > 1 else 0.02
    height = np.clip(float(curve[best]) / 0.5, 0.0, 1.0)
    return float(height * np.clip(rise / 0.15, 0.0, 1.0) * np.clip(1.2 - spread / 0.1, 0.0, 1.0))
