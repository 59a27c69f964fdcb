"""All trials by name, and how many cases of each are run."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.torture import children
from tests.torture.cases import Failure, Trial
from tests.torture.files import Files
from tests.torture.full_disk import FullDisk
from tests.torture.journals import Journals
from tests.torture.kills import Kills
from tests.torture.packets import Packets
from tests.torture.zips import Zips

SEED = 12
"""Of the cases that are run unless another is asked for."""
TRIALS: dict[str, type[Trial]] = {
    trial.NAME: trial for trial in (Journals, Files, Zips, Packets, Kills, FullDisk)
}
USUAL = {"journals": 1000, "files": 800, "zips": 200, "packets": 200, "kills": 84, "full-disk": 42}
LONG = {"journals": 10_000, "files": 10_000, "zips": 2000, "packets": 5000, "kills": 1000, "full-disk": 300}
SMALL = {"journals": 12, "files": 16, "zips": 6, "packets": 4, "kills": 5, "full-disk": 2}
_KEPT_FAILURES = 40
"""Failures told one by one; of more, only how many there are."""


def run(
    cases: Mapping[str, Sequence[int]],
    seed: int,
    jobs: int,
    folder: Path,
    shared: Path | None = None,
    say: Callable[[str], object] | None = None,
) -> dict[str, Any]:
    """Hold trials, one after the other.

    Args:
        cases: the numbers of the cases of each trial.
        jobs: cases at a time.
        folder: where everything is written; what remains there is the caller's.
        shared: what `prepare` made before, where it was.
        say: is told how it goes.

    Returns:
        Figures by trial: counts, failures by kind, and the failures with how to see each again.
    """
    figures = {}
    for name, numbers in cases.items():
        kind = TRIALS[name]
        trial = kind(shared or folder / (kind.SHARES or name) / "shared", seed)
        figures[name] = _hold(trial, numbers, jobs, shared is not None, say or (lambda _: None))
    return figures


def _hold(
    trial: Trial, numbers: Sequence[int], jobs: int, prepared: bool, say: Callable[[str], object]
) -> dict[str, Any]:
    begun = time.monotonic()
    trial.warm()
    trial.shared.mkdir(parents=True, exist_ok=True)
    if why := "" if prepared else children.apart(lambda: trial.prepare(numbers), trial.shared / "console"):
        say(f"{trial.NAME}: skipped. {why}")
        return {"skipped": why}
    total, failures, kinds = Counter[str](), list[Failure](), Counter[str]()
    for number, outcome in children.run_cases(trial, numbers, jobs):
        total += outcome.counts
        for what, sentence in outcome.faults:
            kinds[what] += 1
            failures.append(Failure(trial.NAME, trial.seed, number, what, sentence))
            if len(failures) <= _KEPT_FAILURES:
                say(f"{trial.NAME}: {what}: {sentence}\n    {failures[-1].again}")
    seconds = time.monotonic() - begun
    say(f"{trial.NAME}: {total['cases']} cases in {seconds:.0f} s, {len(failures)} failures. {dict(kinds)}")
    return {
        "seed": trial.seed,
        "seconds": round(seconds, 1),
        "counts": dict(sorted(total.items())),
        "failed": dict(kinds),
        "failures": [one.plain() for one in sorted(failures, key=lambda f: f.case)[:_KEPT_FAILURES]],
    }
