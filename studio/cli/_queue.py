"""Several files one after another: what fails is told, and the rest goes on.

Meanwhile it reads its standard input: `skip N` takes out the N-th entry (from 0), `stop` all that is left,
and so does its end once the parent is gone.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from studio.cli._output import Output
from studio.cli._stdin import wait_until_alone
from studio.errors import Cancelled, StudioError
from studio.ipc import commands

REPORT_SECONDS = 0.2


@dataclass(frozen=True, eq=False)
class Entry:
    """One file to make.

    Args:
        name: what a list calls it.
        weight: how long it takes in comparison with the others.
        make: makes it, and gives the files; told what to report progress to (0..1), which raises where the
            entry is to end.
    """

    name: str
    weight: float
    make: Callable[[Callable[[float], None]], Sequence[Path]]


@dataclass(frozen=True)
class Failure:
    """An entry that came to nothing, and why."""

    name: str
    what: str
    remedy: str


class CancelRequests:
    """What is no longer wanted, read from standard input.

    Args:
        watched: a window waits for what is made, and its end is a wish to stop. What a person began at a
            terminal goes on when that is closed under nohup.
    """

    def __init__(self, watched: bool = False) -> None:
        self._watched, self._parent = watched, os.getppid()
        self._stopped, self._skipped = threading.Event(), set[int]()
        self._over = threading.Event()
        self._reader: threading.Thread | None = None
        if sys.stdin is not None and not sys.stdin.isatty():
            self._reader = threading.Thread(target=self._read, args=(sys.stdin,), name="stdin", daemon=True)
            self._reader.start()

    def close(self) -> None:
        """Nothing is left that could be wished away."""
        self._over.set()

    def is_cancelled(self, index: int) -> bool:
        """Whether an entry is to be left away."""
        return self._stopped.is_set() or index in self._skipped

    def process(self, line: str) -> None:
        """One line of what was said."""
        match commands.read(line):
            case ("stop", _):
                self._stopped.set()
            case ("skip", index) if index.isdecimal():
                self._skipped.add(int(index))

    def _read(self, stdin: TextIO) -> None:
        """Runs on a thread of its own. A window that died ends our standard input."""
        with suppress(OSError, ValueError):  # closed under us is the same as its end
            for line in stdin:
                self.process(line)
        if self._watched and wait_until_alone(self._parent, self._over):
            self._stopped.set()


class Queue:
    """The entries on their way.

    Args:
        entries: what is to be made, in this order.
        out: where it is told; see the events below.
        requests: what is no longer wanted.

    Events: `queue` with all names; `entry` with index, name, state ("running", "done", "failed",
    "cancelled"), files, what and remedy; `progress` with fraction, eta_s, index and entry (its own fraction).
    """

    def __init__(self, entries: Sequence[Entry], out: Output, requests: CancelRequests) -> None:
        self._entries, self._out, self._requests = list(entries), out, requests
        self._whole = sum(entry.weight for entry in entries) or 1.0
        self._before = 0.0  # weight of the entries that are over
        self._began, self._last = time.monotonic(), 0.0
        self._left_out = 0.0  # weight of those that took no time
        self.files: list[Path] = []
        self.failed: list[Failure] = []
        self.cancelled: list[str] = []

    def run(self) -> None:
        """Make one after another."""
        self._out.event("queue", names=[entry.name for entry in self._entries])
        for index, entry in enumerate(self._entries):
            if self._requests.is_cancelled(index):
                self._cancel(index, entry)
                self._left_out += entry.weight
            else:
                self._make(index, entry)
            self._before += entry.weight
        self._progress(len(self._entries) - 1, 1.0, last=True)

    def _make(self, index: int, entry: Entry) -> None:
        self._report(index, entry, "running")

        def report(fraction: float) -> None:
            if self._requests.is_cancelled(index):
                raise Cancelled
            self._progress(index, min(max(fraction, 0.0), 1.0))

        try:
            files = list(entry.make(report))
        except Cancelled:
            self._cancel(index, entry)
        except StudioError as error:
            self._fail(index, entry, error.what, error.remedy)
        except Exception as error:
            what = f"Something unexpected happened: {type(error).__name__}: {error}."
            self._fail(index, entry, what, "Please report it; the other files go on.")
        else:
            self.files += files
            text = f"{entry.name}: {', '.join(str(file) for file in files)}"
            self._report(index, entry, "done", text, files=files)

    def _fail(self, index: int, entry: Entry, what: str, remedy: str) -> None:
        self.failed.append(Failure(entry.name, what, remedy))
        self._report(index, entry, "failed", f"{entry.name}: {what} {remedy}", what=what, remedy=remedy)

    def _cancel(self, index: int, entry: Entry) -> None:
        self.cancelled.append(entry.name)
        self._report(index, entry, "cancelled", f"{entry.name}: cancelled")

    def _report(self, index: int, entry: Entry, state: str, text: str = "", /, **facts: object) -> None:
        self._out.event("entry", text, index=index, name=entry.name, state=state, **facts)

    def _progress(self, index: int, own: float, last: bool = False) -> None:
        now = time.monotonic()
        if not last and now - self._last < REPORT_SECONDS:
            return
        self._last = now
        done = self._before + (0.0 if last else own * self._entries[index].weight)
        fraction = 1.0 if last else done / self._whole
        worked = max(done - self._left_out, 0.0)
        spent = now - self._began
        eta_s = 0.0 if last else spent * (self._whole - done) / worked if worked > 0 else None
        text = f"{fraction:4.0%}  {self._entries[index].name}" if self._entries else ""
        self._out.passing("progress", text, fraction=fraction, eta_s=eta_s, index=index, entry=own)


def run_queue(entries: Sequence[Entry], out: Output, note: str = "") -> None:
    """Make everything and say what came of it; the last line names what failed and what was cancelled.

    Raises:
        StudioError: not one file could be made.
    """
    requests = CancelRequests(watched=out.as_json)
    queue = Queue(entries, out, requests)
    try:
        queue.run()
    finally:
        requests.close()
    if queue.failed and not queue.files and not queue.cancelled:
        first = queue.failed[0]
        if len(entries) == 1:
            raise StudioError(first.what, first.remedy)
        alike = all(failure.what == first.what for failure in queue.failed)
        details = first.what if alike else f"The first, {first.name}: {first.what}"
        raise StudioError(f"None of the {len(entries)} files could be made. {details}", first.remedy)
    parts = [f"{len(queue.files)} files written."]
    parts += [f"{len(queue.failed)} failed."] if queue.failed else []
    parts += [f"{len(queue.cancelled)} cancelled."] if queue.cancelled else []
    failed = [{"name": one.name, "what": one.what, "remedy": one.remedy} for one in queue.failed]
    text = " ".join([*parts, note]).strip()
    out.done(text, files=queue.files, failed=failed, cancelled=queue.cancelled, note=note)
