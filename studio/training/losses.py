"""Loss functions on scaled columns, by groups of channels.

Groups are channels (face, body), never slices of the batch, and channels a take lacks do not count.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from studio.features.motion import FACE, Layout
from studio.training.recipe import LossSettings

# Within a square root: its slope at 0 is infinite, and one still channel would make every gradient NaN.
_TINY = 1e-8
_QUIET_SHAPE, _QUIET_BODY = 0.02, 0.002
"""Added to deviations before they are balanced, so that what hardly moves does not count for too much."""


@dataclass(frozen=True, eq=False)
class Opening:
    """How far the mouth is open, of scaled columns: columns times weights, plus bias, in deviations.

    Args:
        weights: (C,), 0 for all columns but those that open or seal the mouth.
        bias: added to their sum.
        closed: at most this counts as closed.
    """

    weights: Tensor
    bias: float
    closed: float

    def of(self, poses: Tensor) -> Tensor:
        """(..., C) to (...)."""
        opening: Tensor = poses @ self.weights + self.bias
        return opening


@dataclass(frozen=True)
class Group:
    """Columns that share weights: their indices, the weights, and the cosine's weight and target."""

    columns: Tensor
    weight: float
    velocity: float
    variance: float
    cosine: float
    theta: float


class Loss:
    """The loss of a recipe.

    Columns are first multiplied by their own weights (`balance`; cosines are taken without).
    For each group: w point(y, t) + w velocity point(dy, dt) + w variance (sd(y) - sd(t))^2 + c |theta -
    cos(y_{t-1}, y_t)|, where d is the change from frame to frame.
    Source: velocity as in Karras et al. 2017; the cosine term as in Tian et al. 2019 (theta = 1) and the SAIA
    reports (theta < 1, weights for face and body); Huber 1964 with delta 1.

    Args:
        settings: the recipe's.
        layout: which column belongs to which group.
        shift: (C,) added before cosines, so that they are taken between poses, not between
            deviations from the mean pose.
        device: where the columns live.
        balance: (C,) each column's weight; `column_weights` gives it.
        opening: of the mouth; None where no column says so.
    """

    def __init__(
        self,
        settings: LossSettings,
        layout: Layout,
        shift: Tensor,
        device: torch.device | str = "cpu",
        balance: Tensor | None = None,
        opening: Opening | None = None,
    ) -> None:
        self.settings = settings
        # One process alone averages nothing; `shared` replaces this where there are several.
        self._averaged: Callable[[Tensor], Tensor] = lambda number: number
        self.shift = shift.to(device)
        self.balance = (torch.ones(layout.width) if balance is None else balance).to(device)
        self._opening = None
        if opening is not None and settings.closures:
            self._opening = replace(opening, weights=opening.weights.to(device))
        # Everything that is no blend shape goes with the body, the place of the hips too.
        groups = torch.from_numpy(layout.groups)
        face, body = (groups == FACE).nonzero()[:, 0], (groups != FACE).nonzero()[:, 0]
        s = settings
        self._of_batch = s.variance_over == "batch"
        slow = s.of_body("velocity")
        of_face = Group(face.to(device), s.face, s.velocity, s.face_variance, s.face_cosine, s.face_theta)
        of_body = Group(body.to(device), s.body, slow, s.body_variance, s.body_cosine, s.body_theta)
        # A face-only recording has no body columns, and a mean of nothing is NaN.
        self.groups = [group for group in (of_face, of_body) if len(group.columns)]

    def __call__(self, predicted: Tensor, truth: Tensor, weight: Tensor) -> Tensor:
        """The loss of a batch.

        Args:
            predicted, truth: scaled poses (B, T, C).
            weight: (B, T, C), 0 where a value does not count.

        Returns:
            A scalar.
        """
        total = predicted.new_zeros(())
        for group in self.groups:
            y, t = predicted[..., group.columns], truth[..., group.columns]
            total = total + self._group(y, t, weight[..., group.columns], group)
        if self._opening is not None:
            total = total + self.settings.closures * self._ajar(self._opening, predicted, truth, weight)
        return total

    def _ajar(self, opening: Opening, predicted: Tensor, truth: Tensor, weight: Tensor) -> Tensor:
        """How much further open than captured where the mouth should be closed, and closed where open."""
        captured, found = opening.of(truth), opening.of(predicted)
        # A take that lacks one of the shapes says nothing of its mouth.
        counts = weight[..., opening.weights != 0].amin(dim=-1)
        shut = counts * (captured <= opening.closed)
        ajar = (found - captured).clamp(min=0.0)
        # The second, or the mouth would close by and by wherever that is the safer guess.
        pressed = (opening.closed - found).clamp(min=0.0)
        return self._mean(ajar, shut) + self._mean(pressed, counts - shut)

    def shared(self, averaged: Callable[[Tensor], Tensor]) -> Loss:
        """This loss for one of several processes, each with its own part of the crops.

        The mean of their losses is then the loss of all the crops, however much counts in each part, and the
        mean of their gradients its gradient.

        Args:
            averaged: a number's mean over the processes; each of them must ask for it as often as the others.
        """
        other = copy.copy(self)
        other._averaged = averaged
        return other

    def _group(self, y: Tensor, t: Tensor, weight: Tensor, group: Group) -> Tensor:
        # Cosines are taken of unweighted columns: balance would turn the poses' directions.
        plain = y
        balance = self.balance[group.columns]
        y, posed = y * balance, t
        t = t * balance
        loss = group.weight * self._mean(self._point(y, t), weight)
        # A crop of one frame has no change, no deviation and no neighbour.
        if y.shape[1] < 2:
            return loss
        # A change counts only where both of its frames were captured.
        both = weight[:, 1:] * weight[:, :-1]
        if group.velocity:
            change = self._point(y.diff(dim=1), t.diff(dim=1))
            loss = loss + group.weight * group.velocity * self._mean(change, both)
        if group.variance:
            loss = loss + group.weight * group.variance * self._narrowness(y, t, weight)
        if group.cosine:
            loss = loss + group.cosine * self._stillness(plain, posed, both, group)
        return loss

    def _narrowness(self, y: Tensor, t: Tensor, weight: Tensor) -> Tensor:
        """How far deviations are apart, over each crop or over all of them as one."""
        shared = _as_it_is
        if self._of_batch:
            # As one long crop: short crops of calm moments have no deviation worth matching.
            y, t, weight = (v.flatten(0, 1)[None] for v in (y, t, weight))
            shared = self._everyones
        apart = (_deviation(y, weight, shared) - _deviation(t, weight, shared)).square()
        counting = shared(weight.sum(dim=1)) / shared(weight.new_tensor(float(weight.shape[1])))
        return self._mean(apart, counting)

    def _everyones(self, numbers: Tensor) -> Tensor:
        """Numbers' means over the processes, through which each learns from its own part."""
        # Detached: all_reduce passes no gradients; the difference below puts this process's own back in.
        mean = self._averaged(numbers.detach().clone())
        return mean + (numbers - numbers.detach())

    def _point(self, y: Tensor, t: Tensor) -> Tensor:
        if self.settings.point == "huber":
            return torch.nn.functional.huber_loss(y, t, reduction="none", delta=1.0)
        return (y - t).abs() if self.settings.point == "mae" else (y - t).square()

    def _stillness(self, y: Tensor, t: Tensor, weight: Tensor, group: Group) -> Tensor:
        shift = self.shift[group.columns]
        # A fixed target below 1 asks for motion everywhere; the capture's own asks for it where there was
        # some.
        theta: Tensor | float = group.theta
        if self.settings.theta == "capture":
            theta = _cosine(t + shift, weight)
        return self._mean((theta - _cosine(y + shift, weight)).abs(), weight.amax(dim=-1))

    def _mean(self, values: Tensor, weight: Tensor) -> Tensor:
        # Over the count of all processes, or one with many gaps would weigh as much as a full one.
        return (values * weight).sum() / self._averaged(weight.sum()).clamp(min=1.0)


def column_weights(deviation: Tensor, groups: Tensor, settings: LossSettings) -> Tensor:
    """What columns are multiplied by before errors are taken: small movements are seen as well as large ones.

    w = (deviation + quiet)^-balance, so that squared errors weigh w^2; the mean of w^2 in a group is 1.

    Args:
        deviation: (C,) in training, natural units.
        groups: (C,) each column's group.
        settings: their balance; 0 gives all ones.
    """
    weights = torch.ones_like(deviation)
    for group in set(groups.tolist()):
        chosen = groups == group
        balance = settings.balance if group == FACE else settings.of_body("balance")
        # In natural units, which differ: a shape is a weight, a column of the body a part of a rotation.
        quiet = _QUIET_SHAPE if group == FACE else _QUIET_BODY
        weights[chosen] = (deviation[chosen] + quiet) ** -balance
        # So that `balance` shifts weight between columns and leaves the learning rate's meaning alone.
        weights[chosen] /= weights[chosen].square().mean().sqrt()
    return weights


def _as_it_is(numbers: Tensor) -> Tensor:
    return numbers


def _deviation(values: Tensor, weight: Tensor, shared: Callable[[Tensor], Tensor] = _as_it_is) -> Tensor:
    """Standard deviation over time of each column, (B, C); `shared` gives sums' means over the processes."""
    count = shared(weight.sum(dim=1)).clamp(min=_TINY)
    mean = shared((values * weight).sum(dim=1)) / count
    # Moving the mean changes nothing here, and what a process learns of it would be wrong for the others.
    apart = values - mean.detach()[:, None]
    return (shared((apart.square() * weight).sum(dim=1)) / count + _TINY).sqrt()


def _cosine(poses: Tensor, weight: Tensor) -> Tensor:
    """cos(y_{t-1}, y_t) over the columns that count, (B, T - 1)."""
    a, b = poses[:, :-1] * weight, poses[:, 1:] * weight
    lengths = (a.square().sum(dim=-1) * b.square().sum(dim=-1) + _TINY).sqrt()
    return (a * b).sum(dim=-1) / lengths
