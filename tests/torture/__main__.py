"""The trial of reliability: `python -m tests.torture [TRIAL...]`, also as `make bench ARGS=torture`.

What fails is printed with the command that runs that one case again.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

# Before numpy or torch are imported: forked processes share no threads.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"

from tests.torture import program  # noqa: E402


def main(words: list[str]) -> int:
    """Run trials; exit code 1 where a case failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.torture", description=__doc__)
    parser.add_argument("trials", nargs="*", metavar="TRIAL", help=f"of {', '.join(program.TRIALS)}; all")
    parser.add_argument("--seed", type=int, default=program.SEED)
    parser.add_argument("--count", type=int, help="cases of each trial")
    parser.add_argument("--long", action="store_true", help="as many cases as were promised")
    parser.add_argument("--small", action="store_true", help="as few as the tests run")
    parser.add_argument("--only", type=int, nargs="+", metavar="N", help="these cases alone")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="cases at a time")
    parser.add_argument("--json", action="store_true", help="the figures as one line of JSON, at the end")
    parser.add_argument("--shared", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args(words)
    if unknown := [name for name in args.trials if name not in program.TRIALS]:
        parser.error(f"There is no trial called {unknown[0]}. Choose from: {', '.join(program.TRIALS)}.")
    usual = program.LONG if args.long else program.SMALL if args.small else program.USUAL
    counts = {name: args.count or usual[name] for name in args.trials or program.TRIALS}
    cases = {name: args.only or range(count) for name, count in counts.items()}
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        figures = program.run(
            cases, args.seed, args.jobs, Path(folder), args.shared, None if args.json else print
        )
    if args.json:
        print(json.dumps(figures, ensure_ascii=False))
    return 1 if any(one.get("failures") for one in figures.values()) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
