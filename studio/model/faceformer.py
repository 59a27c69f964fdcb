"""FaceFormer: an autoregressive transformer; each pose follows from the sound and the poses before it.

Periodic positions, causal self-attention that prefers near periods, cross-attention of each frame to its own
rows of sound, as published; speech is encoded by a small convolutional encoder learnt from scratch, or by a
pretrained one whose rows come in and are projected, as published. Unlike the published code, keys and values
are kept instead of worked out again for every frame, and self-attention reaches back a fixed span, so that
any length takes the same time and memory a frame.
Source: Fan et al. 2022, FaceFormer: Speech-Driven 3D Facial Animation with Transformers, arXiv 2112.05329;
the bias after Press et al. 2022 (ALiBi); learning from its own answers in a few parallel passes after
Duckworth et al. 2019, Parallel Scheduled Sampling.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from studio.errors import RequestError, say
from studio.model._decoder import (
    AudioEncoder,
    AudioKV,
    DecoderSizes,
    Layer,
    Projection,
    attended,
    nearness,
    places,
)
from studio.model._network import Network, Sizes, State

_STYLE_DEVIATION = 0.3
_LIMITS = {"layers": (1, 12), "hearing": (1, 8), "passes": (1, 32), "reach_s": (0.01, 60.0)}


class FaceFormer(Network):
    """Audio encoder, style and decoder; the state: keys and values of the past, the last pose, its place.

    Args:
        sizes: what it must fit.
        shape: of the decoder.
        encoder: of the rows of sound.
        passes: how often a crop is answered while learning; all but the last only make the poses that the
            last one is shown as its own past.
        captured_share: share of frames whose past is the captured pose instead (teacher forcing).
    """

    def __init__(
        self,
        sizes: Sizes,
        shape: DecoderSizes,
        encoder: AudioEncoder | Projection,
        passes: int,
        captured_share: float,
    ) -> None:
        super().__init__(sizes)
        self.shape, self.passes, self.captured_share = shape, passes, captured_share
        self.encoder = encoder
        # The past needs no rows of its own: it comes from the poses already given.
        self.before = self.after = self.encoder.reach
        self.past = nn.Linear(sizes.columns, shape.width)
        self.style = nn.Embedding(sizes.styles + 1, shape.width)
        nn.init.normal_(self.style.weight, std=_STYLE_DEVIATION)
        self.layers = nn.ModuleList(Layer(shape) for _ in range(shape.layers))
        self.pose = nn.Linear(shape.width, sizes.columns)
        nn.init.zeros_(self.pose.weight)  # as published: it begins with no motion at all
        # Kept in the file: a model is loaded without running any arithmetic of its own.
        self.register_buffer("places", places(shape))
        self.register_buffer("nearness", nearness(shape))

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
        """Poses (B, n, C) one frame after another from the cached keys and values; without gradients."""
        encoded, layers = self.encode(rows), list(self._each())
        cache, pose, frame = self._opened(state, encoded)
        audio_kv = [_by_frame(kv) for kv in self.audio_kv(encoded)]
        # What stays the same is worked out once: the place in the period and the style go together.
        starts = (self.places[:, None] + self._styled(style, len(rows)) + self.past.bias).unbind(0)
        near = self.nearness.repeat(len(rows), 1).unsqueeze(1)
        weight, count = self.past.weight.t(), encoded.shape[1]
        kept, poses = cache.shape[-2] - count, []
        for i in range(count):
            x = torch.addmm(starts[(frame + i) % self.shape.period], pose, weight)
            for number, layer in enumerate(layers):
                seen = self._look_back(layer, x, cache[number], kept + i, near)
                x = layer.finish(x, seen, audio_kv[number][i])
            pose = self.pose(x)
            poses.append(pose)
        tail = torch.cat([pose, pose.new_full((len(pose), 1), (frame + count) % self.shape.period)], dim=1)
        # Only what a next frame can look back on, or the state would grow with the sound.
        keep = min(cache.shape[-2], self.shape.reach - 1)
        return torch.stack(poses, dim=1), (cache[..., cache.shape[-2] - keep :, :].clone(), tail)

    def _look_back(self, layer: Layer, x: Tensor, cache: Tensor, at: int, near: Tensor) -> Tensor:
        """Self-attention of one new token (B, width); key and value go into the cache (2, B heads, ...)."""
        batch, width = x.shape
        fresh = layer.self_qkv(x).view(batch, 3, -1, 1, width // layer.heads).transpose(0, 1).flatten(1, 2)
        # Written in place: a cache that is concatenated copies its whole past at every frame.
        cache[:, :, at : at + 1] = fresh[1:]
        first = max(0, at + 1 - self.shape.reach)
        keys, values = cache[:, :, first : at + 1].unbind(0)
        bias = near[..., self.shape.reach - (at + 1 - first) :]
        return attended(fresh[0], keys, values, bias).view(batch, width)

    def _opened(self, state: State | None, encoded: Tensor) -> tuple[Tensor, Tensor, int]:
        """Room for past and new frames (layers, 2, B heads, N, ...), the last pose, the next place."""
        batch, frames = encoded.shape[:2]
        shape = self.shape
        if state is None:
            past = encoded.new_zeros(shape.layers, 2, batch * shape.heads, 0, shape.width // shape.heads)
            pose, frame = self.pose_mean.expand(batch, -1), 0
        else:
            past, pose, frame = state[0], state[1][:, :-1], int(state[1][0, -1])
        # Room for the new frames at once, for the same reason.
        room = past.new_empty(*past.shape[:3], past.shape[3] + frames, past.shape[4])
        room[..., : past.shape[3], :] = past
        return room, pose, frame

    def learn(
        self, rows: Tensor, style: Tensor | None, values: Tensor, weight: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Poses of crops by a few passes over the whole crop, each shown the poses of the one before."""
        encoded, past = self.encode(rows), values
        audio_kv = self.audio_kv(encoded)
        # In parallel passes instead of frame by frame: each brings the shown past nearer to its own poses.
        for _ in range(self.passes - 1):
            with torch.no_grad():
                past = self.decode(past, style, audio_kv)
        if self.captured_share:
            # Some captured frames remain, so that early in training not every past is wrong.
            shown = torch.rand(*past.shape[:2], 1, device=past.device) < self.captured_share
            past = torch.where(shown, values, past)
        return self.decode(past, style, audio_kv), values.new_zeros(())

    def encode(self, rows: Tensor) -> Tensor:
        """Encoded rows of each frame, (B, n, K, width), from rows (B, n K + before + after, F)."""
        encoded = self.encoder(self.normalised(rows))
        return encoded.view(len(rows), -1, self.sizes.steps_per_frame, self.shape.width)

    def audio_kv(self, encoded: Tensor) -> list[AudioKV]:
        """Keys and values of each layer for encoded rows (B, n, K, width)."""
        return [layer.audio_kv(encoded) for layer in self._each()]

    def decode(self, poses: Tensor, style: Tensor | None, audio_kv: Sequence[AudioKV]) -> Tensor:
        """All frames at once, each from the poses before it: what forward does one by one.

        Args:
            poses: scaled poses (B, n, C); the last one is not looked at.
            style: see Network.forward.
            audio_kv: of the sound of the same frames.
        """
        batch, count = poses.shape[:2]
        # Shifted by one: a frame sees the poses before it and never its own.
        past = torch.cat([self.pose_mean.expand(batch, 1, -1), poses[:, :-1]], dim=1)
        frames = torch.arange(count, device=poses.device)
        x = self.past(past) + self._styled(style, batch)[:, None] + self.places[frames % self.shape.period]
        bias = self._bias(frames)
        for layer, kv in zip(self._each(), audio_kv, strict=True):
            qkv = layer.self_qkv(x).view(batch, count, 3, layer.heads, -1).permute(2, 0, 3, 1, 4)
            seen = functional.scaled_dot_product_attention(qkv[0], qkv[1], qkv[2], bias)
            flat = AudioKV(*(part.flatten(0, 1) for part in kv))
            x = layer.finish(x.flatten(0, 1), seen.transpose(1, 2).reshape(batch * count, -1), flat)
            x = x.view(batch, count, -1)
        done: Tensor = self.pose(x)
        return done

    def _bias(self, frames: Tensor) -> Tensor:
        """Of self-attention between all frames (heads, n, n); -inf for the future and beyond the reach."""
        ago = frames[:, None] - frames[None]
        seen = (ago >= 0) & (ago < self.shape.reach)
        bias = self.nearness[:, (self.shape.reach - 1 - ago).clamp(0, self.shape.reach - 1)]
        # Also beyond the reach: live and offline cut the past there, and must give the same.
        return bias.masked_fill(~seen, float("-inf"))

    def _styled(self, style: Tensor | None, batch: int) -> Tensor:
        """The style's embedding of each row of a batch, (B, width)."""
        if style is None or not self.sizes.styles:
            style = torch.zeros(batch, dtype=torch.long, device=self.style.weight.device)
        if style.is_floating_point():  # a mixture, the same throughout
            mixed: Tensor = style[:, 0, : self.sizes.styles + 1] @ self.style.weight
            return mixed
        embedded: Tensor = self.style(style)
        return embedded

    def _each(self) -> Iterator[Layer]:
        for layer in self.layers:
            assert isinstance(layer, Layer)
            yield layer


def _by_frame(kv: AudioKV) -> list[AudioKV]:
    """Keys and values (B, n, ...) one frame at a time."""
    keys, bias, values = (part.unbind(1) for part in kv)
    return [AudioKV(*one) for one in zip(keys, bias, values, strict=True)]


def build(
    sizes: Sizes,
    *,
    width: int = 128,
    heads: int = 4,
    layers: int = 1,
    period: int = 30,
    reach_s: float = 5.0,
    hearing: int = 5,
    projected: bool = False,
    dropout: float = 0.1,
    passes: int = 3,
    told: float = 0.0,
) -> Network:
    """A FaceFormer; the names of these settings are keys of recipes on disk.

    Args:
        sizes: what it must fit.
        width: numbers of a token.
        heads: of attention; they share the width.
        layers: of the decoder.
        period: frames after which positions repeat; 25 or 30 in the paper.
        reach_s: seconds of its own past it looks back on.
        hearing: convolutions of the audio encoder; it reaches about 2^hearing rows to either side.
        projected: rows are a pretrained encoder's, which has encoded them already: one linear layer instead.
        dropout: share of values dropped while training.
        passes: how often a crop is answered while learning; 1 shows it the captured past alone.
        told: share of frames whose past is captured rather than its own.
    """
    _must_fit(width, heads)
    for name, value in (("layers", layers), ("hearing", hearing), ("passes", passes), ("reach_s", reach_s)):
        _must_be_within(name, value)
    reach = max(1, round(reach_s * sizes.fps))
    shape = DecoderSizes(width, heads, layers, period, reach, dropout)
    encoder = (
        Projection(sizes.features, width)
        if projected
        else AudioEncoder(sizes.features, width, hearing, dropout)
    )
    return FaceFormer(sizes, shape, encoder, passes, told)


def _must_fit(width: int, heads: int) -> None:
    if width % heads or width % 2:
        what = say("A width of {width} cannot be shared by {heads} heads.", width=width, heads=heads)
        raise RequestError(what, "Choose network.width as a multiple of both 2 and network.heads.")


def _must_be_within(name: str, value: float) -> None:
    low, high = _LIMITS[name]
    if not low <= value <= high:
        raise RequestError(
            say("{value} is not possible for network.{name}.", value=value, name=name),
            say("Choose {low} to {high}.", low=f"{low:g}", high=f"{high:g}"),
        )
