"""What is used of takes that a project finds: of new ones all but what is of no use, of older ones too."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress

from studio.dataset import edits
from studio.dataset.dataset import Dataset, Selection
from studio.errors import StudioError
from studio.take.folder import with_dead_parts
from studio.take.take import Take, TakeInfo


def selection_of(take: Take, performer: str) -> Selection:
    """What is used of a new take: all but what it says itself is of no use, each span labelled with why."""
    whole = Selection(take.id, take.id, performer=performer, split="train" if _is_material(take) else "")
    return edits.without(whole, take.info.left_out)


def takes_with_dead_parts(takes: Iterable[Take]) -> dict[str, Take]:
    """Those saved before sound without motion was noted that have some, with that noted, by id."""
    found = {}
    for take in takes:
        # What cannot be read is for its check to tell of.
        with suppress(StudioError):
            known = with_dead_parts(take)
            if known is not take:
                found[take.id] = known
    return found


def without_dead_parts(dataset: Dataset, takes: Mapping[str, Take]) -> Dataset:
    """With what takes, by id, say is of no use left out of all that is used of them."""
    ids = [selection.id for selection in dataset.selections if selection.take in takes]
    return edits.update(dataset, ids, lambda selection: _without(selection, takes[selection.take].info))


def _without(selection: Selection, info: TakeInfo) -> Selection:
    # An older take may be aligned already: where its motion begins and ends has moved, the sound has not.
    spans = [
        (
            start + selection.offset * (start > 0.0),
            end + selection.offset * (end < info.duration - 0.001),
            why,
        )
        for start, end, why in info.left_out
    ]
    held = [(max(start, 0.0), min(end, info.duration), why) for start, end, why in spans]
    return edits.without(selection, [span for span in held if span[0] < span[1]])


def _is_material(take: Take) -> bool:
    """Whether a new take is trained on: it has both parts, it can be heard, and no run made its motion."""
    return take.trains and not take.info.predicted and not _is_silent(take)


def _is_silent(take: Take) -> bool:
    """Whether nothing can be heard in a take; one that cannot be read is for its check to tell of."""
    from studio.take.findings import is_silent

    with suppress(StudioError):
        return take.audio_path is not None and is_silent(take.audio_path)
    return False
