"""Events of a training run: plain values, one JSON line each (no torch)."""

from __future__ import annotations

from enum import StrEnum

from studio.ipc.events import (
    CleaningEvent,
    EpochEvent,
    ListeningEvent,
    NoteEvent,
    OutOfMemoryEvent,
    StartedEvent,
    StepEvent,
)

STILL_RATIO = 0.3
"""Below this share of the captured motion a model is called still."""

STILL_ADVICE = (
    "The model hardly moves yet. If this stays, train longer, choose the recipe balanced, "
    "or check in Curate that sound and motion line up."
)


class RunStatus(StrEnum):
    """How a run stands; `status` in report.json."""

    RUNNING = "running"
    DONE = "done"
    STOPPED = "stopped"
    FAILED = "failed"


Event = StartedEvent | NoteEvent | CleaningEvent | ListeningEvent | EpochEvent | StepEvent | OutOfMemoryEvent


def is_still(motion_ratio: float | None) -> bool:
    """Whether a model moves so little that a person should be told."""
    return motion_ratio is not None and motion_ratio < STILL_RATIO
