"""Validation while training: whole takes predicted, loss, figures, and gains of each region.

A network that errs least stands too still where sound says little, and one that is told to be lively may
tremble where the body only sways. A gain about the mean pose for each region of the body repairs both. The
face is left as it is: how far it moves is a matter of style, and one take's gain would be wrong for the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from studio.features.audio_spec import Floats
from studio.features.examples import Example
from studio.features.motion import FACE, Layout
from studio.metrics import scores
from studio.metrics.scores import REGIONS, in_region
from studio.model._network import Network, SamplingOptions, conditions
from studio.motion import rotation
from studio.training import checkpoint
from studio.training.checkpoint import Model
from studio.training.gather import Gathered
from studio.training.losses import Loss


@dataclass(frozen=True, eq=False)
class ValidationResult:
    """What a validation found.

    Args:
        loss: before gains; it chooses the best epoch.
        figures: metrics of what the kept model would generate.
        gain: (C,) what would be kept beside the weights.
        first: the first take as captured and as predicted, None where there is no take.
    """

    loss: float
    figures: scores.Figures
    gain: Floats
    first: scores.Pair | None


class Validation:
    """Predicts the validation takes with the weights that would be kept.

    Args:
        data: the takes.
        model: the model in training.
        loss: of the recipe.
        device: where its weights are.
    """

    def __init__(self, data: Gathered, model: Model, loss: Loss, device: torch.device) -> None:
        self._data, self._model, self._loss, self._device = data, model, loss, device

    def __call__(self, average: Mapping[str, Tensor]) -> ValidationResult:
        """Validate; `average` takes the place of the network's own weights where it has some."""
        val, network = self._data.val, self._model.network
        # The averaged weights are those that are kept, so they and not the live ones are judged.
        with swapped(network, average), torch.no_grad():
            network.eval()
            expected = [predict(network, e, self._device) for e in val]
            # People see what is drawn; the expected poses only choose the epoch.
            seen = [drawn(network, e, self._device) for e in val] if network.draws else expected
        losses = [self._take_loss(p, e) for p, e in zip(expected, val, strict=True)]
        gain = self._gain(seen, expected if network.draws else None)
        mean = self._data.layout.scaled_mean.astype(np.float32)
        # Drawn poses scatter about the expected ones; others deviate from the mean pose.
        around = expected if network.draws else [mean] * len(seen)
        kept = [at + gain * (p - at) for at, p in zip(around, seen, strict=True)]
        pairs = [self._pair(p, e) for p, e in zip(kept, val, strict=True)]
        # By frames: two takes of ten seconds must not outweigh one of ten minutes.
        loss = float(np.average(losses, weights=[example.frames for example in val]))
        return ValidationResult(loss, scores.score(pairs), gain, pairs[0] if pairs else None)

    def _gain(self, seen: list[Floats], around: list[Floats] | None) -> Floats:
        """What deviations from the mean pose, or from what is around, would be multiplied by, (C,)."""
        target, layout = self._model.recipe.training.liveliness, self._data.layout
        # At 0 the gains are not even measured: the recipe asks for the motion as it was learnt.
        if not target or not self._model.network.gains:
            return np.ones(layout.width, dtype=np.float32)
        found = region_gains(seen, self._data.val, layout, around)
        gain: Floats = (1 + target * (found - 1)).astype(np.float32)
        return gain

    def _take_loss(self, predicted: Floats, example: Example) -> float:
        weight = example.grid.valid[:, None] * example.mask[None]
        tensors = (torch.from_numpy(v)[None].to(self._device) for v in (predicted, example.values, weight))
        return float(self._loss(*tensors))

    def _pair(self, predicted: Floats, example: Example) -> scores.Pair:
        motion = self._data.layout.motion(predicted, example.grid.motion.times)
        return scores.Pair(example.grid.motion, motion, example.grid.valid)


PIECE_FRAMES = 1024
"""Frames predicted at once."""


def drawn(network: Network, example: Example, device: torch.device | str = "cpu") -> Floats:
    """Scaled poses (T, C) as generating draws them where nothing else is asked for."""
    return predict(network, example, device, SamplingOptions())


def predict(
    network: Network,
    example: Example,
    device: torch.device | str = "cpu",
    sampling: SamplingOptions | None = None,
) -> Floats:
    """Scaled poses (T, C) of a whole example in the average style, in pieces, as generating does it.

    With the moods that stand on it, or a labelled take would be held against motion without its label.

    Expected ones, without chance, where there is no sampling.
    """
    k, out, state = network.sizes.steps_per_frame, [], None
    average = torch.zeros(1, dtype=torch.long, device=device)
    for first in range(0, example.frames, PIECE_FRAMES):
        last = min(first + PIECE_FRAMES, example.frames)
        # Networks that read both ways see a margin on either side, else each piece's ends would differ.
        a, b = first - network.margin, last + network.margin
        rows = example.rows(a * k - network.before, (b - a) * k + network.before + network.after)
        here = None if sampling is None else replace(sampling, first=a)
        style = average
        if example.moods is not None and network.sizes.moods:
            moods = example.moods[np.clip(np.arange(a, b), 0, example.frames - 1)]
            style = conditions(average, torch.from_numpy(moods)[None].to(device), network.sizes.styles)
        poses, state = network.predict(torch.from_numpy(rows)[None].to(device), state, style, here)
        out.append(poses[0, network.margin : network.margin + last - first].cpu().numpy())
    return np.concatenate(out)


def enliven(path: Path, takes: Sequence[Example], target: float) -> None:
    """Give a kept model the gains that match how lively its regions are to the capture, once.

    Args:
        path: the model's file, rewritten.
        takes: not learnt from.
        target: 1 for the whole gain, 0 for none.
    """
    made = checkpoint.load_model(path)
    # Given once: measured again, the gains of gained motion would be multiplied.
    if not made.network.gains or not bool((made.network.gain == 1).all()):
        return
    with torch.no_grad():
        expected = [predict(made.network, example) for example in takes]
        if made.network.draws:
            poses = [drawn(made.network, example) for example in takes]
            gain = region_gains(poses, takes, made.layout, expected)
        else:
            gain = region_gains(expected, takes, made.layout)
    made.network.gain.copy_(torch.from_numpy(1 + target * (gain - 1)).float())
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
                    # In place: the optimiser holds on to these very tensors.
                    self._own[name] = parameter.detach().clone()
                    parameter.copy_(weights[name])


CALMEST, LIVELIEST = 0.3, 3.0
"""No region's motion is scaled further than this: what is more wrong than that, a gain cannot mend."""
CALM = 0.95
"""Share of the captured motion aimed at: of two gains as far from the truth, the lower errs less."""
_TINY = 1e-12


def regions(layout: Layout) -> NDArray[np.str_]:
    """The region each column belongs to, (C,): "face", "head", "torso", "arms", "rest" or "hips"."""
    found = ["face"] * int((layout.groups == FACE).sum())
    for bone in layout.learnt_bones:
        name = layout.bone_names[bone]
        found += [next((r for r in REGIONS if in_region(name, r)), "rest")] * 6
    return np.array(found + ["hips"] * (layout.width - len(found)))


def region_gains(
    predicted: Sequence[Floats],
    examples: Sequence[Example],
    layout: Layout,
    around: Sequence[Floats] | None = None,
) -> Floats:
    """What each column's deviation from the mean pose is to be multiplied by, (C,).

    For each region of the body the gain that gives it CALM times the captured motion (mean angle turned, or
    way of the hips, from frame to frame), but not more deviation than captured: a trembling tracker looks
    lively by motion alone. Within CALMEST and LIVELIEST; 1 for the face and where the takes say nothing.

    Args:
        predicted: scaled poses (T, C) of each example, gains not applied.
        examples: takes not learnt from.
        layout: their columns.
        around: expected poses (T, C), where the gain is of how far predicted ones are from them: what these
            move of themselves, and what chance adds to it, go together as squares.
    """
    gains, of = np.ones(layout.width, dtype=np.float32), regions(layout)
    for region in sorted(set(of.tolist()) - {"face"}):
        chosen = np.flatnonzero(of == region)
        found = _total(predicted, examples, layout, chosen)
        # Over all takes together: a single one may not move a region at all.
        captured = _total([e.values for e in examples], examples, layout, chosen)
        target = captured * [CALM, 1.0]
        if around is not None:
            still = _total(around, examples, layout, chosen)
            found, target = _beside(found, still), _beside(target, still)
        # What never moves on validation says nothing of how far it should.
        if min(*found, *captured) > _TINY:
            widest = max(1.0, target[1] / found[1])
            gains[chosen] = np.clip(min(target[0] / found[0], widest), CALMEST, LIVELIEST)
    return gains


def _beside(whole: NDArray[np.float64], part: NDArray[np.float64]) -> NDArray[np.float64]:
    """What has to come beside a part to make a whole."""
    return np.sqrt(np.maximum(np.square(whole) - np.square(part), 0.0))


def _total(
    poses: Sequence[Floats], examples: Sequence[Example], layout: Layout, chosen: NDArray[np.int64]
) -> NDArray[np.float64]:
    """How far the columns of a region move and deviate over some takes, (2,)."""
    pairs = zip(poses, examples, strict=True)
    moved, squares = np.sum([_liveliness(p, e, layout, chosen) for p, e in pairs], axis=0)
    return np.array([moved, np.sqrt(squares)])


def _liveliness(
    poses: Floats, example: Example, layout: Layout, chosen: NDArray[np.int64]
) -> NDArray[np.float64]:
    """How far the columns of a region move and how wide they are, sums over the frames that count."""
    counts = (example.grid.valid[:, None] * example.mask[None])[:, chosen]
    values = layout.natural(poses)[:, chosen]
    both = counts[1:] * counts[:-1]
    # Rotations come in sixes; only the hips' place has three columns.
    if len(chosen) % 6:  # the hips' place
        moved = np.abs(np.diff(values, axis=0))
    else:
        turns = rotation.from_6d(values.reshape(len(values), -1, 6))
        moved, both = rotation.angle_between(turns[:-1], turns[1:]), both[:, ::6]
    mean = (values * counts).sum(axis=0) / np.maximum(counts.sum(axis=0), 1)
    return np.array([(moved * both).sum(), np.square((values - mean) * counts).sum()])
