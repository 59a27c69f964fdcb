"""wav2vec 2.0's speech encoder, read from a folder in Hugging Face's layout.

Source: Baevski et al. 2020, wav2vec 2.0, arXiv 2006.11477; names of the weights as Hugging Face's
transformers keeps them.
"""

from __future__ import annotations

import json
import pickle
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn
from torch.nn import functional

from studio.model._whisper import TransformerBlock

Floats = NDArray[np.float32]

WEIGHTS = ("model.safetensors", "pytorch_model.bin")
CONFIG = "config.json"
_LIMITS = {"hidden_size": 4096, "num_hidden_layers": 96, "intermediate_size": 16384}
_KINDS = {"hidden_act": "gelu", "feat_extract_activation": "gelu", "model_type": "wav2vec2"}


@dataclass(frozen=True)
class Config:
    """What config.json says of the network, under the names it has there."""

    hidden_size: int = 768
    num_hidden_layers: int = 12
    num_attention_heads: int = 12
    intermediate_size: int = 3072
    num_conv_pos_embeddings: int = 128
    num_conv_pos_embedding_groups: int = 16
    conv_dim: tuple[int, ...] = (512,) * 7
    conv_kernel: tuple[int, ...] = (10, 3, 3, 3, 3, 2, 2)
    conv_stride: tuple[int, ...] = (5, 2, 2, 2, 2, 2, 2)
    conv_bias: bool = False
    feat_extract_norm: str = "group"
    do_stable_layer_norm: bool = False
    layer_norm_eps: float = 1e-5

    @property
    def step(self) -> int:
        """Samples from a token to the next."""
        product = 1
        for stride in self.conv_stride:
            product *= stride
        return product

    @property
    def reach(self) -> int:
        """Samples that a token of the convolutions depends on."""
        reach, step = 1, 1
        for kernel, stride in zip(self.conv_kernel, self.conv_stride, strict=True):
            reach += (kernel - 1) * step
            step *= stride
        return reach


class Wav2Vec2(nn.Module):
    """Convolutions over samples, then transformer blocks over what they give."""

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.config, width, eps = config, config.hidden_size, config.layer_norm_eps
        sizes = (1, *config.conv_dim)
        self.convs = nn.ModuleList(
            nn.Conv1d(a, b, kernel, stride, bias=config.conv_bias)
            for (a, b), kernel, stride in zip(
                pairwise(sizes), config.conv_kernel, config.conv_stride, strict=True
            )
        )
        self.norms = nn.ModuleList(_conv_norm(config, i, size) for i, size in enumerate(config.conv_dim))
        self.enter_norm = nn.LayerNorm(config.conv_dim[-1], eps)
        self.enter = nn.Linear(config.conv_dim[-1], width)
        reach = config.num_conv_pos_embeddings
        groups = config.num_conv_pos_embedding_groups
        self.place = nn.Conv1d(width, width, reach, padding=reach // 2, groups=groups)
        stable = config.do_stable_layer_norm
        self.blocks = nn.ModuleList(
            TransformerBlock(width, config.num_attention_heads, config.intermediate_size, stable, eps)
            for _ in range(config.num_hidden_layers)
        )
        self.norm = nn.LayerNorm(width, eps)

    @torch.inference_mode()
    def tokens(self, samples: Floats) -> Floats:
        """What forward gives, of and as arrays."""
        conv_features: Floats = self(torch.from_numpy(samples)).numpy()
        return conv_features

    def forward(self, samples: Tensor) -> Tensor:
        """Tokens (n, hidden_size) of sound (N,) with mean 0 and deviation 1."""
        x = self.enter(self.enter_norm(self.conv_features(samples).transpose(1, 2)))
        placed = functional.gelu(self.place(x.transpose(1, 2))[..., : x.shape[1]]).transpose(1, 2)
        x, stable = x + placed, self.config.do_stable_layer_norm
        x = x if stable else self.norm(x)
        for block in self.blocks:
            x = block(x)
        done: Tensor = self.norm(x) if stable else x
        return done[0]

    def conv_features(self, samples: Tensor) -> Tensor:
        """What the convolutions make of the sound, (1, channels, n)."""
        x = samples[None, None]
        for conv, norm in zip(self.convs, self.norms, strict=True):
            x = functional.gelu(norm(conv(x)))
        return x


class _OverChannels(nn.LayerNorm):
    """Layer norm of (B, C, n) over C."""

    def forward(self, x: Tensor) -> Tensor:
        return super().forward(x.transpose(1, 2)).transpose(1, 2)


def _conv_norm(config: Config, index: int, size: int) -> nn.Module:
    if config.feat_extract_norm == "layer":
        return _OverChannels(size)
    return nn.GroupNorm(size, size) if index == 0 else nn.Identity()


def read_config(folder: Path) -> Config:
    """The network a folder's config.json describes.

    Raises:
        ValueError: it is damaged, or of another network.
        OSError: it cannot be read.
    """
    try:
        facts = json.loads((folder / CONFIG).read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{CONFIG} is damaged") from error
    if not isinstance(facts, dict):
        raise ValueError(f"{CONFIG} is damaged")
    for key, wanted in _KINDS.items():
        if facts.get(key, wanted) != wanted:
            raise ValueError(f"its {key} is {facts[key]}, not {wanted}")
    config = Config(**{f.name: _as(f.default, facts[f.name]) for f in fields(Config) if f.name in facts})
    _must_be_possible(config)
    return config


def _as(example: Any, value: Any) -> Any:
    """A value of config.json in the kind our field has."""
    try:
        if isinstance(example, tuple):
            return tuple(int(one) for one in value)
        return type(example)(value)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{CONFIG} is damaged") from error


def _must_be_possible(config: Config) -> None:
    convs = {len(config.conv_dim), len(config.conv_kernel), len(config.conv_stride)}
    whole = (*config.conv_dim, *config.conv_kernel, *config.conv_stride)
    if len(convs) > 1 or not 1 <= len(config.conv_dim) <= 16 or not all(0 < n <= 4096 for n in whole):
        raise ValueError("its convolutions make no sense")
    for name, most in _LIMITS.items():
        if not 1 <= getattr(config, name) <= most:
            raise ValueError(f"its {name} makes no sense")
    heads, groups = config.num_attention_heads, config.num_conv_pos_embedding_groups
    if heads < 1 or groups < 1 or config.hidden_size % heads or config.hidden_size % groups:
        raise ValueError("its attention heads do not share its width")
    if not 1 <= config.num_conv_pos_embeddings <= 1024:
        raise ValueError("its positions make no sense")


def weights_of(folder: Path) -> Path:
    """The file with a folder's weights.

    Raises:
        ValueError: there is none.
    """
    for name in WEIGHTS:
        if (folder / name).is_file():
            return folder / name
    raise ValueError(f"it holds neither {' nor '.join(WEIGHTS)}")


def load(folder: Path) -> Wav2Vec2:
    """The encoder in a folder; nothing in it is executed.

    Raises:
        ValueError: it is damaged, or of another network.
        OSError: it cannot be read.
    """
    config = read_config(folder)
    found = _renamed(_tensors(weights_of(folder)), config)
    with torch.device("meta"):  # hostile sizes must not fill the memory first
        network = Wav2Vec2(config)
    try:
        network.load_state_dict(found, assign=True)
    except RuntimeError as error:
        raise ValueError("its weights do not fit its config.json") from error
    return network.eval().requires_grad_(False)


def _tensors(path: Path) -> dict[str, Tensor]:
    try:
        if path.suffix == ".safetensors":
            return load_file(path)
        with warnings.catch_warnings():  # what it warns of is refused or harmless
            warnings.simplefilter("ignore")
            found = torch.load(path, map_location="cpu", weights_only=True)
    except (SafetensorError, pickle.UnpicklingError, RuntimeError, EOFError, KeyError) as error:
        raise ValueError(f"{path.name} is damaged, or holds more than weights") from error
    if not isinstance(found, dict) or not all(isinstance(t, Tensor) for t in found.values()):
        raise ValueError(f"{path.name} holds more than weights")
    return found


_WHOLE = {
    "feature_projection.layer_norm": "enter_norm",
    "feature_projection.projection": "enter",
    "encoder.layer_norm": "norm",
}
_IN_BLOCK = {
    "attention.out_proj": "self_out",
    "layer_norm": "self_norm",
    "feed_forward.intermediate_dense": "ffn_in",
    "feed_forward.output_dense": "ffn_out",
    "final_layer_norm": "ffn_norm",
}


def _renamed(tensors: Mapping[str, Tensor], config: Config) -> dict[str, Tensor]:
    """Our names for the encoder's weights; those of heads that were trained on top are left out."""
    plain = {name.removeprefix("wav2vec2."): tensor.float() for name, tensor in tensors.items()}
    found: dict[str, Tensor] = {}
    try:
        for i in range(len(config.conv_dim)):
            _take(plain, f"feature_extractor.conv_layers.{i}.conv", found, f"convs.{i}")
            _take(plain, f"feature_extractor.conv_layers.{i}.layer_norm", found, f"norms.{i}")
        for theirs, ours in _WHOLE.items():
            _take(plain, theirs, found, ours)
        found |= _place(plain)
        for i in range(config.num_hidden_layers):
            there, here = f"encoder.layers.{i}", f"blocks.{i}"
            for theirs, ours in _IN_BLOCK.items():
                _take(plain, f"{there}.{theirs}", found, f"{here}.{ours}")
            for end in ("weight", "bias"):
                parts = [plain[f"{there}.attention.{one}_proj.{end}"] for one in "qkv"]
                found[f"{here}.self_qkv.{end}"] = torch.cat(parts)
    except (KeyError, RuntimeError, IndexError) as error:
        raise ValueError("its weights do not fit its config.json") from error
    return found


def _take(plain: Mapping[str, Tensor], theirs: str, found: dict[str, Tensor], ours: str) -> None:
    found |= {
        f"{ours}.{end}": plain[f"{theirs}.{end}"] for end in ("weight", "bias") if f"{theirs}.{end}" in plain
    }


def _place(plain: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The convolution of positions, whose weight is kept as length and direction over its taps."""
    conv = "encoder.pos_conv_embed.conv"
    old, new = (f"{conv}.weight_g", f"{conv}.weight_v"), f"{conv}.parametrizations.weight.original"
    length, direction = (plain[n] for n in (old if old[0] in plain else (f"{new}0", f"{new}1")))
    weight = length * direction / direction.norm(dim=(0, 1), keepdim=True)
    return {"place.weight": weight, "place.bias": plain[f"{conv}.bias"]}
