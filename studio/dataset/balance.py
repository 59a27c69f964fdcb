"""Dividing selections among train, val and test: each gets its share of the seconds and of every label."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Dataset, Selection

SHARES = {"train": 0.8, "val": 0.1, "test": 0.1}
ALL_TRAIN = {"train": 1.0, "val": 0.0, "test": 0.0}
"""Shares where there is too little to keep any of it back; what is locked stays in test."""
FEW_TAKES, FEW_SECONDS = 4, 240.0
"""Below either, a take kept back costs more than it tells: training checks itself on the end of one."""
BALANCED_TIERS = frozenset({"emotion", "gesture", "vowel"})
"""Tiers whose words come from a vocabulary, so that the same one is in many takes."""
MOMENT = 1.0
"""Seconds that a label without a length counts."""
LENGTH_WEIGHT = 2.0
"""How much the seconds count against all labels together."""
ROUNDS = 200

Floats = NDArray[np.float64]


def balanced_split(
    dataset: Dataset,
    durations: Mapping[str, float],
    shares: Mapping[str, float] = SHARES,
    unfit: Collection[str] = (),
) -> Dataset:
    """Selections divided by duration and by what they are labelled, performer by performer where they can be.

    Parts cut from one take stay together, so that nothing tested was trained on. Selections that are not
    used (split "") stay unused, and takes with a locked test part stay whole in test. With two takes or
    more there is always something to train on, with two something to validate on, with three a test.

    Args:
        dataset: what is divided.
        durations: seconds by selection id; one that is missing counts as one second.
        shares: the wanted fraction of all seconds, and of the seconds of each emotion, gesture and other
            label with a vocabulary, for each split.
        unfit: takes that can judge nothing, as those without sound or motion: they stay in train, unless
            there is no other take.
    """
    used = [s for s in dataset.selections if s.split]
    locked = {s.take for s in used if s.locked}
    used = [s for s in used if s.take not in unfit or s.take in locked] or used
    groups = _groups(used, durations)
    where = _divided_groups(groups, used, durations, shares)
    # Performers with a take or two each leave nothing to judge by: then all of them are divided as one.
    if len(set(where.values())) < min(len(where), len(shares)) and len(groups) > 1:
        everybody = {take: seconds for takes in groups for take, seconds in takes.items()}
        where = _divided_groups([everybody], used, durations, shares)
    return replace(
        dataset,
        selections=tuple(
            replace(s, split=where.get(s.take, "train")) if s.split and not s.locked else s
            for s in dataset.selections
        ),
    )


def shares_for(seconds: Collection[float]) -> Mapping[str, float]:
    """The shares for takes that last so many seconds each: all of few of them, or of short ones, trains."""
    return ALL_TRAIN if len(seconds) < FEW_TAKES or sum(seconds) < FEW_SECONDS else SHARES


def _divided_groups(
    groups: Sequence[dict[str, float]],
    used: Sequence[Selection],
    durations: Mapping[str, float],
    shares: Mapping[str, float],
) -> dict[str, str]:
    """The split of each take, one group after another."""
    where: dict[str, str] = {}
    locked = {s.take for s in used if s.locked}
    for takes in groups:
        divided = _divided(takes, locked & takes.keys(), shares)
        where |= _by_label(_amounts(takes, used, durations), sorted(takes), divided, locked, shares)
    return where


def leaking(dataset: Dataset) -> tuple[str, ...]:
    """Takes of which one part is trained on and another one judges the training."""
    splits: dict[str, set[str]] = {}
    for s in dataset.selections:
        splits.setdefault(s.take, set()).add(s.split)
    return tuple(take for take, used in splits.items() if "train" in used and used & {"val", "test"})


def _groups(used: Sequence[Selection], durations: Mapping[str, float]) -> list[dict[str, float]]:
    """Seconds by take, one group a performer; a take of several performers goes with the first of them."""
    performer: dict[str, str] = {}
    for s in sorted(used, key=lambda s: (s.take, s.performer)):
        performer.setdefault(s.take, s.performer)
    groups: dict[str, dict[str, float]] = {name: {} for name in sorted(set(performer.values()))}
    for s in used:
        takes = groups[performer[s.take]]
        takes[s.take] = takes.get(s.take, 0.0) + _duration(s, durations)
    return list(groups.values())


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


def _by_label(
    amounts: Floats, names: list[str], where: dict[str, str], locked: set[str], shares: Mapping[str, float]
) -> dict[str, str]:
    """A division with takes moved and swapped while that brings labels nearer to their shares.

    `amounts` are the takes' (by name) shares of seconds and labels, (takes, 1 + labels).
    """
    splits = [split for split in shares if split in where.values()]
    if amounts.shape[1] == 1 or len(splits) < 2:
        return where
    place = np.array([splits.index(where[name]) for name in names])
    free = np.array([name not in locked for name in names])
    wanted = np.array([shares[split] for split in splits])[:, None] * amounts.sum(axis=0)
    for _ in range(ROUNDS):
        over = np.stack([amounts[place == s].sum(axis=0) for s in range(len(splits))]) - wanted
        better = min(_changes(amounts, place, free, over), default=None)
        if better is None or better[0] > -1e-9:
            break
        for take, split in better[1]:
            place[take] = split
    return {name: splits[place[i]] for i, name in enumerate(names)}


def _amounts(takes: dict[str, float], used: Sequence[Selection], durations: Mapping[str, float]) -> Floats:
    """Share of all seconds, then of the seconds of each label, that every take (by name) has."""
    names = sorted(takes)
    rows = {name: row for row, name in enumerate(names)}
    found: dict[tuple[str, str], Floats] = {}
    for s in used:
        if s.take not in takes:
            continue
        marks = [(x.tier, x.text, max(x.duration, MOMENT)) for x in s.labels if x.tier in BALANCED_TIERS]
        if s.emotion and not any(tier == "emotion" for tier, *_ in marks):
            marks.append(("emotion", s.emotion, _duration(s, durations)))
        for tier, text, seconds in marks:
            found.setdefault((tier, text), np.zeros(len(names)))[rows[s.take]] += seconds
    # A label in one take only cannot be shared out.
    labels = [found[key] / found[key].sum() for key in sorted(found) if np.count_nonzero(found[key]) > 1]
    lengths = np.array([takes[name] for name in names])
    weight = np.sqrt(LENGTH_WEIGHT * max(len(labels), 1))
    columns = [weight * lengths / lengths.sum(), *labels]
    return np.stack(columns, axis=1)


def _changes(
    amounts: Floats, place: NDArray[np.intp], free: NDArray[np.bool_], over: Floats
) -> Iterator[tuple[float, list[tuple[int, int]]]]:
    """The best move and the best swap between each two splits: (what it costs, [(take, its new split)]).

    Taking c from split a to split b changes the sum of squares by 2 |c|^2 - 2 (over_a - over_b) c.
    """
    squares = (amounts**2).sum(axis=1)
    for a, b in ((a, b) for a in range(len(over)) for b in range(len(over)) if a != b):
        mine, theirs = np.flatnonzero((place == a) & free), np.flatnonzero((place == b) & free)
        pull = amounts @ (over[a] - over[b])
        if len(mine) and np.count_nonzero(place == a) > 1:
            cost = 2 * (squares[mine] - pull[mine])
            best = int(np.argmin(cost))
            yield float(cost[best]), [(int(mine[best]), b)]
        if a < b and len(mine) and len(theirs):
            both = amounts[mine] @ amounts[theirs].T
            apart = squares[mine][:, None] + squares[theirs] - 2 * both
            costs = 2 * (apart - pull[mine][:, None] + pull[theirs])
            i, j = np.unravel_index(int(np.argmin(costs)), costs.shape)
            yield float(costs[i, j]), [(int(mine[i]), b), (int(theirs[j]), a)]
