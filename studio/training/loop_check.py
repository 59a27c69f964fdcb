"""How a model in training does on the validation takes: in its best style, with the gains it would keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from studio.features.audio import Floats
from studio.features.examples import Example
from studio.training import metrics, styles
from studio.training.checkpoint import Model
from studio.training.gains import region_gains
from studio.training.gather import Gathered
from studio.training.loop_predict import drawn, part_errors, predict_styles, swapped
from studio.training.losses import Loss


@dataclass(frozen=True, eq=False)
class Checked:
    """What a validation found.

    Args:
        loss: before gains; it chooses the best epoch.
        figures: metrics of what the kept model would generate.
        style: the style that erred least.
        gain: (C,) what would be kept beside the weights.
        first: the first take as captured and as predicted, None where there is no take.
    """

    loss: float
    figures: metrics.Figures
    style: int
    gain: Floats
    first: metrics.Pair | None


class Check:
    """Predicts the validation takes with the weights that would be kept.

    Args:
        data: the takes.
        model: the model in training.
        loss: of the recipe.
        device: where its weights are.
    """

    def __init__(self, data: Gathered, model: Model, loss: Loss, device: torch.device) -> None:
        self._data, self._model, self._loss, self._device = data, model, loss, device
        self._tried = _tried_styles(data)

    def __call__(self, average: Mapping[str, Tensor]) -> Checked:
        """Validate; `average` takes the place of the network's own weights where it has some."""
        val, network = self._data.val, self._model.network
        with swapped(network, average), torch.no_grad():
            network.eval()
            in_styles = [predict_styles(network, e, self._device, self._tried) for e in val]
            errors = [part_errors(p, e, styles.PARTS) for p, e in zip(in_styles, val, strict=True)]
            best = styles.choose(np.concatenate(errors, axis=1))
            expected = [p[best] for p in in_styles]
            style = self._tried[best]
            # People see what is drawn; the expected poses only choose the epoch.
            seen = [drawn(network, e, self._device, style) for e in val] if network.draws else expected
        losses = [self._take_loss(p, e) for p, e in zip(expected, val, strict=True)]
        gain = self._gain(seen, expected if network.draws else None)
        mean = self._data.layout.scaled_mean.astype(np.float32)
        around = expected if network.draws else [mean] * len(seen)
        kept = [at + gain * (p - at) for at, p in zip(around, seen, strict=True)]
        pairs = [self._pair(p, e) for p, e in zip(kept, val, strict=True)]
        loss = float(np.average(losses, weights=[example.frames for example in val]))
        return Checked(loss, metrics.score(pairs), style, gain, pairs[0] if pairs else None)

    def _gain(self, seen: list[Floats], around: list[Floats] | None) -> Floats:
        """What deviations from the mean pose, or from what is around, would be multiplied by, (C,)."""
        wanted, layout = self._model.recipe.training.liveliness, self._data.layout
        if not wanted:
            return np.ones(layout.width, dtype=np.float32)
        found = region_gains(seen, self._data.val, layout, around)
        gain: Floats = (1 + wanted * (found - 1)).astype(np.float32)
        return gain

    def _take_loss(self, predicted: Floats, example: Example) -> float:
        weight = example.grid.valid[:, None] * example.mask[None]
        tensors = (torch.from_numpy(v)[None].to(self._device) for v in (predicted, example.values, weight))
        return float(self._loss(*tensors))

    def _pair(self, predicted: Floats, example: Example) -> metrics.Pair:
        motion = self._data.layout.motion(predicted, example.grid.motion.times)
        return metrics.Pair(example.grid.motion, motion, example.grid.valid)


def _tried_styles(data: Gathered) -> list[int]:
    """The average and the styles with most frames."""
    frames = np.zeros(len(data.styles) + 1)
    for example in data.train:
        frames[example.style] += example.frames
    most = 1 + np.argsort(-frames[1:], kind="stable")[: styles.MOST_TRIED]
    return [0, *sorted(map(int, most))] if data.styles else [0]
