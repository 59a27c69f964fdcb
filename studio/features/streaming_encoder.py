"""Whisper's first blocks as a stream: what speech they hear is known a fifth of a second later (torch).

The whole encoder looks at half a minute at once and cannot follow a microphone. Its convolutions and first
two blocks keep most of what helps a mouth: each 80 ms attends to itself, the 1.8 s before and 60 ms after,
and what lies after is heard for its sake alone and then anew. Every token depends on a bounded stretch of
sound, so that tokens of a piece equal those of the whole.
Source: Radford et al. 2022, arXiv 2212.04356 (the network); Shi et al. 2020, arXiv 2010.10759 (Emformer:
cached keys and values, a right context that is recomputed).
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from studio.features.audio_spec import Floats, mel_filters
from studio.model._whisper import TransformerBlock, Whisper

BLOCKS = 2
"""More blocks cost more of a core and bring nothing to a mouth."""
CHUNK, KEPT, AFTER = 4, 22, 3
"""Tokens that are heard together, chunks before them that they attend to, and tokens after them."""
STEP = 320
"""Samples from a token to the next, at 16 kHz."""
CHUNK_SAMPLES = CHUNK * STEP
REACH_BACK = (BLOCKS * KEPT + 1) * CHUNK_SAMPLES
"""Samples before a chunk that its tokens may depend on."""
_FFT, _HOP = 400, 160
_LATER = AFTER * STEP + _FFT // 2
"""Samples after the end of a chunk that its tokens hear."""
_AT_ONCE = 96
"""Chunks worked out together where all the sound is there."""
_BEFORE = 2 * _HOP + _FFT // 2
"""Samples before a chunk that its convolutions hear."""
LOUDEST = 1.4
"""log10 of the power a loud voice reaches; Whisper's own scale hangs on a window's loudest moment, which a
stream does not know."""

State = list[tuple[Tensor, Tensor]]


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
        self._network = network
        self._blocks = [b for b in list(network.blocks)[:BLOCKS] if isinstance(b, TransformerBlock)]
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
        if not len(centres):
            return np.zeros((0, self.width), dtype=np.float32)
        return TokenStream(self, chunk_of(int(centres[0]))).rows(samples, centres, start_sample)

    def blank(self) -> State:
        """A state that has heard nothing."""
        heads = self._blocks[0].heads
        empty = torch.zeros(heads, KEPT * CHUNK, self.width // heads)
        return [(empty, empty) for _ in self._blocks]

    @torch.inference_mode()
    def advance(self, sound: Floats, chunk: int, state: State) -> tuple[Floats, State]:
        """Tokens (n CHUNK, width) of consecutive chunks from `chunk` on, and the state after them.

        Args:
            sound: what they hear: `heard(chunk, n)` says from which sample on and how many.
            chunk: number of the first, in the whole sound.
            state: after the chunk before.
        """
        x = functional.gelu(functional.conv1d(_bands(sound)[None], *_of(self._network.conv1)))
        x = functional.gelu(functional.conv1d(x, *_of(self._network.conv2), stride=2))[0].T
        at = (chunk * CHUNK + torch.arange(len(x))) % len(self._network.places)
        # Each chunk with what comes after it, (n, CHUNK + AFTER, width): chunks are a batch.
        x = (x + self._network.places[at]).unfold(0, CHUNK + AFTER, CHUNK).transpose(1, 2)
        after: State = []
        for block, (keys, values) in zip(self._blocks, state, strict=True):
            query, new_keys, new_values = block.projected(x)
            # Only a chunk's own keys are remembered: those of what comes after are made anew with it.
            keys, values = _remembered(keys, new_keys), _remembered(values, new_values)
            x = block.attended(
                x, query, torch.cat([_before(keys), new_keys], 2), torch.cat([_before(values), new_values], 2)
            )
            after.append((keys[:, -KEPT * CHUNK :], values[:, -KEPT * CHUNK :]))
        tokens: Floats = self._network.norm(x[:, :CHUNK].flatten(0, 1)).numpy()
        return tokens, after


def _remembered(kept: Tensor, new: Tensor) -> Tensor:
    """Keys or values (heads, KEPT CHUNK, -) with those of new chunks (n, heads, CHUNK + AFTER, -) behind."""
    return torch.cat([kept, new[:, :, :CHUNK].transpose(0, 1).flatten(1, 2)], dim=1)


def _before(remembered: Tensor) -> Tensor:
    """What each new chunk attends to of those before it, (n, heads, KEPT CHUNK, -)."""
    windows = remembered.unfold(1, KEPT * CHUNK, CHUNK)[:, :-1]
    return windows.permute(1, 0, 3, 2)


class TokenStream:
    """Rows one after another, the state carried: live the same network hears each chunk once.

    Args:
        encoder: the network.
        chunk: the first chunk that rows will be asked of.
    """

    def __init__(self, encoder: StreamingWhisper, chunk: int) -> None:
        self._encoder, self._state = encoder, encoder.blank()
        # So many chunks earlier that a state which has heard nothing does not matter any more.
        self._next = self._first = chunk - BLOCKS * KEPT
        self._tokens = np.zeros((0, encoder.width), dtype=np.float32)

    def rows(self, samples: Floats, centres: NDArray[np.int64], start_sample: int) -> Floats:
        """Rows (R, width) as StreamingWhisper.rows gives them; what was heard before is not heard again."""
        until = chunk_of(int(ready_at(centres[-1:])[0]))
        while self._next < until:
            count = min(until - self._next, _AT_ONCE)
            begin, length = heard(self._next, count)
            sound = _cut(samples, begin - start_sample, length)
            made, self._state = self._encoder.advance(sound, self._next, self._state)
            self._tokens = np.concatenate([self._tokens, made])
            self._next += count
        where = centres / STEP - self._first * CHUNK
        left = np.clip(where.astype(np.int64), 0, len(self._tokens) - 1)
        right = np.minimum(left + 1, len(self._tokens) - 1)
        part = (where - left).astype(np.float32)[:, None]
        found: Floats = self._tokens[left] * (1 - part) + self._tokens[right] * part
        return found

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


def _bands(sound: Floats) -> Tensor:
    """Whisper's bands (80, M) of sound cut to fit, on a fixed scale of loudness."""
    from scipy.fft import rfft

    hann = (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(_FFT) / _FFT)).astype(np.float32)
    pieces = np.lib.stride_tricks.sliding_window_view(sound, _FFT)[::_HOP]
    spectrum = rfft(pieces * hann, axis=1)
    power = (spectrum.real**2 + spectrum.imag**2) @ mel_filters(80, _FFT, 16000, 0.0, 8000.0).T
    bands = (np.maximum(np.log10(np.maximum(power, 1e-10)), LOUDEST - 8.0) + 4.0) / 4.0
    return torch.from_numpy(np.ascontiguousarray(bands.T, dtype=np.float32))


def _of(layer: torch.nn.Module) -> tuple[Tensor, Tensor]:
    assert isinstance(layer, torch.nn.Conv1d)
    assert layer.bias is not None
    return layer.weight, layer.bias


def _cut(samples: Floats, begin: int, length: int) -> Floats:
    """So many samples from one on, zeros outside of the sound."""
    cut = np.zeros(length, dtype=np.float32)
    low, high = max(begin, 0), min(begin + length, len(samples))
    if high > low:
        cut[low - begin : high - begin] = samples[low:high]
    return cut
