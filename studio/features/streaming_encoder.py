"""Whisper's first blocks as a stream: what speech they hear is known a fifth of a second later.

The whole encoder looks at half a minute at once and cannot follow a microphone. Its convolutions and first
two blocks keep most of what helps a mouth: each 80 ms attends to itself, the 1.8 s before and 60 ms after,
and what lies after is heard for its sake alone and then anew. Every token depends on a bounded stretch of
sound, so that tokens of a piece equal those of the whole.
Source: Radford et al. 2022, arXiv 2212.04356 (the network); Shi et al. 2020, arXiv 2010.10759 (Emformer:
cached keys and values, a right context that is recomputed).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.features.audio_spec import Floats, between, mel_filters

if TYPE_CHECKING:
    from studio.model._whisper import Whisper

# Runs have learnt from what these numbers give: other ones would be another encoder, by another name.
BLOCKS = 2
"""More blocks cost more of a core and bring nothing to a mouth."""
CHUNK, KEPT, AFTER = 4, 22, 3
"""Tokens that are heard together, chunks before them that they attend to, and tokens after them."""
STEP = 320
"""Samples from a token to the next, at 16 kHz."""
CHUNK_SAMPLES = CHUNK * STEP
REACH_BACK = (BLOCKS * KEPT + 1) * CHUNK_SAMPLES
"""Samples before a chunk that its tokens may depend on."""
FFT, HOP = 400, 160
"""Samples under one of Whisper's bands, and from one to the next."""
_LATER = AFTER * STEP + FFT // 2
"""Samples after the end of a chunk that its tokens hear."""
_AT_ONCE = 96
"""Chunks worked out together where all the sound is there."""
_ROWS_AT_ONCE = 4096
_BEFORE = 2 * HOP + FFT // 2
"""Samples before a chunk that its convolutions hear."""
LOUDEST = 1.4
"""log10 of the power a loud voice reaches; Whisper's own scale hangs on a window's loudest moment, which a
stream does not know."""


def ready_at(centres: NDArray[np.int64]) -> NDArray[np.int64]:
    """The number of samples after which rows centred on some samples can be known."""
    return (-(-centres // STEP) // CHUNK + 1) * CHUNK_SAMPLES + _LATER


def chunk_of(sample: int) -> int:
    """The chunk a sample lies in."""
    return sample // CHUNK_SAMPLES


class StreamingWhisper:
    """Tokens of sound, chunk by chunk.

    Args:
        network: the whole encoder; its later blocks are not used.
    """

    def __init__(self, network: Whisper) -> None:
        from studio.model._whisper import WhisperStream

        self.network = WhisperStream(network, BLOCKS, CHUNK, KEPT, AFTER)
        self.width = network.width

    def rows(self, samples: Floats, centres: NDArray[np.int64], start_sample: int) -> Floats:
        """Tokens at some samples of a sound, straight lines between two.

        Args:
            samples: mono sound at 16 kHz, (N,); silence lies on both sides.
            centres: sample indices in the whole sound, (R,), not falling.
            start_sample: which sample of the whole sound samples[0] is.

        Returns:
            (R, width).
        """
        out = np.empty((len(centres), self.width), dtype=np.float32)
        if not len(centres):
            return out
        stream = TokenStream(self, chunk_of(int(centres[0])))
        # In slices: the tokens of an hour at once would be gigabytes.
        for first in range(0, len(centres), _ROWS_AT_ONCE):
            part = centres[first : first + _ROWS_AT_ONCE]
            stream.forget(int(part[0]))
            out[first : first + len(part)] = stream.rows(samples, part, start_sample)
        return out


class TokenStream:
    """Rows one after another, the state carried: live the same network hears each chunk once.

    Args:
        encoder: the network.
        chunk: the first chunk that rows will be asked of.
    """

    def __init__(self, encoder: StreamingWhisper, chunk: int) -> None:
        self._encoder, self._state = encoder, encoder.network.blank()
        # So many chunks earlier that a state which has heard nothing does not matter any more.
        self._next = self._first = chunk - BLOCKS * KEPT
        self._tokens = np.zeros((0, encoder.width), dtype=np.float32)

    def rows(self, samples: Floats, centres: NDArray[np.int64], start_sample: int) -> Floats:
        """Rows (R, width) as StreamingWhisper.rows gives them; what was heard before is not heard again."""
        until = chunk_of(int(ready_at(centres[-1:])[0]))
        while self._next < until:
            count = min(until - self._next, _AT_ONCE)
            begin, length = heard(self._next, count)
            sound = cut(samples, begin - start_sample, length)
            made, self._state = self._encoder.network.advance(_bands(sound), self._next, self._state)
            self._tokens = np.concatenate([self._tokens, made])
            self._next += count
        where = centres / STEP - self._first * CHUNK
        return between(self._tokens, where)

    def forget(self, centre: int) -> None:
        """Drop tokens that no row centred on a sample or later needs."""
        drop = min(max(chunk_of(centre), self._first), self._next) - self._first
        self._tokens, self._first = self._tokens[drop * CHUNK :], self._first + drop

    @property
    def next_sample(self) -> int:
        """The first sample that is still needed."""
        return heard(self._next, 1)[0]


def heard(chunk: int, count: int) -> tuple[int, int]:
    """The first sample that some chunks hear with their convolutions, and how many."""
    return chunk * CHUNK_SAMPLES - _BEFORE, count * CHUNK_SAMPLES + _BEFORE + _LATER


def _bands(sound: Floats) -> Floats:
    """Whisper's bands (80, M) of sound cut to fit, on a fixed scale of loudness."""
    bands = (np.maximum(whisper_levels(sound), LOUDEST - 8.0) + 4.0) / 4.0
    return np.ascontiguousarray(bands.T, dtype=np.float32)


def whisper_levels(sound: Floats) -> Floats:
    """log10 of the power in Whisper's bands, (M, 80), of every window that lies within the sound (N,)."""
    from scipy.fft import rfft

    hann = (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(FFT) / FFT)).astype(np.float32)
    pieces = np.lib.stride_tricks.sliding_window_view(sound, FFT)[::HOP]
    spectrum = rfft(pieces * hann, axis=1)
    power = (spectrum.real**2 + spectrum.imag**2) @ mel_filters(80, FFT, 16000, 0.0, 8000.0).T
    levels: Floats = np.log10(np.maximum(power, 1e-10))
    return levels


def cut(samples: Floats, begin: int, length: int) -> Floats:
    """So many samples from one on, zeros outside of the sound."""
    piece = np.zeros(length, dtype=np.float32)
    low, high = max(begin, 0), min(begin + length, len(samples))
    if high > low:
        piece[low - begin : high - begin] = samples[low:high]
    return piece
