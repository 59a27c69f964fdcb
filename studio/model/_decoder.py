"""Parts of FaceFormer: its audio encoder and the layers of its decoder.

Source: Fan et al. 2022, FaceFormer, arXiv 2112.05329; the bias after Press et al. 2022 (ALiBi).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

_KERNEL = 3
_HIDDEN = 2
"""Width of the feed-forward layers, times the network's."""


class DecoderSizes(NamedTuple):
    """Sizes of the decoder: numbers of a token, heads, layers, frames of a period and of the past seen."""

    width: int
    heads: int
    layers: int
    period: int
    reach: int
    dropout: float


class AudioEncoder(nn.Module):
    """Rows of sound to rows of what was said: residual dilated convolutions, exact in pieces.

    Source: Bai et al. 2018, An Empirical Evaluation of Generic Convolutional and Recurrent Networks.
    """

    def __init__(self, features: int, width: int, layers: int, dropout: float) -> None:
        super().__init__()
        width, wide = width // 2, width  # there are many more rows than frames
        self.dilations = [2**i for i in range(layers)]
        self.reach = _KERNEL // 2 + sum(self.dilations)
        # No padding anywhere: rows at a piece's edge come from true neighbours, so pieces equal the whole.
        self.enter = nn.Conv1d(features, width, _KERNEL)
        self.blocks = nn.ModuleList(nn.Conv1d(width, width, _KERNEL, dilation=d) for d in self.dilations)
        self.mixes = nn.ModuleList(nn.Conv1d(width, width, 1) for _ in self.dilations)
        self.project = nn.Linear(width, wide)
        self.norm = nn.LayerNorm(wide)
        self.dropout = nn.Dropout(dropout)

    def forward(self, rows: Tensor) -> Tensor:
        """(B, R + 2 reach, F) -> (B, R, width)."""
        x = self.enter(rows.transpose(1, 2))
        for block, mix, dilation in zip(self.blocks, self.mixes, self.dilations, strict=True):
            heard = mix(self.dropout(functional.gelu(block(functional.gelu(x)))))
            # The residual loses at its ends what the unpadded convolution lost.
            x = x[..., dilation:-dilation] + heard
        normed: Tensor = self.norm(self.project(x.transpose(1, 2)))
        return normed


class Projection(nn.Module):
    """A pretrained encoder's rows to the decoder's width, as published: one linear layer."""

    reach = 0

    def __init__(self, features: int, width: int) -> None:
        super().__init__()
        self.enter = nn.Linear(features, width)

    def forward(self, rows: Tensor) -> Tensor:
        """(B, R, F) -> (B, R, width)."""
        projected: Tensor = self.enter(rows)
        return projected


def attended(query: Tensor, keys: Tensor, values: Tensor, bias: Tensor) -> Tensor:
    """softmax(q k^T / sqrt(d) + bias) v for one query each; for these few numbers torch's own takes longer.

    Args:
        query: (N, 1, d), N the product of batch and heads.
        keys, values: (N, m, d).
        bias: (N, 1, m).
    """
    scores = torch.baddbmm(bias, query, keys.transpose(1, 2), alpha=1 / math.sqrt(query.shape[-1]))
    return torch.bmm(torch.softmax(scores, dim=-1), values)


class AudioKV(NamedTuple):
    """Keys and values of the sound for cross-attention, with the weights of query and output in them.

    Args:
        keys: (..., width, heads K).
        bias: of the keys (..., 1, heads K).
        values: (..., heads K, width).
    """

    keys: Tensor
    bias: Tensor
    values: Tensor


class Layer(nn.Module):
    """Decoder layer: self-attention, cross-attention, feed-forward; a residual and a norm after each."""

    def __init__(self, shape: DecoderSizes) -> None:
        super().__init__()
        width = shape.width
        self.heads, self.dropout = shape.heads, shape.dropout
        self.self_qkv = nn.Linear(width, 3 * width)
        self.self_out = nn.Linear(width, width)
        self.cross_q = nn.Linear(width, width)
        self.cross_kv = nn.Linear(width, 2 * width)
        self.cross_out = nn.Linear(width, width)
        self.ffn_in = nn.Linear(width, _HIDDEN * width)
        self.ffn_out = nn.Linear(_HIDDEN * width, width)
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in range(3))

    def audio_kv(self, heard: Tensor) -> AudioKV:
        """Keys and values of the sound for every frame (B, n, ...), from encoded rows (B, n, K, width).

        Queries meet the same keys in whatever pose a frame is: the query's and the output's weights are
        multiplied into keys and values once, so that a frame costs two small products.
        """
        batch, frames, rows, width = heard.shape
        size = width // self.heads
        keys, values = self.cross_kv(heard).view(batch, frames, rows, 2, self.heads, size).unbind(3)
        # Scaled here once, where softmax(q k / sqrt(d)) would divide in every frame.
        query_weights = self.cross_q.weight.view(self.heads, size, width) / math.sqrt(size)
        bias = self.cross_q.bias.view(self.heads, size) / math.sqrt(size)
        out_weights = self.cross_out.weight.view(width, self.heads, size)
        return AudioKV(
            torch.einsum("bnkhs,hsw->bnwhk", keys, query_weights).flatten(3),
            torch.einsum("bnkhs,hs->bnhk", keys, bias).flatten(2).unsqueeze(2),
            torch.einsum("bnkhs,whs->bnhkw", values, out_weights).flatten(2, 3),
        )

    def finish(self, x: Tensor, seen: Tensor, audio: AudioKV) -> Tensor:
        """Cross-attention and feed-forward: what comes after self-attention.

        Args:
            x: tokens (N, width), N of any frames of any batch.
            seen: what self-attention gave each of them (N, width).
            audio: keys and values of the sound for each of them (N, ...).
        """
        # Norm after the sum, as published; a norm before it would give other weights than those of the paper.
        x = self._joined(0, x, self.self_out(seen))
        scores = torch.baddbmm(audio.bias, x.unsqueeze(1), audio.keys)
        weights = torch.softmax(scores.view(len(x), self.heads, -1), dim=-1).view(scores.shape)
        x = self._joined(1, x, torch.bmm(weights, audio.values).squeeze(1) + self.cross_out.bias)
        return self._joined(2, x, self.ffn_out(self._dropped(functional.gelu(self.ffn_in(x)))))

    def _joined(self, number: int, x: Tensor, new: Tensor) -> Tensor:
        norm = self.norms[number]
        assert isinstance(norm, nn.LayerNorm)
        return functional.layer_norm(x + self._dropped(new), norm.normalized_shape, norm.weight, norm.bias)

    def _dropped(self, x: Tensor) -> Tensor:
        return functional.dropout(x, self.dropout) if self.training else x


def places(shape: DecoderSizes) -> Tensor:
    """PPE(t, 2i) = sin((t mod p) / 10000^(2i / d)), cos for odd, (p, d): Fan et al., equation 4."""
    t = torch.arange(shape.period)[:, None]
    rates = torch.exp(torch.arange(0, shape.width, 2) * (-math.log(10000.0) / shape.width))
    return torch.stack([torch.sin(t * rates), torch.cos(t * rates)], dim=-1).flatten(1)


def nearness(shape: DecoderSizes) -> Tensor:
    """Bias of each head for poses reach - 1 .. 0 frames ago, (heads, reach): -slope floor(frames / p)."""
    slopes = 2.0 ** (-8.0 * torch.arange(1, shape.heads + 1) / shape.heads)
    ago = torch.arange(shape.reach - 1, -1, -1)
    return -slopes[:, None] * torch.div(ago, shape.period, rounding_mode="floor")
