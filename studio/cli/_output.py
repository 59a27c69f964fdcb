"""What a command prints: sentences for people, JSON lines for programs, and how things are counted."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any, TextIO

from studio.errors import RequestError, StudioError
from studio.ipc.events import ChildEvent, ProgressEvent


def counted(number: int, thing: str) -> str:
    """ "1 take", "2 takes"."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def address(text: str) -> tuple[str, int]:
    """HOST:PORT as its two parts.

    Raises:
        RequestError: it is written otherwise, or there is no such port.
    """
    host, _, port = text.rpartition(":")
    if not host or not (port.isascii() and port.isdigit()) or not 1 <= int(port) <= 65535:
        raise RequestError(f"{text} is not an address.", "Write HOST:PORT, such as 127.0.0.1:39539.")
    return host.strip("[]"), int(port)


class Output:
    """Where a command reports to.

    Args:
        as_json: one JSON object per line instead of sentences.
    """

    def __init__(self, as_json: bool = False) -> None:
        self.as_json = as_json
        self.finished = False
        self._passing = 0

    def event(self, name: str, text: str = "", /, **facts: Any) -> None:
        """Something happened.

        Args:
            name: the event's name in JSON.
            text: the sentence for people; nothing is printed for them where empty.
            facts: JSON values; Path becomes text, NaN and infinity become null.
        """
        if self.as_json:
            put(json.dumps({"event": name, **plain(facts)}, ensure_ascii=False))
        elif text:
            self._wipe()
            put(text)

    def emit(self, event: ChildEvent, text: str = "") -> None:
        """Something happened.

        Args:
            event: what programs read.
            text: the sentence for people; nothing is printed for them where empty.
        """
        if self.as_json:
            put(json.dumps({"event": event.NAME, **plain(_fields(event))}, ensure_ascii=False))
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
        elif sys.stdout.isatty():
            self._wipe()
            text = text[: shutil.get_terminal_size().columns - 1]
            self._passing = len(text)
            put(text, end="")

    def note(self, text: str) -> None:
        """Something a person should know about the work, as the event `note`."""
        self.event("note", text, text=text)

    def passing(self, name: str, text: str, /, **facts: Any) -> None:
        """Something soon out of date, such as progress.

        On a terminal it is one line, written over by the next; in a file or a pipe people are spared it.
        """
        if self.as_json:
            self.event(name, **facts)
        elif sys.stdout.isatty():
            self._wipe()
            text = text[: shutil.get_terminal_size().columns - 1]
            self._passing = len(text)
            put(text, end="")

    def warning(self, name: str, text: str, /, **facts: Any) -> None:
        """Something went wrong beside the command's own work, which goes on: a sentence on stderr."""
        if self.as_json:
            self.event(name, **facts)
        else:
            self._wipe()
            print(text, file=sys.stderr, flush=True)

    def _wipe(self) -> None:
        """Take a passing line away again; spaces do, where a terminal knows no escape codes."""
        if self._passing:
            put(f"\r{' ' * self._passing}\r", end="")
            self._passing = 0

    def done(self, event: Any = "", text: Any = "", **facts: Any) -> None:
        """The command ended well; the last line of every successful command."""
        self.finished = True
        if isinstance(event, str):
            self.event("done", event, **facts)
        else:
            self.emit(event, text)

    def error(
        self, what: str, remedy: str, log: Path | None = None, *, hint: bool = False, **facts: Any
    ) -> None:
        """The command failed: a sentence on stderr and, in JSON, the last line.

        Args:
            what, remedy: the two sentences.
            log: where the details lie.
            hint: people are told of the log too; they need it only for what nobody foresaw.
            facts: for programs; `there` names the file that would have been written over.
        """
        details = f" Details are in {log}." if log and hint else ""
        if self.as_json:
            self.event("error", what=what, remedy=remedy, log=log, **facts)
        self._wipe()
        try:
            print(f"{what} {remedy}{details}", file=sys.stderr, flush=True)
        except OSError:  # both may go to one full disk; the exit code tells the rest
            # Python would try once more when it ends, and then leave with a code of its own, 120.
            _silence(sys.stderr)


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
        what = f"The output could not be written: {error.strerror or type(error).__name__}."
        raise StudioError(what, "Free some space where it goes, or send it somewhere else.") from error


def silence_stdout() -> None:
    """Let what is printed from now on vanish, after the reader of a pipe has left."""
    _silence(sys.stdout)


def _silence(stream: TextIO) -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _fields(event: ChildEvent) -> dict[str, Any]:
    return {one.name: getattr(event, one.name) for one in fields(event)}


def plain(value: Any) -> Any:
    """A value as JSON can hold it: paths and arrays as text and lists, NaN and infinity as null."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:  # numpy and torch scalars
        value = value.item()
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
