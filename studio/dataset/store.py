"""dataset.json and the steps that undo can take: choices to and from plain JSON values."""

from __future__ import annotations

import math
from typing import Any

from studio.dataset.dataset import SPLITS, Dataset, Label, Selection
from studio.dataset.history import History, Step
from studio.take.cleaned import WAYS

FORMAT_VERSION = 1
STEPS_KEPT = 50
"""Undo steps that outlive the program."""
CHANGES_KEPT = 5000
"""Selections in all those steps together, so that the file stays small."""
_SENSELESS = (TypeError, ValueError, KeyError, AttributeError, OverflowError)
"""What an entry that makes no sense raises; OverflowError where a number is infinite or endless."""


def to_plain(dataset: Dataset) -> dict[str, Any]:
    """The content of dataset.json."""
    plain: dict[str, Any] = {"version": FORMAT_VERSION}
    plain["selections"] = [selection_to_plain(s) for s in dataset.selections]
    if dataset.found:
        plain["found"] = list(dataset.found)
    return plain


def from_plain(content: dict[str, Any]) -> tuple[Dataset, int]:
    """The dataset in a dataset.json, and how many of its entries could not be understood."""
    entries = content.get("selections")
    if not isinstance(entries, list):
        return Dataset(), 1
    found: dict[str, Selection] = {}
    for entry in entries:
        try:
            selection = selection_from_plain(entry)
        except _SENSELESS:
            continue
        found.setdefault(selection.id, selection)
    return Dataset(tuple(found.values()), _paths(content.get("found"))), len(entries) - len(found)


def selection_to_plain(selection: Selection) -> dict[str, Any]:
    """One selection; what is at its default is left out."""
    plain: dict[str, Any] = {"id": selection.id, "take": selection.take, "split": selection.split}
    for name in (
        "in_point",
        "out_point",
        "offset",
        "performer",
        "emotion",
        "stars",
        "note",
        "locked",
        "clean",
    ):
        value = getattr(selection, name)
        if value != getattr(_DEFAULT, name):
            plain[name] = value
    if selection.excluded:
        plain["excluded"] = [list(span) for span in selection.excluded]
    if selection.labels:
        plain["labels"] = [[label.t, label.duration, label.tier, label.text] for label in selection.labels]
    if selection.tags:
        plain["tags"] = list(selection.tags)
    return plain


def selection_from_plain(plain: dict[str, Any]) -> Selection:
    """One selection; TypeError, ValueError or KeyError where it makes no sense."""
    out_point = plain.get("out_point")
    split = plain.get("split", "train")
    if split not in SPLITS:
        raise ValueError(split)
    return Selection(
        id=_text(plain["id"]),
        take=_text(plain["take"]),
        in_point=_number(plain.get("in_point", 0.0)),
        out_point=None if out_point is None else _number(out_point),
        offset=_number(plain.get("offset", 0.0)),
        excluded=tuple((_number(a), _number(b)) for a, b in plain.get("excluded", ())),
        labels=tuple(
            Label(_number(t), _number(d), _text(tier), _text(text))
            for t, d, tier, text in plain.get("labels", ())
        ),
        split=split,
        performer=_text(plain.get("performer", "")),
        emotion=_text(plain.get("emotion", "")),
        tags=tuple(_text(tag) for tag in plain.get("tags", ())),
        stars=int(plain.get("stars", 0)),
        note=_text(plain.get("note", "")),
        locked=bool(plain.get("locked", False)),
        clean=clean if (clean := plain.get("clean", "")) in WAYS else "",
    )


def history_to_plain(history: History[Dataset]) -> dict[str, Any]:
    """The steps of a history as changes, each against the value beside it."""
    return {
        "version": FORMAT_VERSION,
        "undo": _changes(history.value, history.undo_steps),
        "redo": _changes(history.value, history.redo_steps),
    }


def history_from_plain(dataset: Dataset, content: dict[str, Any]) -> History[Dataset]:
    """A history whose present value is `dataset`; without steps where the content makes no sense."""
    history = History(dataset)
    try:
        undo_steps = _values(dataset, content["undo"])
        redo_steps = _values(dataset, content["redo"])
    except _SENSELESS:
        return history
    history.undo_steps, history.redo_steps = undo_steps, redo_steps
    return history


def _changes(value: Dataset, steps: list[Step[Dataset]]) -> list[dict[str, Any]]:
    """Newest first: what turns each value into the one on the other side of its step."""
    result: list[dict[str, Any]] = []
    size = 0
    for step in reversed(steps[-STEPS_KEPT:]):
        here = {s.id: s for s in value.selections}
        # Most are the very same object: asking that first is what keeps an edit among 1,000 takes quick.
        put = [s for s in step.value.selections if (old := here.get(s.id)) is not s and old != s]
        change: dict[str, Any] = {"name": step.name, "put": [selection_to_plain(s) for s in put]}
        order = [s.id for s in step.value.selections]
        if order != list(here):
            change["order"] = order
        if step.value.found != value.found:
            change["found"] = list(step.value.found)
        size += len(put) + (len(order) if "order" in change else 0) // 10
        if size > CHANGES_KEPT:
            break
        result.append(change)
        value = step.value
    return result


def _values(value: Dataset, changes: list[dict[str, Any]]) -> list[Step[Dataset]]:
    steps: list[Step[Dataset]] = []
    for change in changes:
        known = {s.id: s for s in value.selections}
        known |= {s.id: s for s in map(selection_from_plain, change["put"])}
        order = change.get("order", [s.id for s in value.selections])
        found = _paths(change["found"]) if "found" in change else value.found
        value = Dataset(tuple(known[selection_id] for selection_id in order), found)
        steps.append(Step(_text(change["name"]), value))
    return steps[::-1]


def _paths(value: object) -> tuple[str, ...]:
    """Paths inside the project; what is no such path is left out."""
    entries = value if isinstance(value, list) else []
    return tuple(path for path in entries if isinstance(path, str) and is_inside(path))


def is_inside(path: str) -> bool:
    """Whether a path with slashes leads to something among a project's takes, and nowhere else."""
    parts = path.split("/")
    return (
        parts[0] == "takes" and len(parts) > 1 and not any(p in ("", ".", "..") or "\\" in p for p in parts)
    )


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(value)
    return value


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise TypeError(value)
    return float(value)


_DEFAULT = Selection("", "")
