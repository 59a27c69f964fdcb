"""One command in a process group of its own, to be killed at any moment, fed with motion where it records."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.torture import children, watch
from tests.torture.commands import Told, events_in
from tests.torture.sender import Sender


@dataclass(frozen=True)
class Moment:
    """When a command is killed: just before its nth change of the disk, or after some seconds."""

    change: int | None = None
    seconds: float | None = None


@dataclass
class Attempt:
    """What came of it.

    Args:
        told: what it said; the code is minus the signal that ended it.
        seconds: how long it took.
        changes: how often it changed the disk, where it ended by itself.
        sent: frames of motion that were sent to it.
    """

    told: Told
    seconds: float
    changes: int
    sent: int = 0

    @property
    def killed(self) -> bool:
        """Whether the kill came in time."""
        return self.told.code == -signal.SIGKILL


def attempt(
    words: tuple[object, ...],
    place: Path,
    moment: Moment,
    work: Callable[[], int] | None = None,
    on_port: Callable[[int], None] | None = None,
    beside: Path | None = None,
) -> Attempt:
    """Run a command, with motion sent to the port that it names, and kill it at a moment.

    Args:
        words: the command.
        place: the folder whose changes are counted.
        work: what to do in place of the command.
        on_port: is told where a recording listens, as soon as it does.
        beside: where its output is kept; the same folder unless that may be full.
    """
    kept = beside or place
    console = kept / f"said-{len(list(kept.glob('said-*')))}"
    count = console.with_name(f"{console.name}.changes")
    begun = time.monotonic()
    pid = children.fork(lambda: _run(words, place, count, moment, work), console)
    status, sent = _follow(pid, console, moment, begun, on_port)
    seconds = time.monotonic() - begun
    children.kill(pid)  # what it started goes too
    text = console.read_text(encoding="utf-8", errors="replace") if console.is_file() else ""
    code = os.waitstatus_to_exitcode(status)
    told = Told(tuple(map(str, words)), code, text, events_in(text))
    changes = int(count.read_text()) if count.is_file() else 0
    for path in (count, console):
        path.unlink(missing_ok=True)
    console.touch()  # the next one has another name
    return Attempt(told, seconds, changes, sent)


def _run(
    words: tuple[object, ...], place: Path, count: Path, moment: Moment, work: Callable[[], int] | None
) -> int:
    """Within the process that may be killed."""
    changes = 0
    own = str(place)

    def on_change(paths: tuple[str, ...]) -> None:
        nonlocal changes
        if not any(path.startswith(own) for path in paths):
            return  # a cache of Python's or of a device
        changes += 1
        if changes == moment.change:
            os.killpg(0, signal.SIGKILL)
            time.sleep(60.0)  # it ends on the way back from the system, if not before

    os.close(0)
    os.open(os.devnull, os.O_RDONLY)
    watch.writes(on_change)
    if work is not None:
        code = work()
    else:
        from studio import cli

        code = cli.main([*map(str, words), "--json"])
    count.write_text(str(changes))
    return code


def _follow(
    pid: int, console: Path, moment: Moment, begun: float, on_port: Callable[[int], None] | None
) -> tuple[int, int]:
    """Wait for the end, and bring it about where its moment has come.

    Returns:
        The exit status, and how many frames were sent.
    """
    sender: Sender | None = None
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            if sender is not None:
                sender.close()
            return status, sender.sent if sender is not None else 0
        if moment.seconds is not None and time.monotonic() - begun >= moment.seconds:
            children.kill(pid)
        if sender is not None:
            sender.send_due()
        elif port := _port_told(console):
            sender = Sender(port)
            if on_port is not None:
                on_port(port)
        time.sleep(0.004)


def _port_told(console: Path) -> int:
    """Where a recording says that it listens; 0 where it does not yet, or where nothing is recorded."""
    if not console.is_file():
        return 0
    return next((int(event["port"]) for event in events_in(console.read_text()) if event.get("port")), 0)
