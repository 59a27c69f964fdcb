"""Recipes: how a network is built and trained, as values anyone can read and change (no torch)."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, field, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from studio.errors import RequestError, StudioError, say
from studio.features.audio_spec import AudioSpec
from studio.features.examples import Augmentation
from studio.paths import resource
from studio.training.recipe_values import Scalar, check, check_kind, converted, full_key, pair, toml


@dataclass(frozen=True)
class ChannelSettings:
    """How motion becomes columns.

    Args:
        fps: frames a second that are learnt; 0 takes that of the takes, at most `most_fps`.
        most_fps: faster takes are learnt at a whole fraction of their rate not above this.
        scaling: "group", "minmax" or "none" (see features.motion.fit).
    """

    fps: float = 0.0
    most_fps: float = 30.0
    scaling: str = "group"


@dataclass(frozen=True)
class LossSettings:
    """What is held against a prediction.

    Args:
        point: "mse", "huber" (delta 1) or "mae", per value.
        velocity: weight of the same on frame-to-frame changes, times the group's weight.
        face_variance, body_variance: weights of the squared difference of deviations over a crop, times
            the group's weight; they keep motion alive.
        face, body: weights of blend shapes and of bones.
        face_cosine, body_cosine: weights of |theta - cos(y_{t-1}, y_t)|.
        face_theta, body_theta: the cosine wanted; 1 asks for no change.
        theta: "fixed" uses those numbers, "capture" the cosine of the captured neighbours.
        balance: columns are weighted by 1 / (deviation + a little)^balance before errors are taken, so that
            small movements count too; 0 leaves them.
        body_velocity, body_balance: those of bones where they differ; below 0 the same as of shapes. A body
            sways more slowly than lips move: a high velocity weight keeps it from trembling.
        closures: weight of how much further than captured the mouth is open where it should be closed, and
            of how far closed where it should be open (metrics.face says where that is); errors alone leave
            lips ajar on every p, b and m.
        variance_over: deviations are those of each "crop", or of all crops of a step ("batch").
    """

    point: str = "mse"
    velocity: float = 1.0
    face_variance: float = 0.0
    body_variance: float = 0.0
    face: float = 1.0
    body: float = 1.0
    face_cosine: float = 0.0
    body_cosine: float = 0.0
    face_theta: float = 1.0
    body_theta: float = 1.0
    theta: str = "fixed"
    balance: float = 0.0
    body_velocity: float = -1.0
    body_balance: float = -1.0
    variance_over: str = "crop"
    closures: float = 0.0

    def of_body(self, name: str) -> float:
        """The "velocity" or "balance" that holds for bones."""
        own = float(getattr(self, f"body_{name}"))
        return own if own >= 0 else float(getattr(self, name))


@dataclass(frozen=True)
class TrainingSettings:
    """How weights are found.

    Args:
        epochs: after this many it ends.
        steps: optimiser steps an epoch; 0 is one pass over all frames.
        crops: pieces of takes in a step.
        crop_frames: motion frames in a piece.
        optimiser: "adamw" or "adam".
        learning_rate: its highest value.
        weight_decay: of AdamW.
        schedule: "one_cycle" or "constant".
        clip: gradients are scaled down to this norm; 0 leaves them.
        average: decay of the running mean of the weights, which is what is validated and kept; 0 is off.
        start_at_mean: the output begins at the training mean.
        start_from: "fresh", or "base_voice": what hears begins as it is there, if sizes and rate fit.
        liveliness: 0 leaves predictions as they are, 1 gives each region of the body (head, torso, arms...)
            the motion captured in the validation takes.
        validate_every: epochs between validations.
        style_by: what counts as a style: each "take", each "performer", "none", or "auto": performers
            where several are named with several takes each, else takes.
        style_dropout: share of crops learnt as the average style.
        seed: of everything random.
        accelerator: "auto", "cpu", "cuda" or "mps".
        devices: how many of them on this machine; under torchrun its own count is used.
        precision: of the arithmetic: "auto" mixes in 16 bits on NVIDIA graphics cards and is "32" elsewhere;
            "bf16" and "fp16" mix anywhere. Weights, losses and validation stay 32 bits wide.
    """

    epochs: int = 40
    steps: int = 20
    crops: int = 8
    crop_frames: int = 150
    optimiser: str = "adamw"
    learning_rate: float = 3e-3
    weight_decay: float = 0.01
    schedule: str = "one_cycle"
    clip: float = 1.0
    average: float = 0.0
    start_at_mean: bool = True
    start_from: str = "fresh"
    liveliness: float = 0.0
    validate_every: int = 1
    style_by: str = "none"
    style_dropout: float = 0.3
    seed: int = 1
    accelerator: str = "auto"
    devices: int = 1
    precision: str = "auto"


DEFAULT = "balanced"
PLAIN = "plain"
"""What the form without a name is asked for by."""
FORMAT_VERSION = 1
_INHERITED_LEVELS = 8


@dataclass(frozen=True)
class Recipe:
    """All choices of a training run.

    Args:
        name: the file's name without its suffix.
        title, summary: for people.
        preset: the card it is shown as ("Quick look", "Balanced", "Best"); "" for none.
        minutes: its time on the two cores it was measured on with ten minutes of takes; see `duration` for
            this computer's.
        model: a module of studio.model.
        form: which of its forms, "" for the plain one.
        with_encoder: the form that is meant where its speech encoder is installed; "" for none.
        network: keyword arguments of that module's `build`.
    """

    name: str
    title: str = ""
    summary: str = ""
    preset: str = ""
    minutes: float = 0.0
    model: str = "recurrent"
    form: str = ""
    with_encoder: str = ""
    sound: AudioSpec = field(default_factory=AudioSpec)
    channels: ChannelSettings = field(default_factory=ChannelSettings)
    network: Mapping[str, Scalar] = field(default_factory=dict)
    loss: LossSettings = field(default_factory=LossSettings)
    training: TrainingSettings = field(default_factory=TrainingSettings)
    augment: Augmentation = field(default_factory=Augmentation)

    def as_dict(self) -> dict[str, Any]:
        """Plain values in the shape of a recipe file."""
        facts = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in (*_SECTIONS, "network")}
        facts |= {name: asdict(getattr(self, name)) for name in _SECTIONS}
        return facts | {"network": dict(self.network)}

    def as_toml(self) -> str:
        """The text of a recipe file that gives this recipe again."""
        facts = self.as_dict()
        tables = {name: facts.pop(name) for name in (*_SECTIONS, "network")}
        lines = [f"version = {FORMAT_VERSION}"]
        lines += [f"{key} = {toml(value)}" for key, value in facts.items()]
        for name, table in tables.items():
            lines += ["", f"[{name}]", *(f"{key} = {toml(value)}" for key, value in table.items())]
        return "\n".join(lines) + "\n"

    def settings(self) -> dict[str, Scalar]:
        """Every changeable value by its dotted name ("training.epochs")."""
        facts = self.as_dict()
        named = {f"{name}.{key}": v for name in (*_SECTIONS, "network") for key, v in facts[name].items()}
        return {key: v for key, v in named.items() if key not in _FOUND}

    def with_overrides(self, overrides: Iterable[str]) -> Recipe:
        """This recipe with some values changed.

        Args:
            overrides: "key=value" each; the section may be left out where the key is in one only
                ("epochs=3"). "form=NAME" takes a form the recipe offers and comes before the others.

        Raises:
            RequestError: a key or a value that is not possible.
        """
        pairs = [pair(text) for text in overrides]
        recipe = self
        for key, value in pairs:
            if key == "form":
                recipe = _with_form(recipe, value)
        for key, value in pairs:
            if key != "form":
                recipe = recipe._with_value(full_key(key, recipe.settings()), value)
        check(recipe.settings(), recipe.network, _USUAL)
        return recipe

    def _with_value(self, key: str, text: str) -> Recipe:
        section, _, name = key.partition(".")
        value = converted(key, text, self.settings()[key])
        if section == "network":
            return replace(self, network={**self.network, name: value})
        try:
            return replace(self, **{section: replace(getattr(self, section), **{name: value})})
        except RequestError:
            raise
        except StudioError as error:
            raise RequestError(error.what, error.remedy) from error


@dataclass(frozen=True)
class RecipeInfo:
    """What a list of recipes shows: name, title, summary, preset card and expected minutes."""

    name: str
    title: str
    summary: str
    preset: str
    minutes: float
    forms: tuple[str, ...] = ()
    with_encoder: str = ""


_SECTIONS = {
    "sound": AudioSpec,
    "channels": ChannelSettings,
    "loss": LossSettings,
    "training": TrainingSettings,
    "augment": Augmentation,
}
_FOUND = ("sound.encoder_width", "sound.encoder_digest")
"""What is found out rather than chosen."""
_EMPTY = Recipe("")
_USUAL = _EMPTY.settings()
"""A possible value of every setting, for its kind."""
_PRESET_ORDER = ("Quick look", "Balanced", "Best", "")


def recipes() -> tuple[RecipeInfo, ...]:
    """All recipes that come with the studio, presets first."""
    found = [_info(path) for path in sorted(resource("recipes").glob("*.toml"))]
    return tuple(sorted(found, key=lambda info: (_rank(info.preset), info.minutes)))


def _rank(preset: str) -> int:
    return _PRESET_ORDER.index(preset) if preset in _PRESET_ORDER else len(_PRESET_ORDER)


def _info(path: Path) -> RecipeInfo:
    content = _content(path)
    recipe = usual_recipe(path.stem)
    return RecipeInfo(
        recipe.name,
        recipe.title,
        recipe.summary,
        recipe.preset,
        recipe.minutes,
        tuple(content["forms"]),
        recipe.with_encoder,
    )


def load_recipe(name: str) -> Recipe:
    """A recipe by name.

    Raises:
        RequestError: there is none of that name.
    """
    path = resource("recipes", f"{name}.toml")
    if Path(name).name != name or not path.is_file():
        known = ", ".join(info.name for info in recipes())
        raise RequestError(
            say("There is no recipe called {name}.", name=name), say("Choose one of: {known}.", known=known)
        )
    return _build(name, _content(path))


def usual_recipe(name: str) -> Recipe:
    """A recipe as it is trained unless a form is asked for: with what knows speech, where that is installed.

    Raises:
        RequestError: there is none of that name.
    """
    recipe = load_recipe(name)
    if not recipe.with_encoder:
        return recipe
    from studio.features.encoders import has_whisper

    return _with_form(recipe, recipe.with_encoder) if has_whisper() else recipe


class UnusableRunError(StudioError):
    """A run that is whole, but asks for what cannot be: a sample rate of a billion, say.

    Args:
        name: of the run.
        why: one sentence that names the value.
    """

    def __init__(self, name: str, why: str) -> None:
        super().__init__(
            say("The run {name} cannot be used: {reason}", name=name, reason=why),
            "Train again, or choose another run.",
        )
        self.why = why


def read_recipe(path: Path) -> Recipe:
    """The recipe in a file, as `Recipe.as_toml` wrote it into a run's folder.

    Raises:
        UnusableRunError: it holds values that are not possible.
        StudioError: it is missing, damaged or of a newer version.
    """
    try:
        return _build(path.stem, _content(path))
    except RequestError as error:
        raise UnusableRunError(path.parent.name, error.what) from error


def from_dict(facts: Mapping[str, Any]) -> Recipe:
    """The recipe given by `Recipe.as_dict`."""
    return _build(str(facts.get("name", "")), facts)


def _with_form(recipe: Recipe, form: str) -> Recipe:
    path = resource("recipes", f"{recipe.name}.toml")
    content = _content(path) if path.is_file() else {"forms": {}}
    if form in ("", PLAIN):
        return replace(_build(recipe.name, content), form="")
    if form not in content["forms"]:
        known = ", ".join(content["forms"]) or say("none")
        raise RequestError(
            say("The recipe {recipe} has no form called {form}.", recipe=recipe.name, form=form),
            say("Forms it has: {known}.", known=known),
        )
    return replace(_build(recipe.name, _merged(content, content["forms"][form])), form=form)


@lru_cache(32)
def _parsed(text: str) -> dict[str, Any]:
    """Kept, since every change of the takes asks for all recipes, and a window waits for it."""
    return tomllib.loads(text)


def _content(path: Path, depth: int = 0) -> dict[str, Any]:
    """A recipe file with what it extends underneath."""
    try:
        content = deepcopy(_parsed(path.read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        raise StudioError(
            say("The recipe {path} is missing.", path=path), "Choose another run or recipe."
        ) from error
    except (ValueError, RecursionError, OSError) as error:  # also numbers of more digits than Python reads
        raise StudioError(
            say("The recipe {name} is damaged: {error}.", name=path.name, error=error), "Restore the file."
        ) from error
    version, base = content.pop("version", FORMAT_VERSION), content.pop("extends", "")
    if isinstance(version, int) and version > FORMAT_VERSION:
        raise StudioError(
            say("The recipe {name} was written by a newer Saia Studio.", name=path.name),
            "Update Saia Studio to use it.",
        )
    if (
        isinstance(version, bool)
        or version != FORMAT_VERSION
        or not isinstance(base, str)
        or Path(base).name != base
    ):
        raise StudioError(say("The recipe {name} is damaged.", name=path.name), "Restore the file.")
    content.setdefault("forms", {})
    if base and depth < _INHERITED_LEVELS:
        under = _content(path.with_name(f"{base}.toml"), depth + 1)
        content = _merged(under | {"preset": "", "forms": {}}, content)
    return content


def _merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    result = dict(under)
    for key, value in over.items():
        old = result.get(key)
        result[key] = {**old, **value} if isinstance(value, dict) and isinstance(old, dict) else value
    return result


def _build(name: str, content: Mapping[str, Any]) -> Recipe:
    """The recipe of a file's content.

    Raises:
        RequestError: a value that is not possible.
        StudioError: what is there is no recipe.
    """
    facts = {key: value for key, value in content.items() if key not in ("forms", "version", "name")}
    try:
        for section, kind in _SECTIONS.items():
            facts[section] = kind(**facts.get(section, {}))
        recipe = Recipe(name=str(content.get("name", name)), **facts)
        settings = recipe.settings()
    except (TypeError, ValueError) as error:
        raise StudioError(
            say("The recipe {name} is damaged: {error}.", name=name, error=error), "Restore the file."
        ) from error
    for key in ("title", "summary", "preset", "minutes", "model", "form", "with_encoder"):
        check_kind(key, getattr(recipe, key), getattr(_EMPTY, key))
    check(settings, recipe.network, _USUAL)
    return recipe
