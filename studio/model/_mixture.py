"""Heads that give how likely all poses are, not one pose for a sound, and draw samples: faces and bodies.

A sound asks for little of a body: the same words come with one gesture today and another tomorrow, and the
mean of both is neither. The pose layer gives the expected pose; a head gives how far the body may be from it.
The body's head works in directions in which captured bodies move, uncorrelated in place and in speed, and the
noise in each is as slow as the capture: so samples are about as wide and as fast as what was captured, in
head, torso and arms, and hips and legs still belong to each other. The face is left alone.
Source: Bishop 1994, Mixture Density Networks; proposed in K. J. Cui, SAIA progress report 3, McGill 2023.
Source of the directions: Wiskott and Sejnowski 2002, Slow Feature Analysis.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from studio.errors import RequestError, say
from studio.model._network import SamplingOptions, Sizes

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
        # In logarithms throughout: the density of a hundred columns underflows float32.
        z = (values[:, :, None] - self.means) / self.deviations
        single = -0.5 * z.square() - self.deviations.log() - 0.5 * math.log(2 * math.pi)
        joint = (single * weight[:, :, None]).sum(dim=-1)
        counted = weight.sum().clamp(min=1.0)
        # A frame without any captured value would count with log 1 and dilute the mean.
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
        # The components' share of the noise is slow as well, or the pose would flicker between them.
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
        # Nearly the same deviation for every sound at first, so that the means are learnt before it.
        nn.init.normal_(self.deviations.weight, std=1e-3)

    def start_at(self, mean: Tensor) -> None:
        """Let every component begin near a pose (C,), no two at the same place."""
        with torch.no_grad():
            # At one place all components would get the same gradient and stay one.
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
    # Drawn by blocks with a seed each: a frame in the midst needs only its own block, not all before it.
    skip = first - first // _BLOCK * _BLOCK
    white = np.concatenate(blocks)[skip : skip + last - first]
    near = np.lib.stride_tricks.sliding_window_view(white, windows.shape[1], axis=0)
    return np.einsum("tcw,cw->tc", near, windows).astype(np.float32)


def _window(reach: int) -> Array:
    """What white noise is blurred with, (2 reach + 1,), of power 1."""
    window = np.hanning(2 * reach + 3)[1:-1]
    # Of power 1, so that blurred noise keeps the deviation it was learnt with.
    blur: Array = window / np.linalg.norm(window)
    return blur


def _gumbel(noise: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gumbel noise made of Gaussian noise, number by number."""
    from scipy.special import ndtr

    # Clipped: at 0 or 1 the logarithm is infinite.
    uniform = np.clip(ndtr(noise.astype(np.float64)), 1e-6, 1 - 1e-6)
    return (-np.log(-np.log(uniform))).astype(np.float32)


KINDS = ("plain", "flow", "mixture")
MATCHED = "matched"
"""Plays what was captured, around a network that draws; no head of one."""
DIRECTIONS = 32
"""Directions that are drawn; what goes beyond them follows the expected pose alone."""
WIDTH = 96
STEPS = 8
"""Steps from chance to pose."""
MIXTURES = 4
BOLDNESS = 0.5
"""Deviation of the chance that is drawn from: the rarest poses are those least well learnt."""
PACE = 0.8
"""Windows over those captured: what is drawn less boldly keeps its speed."""
CALM_SECONDS = 0.5
"""A head hears this slowly: gestures that followed each syllable's state would tremble."""
SLOWEST_SECONDS, FASTEST_SECONDS = 6.0, 0.3
"""Of the windows that make chance slow."""
_QUIET = 0.1
"""Share of the mean deviation added to each column's: what hardly moves must not count for too much."""
_NARROW = 0.02
"""A direction narrower than this share of the widest is not drawn: it is the rounding of the others."""
_MOMENT = 8
"""Numbers that say how far from chance to pose a step is."""
_PIECE = 256
_HANN = 2 * np.pi / np.sqrt(3)
"""Noise under a Hann window of W frames changes by this / W deviations a frame."""
_MEAN_OF_NORMAL = np.sqrt(2 / np.pi)
"""Mean size of a normal number of deviation 1."""


class BodyHead(nn.Module):
    """What every head has: the directions, and how slow chance is in each.

    Args:
        sizes: the network's.
    """

    into: Tensor
    out: Tensor
    seconds: Tensor

    def __init__(self, sizes: Sizes) -> None:
        super().__init__()
        self.sizes = sizes
        columns = sizes.columns - sizes.faces
        self.directions = min(DIRECTIONS, columns)
        self.register_buffer("into", torch.eye(self.directions, columns))
        self.register_buffer("out", torch.eye(self.directions, columns))
        self.register_buffer("seconds", torch.ones(self.directions))

    def see(self, stretches: Sequence[Tensor]) -> None:
        """Find the directions of captured poses (T, C), and their speed."""
        bodies = [poses[:, self.sizes.faces :].double() for poses in stretches if len(poses) > 1]
        if not bodies:
            return
        # Whitened first: the slowest directions are then found by turning alone.
        white, back = _whitened(torch.cat(bodies), self.directions)
        # Stretch by stretch: from one take's end to the next one's start is no movement.
        changes = torch.cat([body.diff(dim=0) @ white for body in bodies])
        _, turn = torch.linalg.eigh(changes.T @ changes / len(changes))
        speeds = (changes @ turn).abs().mean(dim=0) / _MEAN_OF_NORMAL
        frames = PACE * _HANN / speeds.clamp(min=1e-6)
        self.into.copy_((white @ turn).T)
        self.out.copy_((back @ turn).T)
        self.seconds.copy_((frames / self.sizes.fps).clamp(FASTEST_SECONDS, SLOWEST_SECONDS))

    def loss(self, known: Tensor, apart: Tensor, weight: Tensor) -> Tensor:
        """How little likely the captured bodies are.

        Args:
            known: of each frame (B, n, H).
            apart: captured less expected poses (B, n, C), scaled.
            weight: (B, n, C), 0 where a value does not count: the body is then where it is expected.
        """
        body, counts = apart[..., self.sizes.faces :], weight[..., self.sizes.faces :]
        return self.surprise(known, (body * counts) @ self.into.T, counts.mean(dim=-1))

    def draw(self, known: Tensor, sampling: SamplingOptions) -> Tensor:
        """How far poses are from the expected ones (B, n, C), scaled; 0 for the face."""
        return nn.functional.pad(self.drawn(known, sampling) @ self.out, (self.sizes.faces, 0))

    def surprise(self, known: Tensor, apart: Tensor, weight: Tensor) -> Tensor:
        """The loss of directions (B, n, R) in frames of a weight (B, n)."""
        raise NotImplementedError

    def drawn(self, known: Tensor, sampling: SamplingOptions) -> Tensor:
        """Directions (B, n, R)."""
        raise NotImplementedError


class FlowHead(BodyHead):
    """Conditional flow matching, frame by frame: chance is carried to a pose along a learnt velocity.

    Chance that changes slowly comes out as a pose that changes slowly, and the same in any pieces.
    Source: Lipman et al. 2023, Flow Matching for Generative Modeling, arXiv 2210.02747.
    """

    def __init__(self, inputs: int, sizes: Sizes) -> None:
        super().__init__(sizes)
        self.enter = nn.Linear(self.directions + _MOMENT, WIDTH)
        self.know = nn.Linear(inputs, WIDTH)
        self.think = nn.Linear(WIDTH, WIDTH)
        self.leave = nn.Linear(WIDTH, self.directions)

    def surprise(self, known: Tensor, apart: Tensor, weight: Tensor) -> Tensor:
        """|velocity - (pose - chance)|^2 somewhere on the way."""
        # A moment of its own for each frame: a crop then teaches the whole way from noise to pose.
        noise, step = torch.randn_like(apart), torch.rand_like(apart[..., :1])
        there = torch.lerp(noise, apart, step)
        error = (self._velocity(there, step, self.know(known)) - (apart - noise)).square().mean(dim=-1)
        return (error * weight).sum() / weight.sum().clamp(min=1.0)

    def drawn(self, known: Tensor, sampling: SamplingOptions) -> Tensor:
        """Midpoint steps along the velocity."""
        seconds = self.seconds.cpu().numpy()
        noise = slow_noise(sampling, known.shape[1], self.directions, self.sizes.fps, seconds)
        there = BOLDNESS * torch.from_numpy(noise).to(known).expand(len(known), -1, -1)
        known, size = self.know(known), 1.0 / STEPS
        for number in range(STEPS):
            step = torch.full_like(there[..., :1], number * size)
            half = there + 0.5 * size * self._velocity(there, step, known)
            there = there + size * self._velocity(half, step + 0.5 * size, known)
        return there

    def _velocity(self, there: Tensor, step: Tensor, known: Tensor) -> Tensor:
        angles = step * np.pi * torch.arange(1, _MOMENT // 2 + 1).to(step)
        # Sines and cosines: a network reads small differences of a single number badly.
        moment = torch.cat([angles.sin(), angles.cos()], dim=-1)
        x = nn.functional.silu(self.enter(torch.cat([there, moment], dim=-1)) + known)
        left: Tensor = self.leave(nn.functional.silu(self.think(x)))
        return left


class MixedHead(BodyHead):
    """A mixture of Gaussians in the directions."""

    def __init__(self, inputs: int, sizes: Sizes) -> None:
        super().__init__(sizes)
        self.mixture = MixtureHead(inputs, self.directions, MIXTURES)
        self.mixture.start_at(torch.zeros(self.directions))

    def surprise(self, known: Tensor, apart: Tensor, weight: Tensor) -> Tensor:
        """-log p, a frame as heavy as the share of its body that was captured."""
        loss: Tensor = self.mixture(known).loss(apart, weight[..., None].expand_as(apart))
        return loss

    def drawn(self, known: Tensor, sampling: SamplingOptions) -> Tensor:
        """A sample of the mixture."""
        # At 1 here: the liveliness is applied once, by the network around.
        whole = SamplingOptions(sampling.seed, 1.0, sampling.first)
        sample: Tensor = self.mixture(known).sample(whole, self.sizes.fps, self.seconds.cpu().numpy())
        return sample


def body_head(kind: str, inputs: int, sizes: Sizes) -> BodyHead | None:
    """The head of a kind, told so many numbers of a frame; None where nothing is to be drawn.

    That is where the kind is "plain" and where takes have no bones.

    Raises:
        RequestError: there is no such kind.
    """
    if kind not in KINDS:
        raise RequestError(
            say("{kind} is not possible for network.body.", kind=repr(kind)),
            say("Choose {kinds} or {last}.", kinds=", ".join(KINDS), last=MATCHED),
        )
    # A head without body columns would have no directions to draw in.
    if kind == "plain" or sizes.columns <= sizes.faces:
        return None
    return FlowHead(inputs, sizes) if kind == "flow" else MixedHead(inputs, sizes)


def low_passed(course: Tensor, last: Tensor | None, fps: float) -> Tensor:
    """A course (B, n, H) followed without haste: y_t = a y_{t-1} + (1 - a) x_t.

    Args:
        course: what is followed.
        last: where it stood before (B, H); 0 where None.
        fps: frames a second; a = exp(-1 / (CALM_SECONDS fps)).
    """
    keep = float(np.exp(-1.0 / (CALM_SECONDS * fps)))
    at = torch.zeros_like(course[:, 0]) if last is None else last
    parts = []
    for part in torch.split(course, _PIECE, dim=1):  # in pieces: the weights of all with all would not fit
        weights, fading = _weights(part.shape[1], keep, part)
        followed = weights @ part + fading[:, None] * at[:, None]
        parts.append(followed)
        at = followed[:, -1]
    return torch.cat(parts, dim=1)


def _weights(count: int, keep: float, like: Tensor) -> tuple[Tensor, Tensor]:
    """How much each frame hears of each before it (n, n), and of what came before all of them (n,)."""
    ago = np.arange(count)[:, None] - np.arange(count)
    weights = np.where(ago >= 0, (1 - keep) * keep ** np.maximum(ago, 0), 0.0)
    fading = keep ** np.arange(1, count + 1)
    return torch.from_numpy(weights).to(like), torch.from_numpy(fading).to(like)


def _whitened(poses: Tensor, directions: int) -> tuple[Tensor, Tensor]:
    """What makes uncorrelated numbers of deviation 1 of poses (T, C), and poses of them; (C, R) each.

    The widest directions, columns first made more even: a head nods less far than an arm swings.
    """
    deviation = poses.std(dim=0)
    # The root only: fully evened, fingers that tremble would weigh as much as arms.
    even = (deviation + _QUIET * deviation.mean()).clamp(min=1e-9).sqrt()[:, None]
    variances, vectors = torch.linalg.eigh(torch.cov((poses / even.T).T).reshape(len(even), len(even)))
    widths = variances.clamp(min=0.0).sqrt().flip(0)[:directions]
    kept = vectors.flip(1)[:, :directions] * (widths > _NARROW * widths[0])
    return kept / widths.clamp(min=1e-12) / even, kept * widths * even
