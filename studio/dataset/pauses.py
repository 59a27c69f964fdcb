"""One take cut into many where nobody speaks: which spans stay, and the edit that makes parts of them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.dataset import edits
from studio.dataset.dataset import Dataset

Span = tuple[float, float]

SPEAKS, FALLS_SILENT = 0.5, 0.35
"""Chance from which speech begins, and below which it has ended: two, so that it does not flicker."""


@dataclass(frozen=True)
class Cut:
    """How a take is cut.

    Args:
        pause: seconds of silence at least, for a cut to be made there.
        shortest: seconds a part has at least; a shorter one stays with its nearer neighbour.
        padding: seconds of silence kept before and after what is spoken.
    """

    pause: float = 0.6
    shortest: float = 2.0
    padding: float = 0.3


def spoken(chances: NDArray[np.floating], hop: float) -> tuple[Span, ...]:
    """Where somebody speaks, seconds, by the chance of it in every `hop` seconds (T,)."""
    spans: list[Span] = []
    start: int | None = None
    for i, chance in enumerate(chances.tolist()):
        if start is None and chance >= SPEAKS:
            start = i
        elif start is not None and chance < FALLS_SILENT:
            spans.append((start * hop, i * hop))
            start = None
    if start is not None:
        spans.append((start * hop, len(chances) * hop))
    return tuple(spans)


def parts(speech: tuple[Span, ...], cut: Cut, start: float, end: float) -> tuple[Span, ...]:
    """The spans that stay of start..end seconds; in order, and never over each other.

    Args:
        speech: where somebody speaks, in order.
        cut: how it is cut.
        start, end: what is used of the take.

    Returns:
        None or one where nobody pauses for long enough.
    """
    inside = [(max(a, start), min(b, end)) for a, b in speech if b > start and a < end]
    joined: list[Span] = []
    for a, b in inside:
        if joined and a - joined[-1][1] < cut.pause:
            joined[-1] = (joined[-1][0], b)
        else:
            joined.append((a, b))
    joined = _long_enough(joined, cut)
    padded: list[Span] = []
    for i, (a, b) in enumerate(joined):
        # Where two parts would reach for the same silence, each gets half of it.
        before = (joined[i - 1][1] + a) / 2 if i else start
        after = (b + joined[i + 1][0]) / 2 if i + 1 < len(joined) else end
        padded.append((max(a - cut.padding, before), min(b + cut.padding, after)))
    return tuple(padded)


def split_into(dataset: Dataset, selection_id: str, spans: tuple[Span, ...], end: float) -> Dataset:
    """One selection made into parts `<id>.1`, `<id>.2`, ... that use these spans and keep its choices.

    Args:
        spans: in order, not over each other; fewer than two change nothing.
        end: the end of the take.
    """
    if len(spans) < 2:
        return dataset
    borders = [(a[1] + b[0]) / 2 for a, b in pairwise(spans)]
    before = {s.id for s in dataset.selections}
    dataset = edits.split_at(dataset, selection_id, borders, end)
    made = [s.id for s in dataset.selections if s.id not in before]
    for name, (a, b) in zip(made, spans, strict=True):
        dataset = edits.trim(dataset, name, a, None if b >= end - 1e-6 else b)
    return dataset


def _long_enough(spans: list[Span], cut: Cut) -> list[Span]:
    """Spans of which none, padded, is shorter than a part may be."""
    spans = list(spans)
    while len(spans) > 1:
        lengths = [b - a + 2 * cut.padding for a, b in spans]
        i = int(np.argmin(lengths))
        if lengths[i] >= cut.shortest:
            break
        before = spans[i][0] - spans[i - 1][1] if i else np.inf
        after = spans[i + 1][0] - spans[i][1] if i + 1 < len(spans) else np.inf
        first = i - 1 if before <= after else i
        spans[first : first + 2] = [(spans[first][0], spans[first + 1][1])]
    return spans
