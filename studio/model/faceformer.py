"""FaceFormer: a transformer that says each pose from the sound and from the poses it said before.

Periodic positions, causal self-attention that prefers near periods, cross-attention of each frame to its own
rows of sound, as published; speech is heard by a small convolutional encoder learnt from scratch. Unlike the
published code, keys and values are kept instead of worked out again for every frame, and self-attention
reaches back a fixed span, so that any length takes the same time and memory a frame.
Source: Fan et al. 2022, FaceFormer: Speech-Driven 3D Facial Animation with Transformers, arXiv 2112.05329;
the bias after Press et al. 2022 (ALiBi); learning from its own answers in a few parallel passes after
Duckworth et al. 2019, Parallel Scheduled Sampling.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from studio.errors import RequestError
from studio.model._network import Network, Sizes, State

_STYLE_DEVIATION = 0.3
_KERNEL = 3
_HIDDEN = 2
"""Width of the feed-forward layers, times the network's."""


class Shape(NamedTuple):
    """Sizes of the decoder: numbers of a token, heads, layers, frames of a period and of the past seen."""

    width: int
    heads: int
    layers: int
    period: int
    reach: int
    dropout: float


class Ear(nn.Module):
    """Rows of sound to rows of what was said: residual dilated convolutions, exact in pieces.

    Source: Bai et al. 2018, An Empirical Evaluation of Generic Convolutional and Recurrent Networks.
    """

    def __init__(self, features: int, width: int, layers: int, dropout: float) -> None:
        super().__init__()
        width, wide = width // 2, width  # there are many more rows than frames
        self.dilations = [2**i for i in range(layers)]
        self.reach = _KERNEL // 2 + sum(self.dilations)
        self.enter = nn.Conv1d(features, width, _KERNEL)
        self.blocks = nn.ModuleList(nn.Conv1d(width, width, _KERNEL, dilation=d) for d in self.dilations)
        self.mixes = nn.ModuleList(nn.Conv1d(width, width, 1) for _ in self.dilations)
        self.widen = nn.Linear(width, wide)
        self.norm = nn.LayerNorm(wide)
        self.dropout = nn.Dropout(dropout)

    def forward(self, rows: Tensor) -> Tensor:
        """(B, R + 2 reach, F) -> (B, R, width)."""
        x = self.enter(rows.transpose(1, 2))
        for block, mix, dilation in zip(self.blocks, self.mixes, self.dilations, strict=True):
            heard = mix(self.dropout(functional.gelu(block(functional.gelu(x)))))
            x = x[..., dilation:-dilation] + heard
        normed: Tensor = self.norm(self.widen(x.transpose(1, 2)))
        return normed


def attended(query: Tensor, keys: Tensor, values: Tensor, bias: Tensor) -> Tensor:
    """softmax(q k^T / sqrt(d) + bias) v for one query each; for these few numbers torch's own takes longer.

    Args:
        query: (..., heads, 1, d).
        keys, values: (..., heads, m, d).
        bias: (N, 1, m), or anything that spreads to it, N the product of all dimensions before the last two.
    """
    q, k, v = query.flatten(0, -3), keys.flatten(0, -3), values.flatten(0, -3)
    scores = torch.baddbmm(bias, q, k.transpose(1, 2), alpha=1 / math.sqrt(q.shape[-1]))
    return torch.bmm(torch.softmax(scores, dim=-1), v).view(query.shape)


class Layer(nn.Module):
    """One decoder layer: looks back, listens, thinks; each with a residual and a norm after it."""

    def __init__(self, shape: Shape) -> None:
        super().__init__()
        width = shape.width
        self.heads, self.dropout = shape.heads, shape.dropout
        self.look = nn.Linear(width, 3 * width)
        self.looked = nn.Linear(width, width)
        self.ask = nn.Linear(width, width)
        self.sound = nn.Linear(width, 2 * width)
        self.listened = nn.Linear(width, width)
        self.widen = nn.Linear(width, _HIDDEN * width)
        self.narrow = nn.Linear(_HIDDEN * width, width)
        self.norms = nn.ModuleList(nn.LayerNorm(width) for _ in range(3))

    def offered(self, heard: Tensor) -> Tensor:
        """Keys and values of the sound (2, n, B, heads, K, width / heads) from (B, n, K, width)."""
        batch, frames, rows, width = heard.shape
        both = self.sound(heard).view(batch, frames, rows, 2, self.heads, width // self.heads)
        return both.permute(3, 1, 0, 4, 2, 5).contiguous()

    def looking(self, x: Tensor) -> Tensor:
        """Queries, keys and values of tokens: (B, n, width) -> (3, B, heads, n, width / heads)."""
        batch, frames, width = x.shape
        return self.look(x).view(batch, frames, 3, self.heads, width // self.heads).permute(2, 0, 3, 1, 4)

    def finish(self, x: Tensor, seen: Tensor, offered: Tensor) -> Tensor:
        """What comes after looking back.

        Args:
            x: tokens (B, n, width).
            seen: what self-attention gave (B, heads, n, width / heads).
            offered: keys and values of the sound (2, n, B, heads, K, width / heads).
        """
        batch, frames, width = x.shape
        x = self._joined(0, x, self.looked(seen.transpose(1, 2).reshape(batch, frames, width)))
        asked = self.ask(x).view(batch, frames, self.heads, 1, -1).transpose(0, 1)
        heard = attended(asked, offered[0], offered[1], x.new_zeros(1, 1, 1))
        x = self._joined(1, x, self.listened(heard.transpose(0, 1).reshape(batch, frames, width)))
        return self._joined(2, x, self.narrow(self._dropped(functional.gelu(self.widen(x)))))

    def _joined(self, number: int, x: Tensor, new: Tensor) -> Tensor:
        norm = self.norms[number]
        assert isinstance(norm, nn.LayerNorm)
        return functional.layer_norm(x + self._dropped(new), norm.normalized_shape, norm.weight, norm.bias)

    def _dropped(self, x: Tensor) -> Tensor:
        return functional.dropout(x, self.dropout) if self.training else x


class FaceFormer(Network):
    """Ear, style and decoder; the state is the keys and values of the past, the last pose and its place.

    Args:
        sizes: what it must fit.
        shape: of the decoder.
        hearing: convolutions of the ear.
        passes: how often a crop is answered while learning; all but the last only make the poses that the
            last one is shown as its own past.
        told: share of frames whose past is the captured pose instead.
    """

    def __init__(self, sizes: Sizes, shape: Shape, hearing: int, passes: int, told: float) -> None:
        super().__init__(sizes)
        self.shape, self.passes, self.told = shape, passes, told
        self.ear = Ear(sizes.features, shape.width, hearing, shape.dropout)
        self.before = self.after = self.ear.reach
        self.past = nn.Linear(sizes.columns, shape.width)
        self.style = nn.Embedding(sizes.styles + 1, shape.width)
        nn.init.normal_(self.style.weight, std=_STYLE_DEVIATION)
        self.layers = nn.ModuleList(Layer(shape) for _ in range(shape.layers))
        self.pose = nn.Linear(shape.width, sizes.columns)
        nn.init.zeros_(self.pose.weight)  # as published: it begins with no motion at all
        self.register_buffer("places", _places(shape), persistent=False)
        self.register_buffer("nearness", _nearness(shape), persistent=False)

    places: Tensor
    nearness: Tensor

    @property
    def output(self) -> nn.Linear:
        """The motion decoder."""
        return self.pose

    @torch.no_grad()
    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """See Network.forward: one frame after another, from what was kept; without gradients."""
        heard, layers = self.hear(rows), list(self._each())
        cache, pose, frame = self._opened(state, heard)
        offered = [layer.offered(heard).unbind(1) for layer in layers]
        # What stays the same is worked out once: the place in the period and the style go together.
        starts = (self.places[:, None] + self._styled(style, len(rows)) + self.past.bias).unbind(0)
        weight, count = self.past.weight, heard.shape[1]
        kept = cache.shape[-2] - count
        nearness = self.nearness.repeat(len(rows), 1).unsqueeze(1)
        poses = []
        for i in range(count):
            x = torch.addmm(starts[(frame + i) % self.shape.period], pose, weight.t())[:, None]
            for number, layer in enumerate(layers):
                seen = self._look_back(layer, x, cache[number], kept + i, nearness)
                x = layer.finish(x, seen, offered[number][i][:, None])
            pose = self.pose(x[:, 0])
            poses.append(pose)
        tail = torch.cat([pose, pose.new_full((len(pose), 1), (frame + count) % self.shape.period)], dim=1)
        keep = min(cache.shape[-2], self.shape.reach - 1)
        return torch.stack(poses, dim=1), (cache[..., cache.shape[-2] - keep :, :].clone(), tail)

    def _look_back(self, layer: Layer, x: Tensor, cache: Tensor, at: int, nearness: Tensor) -> Tensor:
        """Self-attention of one new token; its key and value go into the cache (2, B, heads, N, ...)."""
        fresh = layer.looking(x)
        cache[..., at : at + 1, :] = fresh[1:]
        first = max(0, at + 1 - self.shape.reach)
        keys, values = cache[..., first : at + 1, :].unbind(0)
        return attended(fresh[0], keys, values, nearness[..., self.shape.reach - (at + 1 - first) :])

    def _opened(self, state: State | None, heard: Tensor) -> tuple[Tensor, Tensor, int]:
        """Room for past and new frames (layers, 2, B, heads, N, ...), the last pose, the next place."""
        batch, frames = heard.shape[:2]
        shape = self.shape
        if state is None:
            past = heard.new_zeros(shape.layers, 2, batch, shape.heads, 0, shape.width // shape.heads)
            pose, frame = self.pose_mean.expand(batch, -1), 0
        else:
            past, pose, frame = state[0], state[1][:, :-1], int(state[1][0, -1])
        room = past.new_empty(*past.shape[:4], past.shape[4] + frames, past.shape[5])
        room[..., : past.shape[4], :] = past
        return room, pose, frame

    def learn(
        self, rows: Tensor, style: Tensor | None, values: Tensor, weight: Tensor
    ) -> tuple[Tensor, Tensor]:
        """See Network.learn: a few passes over the whole crop, each shown what the one before answered."""
        heard, past = self.hear(rows), values
        for _ in range(self.passes - 1):
            with torch.no_grad():
                past = self.decode(heard.detach(), past, style)
        if self.told:
            shown = torch.rand(*past.shape[:2], 1, device=past.device) < self.told
            past = torch.where(shown, values, past)
        return self.decode(heard, past, style), values.new_zeros(())

    def hear(self, rows: Tensor) -> Tensor:
        """What was said in each frame, (B, n, K, width), from rows (B, n K + before + after, F)."""
        heard = self.ear(self.normalised(rows))
        return heard.view(len(rows), -1, self.sizes.steps_per_frame, self.shape.width)

    def decode(self, heard: Tensor, poses: Tensor, style: Tensor | None = None) -> Tensor:
        """All frames at once, each from the poses before it: what forward does one by one.

        Args:
            heard: (B, n, K, width).
            poses: scaled poses (B, n, C); the last one is not looked at.
            style: see Network.forward.
        """
        first = self.pose_mean.expand(len(poses), 1, -1)
        past = self.past(torch.cat([first, poses[:, :-1]], dim=1))
        frames = torch.arange(poses.shape[1], device=poses.device)
        x = past + self._styled(style, len(poses))[:, None] + self.places[frames % self.shape.period]
        apart = frames[:, None] - frames[None]
        seen = (apart >= 0) & (apart < self.shape.reach)
        bias = self.nearness[:, (self.shape.reach - 1 - apart).clamp(0, self.shape.reach - 1)]
        bias = bias.masked_fill(~seen, float("-inf"))
        for layer in self._each():
            query, keys, values = layer.looking(x).unbind(0)
            looked = functional.scaled_dot_product_attention(query, keys, values, attn_mask=bias)
            x = layer.finish(x, looked, layer.offered(heard))
        done: Tensor = self.pose(x)
        return done

    def _styled(self, style: Tensor | None, batch: int) -> Tensor:
        """The style's embedding of each row of a batch, (B, width)."""
        if style is None or not self.sizes.styles:
            style = torch.zeros(batch, dtype=torch.long, device=self.style.weight.device)
        embedded: Tensor = self.style(style)
        return embedded

    def _each(self) -> Iterator[Layer]:
        for layer in self.layers:
            assert isinstance(layer, Layer)
            yield layer


def _places(shape: Shape) -> Tensor:
    """PPE(t, 2i) = sin((t mod p) / 10000^(2i / d)), cos for odd, (p, d): Fan et al., equation 4."""
    t = torch.arange(shape.period)[:, None]
    rates = torch.exp(torch.arange(0, shape.width, 2) * (-math.log(10000.0) / shape.width))
    return torch.stack([torch.sin(t * rates), torch.cos(t * rates)], dim=-1).flatten(1)


def _nearness(shape: Shape) -> Tensor:
    """Bias of each head for poses reach - 1 .. 0 frames ago, (heads, reach): -slope floor(frames / p)."""
    slopes = 2.0 ** (-8.0 * torch.arange(1, shape.heads + 1) / shape.heads)
    ago = torch.arange(shape.reach - 1, -1, -1)
    return -slopes[:, None] * torch.div(ago, shape.period, rounding_mode="floor")


def build(
    sizes: Sizes,
    *,
    width: int = 128,
    heads: int = 4,
    layers: int = 1,
    period: int = 30,
    reach_s: float = 5.0,
    hearing: int = 5,
    dropout: float = 0.1,
    passes: int = 3,
    told: float = 0.0,
) -> Network:
    """The network.

    Args:
        sizes: what it must fit.
        width: numbers of a token.
        heads: of attention; they share the width.
        layers: of the decoder.
        period: frames after which positions repeat; 25 or 30 in the paper.
        reach_s: seconds of its own past it looks back on.
        hearing: convolutions of the ear; it hears about 2^hearing rows to either side.
        dropout: share of values dropped while training.
        passes: how often a crop is answered while learning; 1 shows it the captured past alone.
        told: share of frames whose past is captured rather than its own.
    """
    if width % heads or width % 2:
        raise RequestError(
            f"A width of {width} cannot be shared by {heads} heads.",
            "Choose network.width as a multiple of both 2 and network.heads.",
        )
    reach = max(1, round(reach_s * sizes.fps))
    return FaceFormer(sizes, Shape(width, heads, layers, period, reach, dropout), hearing, passes, told)
