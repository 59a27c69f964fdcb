"""Whisper's speech encoder, read from a CTranslate2 file, and the block it shares with wav2vec 2.0."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional


class TransformerBlock(nn.Module):
    """Self-attention over a whole window, then two dense layers, each with a residual.

    Args:
        width: numbers of a token.
        heads: of attention; they share the width.
        hidden: width between the two dense layers.
        norm_first: normalise before each part (Whisper, large wav2vec 2.0) or after it (base wav2vec 2.0).
        eps: of its norms.
    """

    def __init__(self, width: int, heads: int, hidden: int, norm_first: bool, eps: float = 1e-5) -> None:
        super().__init__()
        self.heads, self.norm_first = heads, norm_first
        self.self_qkv = nn.Linear(width, 3 * width)
        self.self_out = nn.Linear(width, width)
        self.ffn_in = nn.Linear(width, hidden)
        self.ffn_out = nn.Linear(hidden, width)
        self.self_norm = nn.LayerNorm(width, eps)
        self.ffn_norm = nn.LayerNorm(width, eps)

    def forward(self, x: Tensor) -> Tensor:
        """(B, n, width) -> the same."""
        if self.norm_first:
            return self.attended(x, *self.projected(x))
        x = self.self_norm(x + self._attention(*self._qkv(x)))
        normed: Tensor = self.ffn_norm(x + self._feed_forward(x))
        return normed

    def projected(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Queries, keys and values (B, heads, n, width / heads) of tokens; norm_first only."""
        return self._qkv(self.self_norm(x))

    def attended(self, x: Tensor, query: Tensor, keys: Tensor, values: Tensor) -> Tensor:
        """The block's tokens (B, n, width) with keys and values of these and others; norm_first only."""
        x = x + self._attention(query, keys, values)
        return x + self._feed_forward(self.ffn_norm(x))

    def _qkv(self, x: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        batch, count, _ = x.shape
        qkv = self.self_qkv(x).view(batch, count, 3, self.heads, -1).permute(2, 0, 3, 1, 4)
        return qkv[0], qkv[1], qkv[2]

    def _attention(self, query: Tensor, keys: Tensor, values: Tensor) -> Tensor:
        attended = functional.scaled_dot_product_attention(query, keys, values)
        done: Tensor = self.self_out(attended.transpose(1, 2).flatten(2))
        return done

    def _feed_forward(self, x: Tensor) -> Tensor:
        done: Tensor = self.ffn_out(functional.gelu(self.ffn_in(x)))
        return done


Floats = NDArray[np.float32]

BANDS = 80
_BINARY_VERSION = 6
_TYPES = {0: np.float32, 4: np.float16}
_MOST_NUMBERS = 100_000_000
_MOST_VARIABLES = 10_000
_NAMES = {
    "self_attention/layer_norm": "self_norm",
    "self_attention/linear_0": "self_qkv",
    "self_attention/linear_1": "self_out",
    "ffn/layer_norm": "ffn_norm",
    "ffn/linear_0": "ffn_in",
    "ffn/linear_1": "ffn_out",
}
_ENDS = {"gamma": "weight", "beta": "bias"}


class Whisper(nn.Module):
    """Two convolutions, the second of which halves the rate, then transformer blocks.

    Args:
        width: numbers of a token.
        heads: of attention.
        blocks: how many.
        most: tokens it has positions for.
    """

    places: Tensor

    def __init__(self, width: int, heads: int, blocks: int, most: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv1d(BANDS, width, 3, padding=1)
        self.conv2 = nn.Conv1d(width, width, 3, stride=2, padding=1)
        self.register_buffer("places", torch.zeros(most, width))
        self.blocks = nn.ModuleList(
            TransformerBlock(width, heads, 4 * width, norm_first=True) for _ in range(blocks)
        )
        self.norm = nn.LayerNorm(width)

    @property
    def width(self) -> int:
        """Numbers of a token."""
        return int(self.places.shape[1])

    @torch.inference_mode()
    def tokens(self, bands: Floats) -> Floats:
        """What forward gives, of and as arrays."""
        found: Floats = self(torch.from_numpy(bands)).numpy()
        return found

    def forward(self, bands: Tensor) -> Tensor:
        """Tokens (n / 2, width) of normalised log-mel bands (80, n), 100 a second; n even."""
        x = functional.gelu(self.conv1(bands[None]))
        x = functional.gelu(self.conv2(x)).transpose(1, 2)
        x = x + self.places[: x.shape[1]]
        for block in self.blocks:
            x = block(x)
        normed: Tensor = self.norm(x)[0]
        return normed


State = list[tuple[Tensor, Tensor]]
"""Keys and values (heads, kept, width / heads) of each block."""


class WhisperStream:
    """The first blocks of an encoder over chunks of tokens, one after another.

    A chunk attends to itself, to some chunks before it, whose keys and values are remembered, and to some
    tokens after it, which are made for its sake alone. Source: Shi et al. 2020, arXiv 2010.10759 (Emformer).

    Args:
        network: the whole encoder; its later blocks are not used.
        blocks: how many are.
        chunk: tokens of a chunk.
        kept: chunks before it that are remembered.
        after: tokens after it.
    """

    def __init__(self, network: Whisper, blocks: int, chunk: int, kept: int, after: int) -> None:
        self._network, self._chunk, self._kept, self._after = network, chunk, kept * chunk, after
        self._blocks = [b for b in list(network.blocks)[:blocks] if isinstance(b, TransformerBlock)]

    def blank(self) -> State:
        """A state that has heard nothing."""
        heads = self._blocks[0].heads
        empty = torch.zeros(heads, self._kept, self._network.width // heads)
        return [(empty, empty) for _ in self._blocks]

    @torch.inference_mode()
    def advance(self, bands: Floats, number: int, state: State) -> tuple[Floats, State]:
        """Tokens (n chunk, width) of n consecutive chunks, and the state after them.

        Args:
            bands: log-mel bands (80, 2 (n chunk + after) + 3): two more before and one after those of the
                tokens, which the convolutions hear.
            number: of the first chunk in the whole sound.
            state: after the chunk before.
        """
        one, two = self._network.conv1, self._network.conv2
        x = functional.gelu(functional.conv1d(torch.from_numpy(bands)[None], one.weight, one.bias))
        x = functional.gelu(functional.conv1d(x, two.weight, two.bias, stride=2))[0].T
        # Places begin again after half a minute, as Whisper's windows do.
        at = (number * self._chunk + torch.arange(len(x))) % len(self._network.places)
        # Each chunk with what comes after it, (n, chunk + after, width): chunks are a batch.
        x = (x + self._network.places[at]).unfold(0, self._chunk + self._after, self._chunk).transpose(1, 2)
        left: State = []
        for block, kept in zip(self._blocks, state, strict=True):
            query, *new = block.projected(x)
            # Only a chunk's own keys are remembered: those of what comes after are made anew with it.
            known = [torch.cat([old, self._own(one)], dim=1) for old, one in zip(kept, new, strict=True)]
            keys, values = (
                torch.cat([self._before(old), one], dim=2) for old, one in zip(known, new, strict=True)
            )
            x = block.attended(x, query, keys, values)
            left.append((known[0][:, -self._kept :], known[1][:, -self._kept :]))
        tokens: Floats = self._network.norm(x[:, : self._chunk].flatten(0, 1)).numpy()
        return tokens, left

    def _own(self, new: Tensor) -> Tensor:
        """Of keys or values (n, heads, chunk + after, -) the chunks' own, (heads, n chunk, -)."""
        return new[:, :, : self._chunk].transpose(0, 1).flatten(1, 2)

    def _before(self, known: Tensor) -> Tensor:
        """What each chunk attends to of those before it, (n, heads, kept, -)."""
        return known.unfold(1, self._kept, self._chunk)[:, :-1].permute(1, 0, 3, 2)


def load(path: Path) -> Whisper:
    """The encoder in a CTranslate2 file; nothing in the file is executed.

    Raises:
        ValueError: the file is none of Whisper's, or damaged.
        OSError: it cannot be read.
    """
    try:
        found = _encoder_tensors(path)
        width = found["conv1.weight"].shape[0]
        blocks = len({name.split(".")[1] for name in found if name.startswith("blocks.")})
        made = Whisper(width, int(found.pop("heads")), blocks, len(found["places"]))
        made.load_state_dict(found)
    except (KeyError, RuntimeError, struct.error, UnicodeDecodeError, IndexError) as error:
        raise ValueError(f"not a Whisper model as CTranslate2 writes it ({error})") from error
    return made.eval().requires_grad_(False)


def _encoder_tensors(path: Path) -> dict[str, Tensor]:
    with path.open("rb") as file:
        if _number(file, "I") != _BINARY_VERSION or _text(file) != "WhisperSpec":
            raise ValueError("another kind of model, or another version")
        _number(file, "I")  # the specification's revision
        found = dict(_variables(file))
    heads = found.pop("encoder/num_heads")
    return {"heads": heads} | {_name(name): tensor for name, tensor in found.items()}


def _variables(file: BinaryIO) -> Iterator[tuple[str, Tensor]]:
    """The encoder's variables; the decoder's are passed over."""
    count = _number(file, "I")
    if count > _MOST_VARIABLES:
        raise ValueError("more variables than any model has")
    for _ in range(count):
        name, rank = _text(file), _number(file, "B")
        shape = [_number(file, "I") for _ in range(rank)]
        kind, size = _number(file, "B"), _number(file, "I")
        if not name.startswith("encoder/"):
            file.seek(size, 1)
        elif name == "encoder/num_heads":
            yield name, torch.tensor(struct.unpack("<h", _bytes(file, size))[0])
        elif kind not in _TYPES or size > 4 * _MOST_NUMBERS:
            raise ValueError(f"{name} is of a kind that is not known")
        else:
            values = np.frombuffer(_bytes(file, size), dtype=_TYPES[kind]).astype(np.float32)
            yield name, torch.from_numpy(values.reshape(shape))


def _name(name: str) -> str:
    """Our name of one of CTranslate2's variables."""
    if name == "encoder/position_encodings/encodings":
        return "places"
    place, _, end = name.removeprefix("encoder/").rpartition("/")
    layer, _, part = place.partition("/")
    end = _ENDS.get(end, end)
    if layer.startswith("layer_") and part in _NAMES:
        return f"blocks.{layer.removeprefix('layer_')}.{_NAMES[part]}.{end}"
    return f"{'norm' if place == 'layer_norm' else place}.{end}"


def _bytes(file: BinaryIO, count: int) -> bytes:
    found = file.read(count)
    if len(found) < count:
        raise ValueError("it is cut short")
    return found


def _number(file: BinaryIO, kind: str) -> int:
    size = struct.calcsize(f"<{kind}")
    return int(struct.unpack(f"<{kind}", _bytes(file, size))[0])


def _text(file: BinaryIO) -> str:
    return _bytes(file, _number(file, "H")).rstrip(b"\0").decode()
