"""Events that many commands print: notes, problems, progress, and the last line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class ChildEvent:
    """One line of output."""

    NAME: ClassVar[str] = ""
    VERBS: ClassVar[tuple[str, ...]] = ()


@dataclass(frozen=True)
class NoteEvent(ChildEvent):
    """Something worth knowing, one sentence.

    Args:
        text: the sentence.
        note: the same, from commands that call it so.
        take: whom it is about, "" for nobody.
    """

    NAME = "note"

    text: str = ""
    note: str = ""
    take: str = ""


@dataclass(frozen=True)
class ProblemEvent(ChildEvent):
    """Something went wrong, and the command goes on.

    Args:
        what, remedy: one sentence each.
        path: the file it is about, "" for none.
        fraction: how much of the work is done, None where nobody counts.
    """

    NAME = "problem"

    what: str = ""
    remedy: str = ""
    path: str = ""
    fraction: float | None = None


@dataclass(frozen=True)
class NoticeEvent(ChildEvent):
    """A fault of a performance or playback that goes on, or that one is over."""

    NAME = "notice"

    what: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class RecoveredEvent(ChildEvent):
    """A take whose recording was cut off is whole again."""

    NAME = "recovered"

    take: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class NotRecoveredEvent(ChildEvent):
    """A recording that was cut off could not be made a take."""

    NAME = "not_recovered"

    folder: str = ""
    what: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class UnfinishedEvent(ChildEvent):
    """A recording that is no take yet is packed as it lies."""

    NAME = "unfinished"

    folder: str = ""
    what: str = ""


@dataclass(frozen=True)
class ProgressEvent(ChildEvent):
    """How far a command is.

    Args:
        fraction: 0..1.
        eta_s: seconds left, None where nobody can tell.
    """

    NAME = "progress"

    fraction: float = 0.0
    eta_s: float | None = None


@dataclass(frozen=True)
class TakeProgressEvent(ProgressEvent):
    """How far a command is, and at which take it works."""

    VERBS = ("cut", "clean")

    take: str = ""


@dataclass(frozen=True)
class TakeEvent(ChildEvent):
    """A command is done with a take: it is imported, checked, cut, cleaned or made.

    Args:
        take: its id.
        fraction: how much of the whole work is done, None where nobody counts.
        grade: of `check`.
        path: the file it was imported from.
        file: its cleaned sound.
        notes: sentences about it.
        parts: spans it was cut into, seconds.
    """

    NAME = "take"

    take: str = ""
    fraction: float | None = None
    grade: str = ""
    path: str = ""
    file: str = ""
    notes: tuple[str, ...] = ()
    parts: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class DoneEvent(ChildEvent):
    """The last line of every command that ended well."""

    NAME = "done"


@dataclass(frozen=True)
class ErrorEvent(ChildEvent):
    """The last line of a command that failed.

    Args:
        what, remedy: one sentence each.
        code: what programs decide by, see StudioError.
        in_window: what to do about it in the window, where that is something else.
        there: the file that would have been written over, "" where that is not why.
        log: where the details lie, None for nowhere.
    """

    NAME = "error"

    what: str = ""
    remedy: str = ""
    code: str = "failed"
    in_window: str = ""
    there: str = ""
    log: str | None = None
