"""What a run did, read from its epochs: best epoch, time left, whether it moves. Pure: no Qt widgets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from studio.training.events import STILL_RATIO

ALIVE = (0.8, 1.25)
JITTERS = 1.6
WATCH_FROM = 0.3
"""Part of the epochs after which stillness is worth a word; every model begins still."""

Event = Mapping[str, Any]


@dataclass(frozen=True)
class RunFacts:
    """One run at a glance; numbers are None where they are not known.

    Args:
        epochs: how many it finished.
        of: how many it was to do.
        best: the best epoch's number.
        rmse, pearson, motion_ratio: on validation at the best epoch.
        seconds: an epoch takes.
        eta: seconds left.
        advice: what to try where the model stands still, "" else.
    """

    epochs: int = 0
    of: int | None = None
    best: int | None = None
    rmse: float | None = None
    pearson: float | None = None
    motion_ratio: float | None = None
    seconds: float | None = None
    eta: float | None = None
    advice: str = ""

    @property
    def life(self) -> str:
        """ "alive", "still", "shaky", "calm" or "" where it is not known."""
        ratio = self.motion_ratio
        if ratio is None:
            return ""
        if ratio < STILL_RATIO:
            return "still"
        if ratio < ALIVE[0]:
            return "calm"
        return "alive" if ratio <= JITTERS else "shaky"


def run_facts(events: Sequence[Event]) -> RunFacts:
    """The facts of epoch events in order."""
    epochs = [event for event in events if event.get("event", "epoch") == "epoch" and "epoch" in event]
    if not epochs:
        return RunFacts()
    last = epochs[-1]
    best = _best(epochs)
    return RunFacts(
        epochs=int(last["epoch"]),
        of=_whole(last.get("of")),
        best=int(best["epoch"]) if best else None,
        rmse=_metric(best, "rmse"),
        pearson=_metric(best, "pearson"),
        motion_ratio=_metric(best, "motion_ratio"),
        seconds=_pace(epochs),
        eta=_number(last.get("eta_s")),
        advice=str(last.get("advice") or "") if len(epochs) >= WATCH_FROM * (last.get("of") or 0) else "",
    )


def curves(events: Sequence[Event]) -> dict[str, list[tuple[int, float | None]]]:
    """Points of train_loss, val_loss and every validation metric, by epoch."""
    found: dict[str, list[tuple[int, float | None]]] = {}
    for event in events:
        if "epoch" not in event:
            continue
        epoch = int(event["epoch"])
        values = {key: event.get(key) for key in ("train_loss", "val_loss")} | dict(event.get("val") or {})
        for key, value in values.items():
            found.setdefault(key, []).append((epoch, _number(value)))
    return found


def _best(epochs: Sequence[Event]) -> Event | None:
    """The epoch the training calls best, else that of the lowest validation (or training) loss."""
    said = next((e["best_epoch"] for e in reversed(epochs) if e.get("best_epoch") is not None), None)
    if said is not None:
        return next((e for e in reversed(epochs) if e["epoch"] == said), None)
    marked = [e for e in epochs if e.get("best")]
    if marked:
        return marked[-1]
    for key in ("val_loss", "train_loss"):
        known = [(value, e) for e in epochs if (value := _number(e.get(key))) is not None]
        if known:
            return min(known, key=lambda pair: pair[0])[1]
    return None


def _pace(epochs: Sequence[Event]) -> float | None:
    """Seconds an epoch took lately; events carry the seconds since training began."""
    known = [(e["epoch"], t) for e in epochs if (t := _number(e.get("seconds"))) is not None][-6:]
    if len(known) < 2 or known[-1][0] <= known[0][0]:
        return known[-1][1] / max(known[-1][0], 1) if known else None
    return (known[-1][1] - known[0][1]) / (known[-1][0] - known[0][0])


def _metric(event: Event | None, name: str) -> float | None:
    return _number((event.get("val") or {}).get(name)) if event else None


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def _whole(value: object) -> int | None:
    number = _number(value)
    return None if number is None else int(number)
