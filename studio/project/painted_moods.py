"""Moods painted over the sounds of a project, kept in its folder as moods.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from studio.errors import RequestError, StudioError
from studio.files import atomic
from studio.motion.moods import STRONGEST, MoodSpan
from studio.project.contents import is_project

FILE = "moods.json"
FORMAT_VERSION = 1
_SOUND = "sound:"


@dataclass(frozen=True)
class PaintedMoods:
    """What was painted over the sounds.

    Args:
        spans: by the item's key, "take:ID" or "sound:PATH".
        strengths: by the mood's name; 1 where not said.
    """

    spans: Mapping[str, tuple[MoodSpan, ...]] = field(default_factory=dict)
    strengths: Mapping[str, float] = field(default_factory=dict)

    def of(self, key: str) -> tuple[MoodSpan, ...]:
        """The spans of an item, as strong as they are to be."""
        strengths = self.strengths
        return tuple(replace(one, strength=strengths.get(one.name, 1.0)) for one in self.spans.get(key, ()))

    def over(self, other: PaintedMoods) -> PaintedMoods:
        """These, and the other ones where these say nothing."""
        return PaintedMoods({**other.spans, **self.spans}, {**other.strengths, **self.strengths})


def read_moods(folder: Path) -> PaintedMoods:
    """What was painted in a project; nothing where nothing ever was, and without what makes no sense.

    Raises:
        StudioError: the file is damaged, or of a newer version.
    """
    path = folder / FILE
    if not path.is_file():
        return PaintedMoods()
    content = atomic.read_json(path)
    atomic.check_version(path, content, FORMAT_VERSION)
    painted, strengths = content.get("painted"), content.get("strengths")
    spans = {
        _key_here(key, folder): found
        for key, texts in (painted.items() if isinstance(painted, dict) else ())
        if isinstance(texts, list) and (found := tuple(_spans(texts)))
    }
    known = strengths.items() if isinstance(strengths, dict) else ()
    return PaintedMoods(spans, {name: float(value) for name, value in known if _is_strength(value)})


def write_moods(folder: Path, moods: PaintedMoods) -> None:
    """Keep what is painted in a project; a damaged file is set aside.

    Raises:
        NewerVersionError: the file is of a newer version, and stays as it is.
        StudioError: the folder cannot be written.
    """
    if not is_project(folder):
        # It was moved or removed meanwhile, and is not to come back as an empty folder.
        return
    try:
        read_moods(folder)
    except atomic.NewerVersionError:
        raise
    except StudioError:
        atomic.set_aside(folder / FILE)
    painted = {
        _key_in_file(key, folder): [one.text for one in spans] for key, spans in moods.spans.items() if spans
    }
    content = {"version": FORMAT_VERSION, "painted": painted, "strengths": dict(moods.strengths)}
    atomic.write_json(folder / FILE, content)


def _spans(texts: list[object]) -> list[MoodSpan]:
    found = []
    for text in texts:
        try:
            found.append(MoodSpan.read(text if isinstance(text, str) else ""))
        except RequestError:
            continue
    return found


def _is_strength(value: object) -> bool:
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return plain and math.isfinite(value) and 0 <= value <= STRONGEST  # type: ignore[arg-type, operator]


def _key_in_file(key: str, folder: Path) -> str:
    """A sound's path as it is from the project's folder: that may lie elsewhere the next time."""
    path = Path(key.removeprefix(_SOUND))
    if key.startswith(_SOUND) and path.is_relative_to(folder):
        return _SOUND + path.relative_to(folder).as_posix()
    return key


def _key_here(key: str, folder: Path) -> str:
    return f"{_SOUND}{folder / key.removeprefix(_SOUND)}" if key.startswith(_SOUND) else key
