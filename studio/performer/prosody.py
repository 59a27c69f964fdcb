"""The melody and loudness of a sentence, measured from its sound, and the syllables that stand out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.performer.curves import Curve
from studio.performer.speech import SAMPLE_RATE, Phone, Speech, is_vowel

RATE = 100
"""Measurements a second."""
_PITCH_RATE = 8000
# 50 ms at 8 kHz holds four periods of the lowest voice.
_WINDOW = 400
_LOWEST_HZ, _HIGHEST_HZ = 75.0, 420.0
_VOICED = 0.5
_FLOOR_DBFS, _FULL_DBFS = -60.0, -18.0


@dataclass(frozen=True)
class Beat:
    """A syllable that stands out: when (seconds in the sentence) and how much, 0..1."""

    t: float
    strength: float


@dataclass(frozen=True, eq=False)
class Prosody:
    """Contours at RATE from the start of the sentence, and its beats.

    Args:
        pitch: semitones above the sentence's median, smooth, 0 where it was never voiced, (m,).
        loudness: 0..1 for -60..-18 dBFS, (m,).
        beats: in order of time.
    """

    pitch: Curve
    loudness: Curve
    beats: tuple[Beat, ...]

    def pitch_at(self, t: Curve) -> Curve:
        """Semitones at times within the sentence; 0 outside."""
        return np.interp(t, np.arange(len(self.pitch)) / RATE, self.pitch, left=0.0, right=0.0)

    def loudness_at(self, t: Curve) -> Curve:
        """Loudness at times within the sentence; 0 outside."""
        return np.interp(t, np.arange(len(self.loudness)) / RATE, self.loudness, left=0.0, right=0.0)


def measure(speech: Speech) -> Prosody:
    """The prosody of a sentence as it sounds."""
    loudness = _loudness(speech.samples)
    pitch = _pitch(speech.samples, len(loudness))
    return Prosody(pitch, loudness, _beats(speech.phones, pitch, loudness))


def _loudness(samples: NDArray[np.float32]) -> Curve:
    hop = SAMPLE_RATE // RATE
    count = len(samples) // hop + 1
    padded = np.pad(samples.astype(np.float64), (hop, hop * 2))
    energy = np.concatenate([[0.0], np.cumsum(padded * padded)])
    first = np.arange(count) * hop
    # 20 ms about each moment.
    mean = (energy[first + 2 * hop] - energy[first]) / (2 * hop)
    level = 10 * np.log10(np.maximum(mean, 1e-12))
    return np.clip((level - _FLOOR_DBFS) / (_FULL_DBFS - _FLOOR_DBFS), 0.0, 1.0)


def _pitch(samples: NDArray[np.float32], count: int) -> Curve:
    """Semitones above the median by normalised autocorrelation, gaps bridged, gently smoothed."""
    import soxr

    slow = np.asarray(soxr.resample(samples, SAMPLE_RATE, _PITCH_RATE), dtype=np.float64)
    hop = _PITCH_RATE // RATE
    padded = np.pad(slow, (_WINDOW // 2, _WINDOW + hop * 2))
    frames = np.lib.stride_tricks.sliding_window_view(padded, _WINDOW)[::hop][:count]
    frames = frames - frames.mean(axis=1, keepdims=True)
    spectrum = np.fft.rfft(frames * np.hanning(_WINDOW), 1024, axis=1)
    similarity = np.fft.irfft(np.abs(spectrum) ** 2, axis=1)
    low, high = int(_PITCH_RATE / _HIGHEST_HZ), int(_PITCH_RATE / _LOWEST_HZ)
    power = similarity[:, :1]
    # The window itself fades with lag; dividing by its own autocorrelation undoes that.
    fade = np.fft.irfft(np.abs(np.fft.rfft(np.hanning(_WINDOW), 1024)) ** 2)
    usual = similarity[:, : high + 1] / np.maximum(power, 1e-9) / (fade[: high + 1] / fade[0])
    best, strength = _periods(usual, low)
    voiced = (strength > _VOICED) & (power[:, 0] > 1e-4)
    if voiced.sum() < 5:
        return np.zeros(count)
    semitones = 12 * np.log2(_PITCH_RATE / best)
    middle = float(np.median(semitones[voiced]))
    # Octave slips of the estimate.
    good = voiced & (np.abs(semitones - middle) < 9)
    at = np.arange(len(semitones))
    filled = np.interp(at, at[good], semitones[good] - middle)
    kernel = np.hanning(11)
    smooth = np.convolve(np.pad(filled, 5, mode="edge"), kernel / kernel.sum(), mode="valid")
    return smooth


def _periods(similarity: Curve, low: int) -> tuple[Curve, Curve]:
    """The period of each frame in samples, and how alike its periods are; both (m,).

    Twice a period is as alike as one, so the shortest lag that comes near the best is the period.
    """
    inner = similarity[:, low:-1]
    peak = (inner >= similarity[:, low - 1 : -2]) & (inner >= similarity[:, low + 1 :])
    top = np.where(peak, inner, -1.0).max(axis=1, keepdims=True)
    lag = (peak & (inner >= 0.86 * top)).argmax(axis=1) + low
    rows = np.arange(len(similarity))
    before, at, after = (similarity[rows, lag + k] for k in (-1, 0, 1))
    bow = before - 2 * at + after
    finer = np.where(bow < -1e-9, 0.5 * (before - after) / np.where(bow < -1e-9, bow, 1.0), 0.0)
    return lag + np.clip(finer, -0.5, 0.5), at


def _beats(phones: tuple[Phone, ...], pitch: Curve, loudness: Curve) -> tuple[Beat, ...]:
    """Vowels that are louder, longer and higher than the others of the sentence, not too close together."""
    vowels = [phone for phone in phones if is_vowel(phone.name)]
    if not vowels:
        return ()
    spans = [slice(int(v.t * RATE), max(int(v.end * RATE), int(v.t * RATE) + 1)) for v in vowels]
    loud = np.array([loudness[span].max(initial=0.0) for span in spans])
    high = np.array([pitch[span].max(initial=-12.0) for span in spans])
    length = np.log(np.array([v.duration for v in vowels]))
    score = 0.4 * _standard(loud) + 0.35 * _standard(high) + 0.4 * _standard(length)
    chosen: list[int] = []
    for i in np.argsort(-score):
        if score[i] < -0.1 and chosen:
            break
        if all(abs(vowels[i].t - vowels[j].t) > 0.28 for j in chosen):
            chosen.append(int(i))
    return tuple(
        Beat(vowels[i].t + 0.3 * vowels[i].duration, float(np.clip(0.5 + 0.35 * score[i], 0.3, 1.0)))
        for i in sorted(chosen)
    )


def _standard(values: Curve) -> Curve:
    return (values - values.mean()) / (values.std() + 1e-6)
