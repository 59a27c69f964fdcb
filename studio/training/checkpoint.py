"""Weights on disk: safetensors with everything needed to use them in their header, never a pickle."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from studio import model, registry
from studio.errors import RequestError, StudioError
from studio.features.motion import Layout
from studio.model._network import Network, Sizes
from studio.take import safe_file
from studio.training import recipe as recipes
from studio.training.recipe import Recipe

FORMAT_VERSION = 2
"""2 added styles; files of version 1 have none and are read as they are."""
BEST, LAST = "best.safetensors", "last.safetensors"
_KEY = "saia"
_MOST_PARAMETERS = 500_000_000


@dataclass(frozen=True, eq=False)
class Model:
    """A network with what it needs to be used.

    Args:
        network: the weights in their form.
        recipe: how it was made.
        layout: what its columns mean.
        fps: frames a second it predicts.
        epoch: when its weights were taken.
        styles: names of the styles it tells apart besides the average.
        style: the one used unless another is asked for, "" for the average.
    """

    network: Network
    recipe: Recipe
    layout: Layout
    fps: Fraction
    epoch: int = 0
    styles: tuple[str, ...] = ()
    style: str = ""


@dataclass(frozen=True, eq=False)
class TrainingState:
    """Where a training stood: tensors of network, optimiser and averaged weights, and plain facts."""

    network: dict[str, Tensor]
    optimiser: dict[str, Tensor]
    average: dict[str, Tensor]
    facts: dict[str, Any]


def build_network(recipe: Recipe, layout: Layout, fps: Fraction, styles: int = 0) -> Network:
    """A fresh network for a recipe, telling a number of styles apart.

    Raises:
        RequestError: the recipe names no model there is, or gives it settings it does not have.
    """
    module = registry.load(model, recipe.model, "model")
    sound = recipe.sound
    faces = len(layout.learnt_shapes)
    sizes = Sizes(sound.width, layout.width, sound.steps_per_frame, sound.window, float(fps), styles, faces)
    try:
        return module.build(sizes, **recipe.network)
    except (TypeError, ValueError, RuntimeError, MemoryError) as error:
        what = f"The network {recipe.model} cannot be built as asked: {error}."
        raise RequestError(what, "Check the recipe's network settings.") from error


def save_model(path: Path, made: Model, weights: Mapping[str, Tensor] | None = None) -> None:
    """Write a model in one piece.

    Args:
        path: where to.
        made: the model.
        weights: to keep instead of the network's own (the averaged ones).
    """
    facts = {
        "version": FORMAT_VERSION,
        "recipe": made.recipe.as_dict(),
        "layout": made.layout.as_dict(),
        "fps": [made.fps.numerator, made.fps.denominator],
        "epoch": made.epoch,
        "styles": list(made.styles),
        "style": made.style,
    }
    _write(path, dict(weights or made.network.state_dict()), facts)


def load_model(path: Path) -> Model:
    """A model from a file; nothing in the file is executed.

    Raises:
        StudioError: it is missing, damaged, cut short, or of a newer version.
    """
    tensors, facts = _read(path)
    try:
        recipe, layout = recipes.from_dict(facts["recipe"]), Layout.from_dict(facts["layout"])
        fps = Fraction(*map(int, facts["fps"]))
        styles, style = tuple(map(str, facts.get("styles", ()))), str(facts.get("style", ""))
        if style and style not in styles:
            raise ValueError("the default style is not among the styles")
        if sum(t.numel() for t in tensors.values()) > _MOST_PARAMETERS or not 0 < fps <= 1000:
            raise ValueError("sizes are not plausible")
        with torch.device("meta"):  # a hostile header must not make us fill the memory first
            network = build_network(recipe, layout, fps, len(styles))
        network.load_state_dict(tensors, assign=True)
        epoch = int(facts.get("epoch", 0))
    except (
        KeyError,
        TypeError,
        ValueError,
        RuntimeError,
        ArithmeticError,
        AttributeError,
        StudioError,
    ) as error:
        raise _damaged(path) from error
    for parameter in network.parameters():
        parameter.requires_grad_(False)
    return Model(network.eval(), recipe, layout, fps, epoch, styles, style)


def save_state(path: Path, state: TrainingState) -> None:
    """Write where a training stands, in one piece."""
    tensors = {
        f"{part}.{name}": tensor
        for part in ("network", "optimiser", "average")
        for name, tensor in getattr(state, part).items()
    }
    _write(path, tensors, {"version": FORMAT_VERSION, **state.facts})


def load_state(path: Path) -> TrainingState:
    """Where a training stood.

    Raises:
        StudioError: it is missing, damaged, cut short, or of a newer version.
    """
    tensors, facts = _read(path)
    parts: dict[str, dict[str, Tensor]] = {"network": {}, "optimiser": {}, "average": {}}
    for key, tensor in tensors.items():
        part, _, name = key.partition(".")
        if part not in parts:
            raise _damaged(path)
        parts[part][name] = tensor
    return TrainingState(**parts, facts=facts)


def optimiser_tensors(optimiser: torch.optim.Optimizer) -> dict[str, Tensor]:
    """An optimiser's state as flat tensors: "3.exp_avg" is that of the fourth parameter."""
    return {
        f"{index}.{name}": value if isinstance(value, Tensor) else torch.tensor(float(value))
        for index, state in optimiser.state_dict()["state"].items()
        for name, value in state.items()
    }


def restore_optimiser(optimiser: torch.optim.Optimizer, tensors: Mapping[str, Tensor]) -> None:
    """Give an optimiser the state `optimiser_tensors` took."""
    state: dict[int, dict[str, Tensor]] = {}
    for key, tensor in tensors.items():
        index, _, name = key.partition(".")
        state.setdefault(int(index), {})[name] = tensor
    optimiser.load_state_dict({**optimiser.state_dict(), "state": state})


def _write(path: Path, tensors: dict[str, Tensor], facts: dict[str, Any]) -> None:
    # Cloned: safetensors refuses tensors that share memory, and "best" must never alias live weights.
    plain = {name: tensor.detach().to("cpu", copy=True).contiguous() for name, tensor in tensors.items()}
    with safe_file.written(path) as beside:
        save_file(plain, str(beside), metadata={_KEY: json.dumps(facts, ensure_ascii=False)})


def _read(path: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    if not path.is_file():
        raise StudioError(
            f"The run {path.parent.name} has no {path.name} yet.", "Train it, or choose another run."
        )
    try:
        with safe_open(str(path), framework="pt", device="cpu") as file:
            facts = json.loads((file.metadata() or {})[_KEY])
            version = facts["version"]
            if isinstance(version, int) and version > FORMAT_VERSION:
                raise safe_file.newer(path)
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
    except (SafetensorError, OSError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise _damaged(path) from error
    return tensors, facts


def _damaged(path: Path) -> StudioError:
    return StudioError(
        f"{path.name} of the run {path.parent.name} is damaged.", "Train again, or restore it from a backup."
    )
