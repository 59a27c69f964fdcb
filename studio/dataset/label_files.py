"""Labels to and from other programs' files (Audacity, Praat, ELAN), and vocabularies to label with."""

from __future__ import annotations

import codecs
import math
import re
import tomllib
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from studio.dataset.dataset import Label
from studio.errors import RequestError, StudioError, say
from studio.files import atomic
from studio.paths import resource

TIERS = ("sentence", "emotion", "gesture", "vowel", "problem")
"""The tiers every project has; a person may add others."""
SUFFIXES = (".txt", ".textgrid", ".eaf")
LARGEST_BYTES = 64 << 20
_SENSELESS = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)
_SAVE_AGAIN = "Export the labels again, as an Audacity label track (.txt), a Praat TextGrid or an ELAN .eaf."


def read_labels(path: Path, tier: str = "sentence") -> tuple[Label, ...]:
    """The labels in a file, by time.

    Args:
        path: an Audacity label track (.txt) or a Praat TextGrid, in UTF-8, UTF-16 or Shift-JIS; an ELAN
            document (.eaf).
        tier: where labels go whose text names none; only an Audacity file has such.

    Raises:
        RequestError: the suffix is another one.
        StudioError: the file is missing, empty, or not what its suffix says; nothing of it is read.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise _unknown(path)
    suffix = path.suffix.lower()
    if suffix == ".eaf":
        _bytes(path)
        found = _read_elan(path)
    elif suffix == ".textgrid":
        found = _read_textgrid(path, _text(path))
    else:
        found = _read_audacity(path, _text(path), tier)
    if not found:
        raise StudioError(say("There are no labels in {name}.", name=path.name), _SAVE_AGAIN)
    return tuple(sorted(found, key=lambda label: (label.t, label.duration)))


def write_labels(path: Path, labels: Iterable[Label], duration: float) -> None:
    """Write labels in the form that the suffix names.

    Args:
        path: ends in .txt (Audacity), .TextGrid (Praat) or .eaf (ELAN).
        labels: what is written.
        duration: seconds of the take; a TextGrid is as long as its sound.

    Raises:
        RequestError: the suffix is another one, or there are no labels.
        StudioError: the file cannot be written.
    """
    labels = sorted(labels, key=lambda label: (label.t, label.duration))
    if path.suffix.lower() not in SUFFIXES:
        raise _unknown(path)
    if not labels:
        raise RequestError("There are no labels to export.", "Label something first.")
    if path.suffix.lower() == ".eaf":
        with atomic.written(path) as beside:
            write_eaf(beside, _lanes(labels))
        return
    text = _textgrid(labels, duration) if path.suffix.lower() == ".textgrid" else _audacity(labels)
    with atomic.written(path) as beside:
        beside.write_text(text, encoding="utf-8", newline="\n")


def outside(labels: Iterable[Label], start: float, end: float) -> int:
    """How many labels lie wholly before an in point or after an out point."""
    return sum(label.t + label.duration < start or label.t > end for label in labels)


def _unknown(path: Path) -> RequestError:
    what = say("The studio cannot read {name} as a label file.", name=path.name)
    return RequestError(what, "Choose a name that ends in .txt (Audacity), .TextGrid (Praat) or .eaf (ELAN).")


def _bytes(path: Path) -> bytes:
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise StudioError(say("{name} is too large to be a label file.", name=path.name), _SAVE_AGAIN)
        data = path.read_bytes()
    except OSError as error:
        what = say(
            "{name} could not be read: {reason}.",
            name=path.name,
            reason=error.strerror or type(error).__name__,
        )
        raise StudioError(what, "Choose a file that is there.") from error
    if not data.strip():
        raise StudioError(say("{name} is empty.", name=path.name), _SAVE_AGAIN)
    return data


def _text(path: Path) -> str:
    data = _bytes(path)
    marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp932"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise StudioError(say("{name} has an unknown text encoding.", name=path.name), _SAVE_AGAIN)


# -- Audacity ----------------------------------------------------------------------------------


def _read_audacity(path: Path, text: str, tier: str) -> list[Label]:
    """Source: https://manual.audacityteam.org/man/importing_and_exporting_labels.html"""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        # A line that begins with a backslash holds the frequencies of the label above.
        if not line.strip() or line.startswith("\\"):
            continue
        cells = line.split("\t", 2)
        try:
            start, end = (float(cell.strip().replace(",", ".")) for cell in cells[:2])
            if not (math.isfinite(start) and math.isfinite(end)):
                raise ValueError(line)
        except ValueError as error:
            what = say(
                "Line {number} of {name} is not a label: {line}.",
                number=number,
                name=path.name,
                line=repr(line[:40]),
            )
            raise StudioError(what, _SAVE_AGAIN) from error
        start, end = max(min(start, end), 0.0), max(start, end, 0.0)
        name, words = _named(cells[2].strip() if len(cells) > 2 else "", tier)
        found.append(Label(start, end - start, name, words))
    return found


def _named(text: str, tier: str) -> tuple[str, str]:
    """(tier, text) of a label's text."""
    before, colon, after = text.partition(": ")
    return (before, after) if colon and before in TIERS else (tier, text)


def _audacity(labels: Sequence[Label]) -> str:
    lines = []
    for label in labels:
        words = " ".join(label.text.split())
        # A sentence that itself begins like "emotion: " says that it is a sentence.
        named = label.tier != "sentence" or _named(words, "")[0] != ""
        words = f"{label.tier}: {words}" if named else words
        lines.append(f"{label.t:.6f}\t{label.t + label.duration:.6f}\t{words}\n")
    return "".join(lines)


# -- ELAN --------------------------------------------------------------------------------------


def _read_elan(path: Path) -> list[Label]:
    try:
        entries = eaf_entries(path)
    except ValueError as error:
        raise StudioError(
            say("{name} is no ELAN document, or damaged.", name=path.name), _SAVE_AGAIN
        ) from error
    return [label_of(*entry) for entry in entries]


def _lanes(labels: Sequence[Label]) -> dict[str, list[tuple[float, float, str]]]:
    """Entries by tier, none overlapping, moments in tiers of their own."""
    lanes: dict[str, list[tuple[float, float, str]]] = {}
    for label in labels:
        is_moment = label.duration <= 0
        name = f"{label.tier}{POINTS}" if is_moment else _free_lane(label, lanes)
        lanes.setdefault(name, []).append((label.t, label.t + label.duration, label.text))
    return lanes


# -- Praat -------------------------------------------------------------------------------------

_PART = re.compile(r" \((?:points|\d+)\)$")


def _read_textgrid(path: Path, text: str) -> list[Label]:
    from praatio.utilities import errors, textgrid_io

    if "ooTextFile" not in text[:200] and not text.lstrip().startswith("{"):
        raise StudioError(say("{name} is not a TextGrid.", name=path.name), _SAVE_AGAIN)
    try:
        content = textgrid_io.parseTextgridStr(text)
        found = [_label(tier["name"], entry) for tier in content["tiers"] for entry in tier["entries"]]
    except (errors.PraatioException, *_SENSELESS) as error:
        # praatio's parser trusts its input: a file cut short ends in any of these.
        raise StudioError(say("{name} is damaged or was cut short.", name=path.name), _SAVE_AGAIN) from error
    return found


def _label(tier: str, entry: Sequence[Any]) -> Label:
    """One of praatio's entries: (start, end, text), or (moment, text)."""
    start = float(entry[0])
    end = float(entry[1]) if len(entry) > 2 else start
    words = str(entry[-1])
    if len(entry) == 2:
        words = words.replace('""', '"')  # praatio 6.2 leaves the quotes of moments doubled
    if not (math.isfinite(start) and math.isfinite(end)):
        raise ValueError(entry)
    return Label(max(start, 0.0), max(end - max(start, 0.0), 0.0), _PART.sub("", tier), words)


def _textgrid(labels: Sequence[Label], duration: float) -> str:
    from praatio.utilities import textgrid_io

    end = max([duration, *(label.t + label.duration for label in labels)])
    lanes: dict[str, list[tuple[Any, ...]]] = {}
    for label in labels:
        words = label.text or "-"  # a span without text is a gap to Praat
        if label.duration > 0:
            lane = lanes.setdefault(_free_lane(label, lanes), [])
            lane.append((label.t, label.t + label.duration, words))
        else:
            lanes.setdefault(f"{label.tier} (points)", []).append((label.t, words))
    tiers = [
        {
            "class": "TextTier" if name.endswith(" (points)") else "IntervalTier",
            "name": name,
            "xmin": 0.0,
            "xmax": end,
            "entries": entries,
        }
        for name, entries in lanes.items()
    ]
    grid = {"xmin": 0.0, "xmax": end, "tiers": tiers}
    # Of the two forms Praat reads, praatio finds its way in the short one whatever the texts say.
    return textgrid_io.getTextgridAsStr(grid, "short_textgrid", includeBlankSpaces=True)


def _free_lane(label: Label, lanes: Mapping[str, Sequence[tuple[Any, ...]]]) -> str:
    """The first tier of this name whose last span has ended."""
    number = 1
    while True:
        name = label.tier if number == 1 else f"{label.tier} ({number})"
        if name not in lanes or lanes[name][-1][1] <= label.t:
            return name
        number += 1


POINT_MS = 40
"""How long a moment is drawn in ELAN."""
POINTS = " (points)"
_NUMBER = re.compile(r" \(\d+\)$")


def eaf_entries(path: Path) -> list[tuple[str, float, float, str]]:
    """(tier, start, end, text) of every annotation, seconds.

    Raises:
        ValueError: it is no annotation document, or damaged.
    """
    from pympi.Elan import Eaf

    try:
        _refuse_doctype(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of versions it does not know
            document = Eaf(str(path))
        times = _times(document.timeslots)
        found = []
        for tier in document.tiers:
            found += _entries(document, tier, times)
    except Exception as error:
        # pympi trusts its input and itself raises plain Exception: a damaged file ends in anything.
        raise ValueError(str(error)) from error
    return found


def _refuse_doctype(path: Path) -> None:
    """Exception where a document declares a type, in whatever encoding and however late, or is no XML.

    ELAN writes none, and what one declares can swell a small file to fill the memory.
    """
    from xml.parsers import expat

    def refuse(*_: object) -> None:
        raise ValueError("doctype")

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    with path.open("rb") as file:
        parser.ParseFile(file)


def write_eaf(path: Path, lanes: Mapping[str, Sequence[tuple[float, float, str]]]) -> None:
    """Write annotations.

    Args:
        path: the file.
        lanes: (start, end, text) by tier in order of time, seconds, none overlapping; an empty span is a
            moment.
    """
    from pympi.Elan import Eaf, to_eaf

    document = Eaf(author="Saia Studio")
    document.remove_tier("default")
    for tier, entries in lanes.items():
        document.add_tier(tier)
        for i, (start, end, text) in enumerate(entries):
            first, last = round(start * 1000), round(end * 1000)
            if last <= first:
                room = round(entries[i + 1][0] * 1000) - first if i + 1 < len(entries) else POINT_MS
                last = first + max(min(POINT_MS, room), 1)
            document.add_annotation(tier, first, last, text)
    to_eaf(str(path), document)


def label_of(tier: str, start: float, end: float, text: str) -> Label:
    """One annotation as a label."""
    if tier.endswith(POINTS):
        return Label(start, 0.0, tier.removesuffix(POINTS), text)
    return Label(start, max(end - start, 0.0), _NUMBER.sub("", tier), text)


def _times(slots: Mapping[str, int | None]) -> dict[str, float]:
    """Seconds of every time slot; one without a time stands evenly between its neighbours."""
    values = np.array([np.nan if value is None else value / 1000 for value in slots.values()])
    known = np.flatnonzero(np.isfinite(values))
    if len(values) and not len(known):
        raise ValueError("no times")
    filled = np.interp(np.arange(len(values)), known, values[known]) if len(values) else values
    return dict(zip(slots, filled.tolist(), strict=True))


def _entries(document: Any, tier: str, times: Mapping[str, float]) -> list[tuple[str, float, float, str]]:
    aligned, referring = document.tiers[tier][:2]
    spans = [(times[a], times[b], text) for a, b, text, *_ in aligned.values()]
    for target, text, *_ in referring.values():
        first, last = _span(document, target, times)
        spans.append((first, last, text))
    return [(tier, start, end, text or "") for start, end, text in spans]


def _span(document: Any, annotation: str, times: Mapping[str, float]) -> tuple[float, float]:
    """Where an annotation stands that others refer to, or that itself refers to another."""
    for _ in range(64):
        aligned, referring = document.tiers[document.annotations[annotation]][:2]
        if annotation in aligned:
            return times[aligned[annotation][0]], times[aligned[annotation][1]]
        annotation = referring[annotation][0]
    raise ValueError("annotations refer to one another in a circle")


@dataclass(frozen=True)
class Vocabulary:
    """One set of words.

    Args:
        name: its file's name.
        title: what people see, in its own language.
        language: "en" or "ja".
        words: by tier, in the order of the keys 1 to 9.
    """

    name: str
    title: str
    language: str
    words: tuple[tuple[str, tuple[str, ...]], ...]

    @property
    def entries(self) -> tuple[str, ...]:
        """Its words as settings keep them: "tier=word"."""
        return tuple(f"{tier}={word}" for tier, words in self.words for word in words)


@cache
def vocabularies() -> tuple[Vocabulary, ...]:
    """All of them, by name."""
    found = []
    for path in sorted(resource("vocabularies").glob("*.toml")):
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        words = tuple((str(tier), tuple(map(str, some))) for tier, some in content["tiers"].items())
        found.append(Vocabulary(path.stem, str(content["title"]), str(content["language"]), words))
    return tuple(found)
