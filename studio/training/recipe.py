"""Recipes: how a network is built and trained, as values anyone can read and change (no torch).

A recipe is one file in resources/recipes; it may extend another and may offer named forms of itself.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from studio.errors import RequestError, StudioError
from studio.features.audio import AudioSpec
from studio.features.variation import Variation
from studio.paths import resource
from studio.training.recipe_settings import ChannelSettings, LossSettings, TrainingSettings
from studio.training.recipe_values import Scalar, check, converted, full_key, pair, toml

DEFAULT = "balanced"
FORMAT_VERSION = 1
_INHERITED_LEVELS = 8


@dataclass(frozen=True)
class Recipe:
    """All choices of a training run.

    Args:
        name: the file's name without its suffix.
        title, summary: for people.
        preset: the card it is shown as ("Quick look", "Balanced", "Best"); "" for none.
        minutes: expected time on two cores with ten minutes of takes.
        model: a module of studio.model.
        form: which of its forms, "" for the plain one.
        network: keyword arguments of that module's `build`.
    """

    name: str
    title: str = ""
    summary: str = ""
    preset: str = ""
    minutes: float = 0.0
    model: str = "recurrent"
    form: str = ""
    sound: AudioSpec = field(default_factory=AudioSpec)
    channels: ChannelSettings = field(default_factory=ChannelSettings)
    network: Mapping[str, Scalar] = field(default_factory=dict)
    loss: LossSettings = field(default_factory=LossSettings)
    training: TrainingSettings = field(default_factory=TrainingSettings)
    augment: Variation = field(default_factory=Variation)

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
        check(recipe.settings(), recipe.network)
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

    @property
    def expected_time(self) -> str:
        """The expected time in words."""
        if self.minutes < 1:
            return "under a minute"
        return f"about {self.minutes:.0f} minute{'s' if round(self.minutes) != 1 else ''}"


_SECTIONS = {
    "sound": AudioSpec,
    "channels": ChannelSettings,
    "loss": LossSettings,
    "training": TrainingSettings,
    "augment": Variation,
}
_FOUND = ("sound.encoder_width", "sound.encoder_digest")
"""What is found out rather than chosen."""
_PRESET_ORDER = ("Quick look", "Balanced", "Best", "")


def recipes() -> tuple[RecipeInfo, ...]:
    """All recipes that come with the studio, presets first."""
    found = [_info(path) for path in sorted(resource("recipes").glob("*.toml"))]
    return tuple(sorted(found, key=lambda info: (_rank(info.preset), info.minutes)))


def _rank(preset: str) -> int:
    return _PRESET_ORDER.index(preset) if preset in _PRESET_ORDER else len(_PRESET_ORDER)


def _info(path: Path) -> RecipeInfo:
    content = _content(path)
    recipe = _build(path.stem, content)
    return RecipeInfo(
        recipe.name, recipe.title, recipe.summary, recipe.preset, recipe.minutes, tuple(content["forms"])
    )


def load_recipe(name: str) -> Recipe:
    """A recipe by name.

    Raises:
        RequestError: there is none of that name.
    """
    path = resource("recipes", f"{name}.toml")
    if Path(name).name != name or not path.is_file():
        known = ", ".join(info.name for info in recipes())
        raise RequestError(f"There is no recipe called {name}.", f"Choose one of: {known}.")
    return _build(name, _content(path))


def read_recipe(path: Path) -> Recipe:
    """The recipe in a file, as `Recipe.as_toml` wrote it into a run's folder.

    Raises:
        StudioError: it is missing, damaged or of a newer version.
    """
    return _build(path.stem, _content(path))


def from_dict(facts: Mapping[str, Any]) -> Recipe:
    """The recipe given by `Recipe.as_dict`."""
    return _build(str(facts.get("name", "")), facts)


def _with_form(recipe: Recipe, form: str) -> Recipe:
    path = resource("recipes", f"{recipe.name}.toml")
    content = _content(path) if path.is_file() else {"forms": {}}
    if form in ("", "plain"):
        return replace(_build(recipe.name, content), form="")
    if form not in content["forms"]:
        known = ", ".join(content["forms"]) or "none"
        raise RequestError(f"The recipe {recipe.name} has no form called {form}.", f"Forms it has: {known}.")
    return replace(_build(recipe.name, _merged(content, content["forms"][form])), form=form)


def _content(path: Path, depth: int = 0) -> dict[str, Any]:
    """A recipe file with what it extends underneath."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise StudioError(f"The recipe {path} is missing.", "Choose another run or recipe.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise StudioError(f"The recipe {path.name} is damaged: {error}.", "Restore the file.") from error
    if content.pop("version", FORMAT_VERSION) != FORMAT_VERSION:
        raise StudioError(
            f"The recipe {path.name} was written by a newer Saia Studio.", "Update Saia Studio to use it."
        )
    content.setdefault("forms", {})
    base = content.pop("extends", "")
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
    facts = {key: value for key, value in content.items() if key not in ("forms", "version", "name")}
    try:
        for section, kind in _SECTIONS.items():
            facts[section] = kind(**facts.get(section, {}))
        recipe = Recipe(name=str(content.get("name", name)), **facts)
    except TypeError as error:
        raise StudioError(f"The recipe {name} is damaged: {error}.", "Restore the file.") from error
    check(recipe.settings(), recipe.network)
    return recipe
