"""Dividing selections among train, val and test so that each gets its share of the seconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from studio.dataset.dataset import Dataset, Selection

SHARES = {"train": 0.8, "val": 0.1, "test": 0.1}


def balanced_split(
    dataset: Dataset, durations: Mapping[str, float], shares: Mapping[str, float] = SHARES
) -> Dataset:
    """Selections divided by duration, performer by performer.

    Parts cut from one take stay together, so that nothing tested was trained on. Selections that are not
    used (split "") stay unused, and takes with a locked test part stay whole in test. With two takes or
    more there is always something to train on, with two something to validate on, with three a test.

    Args:
        dataset: what is divided.
        durations: seconds by selection id; one that is missing counts as one second.
        shares: the wanted fraction of all seconds for each split.
    """
    where: dict[str, str] = {}
    for performer in sorted({s.performer for s in dataset.selections}):
        takes = _takes(dataset, performer, durations)
        locked = {s.take for s in dataset.selections if s.locked and s.take in takes}
        where |= _divided(takes, locked, shares)
    divided = tuple(
        replace(s, split=where[s.take]) if s.split and not s.locked and s.take in where else s
        for s in dataset.selections
    )
    return replace(dataset, selections=divided)


def _takes(dataset: Dataset, performer: str, durations: Mapping[str, float]) -> dict[str, float]:
    """Seconds by take, of one performer's used selections."""
    seconds: dict[str, float] = {}
    for s in dataset.selections:
        if s.split and s.performer == performer:
            seconds[s.take] = seconds.get(s.take, 0.0) + _duration(s, durations)
    return seconds


def _duration(selection: Selection, durations: Mapping[str, float]) -> float:
    return max(durations.get(selection.id, 1.0), 1e-3)


def _divided(takes: dict[str, float], locked: set[str], shares: Mapping[str, float]) -> dict[str, str]:
    """The split of each take: the longest first, each to where most seconds are still missing."""
    total = sum(takes.values())
    missing = {split: share * total for split, share in shares.items()}
    where = dict.fromkeys(sorted(locked), "test")
    for take in locked:
        missing["test"] -= takes[take]
    free = sorted((take for take in takes if take not in locked), key=lambda take: (-takes[take], take))
    if not free:
        return where
    # The shortest takes go to val and test, which need little: what is left trains.
    wanted = [split for split in ("val", "test") if missing.get(split, 0.0) > 1e-9]
    for split in wanted[: len(free) - 1]:
        take = min(free, key=lambda take: (abs(takes[take] - missing[split]), take))
        free.remove(take)
        where[take] = split
        missing[split] -= takes[take]
    for take in free:
        split = max(missing, key=lambda split: missing[split])
        where[take] = split
        missing[split] -= takes[take]
    return where
