"""Weights on disk: safetensors with everything needed to use them in their header, never a pickle."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor
from torch.overrides import TorchFunctionMode

from studio import model, registry
from studio.errors import RequestError, StudioError, say
from studio.features.motion import Layout
from studio.files import atomic
from studio.model._mixture import MATCHED
from studio.model._network import Network, Sizes
from studio.training import recipe as recipes
from studio.training import styles
from studio.training.recipe import Recipe, UnusableRunError
from studio.training.recipe_values import check_kind
from studio.training.styles import FittedStyle

FORMAT_VERSION = 4
"""2 added styles; files of version 1 have none and are read as they are. 3 gave FaceFormer's weights the
names that transformers have elsewhere; older ones are renamed while they are read.
4 added moods and bodies that play captured takes; a file without either is written as 3."""
BEST, LAST = "best.safetensors", "last.safetensors"
_KEY = "saia"
_OLD_NAMES = (
    (re.compile(r"(^|\.)ear\.widen\."), r"\1encoder.project."),
    (re.compile(r"(^|\.)ear\."), r"\1encoder."),
    (re.compile(r"(^|\.)(layers\.\d+\.)look\."), r"\1\2self_qkv."),
    (re.compile(r"(^|\.)(layers\.\d+\.)looked\."), r"\1\2self_out."),
    (re.compile(r"(^|\.)(layers\.\d+\.)ask\."), r"\1\2cross_q."),
    (re.compile(r"(^|\.)(layers\.\d+\.)sound\."), r"\1\2cross_kv."),
    (re.compile(r"(^|\.)(layers\.\d+\.)listened\."), r"\1\2cross_out."),
    (re.compile(r"(^|\.)(layers\.\d+\.)widen\."), r"\1\2ffn_in."),
    (re.compile(r"(^|\.)(layers\.\d+\.)narrow\."), r"\1\2ffn_out."),
)
"""Names of weights up to version 2 and since; in a training's state, "network." or "average." leads."""
_MOST_PARAMETERS = 500_000_000
_LARGEST_WEIGHT = 1e12
"""No training ever comes near to it."""
_SLOWEST, _FASTEST, _FINEST = 0.5, 250, 250_000
"""Frames a second that can have been learnt, and the largest denominator of them as a fraction."""


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
        moods: names of the moods it was taught, those of its network.
        fitted: styles it was shown when it was finished, numbered behind those of the network.
    """

    network: Network
    recipe: Recipe
    layout: Layout
    fps: Fraction
    epoch: int = 0
    styles: tuple[str, ...] = ()
    style: str = ""
    fitted: tuple[FittedStyle, ...] = ()
    moods: tuple[str, ...] = ()

    @property
    def style_names(self) -> tuple[str, ...]:
        """Names to ask for a style by, "average" first; empty where there are no styles."""
        names = (*self.styles, *(one.name for one in self.fitted))
        return (styles.AVERAGE, *names) if names else ()

    def style_index(self, name: str | None, run: str) -> int:
        """A style's number, 0 for the average; None gives the one used by itself.

        Raises:
            RequestError: the model does not know it; `run` is what the sentence calls the model.
        """
        return styles.index_of(name, self.style_names[1:], self.style, run)

    def style_name(self, index: int) -> str:
        """The name of a style by its number."""
        return self.style_names[index] if index else styles.AVERAGE

    def in_mix(self, mix: Sequence[tuple[str, float]], run: str) -> tuple[Model, NDArray[np.float32]]:
        """The model as it moves in a mix of styles, and how much of each its network is told.

        Args:
            mix: names of styles with their shares.
            run: what sentences call the model.

        Raises:
            RequestError: it does not know one of them, or there is nothing of any.
        """
        total = sum(share for _, share in mix)
        if not 0 < total < float("inf") or min(share for _, share in mix) < 0:
            what = "There is nothing of any style in this mix."
            raise RequestError(what, "Give at least one style a share above 0, such as --mix average:1.")
        told = np.zeros(1 + len(self.styles), dtype=np.float32)
        gain, shift = np.zeros(self.layout.width), np.zeros(self.layout.width)
        for name, share in ((name, share / total) for name, share in mix):
            index = self.style_index(name, run)
            fitted = self.fitted[index - len(told)] if index >= len(told) else None
            told[0 if fitted is not None else index] += share
            gain += share * (fitted.gain if fitted is not None else 1.0)
            shift += share * (fitted.shift if fitted is not None else 0.0)
        return replace(self, layout=FittedStyle("", gain, shift).applied(self.layout)), told

    def in_style(self, index: int) -> tuple[Model, int]:
        """The model as it moves in a style by its number, and the number that its network knows."""
        if index <= len(self.styles):
            return self, index
        fitted = self.fitted[index - len(self.styles) - 1]
        return replace(self, layout=fitted.applied(self.layout)), 0


@dataclass(frozen=True, eq=False)
class TrainingState:
    """Where a training stood: tensors of network, optimiser and averaged weights, and plain facts."""

    network: dict[str, Tensor]
    optimiser: dict[str, Tensor]
    average: dict[str, Tensor]
    facts: dict[str, Any]


class _Unfilled(TorchFunctionMode):
    """Networks are built without the numbers they begin with.

    To draw some for tensors that have no memory torch loads its compiler, which takes over a second.
    """

    def __torch_function__(
        self, func: Any, types: Any, args: tuple[Any, ...] = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        named = kwargs or {}
        if getattr(func, "__module__", "") == "torch.nn.init":
            return named["tensor"] if "tensor" in named else args[0]
        if func is torch.eye:
            return torch.empty(*args)
        return func(*args, **named)


def build_network(recipe: Recipe, layout: Layout, fps: Fraction, styles: int = 0, moods: int = 0) -> Network:
    """A fresh network for a recipe, telling a number of styles apart, and moods where its form knows of them.

    Raises:
        RequestError: the recipe names no model there is, gives it settings it does not have, or asks for more
            than a computer can hold.
    """
    module = registry.load(model, recipe.model, "model")
    for name, parameter in inspect.signature(module.build).parameters.items():
        if parameter.default is not parameter.empty and name in recipe.network:
            check_kind(f"network.{name}", recipe.network[name], parameter.default)
    sound = recipe.sound
    faces = len(layout.learnt_shapes)
    sizes = Sizes(
        sound.width, layout.width, sound.steps_per_frame, sound.window, float(fps), styles, faces, moods
    )
    try:
        with torch.device("meta"), _Unfilled():  # its sizes alone, without the memory
            probe = module.build(sizes, **recipe.network)
            large = sum(t.numel() for t in probe.state_dict().values())
        if large > _MOST_PARAMETERS:
            what = say(
                "The network {model} would have {billions} billion weights.",
                model=recipe.model,
                billions=f"{large / 1e9:.1f}",
            )
            raise RequestError(what, "Lower its sizes in the recipe's network settings.")
        return module.build(sizes if probe.knows_moods else replace(sizes, moods=0), **recipe.network)
    except (TypeError, ValueError, RuntimeError, MemoryError) as error:
        what = say("The network {model} cannot be built as asked: {error}.", model=recipe.model, error=error)
        raise RequestError(what, "Check the recipe's network settings.") from error


def version_of(made: Model) -> int:
    """The version a model's files are written as: the oldest whose programs can use them.

    Programs of before 2027 can neither leave moods away nor build such a body, and say that it is newer.
    """
    return FORMAT_VERSION if made.moods or made.recipe.network.get("body") == MATCHED else 3


def save_model(path: Path, made: Model, weights: Mapping[str, Tensor] | None = None) -> None:
    """Write a model in one piece.

    Args:
        path: where to.
        made: the model.
        weights: to keep instead of the network's own (the averaged ones).
    """
    facts = {
        "version": version_of(made),
        "recipe": made.recipe.as_dict(),
        "layout": made.layout.as_dict(),
        "fps": [made.fps.numerator, made.fps.denominator],
        "epoch": made.epoch,
        "styles": list(made.styles),
        "style": made.style,
        "moods": list(made.moods),
        # Programs of before 2027 pass over it, and know the run without these styles.
        "fitted": [one.as_dict() for one in made.fitted],
    }
    _write(path, dict(weights or made.network.state_dict()), facts)


def load_model(path: Path) -> Model:
    """A model from a file; nothing in the file is executed.

    Raises:
        UnusableRunError: it asks for what is not possible.
        StudioError: it is missing, damaged, cut short, or of a newer version.
    """
    tensors, facts = _read(path)
    try:
        recipe, layout = recipes.from_dict(facts["recipe"]), Layout.from_dict(facts["layout"])
        fps = frame_rate_of(facts)
        names, style = tuple(map(str, facts.get("styles", ()))), str(facts.get("style", ""))
        if style and style not in names:
            raise ValueError("the default style is not among the styles")
        moods = tuple(map(str, facts.get("moods", ())))
        fitted = tuple(FittedStyle.from_dict(one, layout.width) for one in facts.get("fitted", ()))
        # Before anything is built: the file may come from anybody.
        if sum(t.numel() for t in tensors.values()) > _MOST_PARAMETERS:
            raise ValueError("sizes are not plausible")
        with torch.device("meta"), _Unfilled():  # a hostile header must not make us fill the memory first
            network = build_network(recipe, layout, fps, len(names), len(moods))
        if network.sizes.moods != len(moods):
            raise ValueError("moods that the network does not know")
        # Assigned: a network on the meta device has no memory to copy into.
        network.load_state_dict(tensors, assign=True)
        if not all(map(_is_learnt, network.parameters())):
            raise ValueError("weights that no training arrives at")
        epoch = int(facts.get("epoch", 0))
    except RequestError as error:
        raise UnusableRunError(path.parent.name, error.what) from error
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
        # Only used from here on; gradients would be kept for nothing.
        parameter.requires_grad_(False)
    return Model(network.eval(), recipe, layout, fps, epoch, names, style, fitted, moods)


def fitted_names(path: Path) -> tuple[str, ...]:
    """Names of the styles that a model was shown, without reading its weights; none where it has no file."""
    unreadable = (SafetensorError, OSError, KeyError, TypeError, ValueError, RecursionError)
    with suppress(*unreadable), safe_open(str(path), framework="pt", device="cpu") as file:
        return tuple(str(one["name"]) for one in json.loads((file.metadata() or {})[_KEY])["fitted"])
    return ()


def _is_learnt(weights: Tensor) -> bool:
    """Whether numbers may have been learnt: one damaged byte can make 1e37 of a weight."""
    return bool((weights.abs() < _LARGEST_WEIGHT).all())  # False for NaN


def frame_rate_of(facts: Mapping[str, Any]) -> Fraction:
    """The frames a second in a file's facts.

    Raises:
        RequestError: nobody learns at that rate.
        KeyError, TypeError, ValueError, ArithmeticError: there is none.
    """
    # Numerator and denominator: 29.97 as a float would drift by a frame in some hours.
    fps = Fraction(*map(int, facts["fps"]))
    if not _SLOWEST <= fps <= _FASTEST or fps.denominator > _FINEST:
        what = say("{fps} frames a second are not possible.", fps=f"{min(float(fps), 1e9):g}")
        raise RequestError(
            what, say("Choose {slowest} to {fastest}.", slowest=f"{_SLOWEST:g}", fastest=_FASTEST)
        )
    return fps


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
        # safetensors holds tensors alone, and some optimisers keep plain numbers in their state.
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
    with atomic.written(path) as beside:
        save_file(plain, str(beside), metadata={_KEY: json.dumps(facts, ensure_ascii=False)})


def _read(path: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    if not path.is_file():
        raise StudioError(
            say("The run {folder} has no {name} yet.", folder=path.parent.name, name=path.name),
            "Train it, or choose another run.",
        )
    try:
        with safe_open(str(path), framework="pt", device="cpu") as file:
            facts = json.loads((file.metadata() or {})[_KEY])
            version = facts["version"]
            if isinstance(version, bool) or not isinstance(version, int) or version < 1:
                raise ValueError("no version")
            if version > FORMAT_VERSION:
                raise atomic.newer(path)
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (no mapping)
            if version < 3:
                tensors = {_current_name(name): tensor for name, tensor in tensors.items()}
    except (SafetensorError, OSError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise _damaged(path) from error
    return tensors, facts


def _current_name(name: str) -> str:
    for old, new in _OLD_NAMES:
        name = old.sub(new, name)
    return name


def _damaged(path: Path) -> StudioError:
    return StudioError(
        say("{name} of the run {folder} is damaged.", name=path.name, folder=path.parent.name),
        "Train again, or restore it from a backup.",
    )
