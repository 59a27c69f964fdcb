"""What a pretrained speech encoder hears, as rows of sound that lie exactly in time.

An encoder looks at a whole window before it says anything, so the sound is cut into windows at fixed
places: window k is CORE_SECONDS long and begins at k CORE_SECONDS, with CONTEXT_SECONDS more on both sides.
Rows take the encoder's tokens by straight lines between the two nearest ones. As the windows lie where they
lie whatever is asked for, sound in pieces gives the same rows as sound in one piece, in memory of one window.
A row depends on 3 to 27 seconds of sound after it: too much to follow a microphone.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from fractions import Fraction
from functools import lru_cache
from threading import Lock
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from studio.features.audio import AudioSpec, Floats, row_centres

RATE = 16000
"""Samples a second that encoders want."""
CORE_SECONDS = 24
CONTEXT_SECONDS = 3
"""Together the 30 s Whisper was taught with. Where two windows meet, tokens differ by less than from one to
the next (0.35 against 0.44 deviations on read speech); more context costs more than it changes."""

_CORE, _CONTEXT = CORE_SECONDS * RATE, CONTEXT_SECONDS * RATE
_WINDOWS_KEPT = 3


class Encoder(Protocol):
    """A pretrained network that hears speech.

    Attributes:
        width: numbers of a token.
        step: samples from a token to the next.
        first: the sample on which the first token is centred.
    """

    width: int
    step: int
    first: float

    def tokens(self, samples: Floats) -> Floats:
        """Tokens (n, width) of a window of sound (N,) at RATE."""


class Hearing:
    """An encoder that remembers the last windows: pieces of one sound ask for the same one several times."""

    def __init__(self, encoder: Encoder) -> None:
        self.encoder = encoder
        self._kept: OrderedDict[bytes, Floats] = OrderedDict()
        self._lock = Lock()

    def rows(self, samples: Floats, centres: NDArray[np.int64], start_sample: int) -> Floats:
        """What is heard at some samples of a sound.

        Args:
            samples: mono sound at RATE, (N,); silence lies on both sides.
            centres: sample indices in the whole sound, (R,), not falling.
            start_sample: which sample of the whole sound samples[0] is.

        Returns:
            (R, width).
        """
        out = np.empty((len(centres), self.encoder.width), dtype=np.float32)
        windows = centres // _CORE
        for window in range(int(windows[0]), int(windows[-1]) + 1) if len(centres) else ():
            mine = windows == window
            if mine.any():
                begin = window * _CORE - _CONTEXT
                tokens = self._tokens(_window(samples, begin - start_sample))
                out[mine] = _between(tokens, (centres[mine] - begin - self.encoder.first) / self.encoder.step)
        return out

    def _tokens(self, window: Floats) -> Floats:
        key = hashlib.blake2b(window.tobytes(), digest_size=16).digest()
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        made = self.encoder.tokens(window)
        with self._lock:
            self._kept[key] = made
            while len(self._kept) > _WINDOWS_KEPT:
                self._kept.popitem(last=False)
        return made


def speech_rows(
    samples: Floats, spec: AudioSpec, fps: Fraction, first: int, count: int, start_sample: int = 0
) -> Floats:
    """Rows (count, width of the encoder) as features.audio.rows asks for them.

    Raises:
        StudioError: the encoder is not on this computer.
    """
    return hearing_of(spec).rows(samples, row_centres(spec, fps, first, count), start_sample)


def span(centre: int) -> tuple[int, int]:
    """The samples [a, b) that a row centred on a sample may depend on."""
    window = centre // _CORE
    return window * _CORE - _CONTEXT, (window + 1) * _CORE + _CONTEXT


def hearing_of(spec: AudioSpec) -> Hearing:
    """The encoder a spec names.

    Raises:
        StudioError: it is not on this computer, or another one lies in its place.
    """
    return _hearing(spec.encoder, spec.encoder_digest)


@lru_cache(maxsize=2)
def _hearing(encoder: str, digest: str) -> Hearing:
    from studio.features.encoders import load_encoder

    return Hearing(load_encoder(encoder, digest))


def _window(samples: Floats, begin: int) -> Floats:
    """One window of the sound from a sample on, zeros outside of the sound."""
    window = np.zeros(_CORE + 2 * _CONTEXT, dtype=np.float32)
    low, high = max(begin, 0), min(begin + len(window), len(samples))
    if high > low:
        window[low - begin : high - begin] = samples[low:high]
    return window


def _between(tokens: Floats, where: NDArray[np.float64]) -> Floats:
    """Tokens at fractional indices (R,), straight lines between them, ends held."""
    where = np.clip(where, 0, len(tokens) - 1)
    left = np.minimum(where.astype(np.int64), max(len(tokens) - 2, 0))
    part = (where - left).astype(np.float32)[:, None]
    between: Floats = tokens[left] * (1 - part) + tokens[np.minimum(left + 1, len(tokens) - 1)] * part
    return between
