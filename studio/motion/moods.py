"""Moods: labelled stretches as something a network is told, and where a person asks for them.

A run keeps a mood for each label that stands on enough of what it learns from. It is a vector beside the
style, added where the label stands and by as much as is asked for; none is the motion without a label.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, say

Spans = dict[str, list[tuple[float, float]]]
"""Where each mood stands, seconds."""
FADE_S = 0.3
"""One mood goes over into another within so many seconds, half of them on either side of the edge."""
STRONGEST = 1.5
LEAST_SECONDS = 3.0
"""A label that stands on less of the training takes is not learnt: it would be one sentence by heart."""
MOST = 9
"""Moods of a run, those with most material: as many as there are keys in Live."""
_WRITTEN = re.compile(
    r"(?P<name>.+?)(?:\*(?P<strength>\d+(?:\.\d+)?))?"
    r"(?::(?P<start>\d+(?:\.\d+)?)-(?P<end>\d+(?:\.\d+)?)?)?",
    re.DOTALL,
)


@dataclass(frozen=True)
class MoodSpan:
    """A mood that is asked for.

    Args:
        name: one that the run knows.
        start, end: seconds of the sound.
        strength: 1 as it was learnt, up to STRONGEST.
    """

    name: str
    start: float = 0.0
    end: float = float("inf")
    strength: float = 1.0

    @classmethod
    def read(cls, text: str) -> MoodSpan:
        """What is written as NAME, NAME:START-END, NAME:START- (to the end) or NAME*STRENGTH:START-END.

        Raises:
            RequestError: it is not possible.
        """
        found = _WRITTEN.fullmatch(text)
        start = end = None
        if found is not None:
            start, end = found["start"], found["end"]
        if found is None or (start is not None and end is not None and float(start) >= float(end)):
            raise RequestError(
                say("{text} is no mood.", text=text or say("Nothing")), "Write one as happy or happy:2.0-5.5."
            )
        strength = float(found["strength"] or 1)
        if strength > STRONGEST:
            what = say("A mood {strength} times as strong is not possible.", strength=f"{strength:g}")
            raise RequestError(
                what,
                say("Choose 0 (not at all) to {strongest}; 1 is as trained.", strongest=f"{STRONGEST:g}"),
            )
        return cls(found["name"], float(start or 0), float(end or "inf"), strength)

    @property
    def text(self) -> str:
        """As `read` understands it."""
        end = f"{self.end:.3f}" if np.isfinite(self.end) else ""
        where = f":{self.start:.3f}-{end}" if end or self.start > 0 else ""
        found = _WRITTEN.fullmatch(self.name)
        # A name that ends like a strength or a stretch is told from one by its own strength behind it.
        plain = self.strength == 1 and found is not None and found["name"] == self.name
        strength = "" if plain else f"*{self.strength:.6f}".rstrip("0").rstrip(".")
        return f"{self.name}{strength}{where}"


def check_known(moods: Iterable[str], known: Sequence[str], run: str) -> None:
    """Whether a run knows the moods it is asked for.

    Raises:
        RequestError: it does not.
    """
    for name in moods:
        if name not in known:
            what = say("{run} knows no mood called {name}.", run=run, name=name)
            choose = say("Choose one of: {known}.", known=", ".join(known))
            raise RequestError(what, choose if known else "Label moods in Curate, and train again.")


def weights_at(
    spans: Iterable[MoodSpan], names: Sequence[str], times: NDArray[np.floating]
) -> NDArray[np.float32]:
    """How strong each mood is at some moments (n,), with cross-fades at the edges: (n, moods)."""
    weights = np.zeros((len(times), len(names)), dtype=np.float64)
    for span in spans:
        # A span from the very start has no edge there: the first word is as happy as the second.
        begun = _ramp(times - span.start) if span.start > 0 else np.ones(len(times))
        weights[:, names.index(span.name)] += span.strength * begun * (1 - _ramp(times - span.end))
    # Spans of one mood may lie over one another.
    return np.minimum(weights, STRONGEST).astype(np.float32)


def _ramp(seconds: NDArray[np.floating]) -> NDArray[np.floating]:
    """From 0 to 1 around an edge; two moods that meet there are 1 together all the way."""
    return np.clip(seconds / FADE_S + 0.5, 0.0, 1.0)


def learnable(takes: Iterable[tuple[Spans, NDArray[np.floating], float]]) -> tuple[str, ...]:
    """The moods that stand on enough of the takes, the longest first.

    Args:
        takes: where each mood stands, the frames that count (T,), and frames a second, of each take.
    """
    seconds: dict[str, float] = {}
    for spans, valid, fps in takes:
        for name in spans:
            counted = (stands(spans, (name,), len(valid), fps)[:, 0] * valid).sum() / fps
            seconds[name] = seconds.get(name, 0.0) + float(counted)
    enough = sorted((-length, name) for name, length in seconds.items() if length >= LEAST_SECONDS)
    return tuple(name for _, name in enough[:MOST])


def stands(spans: Spans, names: Sequence[str], frames: int, fps: float) -> NDArray[np.float32]:
    """1 where a mood's label stands on a frame, else 0, (T, moods)."""
    times = np.arange(frames) / fps
    found = np.zeros((frames, len(names)), dtype=np.float32)
    for column, name in enumerate(names):
        for start, end in spans.get(name, ()):
            found[(times >= start) & (times < end), column] = 1.0
    return found
