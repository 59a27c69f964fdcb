"""A made-up voice, and a tiny wav2vec 2.0 in Hugging Face's layout whose weights are the same everywhere."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

CONFIG = {
    "model_type": "wav2vec2",
    "architectures": ["Wav2Vec2ForCTC"],
    "hidden_size": 16,
    "num_hidden_layers": 2,
    "num_attention_heads": 2,
    "intermediate_size": 24,
    "num_conv_pos_embeddings": 8,
    "num_conv_pos_embedding_groups": 4,
    "conv_dim": [8, 8, 8],
    "conv_kernel": [10, 8, 4],
    "conv_stride": [5, 8, 8],
    "conv_bias": False,
    "feat_extract_norm": "group",
    "feat_extract_activation": "gelu",
    "hidden_act": "gelu",
    "do_stable_layer_norm": False,
    "hidden_dropout": 0.0,
    "vocab_size": 12,
}
LARGE = {"feat_extract_norm": "layer", "conv_bias": True, "do_stable_layer_norm": True}


def voice(seconds: float, seed: int = 5) -> np.ndarray:
    """A gliding buzz in syllables, with a pause."""
    t = np.arange(round(seconds * 16000)) / 16000
    pitch = 2 * np.pi * np.cumsum(120 + 30 * np.sin(3 * t + seed)) / 16000
    buzz = sum(np.sin(k * pitch) / k for k in range(1, 12))
    sound = 0.1 * buzz * np.clip(np.sin(2 * np.pi * 2.5 * t), 0, 1)
    return np.where((t > 1.0) & (t < 1.4), 0.0, sound).astype(np.float32)


def shapes(config: dict) -> dict[str, tuple[int, ...]]:
    """Every weight of the encoder and its shape, as transformers names them."""
    width, hidden, dims = config["hidden_size"], config["intermediate_size"], config["conv_dim"]
    found: dict[str, tuple[int, ...]] = {"masked_spec_embed": (width,)}
    for i, (a, b, k) in enumerate(zip([1, *dims[:-1]], dims, config["conv_kernel"], strict=True)):
        layer = f"feature_extractor.conv_layers.{i}"
        found[f"{layer}.conv.weight"] = (b, a, k)
        if config["conv_bias"]:
            found[f"{layer}.conv.bias"] = (b,)
        if i == 0 or config["feat_extract_norm"] == "layer":
            found |= {f"{layer}.layer_norm.{end}": (b,) for end in ("weight", "bias")}
    found |= {f"feature_projection.layer_norm.{end}": (dims[-1],) for end in ("weight", "bias")}
    found |= _linear("feature_projection.projection", dims[-1], width)
    taps, groups = config["num_conv_pos_embeddings"], config["num_conv_pos_embedding_groups"]
    found["encoder.pos_conv_embed.conv.weight_g"] = (1, 1, taps)
    found["encoder.pos_conv_embed.conv.weight_v"] = (width, width // groups, taps)
    found["encoder.pos_conv_embed.conv.bias"] = (width,)
    found |= {f"encoder.layer_norm.{end}": (width,) for end in ("weight", "bias")}
    for i in range(config["num_hidden_layers"]):
        layer = f"encoder.layers.{i}"
        for part in ("q_proj", "k_proj", "v_proj", "out_proj"):
            found |= _linear(f"{layer}.attention.{part}", width, width)
        found |= _linear(f"{layer}.feed_forward.intermediate_dense", width, hidden)
        found |= _linear(f"{layer}.feed_forward.output_dense", hidden, width)
        for norm in ("layer_norm", "final_layer_norm"):
            found |= {f"{layer}.{norm}.{end}": (width,) for end in ("weight", "bias")}
    return found


def _linear(name: str, inside: int, outside: int) -> dict[str, tuple[int, ...]]:
    return {f"{name}.weight": (outside, inside), f"{name}.bias": (outside,)}


def weights(config: dict, seed: int = 4) -> dict[str, torch.Tensor]:
    """Made-up weights."""
    rng = np.random.default_rng(seed)
    found = {}
    for name, shape in shapes(config).items():
        values = rng.normal(0, 0.3, shape)
        if "norm.weight" in name or name.endswith("weight_g"):
            values = 1 + 0.3 * values
        found[name] = torch.from_numpy(values.astype(np.float32))
    return found


def write(
    folder: Path, config: dict = CONFIG, *, pickled: bool = False, bare: bool = False, seed: int = 4
) -> Path:
    """The folder of an encoder.

    Args:
        folder: made where it is not there.
        config: of the network.
        pickled: pytorch_model.bin with the older names of weight norm instead of model.safetensors.
        bare: names without the "wav2vec2." that models with a head on top have.
        seed: of the weights.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "config.json").write_text(json.dumps(config), encoding="utf-8")
    prefix = "" if bare else "wav2vec2."
    named = {prefix + name: tensor for name, tensor in weights(config, seed).items()}
    if not bare:
        named |= {"lm_head.weight": torch.zeros(12, config["hidden_size"]), "lm_head.bias": torch.zeros(12)}
    if pickled:
        torch.save(named, folder / "pytorch_model.bin")
        return folder
    newer = {"weight_g": "parametrizations.weight.original0", "weight_v": "parametrizations.weight.original1"}
    for old, new in newer.items():
        name = f"{prefix}encoder.pos_conv_embed.conv."
        named[name + new] = named.pop(name + old)
    save_file(named, folder / "model.safetensors")
    return folder
