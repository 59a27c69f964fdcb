"""A mixture-density head: not one pose for a sound but how likely all poses are, and samples of them.

Source: Bishop 1994, Mixture Density Networks; wished for in K. J. Cui, SAIA progress report 3, McGill 2023.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from studio.model._network import SamplingOptions

Array = NDArray[np.floating]

FLOOR = 0.02
"""No deviation is smaller (scaled units): a component must not collapse onto single frames."""
SLOW_SECONDS = 0.5
"""Length of the window that makes chance slow: noise that is new in every frame would tremble."""
_FIRST_DEVIATION = 0.3
_APART = 0.1
_SWITCH = 0.2
_BLOCK = 256
_BEFORE_START = 1 << 20  # blocks before the first frame have numbers too


@dataclass(frozen=True, eq=False)
class Mixture:
    """Poses as a sum of Gaussians with diagonal covariance.

    Args:
        log_weights: of the components (B, n, K).
        means, deviations: (B, n, K, C).
    """

    log_weights: Tensor
    means: Tensor
    deviations: Tensor

    @property
    def mean(self) -> Tensor:
        """The expected poses (B, n, C)."""
        return (self.log_weights.exp()[..., None] * self.means).sum(dim=2)

    def loss(self, values: Tensor, weight: Tensor) -> Tensor:
        """-log p(values), by log-sum-exp over the components, a mean over all values that count.

        Args:
            values: scaled poses (B, n, C).
            weight: (B, n, C), 0 where a value does not count.
        """
        z = (values[:, :, None] - self.means) / self.deviations
        single = -0.5 * z.square() - self.deviations.log() - 0.5 * math.log(2 * math.pi)
        joint = (single * weight[:, :, None]).sum(dim=-1)
        counted = weight.sum().clamp(min=1.0)
        there = weight.amax(dim=-1)
        return -(torch.logsumexp(self.log_weights + joint, dim=-1) * there).sum() / counted

    def sample(self, sampling: SamplingOptions, fps: float, seconds: Array | None = None) -> Tensor:
        """Poses (B, n, C) drawn with slow chance; liveliness 0 gives the mean, 1 what was learnt.

        `seconds` is how slow in each column (C,), see slow_noise.

        Which component speaks is drawn by the Gumbel-max rule, softened so that changes are no jumps.
        Source: Maddison et al. 2017, The Concrete Distribution.
        """
        frames, components, columns = self.means.shape[1:]
        paces = None if seconds is None else np.append(seconds, np.full(components, np.median(seconds)))
        noise = slow_noise(sampling, frames, columns + components, fps, paces)
        deviates = torch.from_numpy(noise[:, None, :columns]).to(self.means)
        gumbel = torch.from_numpy(_gumbel(noise[:, columns:])).to(self.means)
        chosen = torch.softmax((self.log_weights + gumbel) / _SWITCH, dim=-1)[..., None]
        drawn = (chosen * (self.means + self.deviations * deviates)).sum(dim=2)
        mean = self.mean
        return mean + sampling.liveliness * (drawn - mean)


class MixtureHead(nn.Module):
    """From what a network knows of a frame to the mixture of its poses."""

    def __init__(self, inputs: int, columns: int, mixtures: int) -> None:
        super().__init__()
        self.mixtures = mixtures
        self.weights = nn.Linear(inputs, mixtures)
        self.means = nn.Linear(inputs, mixtures * columns)
        self.deviations = nn.Linear(inputs, mixtures * columns)
        nn.init.constant_(self.deviations.bias, math.log(math.expm1(_FIRST_DEVIATION)))
        nn.init.normal_(self.deviations.weight, std=1e-3)

    def start_at(self, mean: Tensor) -> None:
        """Let every component begin near a pose (C,), no two at the same place."""
        with torch.no_grad():
            apart = _APART * torch.randn(self.mixtures, len(mean))
            self.means.bias.copy_((mean + apart).flatten())

    def forward(self, hidden: Tensor) -> Mixture:
        """The mixture of each frame, hidden (B, n, H)."""
        shape = (*hidden.shape[:2], self.mixtures, -1)
        deviations = FLOOR + nn.functional.softplus(self.deviations(hidden))
        log_weights = torch.log_softmax(self.weights(hidden), dim=-1)
        return Mixture(log_weights, self.means(hidden).view(shape), deviations.view(shape))


def slow_noise(
    sampling: SamplingOptions, frames: int, columns: int, fps: float, seconds: Array | None = None
) -> NDArray[np.float32]:
    """Gaussian noise of deviation 1 that changes slowly, (frames, columns).

    A frame's numbers follow from the seed and the frame's number alone, whatever the pieces are.

    Args:
        seconds: length of each column's window (columns,); SLOW_SECONDS where None.
    """
    lengths = np.full(columns, SLOW_SECONDS) if seconds is None else seconds
    reaches = np.maximum(1, np.round(lengths * fps / 2)).astype(int)
    reach = int(reaches.max())
    windows = np.stack([np.pad(_window(own), reach - own) for own in reaches])
    first, last = sampling.first - reach, sampling.first + frames + reach
    blocks = [
        np.random.default_rng([sampling.seed, _BEFORE_START + block]).standard_normal((_BLOCK, columns))
        for block in range(first // _BLOCK, -(-last // _BLOCK))
    ]
    skip = first - first // _BLOCK * _BLOCK
    white = np.concatenate(blocks)[skip : skip + last - first]
    near = np.lib.stride_tricks.sliding_window_view(white, windows.shape[1], axis=0)
    return np.einsum("tcw,cw->tc", near, windows).astype(np.float32)


def _window(reach: int) -> Array:
    """What white noise is blurred with, (2 reach + 1,), of power 1."""
    window = np.hanning(2 * reach + 3)[1:-1]
    blur: Array = window / np.linalg.norm(window)
    return blur


def _gumbel(noise: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gumbel noise made of Gaussian noise, number by number."""
    from scipy.special import ndtr

    uniform = np.clip(ndtr(noise.astype(np.float64)), 1e-6, 1 - 1e-6)
    return (-np.log(-np.log(uniform))).astype(np.float32)
