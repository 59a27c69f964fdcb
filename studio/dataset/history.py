"""Undo and redo by keeping the old value, and dataset.json with the steps that undo can take."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from studio.dataset.dataset import SPLITS, Dataset, Label, Selection
from studio.take.cleaned import WAYS

T = TypeVar("T")

LIMIT = 200


@dataclass(frozen=True)
class EditStep(Generic[T]):
    """One change that can be taken back or made again.

    Args:
        name: what people call it.
        value: the one on its other side.
        origin: where it was made, "" where that does not matter or is no longer known. Not kept in files: a
            step of an earlier start belongs to nobody in particular.
    """

    name: str
    value: T
    origin: str = field(default="", compare=False)


class History(Generic[T]):
    """A value, the values it had before, and the ones that were undone.

    Args:
        value: where it begins.
        limit: steps kept; older ones are forgotten.
    """

    def __init__(self, value: T, limit: int = LIMIT) -> None:
        self.value = value
        self.limit = limit
        self.undo_steps: list[EditStep[T]] = []
        self.redo_steps: list[EditStep[T]] = []

    def do(self, name: str, value: T, origin: str = "") -> bool:
        """Take a new value; False where it is the one already there, which is no step."""
        # A slider that comes back to where it was is no step that a person would want to undo.
        if value == self.value:
            return False
        self.undo_steps.append(EditStep(name, self.value, origin))
        del self.undo_steps[: -self.limit]
        # What was undone belongs to a past that no longer leads here.
        self.redo_steps.clear()
        self.value = value
        return True

    def undo(self) -> str:
        """Go back one step; gives its name, "" where there is none."""
        if not self.undo_steps:
            return ""
        step = self.undo_steps.pop()
        self.redo_steps.append(EditStep(step.name, self.value, step.origin))
        self.value = step.value
        return step.name

    def redo(self) -> str:
        """Make the last undone step again; gives its name, "" where there is none."""
        if not self.redo_steps:
            return ""
        step = self.redo_steps.pop()
        self.undo_steps.append(EditStep(step.name, self.value, step.origin))
        self.value = step.value
        return step.name

    @property
    def undo_name(self) -> str:
        """What undo would take back; "" for nothing."""
        return self.undo_steps[-1].name if self.undo_steps else ""

    @property
    def undo_origin(self) -> str:
        """Where that was made."""
        return self.undo_steps[-1].origin if self.undo_steps else ""

    @property
    def redo_name(self) -> str:
        """What redo would make again; "" for nothing."""
        return self.redo_steps[-1].name if self.redo_steps else ""

    @property
    def redo_origin(self) -> str:
        """Where that was made first."""
        return self.redo_steps[-1].origin if self.redo_steps else ""


FORMAT_VERSION = 1
STEPS_KEPT = 50
"""Undo steps that outlive the program."""
CHANGES_KEPT = 5000
"""Selections in all those steps together, so that the file stays small."""
SAMPLE_STEP = "Divide and label the sample takes"
"""How sample projects were prepared when that still was a step of undo."""
MOST_STARS = 5
_FARTHEST = 1e9
"""Seconds from a take's beginning that no moment in it is."""
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
    # One count for the whole: a person is to hear that something was lost, not how many lines.
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
        stars=min(max(int(_number(plain.get("stars", 0))), 0), MOST_STARS),
        note=_text(plain.get("note", "")),
        locked=_switch(plain.get("locked", False)),
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
    """A history whose present value is `dataset`; without steps where the content makes no sense.

    The preparation of an older sample project is no step: undo ends after it. It stays where it was undone,
    for redo is the only way back to it.
    """
    history = History(dataset)
    try:
        undo_steps = _values(dataset, content["undo"])
        redo_steps = _values(dataset, content["redo"])
    except _SENSELESS:
        return history
    prepared = max((i for i, step in enumerate(undo_steps) if step.name == SAMPLE_STEP), default=-1)
    history.undo_steps, history.redo_steps = undo_steps[prepared + 1 :], redo_steps
    return history


def _changes(value: Dataset, steps: list[EditStep[Dataset]]) -> list[dict[str, Any]]:
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


def _values(value: Dataset, changes: list[dict[str, Any]]) -> list[EditStep[Dataset]]:
    steps: list[EditStep[Dataset]] = []
    for change in changes:
        known = {s.id: s for s in value.selections}
        known |= {s.id: s for s in map(selection_from_plain, change["put"])}
        order = change.get("order", [s.id for s in value.selections])
        found = _paths(change["found"]) if "found" in change else value.found
        value = Dataset(tuple(known[selection_id] for selection_id in order), found)
        steps.append(EditStep(_text(change["name"]), value))
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
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _FARTHEST:
        raise TypeError(value)
    return float(value)


def _switch(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError(value)
    return value


_DEFAULT = Selection("", "")
