"""Events that many commands print: notes, problems, progress, and the last line."""

from __future__ import annotations

from typing import ClassVar

import msgspec


class ChildEvent(msgspec.Struct, frozen=True):
    """One line of output."""

    NAME: ClassVar[str] = ""
    VERBS: ClassVar[tuple[str, ...]] = ()


class NoteEvent(ChildEvent, frozen=True):
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


class ProblemEvent(ChildEvent, frozen=True):
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


class NoticeEvent(ChildEvent, frozen=True):
    """A fault of a performance or playback that goes on, or that one is over."""

    NAME = "notice"

    what: str = ""
    remedy: str = ""


class RecoveredEvent(ChildEvent, frozen=True):
    """A take whose recording was cut off is whole again."""

    NAME = "recovered"

    take: str = ""
    notes: tuple[str, ...] = ()


class NotRecoveredEvent(ChildEvent, frozen=True):
    """A recording that was cut off could not be made a take."""

    NAME = "not_recovered"

    folder: str = ""
    what: str = ""
    remedy: str = ""


class UnfinishedEvent(ChildEvent, frozen=True):
    """A recording that is no take yet is packed as it lies."""

    NAME = "unfinished"

    folder: str = ""
    what: str = ""


class ProgressEvent(ChildEvent, frozen=True):
    """How far a command is.

    Args:
        fraction: 0..1.
        eta_s: seconds left, None where nobody can tell.
    """

    NAME = "progress"

    fraction: float = 0.0
    eta_s: float | None = None


class TakeProgressEvent(ProgressEvent, frozen=True):
    """How far a command is, and at which take it works."""

    VERBS = ("cut", "clean")

    take: str = ""


class TakeEvent(ChildEvent, frozen=True):
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


class DoneEvent(ChildEvent, frozen=True):
    """The last line of every command that ended well."""

    NAME = "done"


class ErrorEvent(ChildEvent, frozen=True):
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
