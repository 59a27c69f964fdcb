"""Tunings with a name, kept as JSON: some that come with the studio, others in a project's folder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from studio.errors import RequestError, StudioError, say
from studio.files import atomic
from studio.paths import resource
from studio.playback.layers.regions import REGIONS
from studio.playback.layers.tuning import GAIN_LIMITS, LIFT_LIMITS, LIMITS, ShapeTuning, Tuning

FORMAT, VERSION, SUFFIX = "saia-tuning", 1, ".json"
FOLDER = "tunings"
"""Where a project keeps its own."""
_ANOTHER = "Correct the file, or choose another preset."


@dataclass(frozen=True)
class Preset:
    """A tuning people know by name.

    Args:
        title: the name.
        tuning: what it does.
        path: where it lies.
        shipped: it came with the studio and cannot be changed.
    """

    title: str
    tuning: Tuning
    path: Path
    shipped: bool = False


def shipped() -> tuple[Preset, ...]:
    """The presets of the studio, the one that changes nothing first."""
    return tuple(read(path, shipped=True) for path in sorted(resource("tunings").glob(f"*{SUFFIX}")))


def saved(folder: Path) -> tuple[tuple[Preset, ...], tuple[StudioError, ...]]:
    """The presets of a folder by title, and what is wrong with files that cannot be used."""
    found: list[Preset] = []
    problems: list[StudioError] = []
    for path in sorted(folder.glob(f"*{SUFFIX}")) if folder.is_dir() else ():
        try:
            found.append(read(path))
        except StudioError as error:
            problems.append(error)
    return tuple(sorted(found, key=lambda preset: preset.title.casefold())), tuple(problems)


def find(name: str, folder: Path | None = None) -> Preset:
    """The preset of a name, one of the folder before one of the studio; or of a file's path.

    Raises:
        RequestError: there is none.
        StudioError: its file cannot be used.
    """
    path = Path(name)
    if path.suffix.lower() == SUFFIX or path.is_file():
        if not path.is_file():
            raise RequestError(
                say("There is no preset at {name}.", name=name), "Check how the path is written."
            )
        return read(path)
    # Own presets come last into the dictionary, so that they win over shipped ones of the same title.
    own = saved(folder)[0] if folder is not None else ()
    known = {preset.title.casefold(): preset for preset in (*shipped(), *own)}
    if name.casefold() not in known:
        titles = ", ".join(preset.title for preset in known.values())
        raise RequestError(
            say("There is no preset called {name}.", name=name),
            say("Choose one of: {titles}; or a .json file.", titles=titles),
        )
    return known[name.casefold()]


def read(path: Path, shipped: bool = False) -> Preset:
    """The preset in a file.

    Raises:
        StudioError: it cannot be read, is damaged, of a newer version, or asks for what there is not.
    """
    try:
        content = atomic.read_json(path)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise StudioError(
            say("{name} cannot be read: {reason}.", name=path.name, reason=reason), "Choose another preset."
        ) from error
    except StudioError as error:
        raise StudioError(
            say("{name} is no preset: it is damaged.", name=path.name), "Choose another file."
        ) from error
    if content.get("format") != FORMAT or not isinstance(content.get("tuning"), dict):
        raise StudioError(say("{name} is no preset of Saia Studio.", name=path.name), "Choose another file.")
    atomic.check_version(path, content, VERSION)
    # A person may have written the file: one line, and short enough for a menu.
    title = " ".join(str(content.get("title") or "").split())[:60] or path.stem
    return Preset(title, from_plain(content["tuning"], path.name), path, shipped)


def write(path: Path, title: str, tuning: Tuning) -> Preset:
    """Keep a tuning in a file; StudioError where it cannot be written."""
    content = {"format": FORMAT, "version": VERSION, "title": title, "tuning": to_plain(tuning)}
    atomic.write_json(path, content)
    return Preset(title, tuning, path)


def save(folder: Path, title: str, tuning: Tuning) -> Preset:
    """Keep a tuning among a folder's presets; one of the same title is replaced.

    Raises:
        RequestError: it has no title, or the title of a preset of the studio.
        StudioError: it cannot be written.
    """
    title = " ".join(title.split())[:60]
    if not title:
        raise RequestError("A preset needs a name.", "Type one.")
    if any(preset.title.casefold() == title.casefold() for preset in shipped()):
        raise RequestError(say("{title} is a preset of the studio.", title=title), "Choose another name.")
    same = [preset for preset in saved(folder)[0] if preset.title.casefold() == title.casefold()]
    return write(same[0].path if same else _free(folder, title), title, tuning)


def keep(folder: Path, preset: Preset) -> Preset:
    """Keep a preset from elsewhere among a folder's, under another title where that is another tuning's.

    Raises:
        StudioError: it cannot be written.
    """
    known = {one.title.casefold(): one for one in (*saved(folder)[0], *shipped())}
    title, number = preset.title, 1
    while (same := known.get(title.casefold())) is not None:
        if same.tuning == preset.tuning:
            return same
        number += 1
        title = f"{preset.title[:56]} {number}"
    return save(folder, title, preset.tuning)


def _free(folder: Path, title: str) -> Path:
    """A file of the folder for a title; two titles may come to the same name."""
    name, number = atomic.safe_name(title), 1
    path = folder / f"{name}{SUFFIX}"
    while path.exists():
        number += 1
        path = folder / f"{name} {number}{SUFFIX}"
    return path


def to_plain(tuning: Tuning) -> dict[str, Any]:
    """A tuning as JSON values: what differs from one that changes nothing."""
    plain: dict[str, Any] = {
        f.name: getattr(tuning, f.name)
        for f in fields(Tuning)
        if f.name not in ("shapes", "moves") and getattr(tuning, f.name) != f.default
    }
    if tuning.shapes:
        plain["shapes"] = [{"name": s.name, "gain": s.gain, "lift": s.lift} for s in tuning.shapes]
    if tuning.moves != frozenset(REGIONS):
        plain["moves"] = [region for region in REGIONS if region in tuning.moves]
    return plain


def from_plain(plain: dict[str, Any], name: str) -> Tuning:
    """A tuning from JSON values.

    Args:
        plain: what `to_plain` gave, or what a person wrote.
        name: what a sentence calls it.

    Raises:
        StudioError: it asks for something there is not, or for a value out of its limits.
    """
    kinds = {f.name: f.default for f in fields(Tuning)}
    values: dict[str, Any] = {}
    for key, value in plain.items():
        if key not in kinds:
            raise StudioError(
                say("{name} asks for {key}, which is no part of a tuning.", name=name, key=key), _ANOTHER
            )
        if key == "shapes":
            values[key] = tuple(_shape(one, name) for one in _listed(value, key, name))
        elif key == "moves":
            values[key] = _regions(_listed(value, key, name), name)
        elif isinstance(kinds[key], bool):
            if not isinstance(value, bool):
                raise StudioError(say("{name}: {key} must be true or false.", name=name, key=key), _ANOTHER)
            values[key] = value
        else:
            number = _number(value, key, LIMITS[key], name)
            values[key] = int(number) if isinstance(kinds[key], int) else number
    return Tuning(**values)


def _number(value: Any, key: str, limits: tuple[float, float], name: str) -> float:
    low, high = limits
    number = not isinstance(value, bool) and isinstance(value, int | float)
    # Neither is true of what is no number.
    if not number or not low <= value <= high:
        raise StudioError(
            say(
                "{name}: {key} must be a number from {low} to {high}.",
                name=name,
                key=key,
                low=f"{low:g}",
                high=f"{high:g}",
            ),
            _ANOTHER,
        )
    return float(value)


def _listed(value: Any, key: str, name: str) -> list[Any]:
    if not isinstance(value, list) or len(value) > 1000:
        raise StudioError(say("{name}: {key} must be a list.", name=name, key=key), _ANOTHER)
    return value


def _regions(values: Iterable[Any], name: str) -> frozenset[str]:
    for value in values:
        if value not in REGIONS:
            what = say("{name} lets {value} move, which is no region.", name=name, value=value)
            raise StudioError(what, say("Choose among: {regions}.", regions=", ".join(REGIONS)))
    return frozenset(values)


def _shape(value: Any, name: str) -> ShapeTuning:
    if not isinstance(value, dict) or not isinstance(value.get("name"), str):
        raise StudioError(say("{name}: each of shapes needs the name of a blend shape.", name=name), _ANOTHER)
    gain = _number(value.get("gain", 1.0), "gain", GAIN_LIMITS, name)
    return ShapeTuning(value["name"], gain, _number(value.get("lift", 0.0), "lift", LIFT_LIMITS, name))
