"""Damaged journals, mutated files, hostile zips and packets, kills and full disks: what is lost, what breaks.

Some minutes with `make bench ARGS=torture`. `python -m tests.benchmarks.bench_torture --long` runs as many
cases as were promised (10,000 journals, 10,000 files, 1,000 kills: an hour) and keeps the figures in
results/torture_long.json. `python -m tests.torture --help` tells more: one trial alone, other seeds, one case
again.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is imported: processes that fork share no threads

from tests.torture import program  # noqa: E402

LONG_RESULTS = Path(__file__).resolve().parent / "results" / "torture_long.json"


def run(long: bool = False) -> dict[str, Any]:
    """Counts and failures of every trial."""
    counts = program.LONG if long else program.USUAL
    cases = {name: range(count) for name, count in counts.items()}
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        return program.run(cases, program.SEED, os.cpu_count() or 1, Path(folder), say=print)


def long() -> None:
    """The long form."""
    from tests.benchmarks.__main__ import machine, plain

    begun = time.monotonic()
    figures = run(long=True)
    result = {
        "benchmark": "torture_long",
        "measured": time.strftime("%Y-%m-%d"),
        "seconds": round(time.monotonic() - begun, 1),
        "machine": machine(),
        "figures": plain(figures),
    }
    LONG_RESULTS.write_text(json.dumps(result, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--long"]:
        long()
