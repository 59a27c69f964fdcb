"""A small part of the trial of reliability (tests/torture): `make bench ARGS=torture` runs all of it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.torture.program import SMALL, TRIALS

ROOT = Path(__file__).resolve().parents[1]
SEED = "1"


@pytest.fixture(scope="module")
def figures() -> dict[str, Any]:
    """Of all trials, each with a few cases; in a process of its own, since one that has threads must not
    fork."""
    words = [sys.executable, "-m", "tests.torture", "--small", "--seed", SEED, "--json"]
    ended = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=False)
    assert ended.returncode in (0, 1), ended.stderr
    told: dict[str, Any] = json.loads(ended.stdout.splitlines()[-1])
    return told


@pytest.mark.slow
@pytest.mark.parametrize("trial", TRIALS)
def test_nothing_is_lost_and_nothing_breaks(trial: str, figures: dict[str, Any]) -> None:
    found = figures[trial]
    if "skipped" in found:
        pytest.skip(found["skipped"])
    assert found["counts"]["cases"] == SMALL[trial]
    assert found["failures"] == []


@pytest.mark.slow
def test_a_case_that_dies_hangs_or_takes_too_much_is_a_failure(tmp_path: Path) -> None:
    code = f"""
import os, time
from pathlib import Path
from typing import Any
from tests.torture import children
from tests.torture.cases import Limits, Outcome, Trial

class Bad(Trial):
    NAME, LIMITS = "bad", Limits(cpu_s=1, wall_s=8.0, peak_bytes=300 << 20)

    def case(self, number, place):
        match number:
            case 0: os.abort()
            case 1: time.sleep(600)
            case 2: raise ValueError("three")
            case 3: bytearray(400 << 20)
            case 4:
                while True: pass
        return Outcome()

shared = Path({str(tmp_path)!r}) / "shared"
shared.mkdir()
for number, outcome in sorted(children.run_cases(Bad(shared, 1), range(6), 6), key=lambda one: one[0]):
    print(number, *[kind for kind, _ in outcome.faults])
"""
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert told.stdout.splitlines() == ["0 died", "1 hang", "2 traceback", "3 memory", "4 hang", "5"], (
        told.stderr
    )
    assert [path.name for path in tmp_path.iterdir()] == ["shared"]
