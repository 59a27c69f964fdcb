"""What a person can do to the choices: pure functions Dataset -> Dataset.

All times are seconds on the take's clock. An unknown selection is a RequestError; a value out of range
is moved to the nearest one allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

from studio.dataset.dataset import SPLITS, Dataset, Label, Selection
from studio.errors import RequestError, say

if TYPE_CHECKING:
    from studio.motion.lag import Alignment

SHORTEST = 0.02
"""Seconds that a selection or a part keeps at least."""


def add(dataset: Dataset, selections: Iterable[Selection]) -> Dataset:
    """Selections appended; one whose id is there already takes its place."""
    new = {selection.id: selection for selection in selections}
    # In place, so that an import that is repeated does not reorder the list a person sees.
    kept = tuple(new.pop(old.id, old) for old in dataset.selections)
    return replace(dataset, selections=kept + tuple(new.values()))


def remove(dataset: Dataset, ids: Iterable[str]) -> Dataset:
    """Without these selections; the takes stay."""
    gone = set(ids)
    _known(dataset, gone)
    return replace(dataset, selections=tuple(s for s in dataset.selections if s.id not in gone))


def remove_takes(dataset: Dataset, takes: Collection[str]) -> Dataset:
    """Without any selection of these takes."""
    return replace(dataset, selections=tuple(s for s in dataset.selections if s.take not in takes))


def trim(dataset: Dataset, selection_id: str, in_point: float, out_point: float | None) -> Dataset:
    """With new in and out points; out_point None is the end of the take."""
    start = max(in_point, 0.0)
    end = None if out_point is None else max(out_point, start + SHORTEST)
    return update(dataset, [selection_id], lambda s: replace(s, in_point=start, out_point=end))


def set_offset(dataset: Dataset, ids: Iterable[str], offset: float) -> Dataset:
    """With motion moved later against the sound by offset seconds."""
    return update(dataset, ids, lambda s: replace(s, offset=float(offset)))


def align_takes(
    dataset: Dataset, alignments: Iterable[tuple[str, Alignment]], sure: float
) -> tuple[Dataset, tuple[str, ...]]:
    """With the offsets found for takes, where the confidence allows it.

    Args:
        dataset: the choices.
        alignments: take ids with what was found for them.
        sure: confidence from which an offset is set.

    Returns:
        The new choices, and the ids of the takes that were left as they are.
    """
    unsure = []
    for take, alignment in alignments:
        if alignment.confidence < sure:
            unsure.append(take)
            continue
        ids = [selection.id for selection in selections_of(dataset, take)]
        dataset = set_offset(dataset, ids, round(alignment.offset, 4))
    return dataset, tuple(unsure)


def set_split(dataset: Dataset, ids: Iterable[str], split: str) -> Dataset:
    """Used as "train", "val", "test", or "" for not at all.

    Raises:
        RequestError: no such split, or a locked test take would leave the test split.
    """
    if split not in SPLITS:
        raise RequestError(
            say("There is no split called {split}.", split=split), "Choose train, val or test."
        )

    def change(selection: Selection) -> Selection:
        if selection.locked and split != "test":
            what = say("{take} is a locked test take.", take=selection.id)
            raise RequestError(what, "Unlock it first to use it for anything else.")
        return replace(selection, split=split)

    return update(dataset, ids, change)


def set_performer(dataset: Dataset, ids: Iterable[str], performer: str) -> Dataset:
    """Performed by someone; also the style a model may learn."""
    return update(dataset, ids, lambda s: replace(s, performer=performer.strip()))


def set_emotion(dataset: Dataset, ids: Iterable[str], emotion: str) -> Dataset:
    """Played in one emotion throughout."""
    return update(dataset, ids, lambda s: replace(s, emotion=emotion.strip()))


def set_note(dataset: Dataset, selection_id: str, note: str) -> Dataset:
    """With a note."""
    return update(dataset, [selection_id], lambda s: replace(s, note=note))


def set_stars(dataset: Dataset, ids: Iterable[str], stars: int) -> Dataset:
    """With 0 to 5 stars."""
    return update(dataset, ids, lambda s: replace(s, stars=min(max(stars, 0), 5)))


def set_locked(dataset: Dataset, ids: Iterable[str], locked: bool) -> Dataset:
    """Locked as test takes, or not; locking moves them to the test split."""
    return update(dataset, ids, lambda s: replace(s, locked=locked, split="test" if locked else s.split))


def set_tags(dataset: Dataset, ids: Iterable[str], tags: Iterable[str]) -> Dataset:
    """With these tags and no others; each is there once."""
    words = tuple(dict.fromkeys(word for tag in tags if (word := tag.strip())))
    return update(dataset, ids, lambda s: replace(s, tags=words))


def add_label(dataset: Dataset, selection_id: str, label: Label) -> Dataset:
    """With one more mark, kept in order of time."""
    label = replace(label, t=max(label.t, 0.0), duration=max(label.duration, 0.0))
    return update(dataset, [selection_id], lambda s: replace(s, labels=_by_time((*s.labels, label))))


def add_labels(dataset: Dataset, selection_id: str, labels: Iterable[Label]) -> Dataset:
    """With more marks, kept in order of time; one that is there already is not doubled."""
    new = tuple(dict.fromkeys(labels))

    def change(selection: Selection) -> Selection:
        missing = tuple(label for label in new if label not in selection.labels)
        return replace(selection, labels=_by_time((*selection.labels, *missing)))

    return update(dataset, [selection_id], change)


def remove_label(dataset: Dataset, selection_id: str, label: Label) -> Dataset:
    """Without one mark; RequestError where it is not there."""

    def change(selection: Selection) -> Selection:
        if label not in selection.labels:
            what = say(
                "{take} has no label {text} at {at} s.",
                take=selection.id,
                text=repr(label.text),
                at=f"{label.t:.2f}",
            )
            raise RequestError(what, "Choose a label that is there.")
        # Of two that are equal only one goes: each was set by a hand of its own.
        labels = list(selection.labels)
        labels.remove(label)
        return replace(selection, labels=tuple(labels))

    return update(dataset, [selection_id], change)


def replace_label(dataset: Dataset, selection_id: str, old: Label, new: Label) -> Dataset:
    """With one mark changed."""
    return add_label(remove_label(dataset, selection_id, old), selection_id, new)


def exclude(dataset: Dataset, selection_id: str, start: float, end: float) -> Dataset:
    """With a span left out; spans that touch become one."""
    span = (max(min(start, end), 0.0), max(start, end))

    def change(selection: Selection) -> Selection:
        return replace(selection, excluded=merged_spans((*selection.excluded, span)))

    return update(dataset, [selection_id], change)


def without(selection: Selection, spans: Sequence[tuple[float, float, str]]) -> Selection:
    """With spans (start, end, why) left out, each labelled with why."""
    excluded = merged_spans((*selection.excluded, *((start, end) for start, end, _ in spans)))
    labels = dict.fromkeys(selection.labels)
    labels |= dict.fromkeys(Label(start, end - start, "problem", why) for start, end, why in spans)
    return replace(selection, excluded=excluded, labels=tuple(sorted(labels, key=lambda label: label.t)))


def include(dataset: Dataset, selection_id: str, start: float, end: float) -> Dataset:
    """With whatever was left out between start and end used again."""

    def change(selection: Selection) -> Selection:
        spans: list[tuple[float, float]] = []
        for a, b in selection.excluded:
            spans += [(x, y) for x, y in ((a, min(b, start)), (max(a, end), b)) if y > x]
        return replace(selection, excluded=tuple(spans))

    return update(dataset, [selection_id], change)


def split_at(dataset: Dataset, selection_id: str, times: Sequence[float], end: float) -> Dataset:
    """One selection cut into parts `<id>.1`, `<id>.2`, ... that keep its choices.

    A label goes with the part it begins in; what lies outside of the in and out points goes with the nearest.

    Args:
        times: where to cut; those outside the selection, or nearer than SHORTEST, do nothing.
        end: the end of the take, for a selection without an out point.
    """
    whole = _known(dataset, {selection_id})[0]
    last = end if whole.out_point is None else whole.out_point
    cuts = [whole.in_point]
    for t in sorted(times):
        if t - cuts[-1] >= SHORTEST and last - t >= SHORTEST:
            cuts.append(t)
    if len(cuts) == 1:
        return dataset
    names = _free_names(dataset, selection_id, len(cuts))
    ends: list[float | None] = [*cuts[1:], whole.out_point]
    parts = [_part(whole, *part, last) for part in zip(names, cuts, ends, strict=True)]
    borders = [-math.inf, *cuts[1:], math.inf]
    parts = [
        replace(p, labels=_between(whole, *span)) for p, span in zip(parts, pairwise(borders), strict=True)
    ]
    result: list[Selection] = []
    for selection in dataset.selections:
        result += parts if selection.id == selection_id else [selection]
    return replace(dataset, selections=tuple(result))


def put_back(dataset: Dataset, paths: Iterable[str]) -> Dataset:
    """With files of takes (paths inside the project) that were missing and were found again."""
    return replace(dataset, found=tuple(dict.fromkeys((*dataset.found, *paths))))


def update(dataset: Dataset, ids: Iterable[str], change: Callable[[Selection], Selection]) -> Dataset:
    """With a change made to some selections.

    Raises:
        RequestError: one of them is not there.
    """
    chosen = set(ids)
    _known(dataset, chosen)
    changed = tuple(change(s) if s.id in chosen else s for s in dataset.selections)
    return replace(dataset, selections=changed)


def merged_spans(spans: Iterable[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Spans in order, overlapping and touching ones joined."""
    result: list[tuple[float, float]] = []
    for start, end in sorted(spans):
        if result and start <= result[-1][1]:
            result[-1] = (result[-1][0], max(result[-1][1], end))
        elif end > start:
            result.append((start, end))
    return tuple(result)


def selections_of(dataset: Dataset, take: str) -> tuple[Selection, ...]:
    """All selections made of one take."""
    return tuple(s for s in dataset.selections if s.take == take)


def _part(whole: Selection, name: str, start: float, end: float | None, last: float) -> Selection:
    stop = last if end is None else end
    inside = tuple((max(a, start), min(b, stop)) for a, b in whole.excluded if min(b, stop) > max(a, start))
    return replace(whole, id=name, in_point=start, out_point=end, excluded=inside)


def _between(whole: Selection, start: float, stop: float) -> tuple[Label, ...]:
    return tuple(label for label in whole.labels if start <= label.t < stop)


def _free_names(dataset: Dataset, base: str, count: int) -> list[str]:
    taken = {s.id for s in dataset.selections}
    names: list[str] = []
    number = 1
    while len(names) < count:
        if (name := f"{base}.{number}") not in taken:
            names.append(name)
        number += 1
    return names


def _by_time(labels: tuple[Label, ...]) -> tuple[Label, ...]:
    return tuple(sorted(labels, key=lambda label: (label.t, label.tier, label.text)))


def _known(dataset: Dataset, ids: set[str]) -> list[Selection]:
    by_id = {s.id: s for s in dataset.selections}
    for selection_id in sorted(ids):
        if selection_id not in by_id:
            raise RequestError(
                say("There is no take {take} in this project.", take=selection_id),
                "Choose one that is there.",
            )
    return [by_id[selection_id] for selection_id in ids]
