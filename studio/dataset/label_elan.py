"""Labels to and from ELAN's annotation documents (.eaf).

ELAN's annotations have a length and do not overlap within a tier: moments go to a tier of their own,
"gesture (points)", and what overlaps to "emotion (2)". Reading takes both back.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from studio.dataset.dataset import Label

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

    with path.open("rb") as file:
        if b"<!DOCTYPE" in file.read(4096).upper():  # ELAN writes none, and entities can be made to explode
            raise ValueError("doctype")
    try:
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
