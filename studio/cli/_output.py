"""What a command prints: sentences for people, JSON lines for programs, and how each outcome ends it."""

from __future__ import annotations

import os
import shutil
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from studio.errors import FileThereError, RequestError, StudioError, say
from studio.files.atomic import plain
from studio.ipc.events import (
    FOR_WINDOW,
    ChildEvent,
    DoneEvent,
    ErrorEvent,
    NoteEvent,
    ProgressEvent,
    encode,
)
from studio.vmc import MARIONETTE_PORT

EXAMPLE_TARGET = f"127.0.0.1:{MARIONETTE_PORT}"
"""An address as it is written, in helps and complaints; where motion goes is in the settings."""


def address(text: str) -> tuple[str, int]:
    """HOST:PORT as its two parts.

    Raises:
        RequestError: it is written otherwise, or there is no such port.
    """
    host, _, port = text.rpartition(":")
    # isdigit alone takes digits of other scripts, which int reads and sockets do not.
    if not host or not (port.isascii() and port.isdigit()) or not 1 <= int(port) <= 65535:
        raise RequestError(
            say("{text} is not an address.", text=text),
            say("Write HOST:PORT, such as {example}.", example=EXAMPLE_TARGET),
        )
    # IPv6 addresses stand in brackets before a port.
    return host.strip("[]"), int(port)


class Output:
    """Where a command reports to.

    Args:
        as_json: one JSON object per line instead of sentences.
    """

    def __init__(self, as_json: bool = False) -> None:
        self.as_json = as_json
        self._passing = 0

    def emit(self, event: ChildEvent, text: str = "") -> None:
        """Something happened.

        Args:
            event: what programs read.
            text: the sentence for people; nothing is printed for them where empty.
        """
        if self.as_json:
            # UTF-8 as it is: escaped Japanese names are unreadable in a log.
            put(encode(event, plain, templates=FOR_WINDOW in os.environ))
        elif text:
            self._wipe()
            put(text)

    def progress(self, event: ProgressEvent, what: str = "") -> None:
        """How far the command is, on a passing line: percent, then what it is at or the time left."""
        left = f", {event.eta_s:.0f} s left" if event.eta_s is not None and event.fraction < 1 else ""
        self.pass_by(event, f"{event.fraction:4.0%}  {what}" if what else f"{event.fraction:4.0%}{left}")

    def pass_by(self, event: ChildEvent, text: str) -> None:
        """Something soon out of date, such as progress.

        On a terminal it is one line, written over by the next; in a file or a pipe people are spared it.
        """
        if self.as_json:
            self.emit(event)
        # In a log a line for every percent would bury the sentences.
        elif sys.stdout.isatty():
            self._wipe()
            # A line that wraps could not be written over again.
            text = text[: shutil.get_terminal_size().columns - 1]
            self._passing = len(text)
            put(text, end="")

    def note(self, text: str) -> None:
        """Something a person should know about the work, as the event `note`."""
        self.emit(NoteEvent(text), text)

    def warn(self, event: ChildEvent, text: str) -> None:
        """Something went wrong beside the command's own work, which goes on: a sentence on stderr."""
        if self.as_json:
            self.emit(event)
        else:
            self._wipe()
            print(text, file=sys.stderr, flush=True)

    def _wipe(self) -> None:
        """Take a passing line away again; spaces do, where a terminal knows no escape codes."""
        if self._passing:
            put(f"\r{' ' * self._passing}\r", end="")
            self._passing = 0

    def done(self, event: DoneEvent, text: str = "") -> None:
        """The command ended well; the last line of every successful command."""
        self.emit(event, text)

    def error(self, event: ErrorEvent, *, hint: bool = False) -> None:
        """The command failed: a sentence on stderr and, in JSON, the last line.

        Args:
            event: what happened.
            hint: people are told of the log too; they need it only for what nobody foresaw.
        """
        details = f" Details are in {event.log}." if event.log and hint else ""
        if self.as_json:
            self.emit(event)
        self._wipe()
        try:
            print(f"{event.what} {event.remedy}{details}", file=sys.stderr, flush=True)
        except OSError:
            # Both may go to one full disk; the exit code tells the rest.
            # Python would try once more when it ends, and then leave with a code of its own, 120.
            _silence(sys.stderr)


def run_command(work: Callable[[], int], out: Output) -> int:
    """Run a command and turn whatever it raises into a sentence and an exit code."""
    try:
        return work()
    except StudioError as error:
        # A wrong request has no traceback worth a file.
        is_request = isinstance(error, RequestError)
        out.error(
            ErrorEvent(
                error.what, error.remedy, error.code,
                in_window=error.in_window if error.in_window != error.remedy else "",
                there=error.file if isinstance(error, FileThereError) else "",
                log=None if is_request else _write_log(),
            )
        )  # fmt: skip
        return 2 if is_request else 1
    except KeyboardInterrupt as error:
        out.error(ErrorEvent("Interrupted.", str(error) or "Nothing that was saved is lost."))
        return 130
    except BrokenPipeError:
        # The reader left; a second failure at exit would only add noise.
        silence_stdout()
        return 1
    except Exception as error:
        what = say("Something unexpected happened: {kind}: {error}.", kind=type(error).__name__, error=error)
        out.error(ErrorEvent(what, "Please report it with the log.", log=_write_log()), hint=True)
        return 1


@contextmanager
def as_request() -> Iterator[None]:
    """Around reading what a person named: a file that cannot be used is a wrong request, not our failure."""
    try:
        yield
    except RequestError:
        raise
    except StudioError as error:
        raise RequestError(error.what, error.remedy, in_window=error.in_window) from error


def _write_log() -> str | None:
    """The traceback of the current exception in a file people can send; None where it can't be written."""
    from platformdirs import user_log_path

    try:
        folder = user_log_path("saia-studio", appauthor=False, ensure_exists=True)
        # One file, written over: people send the newest, and old ones would pile up.
        path = folder / "last-error.log"
        path.write_text(traceback.format_exc(), encoding="utf-8")
    except OSError:
        return None
    return str(path)


def put(text: str, end: str = "\n") -> None:
    """Print at once.

    Raises:
        StudioError: standard output takes no more; what is printed from then on vanishes.
        BrokenPipeError: its reader left.
    """
    try:
        print(text, end=end, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        silence_stdout()
        what = say(
            "The output could not be written: {reason}.", reason=error.strerror or type(error).__name__
        )
        raise StudioError(what, "Free some space where it goes, or send it somewhere else.") from error


def silence_stdout() -> None:
    """Let what is printed from now on vanish, after the reader of a pipe has left."""
    _silence(sys.stdout)


def _silence(stream: TextIO) -> None:
    # By descriptor: what libraries print below Python must vanish as well.
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
