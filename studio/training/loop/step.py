"""Optimiser steps on batches of crops, which are drawn from seed and epoch alone; processes share a batch."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import lightning_fabric
import numpy as np
import torch
from torch import Tensor

from studio.features.examples import Crop, CropShape, Example, cut
from studio.model._network import conditions
from studio.training import checkpoint
from studio.training.checkpoint import Model, TrainingState
from studio.training.gather import Gathered
from studio.training.loop.setup import learning_rate, make_optimiser
from studio.training.losses import Loss
from studio.training.recipe import TrainingSettings

MOOD_DROPOUT = 0.1
"""Share of crops learnt without their labels: a take that is labelled throughout still says what none is.
Low, since with unlabelled takes beside it each of them pulls the motion without a mood towards that mood."""
AHEAD = 2
"""Batches that lie ready while a step is taken: cutting and varying crops costs a fifth of it."""


@dataclass(frozen=True, eq=False)
class Batch:
    """This process's share of a step: rows of sound, values, weights (B, ...), styles as for `Network`."""

    rows: Tensor
    values: Tensor
    weight: Tensor
    style: Tensor


class TrainingSteps:
    """Changes a model's weights, step by step.

    Everything random in an epoch follows from the seed and the epoch's number alone, so a resumed training
    goes on exactly as if it had never been interrupted.

    Args:
        fabric: what it computes on.
        data: the takes.
        model: its network is changed, and is where `state` says first.
        loss: of the recipe.
        state: where a run that goes on stood.
    """

    def __init__(
        self,
        fabric: lightning_fabric.Fabric,
        data: Gathered,
        model: Model,
        loss: Loss,
        state: TrainingState | None,
    ) -> None:
        self._fabric, self._data, self._recipe, self._network = fabric, data, model.recipe, model.network
        self.optimiser = make_optimiser(model.network, self._recipe.training)
        self.average: dict[str, Tensor] = {}
        """The running mean of the weights, by name; empty where the recipe has none."""
        if state is not None:
            model.network.load_state_dict(state.network)
            checkpoint.restore_optimiser(self.optimiser, state.optimiser)
            self.average = dict(state.average)
        # After the state is loaded: DDP copies the weights of rank 0 to the others right here.
        self._wrapped, self._wrapped_optimiser = fabric.setup(model.network, self.optimiser)
        # Fabric only wraps forward; without this DDP would never average the gradients.
        self._wrapped.mark_forward_method("learn")
        self._loss = loss.shared(self._averaged)
        # A network with several look-aheads judges the poses of each by the same loss.
        model.network.loss_fn = self._loss
        self.an_epoch = steps_per_epoch(self._recipe.training, data.train)

    def begin_epoch(self, number: int) -> np.random.Generator:
        """Make ready for an epoch; gives what is random in its crops, the same in all processes."""
        seed = self._recipe.training.seed
        # Mixed with the rank: dropout must differ between processes, or they learn from the same masks.
        mixed = np.random.SeedSequence([seed, number, self._fabric.global_rank]).generate_state(1)[0]
        torch.manual_seed(int(mixed))
        self._wrapped.train()
        # Without the rank: all processes draw the same crops and each cuts out its share.
        return np.random.default_rng([seed, number])

    def batches(self, chosen: Sequence[list[Pick]], rng: np.random.Generator) -> Iterator[Batch]:
        """The batches of an epoch, made ahead on a thread of their own, one after the other.

        Args:
            chosen: the crops of each step, of all processes.
            rng: as `begin_epoch` gave it; nobody else may draw from it until all are made.
        """
        # One thread and in order: the crops draw from one generator, and a run must repeat exactly.
        ready: deque[Future[Batch]] = deque()
        with ThreadPoolExecutor(1, "crops") as pool:
            for pick in chosen:
                ready.append(pool.submit(self._batch, pick, rng))
                if len(ready) > AHEAD:
                    yield ready.popleft().result()
            while ready:
                yield ready.popleft().result()

    def take(self, index: int, batch: Batch) -> float:
        """One step; gives its loss, the mean over the processes.

        Args:
            index: of all steps of the training, from 0.
            batch: what to learn from.
        """
        settings, device = self._recipe.training, self._fabric.device
        for group in self.optimiser.param_groups:
            # From the step's number and not from a scheduler's state, so that a resumed run needs none.
            group["lr"] = learning_rate(settings, index, settings.epochs * self.an_epoch)
        rows, values, weight = (part.to(device) for part in (batch.rows, batch.values, batch.weight))
        self._wrapped_optimiser.zero_grad()
        with self._fabric.autocast():  # which Fabric does by itself for forward alone
            predicted, own = self._wrapped.learn(rows, batch.style.to(device), values, weight)
        loss = self._loss(predicted.float(), values, weight) + own.float()
        self._fabric.backward(loss)
        # By Fabric, which unscales the gradients of half precision first.
        if settings.clip:
            self._fabric.clip_gradients(self._wrapped, self._wrapped_optimiser, max_norm=settings.clip)
        self._wrapped_optimiser.step()
        self._update_average(settings.average, index)
        return float(self._averaged(loss.detach()))

    def _batch(self, pick: list[Pick], rng: np.random.Generator) -> Batch:
        """Cut and vary the crops of a step. Runs on the thread of the crops."""
        # All crops, also those of other processes: the generator must stand at the same place everywhere.
        crops = [self._crop(take, first, rng) for take, first in pick]
        style_ids = self._shown_moods(self._shown_styles([take for take, _ in pick], rng), crops, rng)
        # Every n-th crop, so that the shares of two processes differ by one crop at most.
        share = slice(self._fabric.global_rank, None, self._fabric.world_size)
        # A process without a crop learns from the first once more: each must take part in every collective.
        mine, style = crops[share] or crops[:1], style_ids[share] if len(style_ids[share]) else style_ids[:1]
        rows, values, weight = (_stacked(mine, name) for name in ("rows", "values", "weight"))
        return Batch(rows, values, weight, style)

    def _averaged(self, numbers: Tensor) -> Tensor:
        """Numbers' means over the processes."""
        mean = self._fabric.all_reduce(numbers, reduce_op="mean")
        assert isinstance(mean, Tensor)
        return mean

    def _shown_styles(self, takes: list[int], rng: np.random.Generator) -> Tensor:
        """Each crop's style, or now and then the average instead, so that it is learnt as well."""
        style_ids = np.array([self._data.train[take].style for take in takes])
        if self._data.styles:
            style_ids[rng.random(len(style_ids)) < self._recipe.training.style_dropout] = 0
        return torch.from_numpy(style_ids)

    def _shown_moods(self, styles: Tensor, crops: list[Crop], rng: np.random.Generator) -> Tensor:
        """The styles with the moods of each frame, now and then without; the styles where none are told."""
        if not self._network.sizes.moods:
            return styles
        shown = (rng.random(len(crops)) >= MOOD_DROPOUT).astype(np.float32)
        moods = _stacked(crops, "moods") * torch.from_numpy(shown)[:, None, None]
        return conditions(styles, moods, self._network.sizes.styles)

    def _crop(self, take: int, first: int, rng: np.random.Generator) -> Crop:
        recipe, network = self._recipe, self._network
        shape = CropShape(recipe.training.crop_frames, network.before, network.after, recipe.sound)
        return cut(self._data.train[take], first, shape, recipe.augment, rng)

    def _update_average(self, decay: float, step: int) -> None:
        if not decay:
            return
        # Early on the mean must not drag the first weights along: decay grows towards its value.
        keep = min(decay, (1 + step) / (10 + step))
        for name, parameter in self._network.named_parameters():
            old, value = self.average.get(name), parameter.detach()
            self.average[name] = value.clone() if old is None else old.to(value.device).lerp(value, 1 - keep)


def _stacked(crops: list[Crop], name: str) -> Tensor:
    return torch.from_numpy(np.stack([getattr(crop, name) for crop in crops]))


Pick = tuple[int, int]
"""An example's index and the first frame of the crop."""


def steps_per_epoch(settings: TrainingSettings, examples: Sequence[Example]) -> int:
    """Optimiser steps in an epoch; one pass over all frames where the recipe says 0."""
    if settings.steps:
        return settings.steps
    pieces = sum(math.ceil(e.frames / settings.crop_frames) for e in examples)
    return max(1, math.ceil(pieces / settings.crops))


def picks(
    settings: TrainingSettings, examples: Sequence[Example], rng: np.random.Generator
) -> list[list[Pick]]:
    """The crops of each step of an epoch."""
    steps = steps_per_epoch(settings, examples)
    if settings.steps:
        return _anywhere(settings, examples, steps, rng)
    return _one_pass(settings, examples, steps, rng)


def _anywhere(
    settings: TrainingSettings, examples: Sequence[Example], steps: int, rng: np.random.Generator
) -> list[list[Pick]]:
    """Crops from anywhere, long takes more often."""
    # By length: a crop from anywhere is as likely as any other, whichever take it lies in.
    frames = np.array([example.frames for example in examples], dtype=np.float64)
    takes = rng.choice(len(frames), size=(steps, settings.crops), p=frames / frames.sum())
    # A take shorter than a crop is cut from its start and padded.
    spans = np.maximum(frames[takes] - settings.crop_frames + 1, 1)
    firsts = (rng.random(takes.shape) * spans).astype(int)
    both = np.stack([takes, firsts], axis=-1).tolist()
    return [[(take, first) for take, first in step] for step in both]


def _one_pass(
    settings: TrainingSettings, examples: Sequence[Example], steps: int, rng: np.random.Generator
) -> list[list[Pick]]:
    """Every frame once, cut at a different place every epoch; a last odd step is filled up."""
    length, crops = settings.crop_frames, settings.crops
    places = [
        (i, first)
        for i, example in enumerate(examples)
        # Begun before the take by chance, so that crop borders fall elsewhere every epoch.
        for first in range(-int(rng.integers(0, length)), example.frames, length)
    ]
    shuffled = [places[i] for i in rng.permutation(len(places))]
    # DDP waits for all: a last step with fewer crops than processes would hang.
    shuffled += shuffled[: max(0, steps * crops - len(shuffled))]
    return [shuffled[step * crops : (step + 1) * crops] or shuffled[:crops] for step in range(steps)]
