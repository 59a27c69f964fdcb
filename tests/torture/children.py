"""Cases in processes of their own, forked from one that has everything loaded: thousands in minutes.

Where a system cannot fork (Windows), a case is a Python of its own that runs the same command a person would
type to see that case again.
"""

from __future__ import annotations

import ctypes
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TypeVar, cast

from tests.torture.cases import Limits, Outcome, Trial

T = TypeVar("T")
CAN_FORK = hasattr(os, "fork")
_RUNAWAY_BYTES = 8 << 30
"""Address space nobody gets: a case that wants it fails by itself before the machine suffers."""


@dataclass
class Child:
    """A process that works for one case.

    Args:
        pid: it leads a process group of its own.
        told: the end of the pipe through which it tells its outcome; -1 where it tells nothing.
    """

    number: int
    pid: int
    told: int
    place: Path
    begun: float
    said: bytes = b""


def run_cases(trial: Trial, numbers: Sequence[int], jobs: int) -> Iterator[tuple[int, Outcome]]:
    """Run cases, several at once.

    Yields:
        Each case's number and outcome, as they end. A case that dies, hangs or takes too much has a fault
        that says so.
    """
    if not CAN_FORK:
        for number in numbers:
            yield number, _spawned(trial, number)
        return
    waiting, going = list(reversed(numbers)), dict[int, Child]()
    try:
        while waiting or going:
            while waiting and len(going) < jobs:
                child = _begin(trial, waiting.pop())
                going[child.told] = child
            ready, _, _ = select.select(list(going), (), (), 0.2)
            for told in ready:
                part = os.read(told, 1 << 16)
                going[told].said += part
                if not part:
                    child = going.pop(told)
                    yield child.number, _end(child, trial.LIMITS)
            late = [c for c in going.values() if time.monotonic() - c.begun > trial.LIMITS.wall_s]
            for child in late:
                del going[child.told]
                yield child.number, _end(child, trial.LIMITS, hung=True)
    finally:
        for child in going.values():
            _end(child, trial.LIMITS, hung=True)


def fork(work: Callable[[], object], console: Path | None = None) -> int:
    """Start a process that does one thing and ends with the exit code it gives; gives its id and group.

    Args:
        work: what to do; an int it gives is the exit code, an exception is 70.
        console: where its output goes.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        with suppress(OSError):  # by both, so that neither meets a group that is not there yet
            os.setpgid(pid, pid)
        return pid
    with suppress(OSError):
        os.setpgid(0, 0)
    _work(work, console)


def _work(work: Callable[[], object], console: Path | None) -> NoReturn:
    code = 70
    try:
        if sys.platform == "linux":
            # PR_SET_PDEATHSIG: a case that is ended for hanging takes with it all that it forked.
            ctypes.CDLL(None).prctl(1, signal.SIGKILL)
        if console is not None:
            _redirect(console)
        code = int(work() or 0)  # type: ignore[call-overload]
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 1
    except BaseException:  # noqa: BLE001  # the last thing this process does
        traceback.print_exc()
    finally:
        with suppress(BaseException):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def apart(work: Callable[[], T], console: Path) -> T:
    """What a piece of work gives, done in a process of its own: threads that it starts (torch, Arrow) end
    with it, and whoever asked may fork again. Where a system cannot fork it is done here.

    Args:
        work: gives what JSON holds.
        console: where its output goes.

    Raises:
        RuntimeError: it ended without giving anything; what it printed last.
    """
    if not CAN_FORK:
        return work()
    given = console.with_name(f"{console.name}.given-{os.getpid()}")

    def told() -> None:
        given.write_text(json.dumps(work()), encoding="utf-8")

    os.waitpid(fork(told, console), 0)
    try:
        return cast(T, json.loads(given.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        last = console.read_text(encoding="utf-8", errors="replace")[-2000:]
        raise RuntimeError(f"It ended without a word: {last}") from None
    finally:
        given.unlink(missing_ok=True)


def judged_apart(work: Callable[[Outcome], None], outcome: Outcome, console: Path) -> None:
    """Add to an outcome what a piece of work notes, done in a process of its own."""

    def noted() -> list[Any]:
        own = Outcome()
        work(own)
        return [own.counts, own.faults]

    counts, faults = apart(noted, console)
    outcome.counts.update(counts)
    outcome.faults += [(kind, sentence) for kind, sentence in faults]


def kill(group: int) -> None:
    """End a process and all it started, without warning."""
    with suppress(OSError):
        os.killpg(group, signal.SIGKILL)


def end(pids: Sequence[int]) -> None:
    """End processes that `fork` began, and wait for them."""
    for pid in pids:
        kill(pid)
        with suppress(ChildProcessError):
            os.waitpid(pid, 0)


def _redirect(console: Path) -> None:
    """All output into a file, that of libraries written in C too."""
    console.parent.mkdir(parents=True, exist_ok=True)
    sink = os.open(console, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    os.dup2(sink, 1)
    os.dup2(sink, 2)
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8", errors="backslashreplace", buffering=1)
    sys.stderr = os.fdopen(os.dup(2), "w", encoding="utf-8", errors="backslashreplace", buffering=1)


def _begin(trial: Trial, number: int) -> Child:
    place = Path(tempfile.mkdtemp(prefix=f"{trial.NAME}-{number}-", dir=trial.shared.parent))
    told, tell = os.pipe()

    def work() -> None:
        os.close(told)
        _limit(trial.LIMITS)
        outcome = run_here(trial, number, place)
        with os.fdopen(tell, "wb") as out:
            out.write(json.dumps([outcome.counts, outcome.faults]).encode())

    pid = fork(work, place / "console")
    os.close(tell)
    return Child(number, pid, told, place, time.monotonic())


def run_here(trial: Trial, number: int, place: Path) -> Outcome:
    """Run one case in this process, with settings, caches and scratch files of its own in its place."""
    for folder in ("home", "tmp"):
        (place / folder).mkdir()
    for name in ("CONFIG", "DATA", "CACHE", "STATE"):
        os.environ[f"XDG_{name}_HOME"] = str(place / "home" / name.lower())
    os.environ["SAIA_SETTINGS"] = str(place / "home" / "settings")
    for name in ("TMPDIR", "TEMP", "TMP"):
        os.environ[name] = str(place / "tmp")
    tempfile.tempdir = None
    os.chdir(place)
    try:
        return trial.case(number, place)
    except Exception as error:  # noqa: BLE001  # whatever a reader raised is what is looked for
        lines = traceback.format_exc(limit=-4).splitlines()
        return Outcome(faults=[("traceback", f"{type(error).__name__}: {error} | {' / '.join(lines[-6:])}")])


def _limit(limits: Limits) -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_CPU, (limits.cpu_s, limits.cpu_s + 5))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":  # elsewhere it is not kept, or counts what no machine has
        resource.setrlimit(resource.RLIMIT_AS, (_RUNAWAY_BYTES, _RUNAWAY_BYTES))


def _end(child: Child, limits: Limits, hung: bool = False) -> Outcome:
    """Wait for a child that told its outcome or will not; what it leaves goes with it."""
    if hung:
        kill(child.pid)
    _, status, used = os.wait4(child.pid, 0)
    kill(child.pid)  # what it started and forgot
    os.close(child.told)
    outcome = _understood(child.said)
    code = os.waitstatus_to_exitcode(status)
    if hung:
        outcome.fault("hang", f"It was still going after {limits.wall_s:.0f} s.")
    elif code == -signal.SIGXCPU:
        outcome.fault("hang", f"It took more than {limits.cpu_s} s of a core.")
    elif code or not child.said:
        console = child.place / "console"
        last = console.read_text("utf-8", "replace")[-400:] if console.is_file() else ""
        outcome.fault("died", f"It ended with {code}. {last}")
    # Kilobytes, but bytes on a Mac.
    peak = used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    if peak > limits.peak_bytes:
        outcome.fault("memory", f"It took {peak / 1e9:.2f} GB.")
    outcome.counts["cases"] += 1
    outcome.counts["cpu_ms"] += round(1e3 * (used.ru_utime + used.ru_stime))
    shutil.rmtree(child.place, ignore_errors=True)
    return outcome


def _understood(said: bytes) -> Outcome:
    try:
        counts, faults = json.loads(said)
    except ValueError:
        return Outcome()
    return Outcome(Counter(counts), [(kind, sentence) for kind, sentence in faults])


def _spawned(trial: Trial, number: int) -> Outcome:
    words: list[Any] = [sys.executable, "-m", "tests.torture", trial.NAME]
    words += ["--seed", trial.seed, "--only", number, "--json", "--shared", trial.shared]
    root = Path(__file__).resolve().parents[2]
    try:
        ended = subprocess.run(
            [str(word) for word in words], capture_output=True, cwd=root, timeout=trial.LIMITS.wall_s
        )
    except subprocess.TimeoutExpired:
        return Outcome(Counter(cases=1), [("hang", f"It was still going after {trial.LIMITS.wall_s:.0f} s.")])
    try:
        told = json.loads(ended.stdout.splitlines()[-1])[trial.NAME]
    except (ValueError, IndexError, KeyError):
        last = ended.stderr.decode("utf-8", "replace")[-400:]
        return Outcome(Counter(cases=1), [("died", f"It ended with {ended.returncode}. {last}")])
    return Outcome(Counter(told["counts"]), [(f["kind"], f["sentence"]) for f in told["failures"]])
