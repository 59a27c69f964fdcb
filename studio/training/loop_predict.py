"""Predicting whole takes while training, and how lively the best model comes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from studio.features.audio import Floats
from studio.features.examples import Example
from studio.model._network import Chance, Network
from studio.training import checkpoint
from studio.training.gains import region_gains

PIECE_FRAMES = 1024
"""Frames predicted at once."""


def predict(network: Network, example: Example, device: torch.device | str = "cpu", style: int = 0) -> Floats:
    """Scaled poses (T, C) of a whole example in a style, in pieces, as generating does it."""
    return predict_styles(network, example, device, (style,))[0]


def drawn(network: Network, example: Example, device: torch.device | str, style: int) -> Floats:
    """Scaled poses (T, C) as generating draws them where nothing else is asked for."""
    return predict_styles(network, example, device, (style,), Chance())[0]


def predict_styles(
    network: Network,
    example: Example,
    device: torch.device | str = "cpu",
    styles: Sequence[int] = (0,),
    chance: Chance | None = None,
) -> Floats:
    """Scaled poses (S, T, C) of a whole example in several styles at once; expected ones without chance."""
    k, out, state = network.sizes.steps_per_frame, [], None
    chosen = torch.tensor(styles, device=device)
    for first in range(0, example.frames, PIECE_FRAMES):
        last = min(first + PIECE_FRAMES, example.frames)
        a, b = first - network.margin, last + network.margin
        rows = example.rows(a * k - network.before, (b - a) * k + network.before + network.after)
        heard = torch.from_numpy(rows).to(device).expand(len(styles), -1, -1)
        here = None if chance is None else replace(chance, first=a)
        poses, state = network.predict(heard, state, chosen, here)
        out.append(poses[:, network.margin : network.margin + last - first].cpu().numpy())
    return np.concatenate(out, axis=1)


def part_errors(predicted: Floats, example: Example, parts: int) -> Floats:
    """Mean squared errors (S, parts) of scaled poses (S, T, C) on even parts of an example."""
    weight = example.grid.valid[:, None] * example.mask[None]
    squares = np.square(predicted - example.values[None]) * weight
    edges = np.linspace(0, example.frames, min(parts, example.frames) + 1).astype(int)[:-1]
    counts = np.add.reduceat(weight.sum(axis=1), edges)
    sums = np.add.reduceat(squares.sum(axis=2), edges, axis=1)
    errors: Floats = (sums / np.maximum(counts, 1.0))[:, counts > 0].astype(np.float32)
    return errors


def enliven(path: Path, takes: Sequence[Example], style: int, wanted: float) -> None:
    """Give a kept model the gains that match how lively its regions are to the capture, once.

    Args:
        path: the model's file, rewritten.
        takes: not learnt from.
        style: it is measured in.
        wanted: 1 for the whole gain, 0 for none.
    """
    made = checkpoint.load_model(path)
    if not bool((made.network.gain == 1).all()):
        return
    with torch.no_grad():
        expected = [predict(made.network, example, style=style) for example in takes]
        if made.network.draws:
            poses = [drawn(made.network, example, "cpu", style) for example in takes]
            gain = region_gains(poses, takes, made.layout, expected)
        else:
            gain = region_gains(expected, takes, made.layout)
    made.network.gain.copy_(torch.from_numpy(1 + wanted * (gain - 1)).float())
    checkpoint.save_model(path, made)


class swapped:  # noqa: N801 (used like a function)
    """Within the block a network has other weights for some of its parameters."""

    def __init__(self, network: Network, weights: Mapping[str, Tensor]) -> None:
        self._network, self._weights = network, weights
        self._own: dict[str, Tensor] = {}

    def __enter__(self) -> None:
        self._exchange(self._weights)

    def __exit__(self, *_: object) -> None:
        self._exchange(dict(self._own))

    def _exchange(self, weights: Mapping[str, Tensor]) -> None:
        with torch.no_grad():
            for name, parameter in self._network.named_parameters():
                if name in weights:
                    self._own[name] = parameter.detach().clone()
                    parameter.copy_(weights[name])
