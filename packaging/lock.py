"""Writes packaging/constraints.txt from `.venv`: `.venv/bin/python packaging/lock.py`.

Every distribution the studio and its tests need, transitively, at the version installed there. What only
another system needs has to be installed there too (see ELSEWHERE).
"""

from __future__ import annotations

import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parent.parent
CONSTRAINTS = ROOT / "packaging" / "constraints.txt"
HEADER = """\
# Written by packaging/lock.py from a .venv whose tests pass; the versions bootstrap.py installs.
# PySide6 stays below 6.12: on Python 3.11 that one loses references to None and dies.
"""
ELSEWHERE = ("colorama", "tzdata")
"""Needed on Windows only, so a Linux environment would not find them by itself."""


def main() -> int:
    """Write the file; exit code 1 where something is not installed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    roots = [*project["dependencies"], *project["optional-dependencies"]["dev"], *ELSEWHERE, "setuptools"]
    pins: dict[str, str] = {}
    waiting = [Requirement(text) for text in roots]
    while waiting:
        wanted = waiting.pop()
        name = canonicalize_name(wanted.name)
        known = f"{name}[{','.join(sorted(wanted.extras))}]"
        if known in pins:
            continue
        try:
            found = distribution(wanted.name)
        except PackageNotFoundError:
            print(f"{wanted} is not installed in this environment.", file=sys.stderr)
            return 1
        # A local label ("+cpu") names a build, not a version; the pin must hold for every build.
        pins[known] = f"{found.metadata['Name']}=={found.version.partition('+')[0]}"
        waiting += _needs(found.requires or [], wanted.extras)
    lines = sorted(set(pins.values()), key=str.lower)
    CONSTRAINTS.write_text(HEADER + "\n".join(lines) + "\n", encoding="utf-8")
    print(f"{len(lines)} versions written to {CONSTRAINTS.relative_to(ROOT)}.")
    return 0


def _needs(requires: list[str], extras: set[str]) -> list[Requirement]:
    found = (Requirement(text) for text in requires)
    return [
        one
        for one in found
        if one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in (extras or {""}))
    ]


if __name__ == "__main__":
    sys.exit(main())
