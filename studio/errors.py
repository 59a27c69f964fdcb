"""The one way the studio says that something went wrong, and how it counts things in a sentence."""

from __future__ import annotations


def counted(number: int, thing: str) -> str:
    """A number and what it counts: "1 frame", "1,472 frames"."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


class StudioError(Exception):
    """Something a person can act on.

    Args:
        what: one sentence naming the thing that happened.
        remedy: one sentence saying what to do about it, at a terminal too.
        code: what programs decide by; the kind's own where it is not given. Sentences change and are
            translated, codes stay.
        in_window: the remedy where it is another one in the window, where options have no dashes.
    """

    code = "failed"

    def __init__(self, what: str, remedy: str, *, code: str = "", in_window: str = "") -> None:
        super().__init__(f"{what} {remedy}")
        self.what = what
        self.remedy = remedy
        self.in_window = in_window or remedy
        if code:
            self.code = code


class RequestError(StudioError):
    """The request itself was wrong (an unknown take, a bad option): exit code 2 on the command line."""

    code = "request"


class FileThereError(RequestError):
    """A file would be written over, which is not done unasked.

    Args:
        what, remedy: the two sentences.
        file: the name of the file.
        in_window: the remedy in the window.
    """

    code = "exists"

    def __init__(self, what: str, remedy: str, file: str, *, in_window: str = "") -> None:
        super().__init__(what, remedy, in_window=in_window)
        self.file = file


class InputError(StudioError):
    """A port or a microphone cannot be opened."""

    code = "input"


def port_taken(port: int) -> InputError:
    """Another program receives on a UDP port."""
    return InputError(
        f"Port {port} is used by another program, such as VSeeFace or a second studio.",
        "Close it, or choose another port in Record (or with --port).",
        in_window="Close it, or choose another port here.",
    )


def no_sound(what: str) -> InputError:
    """There is no sound input to be had; `what` says why."""
    check = "Check that a microphone is plugged in and allowed"
    return InputError(
        what,
        f"{check}. Without one, record takes --device none and live takes --file.",
        in_window=f"{check}, then refresh the list of devices.",
    )


class Cancelled(StudioError):  # noqa: N818 (a request that was met, not an error)
    """Work ended because the person who asked for it cancelled it; nothing of it was written."""

    code = "cancelled"

    def __init__(self, what: str = "It was cancelled.") -> None:
        super().__init__(what, "Nothing was written.")
