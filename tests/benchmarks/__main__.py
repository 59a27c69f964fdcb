"""Measures what people were promised: `make bench`, or `python tests/benchmarks [NAME...]`.

Every bench_<name>.py beside this offers `run() -> dict[str, Any]` with figures whose names carry their
units. Each runs in a process of its own; what it gives is printed and kept in results/<name>.json with
the machine it was measured on. Nothing is asserted on the clock. `house --at COMMIT` counts that commit
beside the working tree.
"""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results"
LIBRARIES = ("numpy", "scipy", "torch", "PySide6-Essentials", "pyqtgraph", "pyvista", "vtk", "pyarrow",
             "sounddevice", "soundfile", "librosa", "lightning-fabric", "python-osc")  # fmt: skip
TIME_LIMIT, LONG_LIMIT = 30 * 60.0, 6 * 3600.0
"""Seconds one benchmark may take, and one of LONG."""
LONG = {"learning"}


def main(words: list[str]) -> int:
    """Run the benchmarks named, or all; exit code 1 where one failed."""
    if words[:1] == ["--one"]:
        return run_one(words[1], Path(words[2]))
    if "--at" in words:  # of `house`: another commit, counted beside this one
        at = words.index("--at")
        os.environ["SAIA_BENCH_AT"] = words[at + 1] if at + 1 < len(words) else "HEAD"
        del words[at : at + 2]
    known = sorted(path.stem.removeprefix("bench_") for path in HERE.glob("bench_*.py"))
    unknown = [word for word in words if word not in known]
    if unknown:
        print(f"There is no benchmark called {unknown[0]}. Choose from: {', '.join(known)}.", file=sys.stderr)
        return 2
    RESULTS.mkdir(exist_ok=True)
    failed = [name for name in words or known if not measure(name)]
    if failed:
        print(f"\nFAILED: {', '.join(failed)}.", file=sys.stderr)
    return 1 if failed else 0


def measure(name: str) -> bool:
    """Run one benchmark in a child process, print its table and keep its result."""
    print(f"\n{name} ...", flush=True)
    path = RESULTS / f"{name}.json"
    beside = path.with_suffix(".new")
    beside.unlink(missing_ok=True)
    start, limit = time.monotonic(), LONG_LIMIT if name in LONG else TIME_LIMIT
    command = [sys.executable, str(HERE), "--one", name, str(beside)]
    try:
        code = subprocess.run(command, check=False, timeout=limit).returncode
    except subprocess.TimeoutExpired:
        print(f"  took longer than {limit / 60:.0f} minutes and was ended")
        return False
    if code or not beside.is_file():
        return False
    figures = json.loads(beside.read_text(encoding="utf-8"))
    beside.unlink()
    result = {
        "benchmark": name,
        "measured": time.strftime("%Y-%m-%d"),
        "seconds": round(time.monotonic() - start, 1),
        "machine": machine(),
        "figures": figures,
    }
    path.write_text(json.dumps(result, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    print(table(figures))
    return True


def run_one(name: str, out: Path) -> int:
    """Inside the child: run one benchmark and write its figures."""
    sys.path.insert(0, str(HERE.parents[1]))  # benchmarks import each other's material as `tests`
    spec = importlib.util.spec_from_file_location(f"bench_{name}", HERE / f"bench_{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # before it runs: what it pickles or decorates looks itself up there
    spec.loader.exec_module(module)
    out.write_text(json.dumps(plain(module.run()), ensure_ascii=False), encoding="utf-8")
    return 0


def plain(value: Any) -> Any:
    """A value as JSON holds it, numbers of numpy and torch included, with no more digits than are meant."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:
        value = value.item()
    elif hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float):
        return float(f"{value:.5g}") if value == value and abs(value) != float("inf") else None
    return value if isinstance(value, int | str | bool | None) else str(value)


def table(figures: dict[str, Any], indent: str = "  ") -> str:
    """Figures under one another, names on the left; groups of the same names stand beside one another."""
    groups = [value for value in figures.values() if isinstance(value, dict)]
    if len(groups) == len(figures) > 1 and all(group.keys() == groups[0].keys() for group in groups):
        width = max(map(len, groups[0]))
        lines = [indent + " " * width + "".join(f"{name:>12}" for name in figures)]
        lines += [f"{indent}{name:<{width}}" + "".join(f"{group[name]!s:>12}" for group in groups)
                  for name in groups[0]]  # fmt: skip
        return "\n".join(lines)
    width = max((len(name) for name, value in figures.items() if not isinstance(value, dict)), default=0)
    lines = []
    for name, value in figures.items():
        if isinstance(value, dict):
            lines += [f"{indent}{name}", table(value, indent + "  ")]
        else:
            lines.append(f"{indent}{name:<{width}}  {value}")
    return "\n".join(lines)


def machine() -> dict[str, Any]:
    """What the figures were measured on: hardware and versions, nothing that names a person or a host."""
    return {
        "cpu": cpu_model(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.release().partition('-')[0]} {platform.machine()}",
        "python": platform.python_version(),
        "libraries": {name: version for name in LIBRARIES if (version := version_of(name))},
    }


def cpu_model() -> str:
    """The processor's name as it gives it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def version_of(name: str) -> str | None:
    """The installed version of a library, None where it is not installed."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
