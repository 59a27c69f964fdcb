"""How soon the studio answers: the command line, and the window until it can be used."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
TIMES = 5

WINDOW = """
import sys, time
begin = time.perf_counter()
from studio.ui.app import build
app, window = build([])
window.show()
app.processEvents()
shown = time.perf_counter() - begin
heavy = [name for name in ("torch", "librosa", "numba", "scipy.signal", "pyarrow") if name in sys.modules]
print(shown, ",".join(heavy) or "none")
window.close()
"""


def run() -> dict[str, Any]:
    """Medians of five warm starts, in seconds of the wall clock."""
    return {
        "python_itself_s": median_of([sys.executable, "-c", "pass"]),
        "saia_help_s": median_of([sys.executable, "-m", "studio", "--help"]),
        **window(),
    }


def median_of(command: list[str]) -> float:
    """Median wall time of a command that is run once before it counts."""
    return statistics.median([wall_time(command) for _ in range(TIMES + 1)][1:])


def wall_time(command: list[str]) -> float:
    """Seconds from starting a command to its end."""
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    return time.perf_counter() - start


def window() -> dict[str, Any]:
    """Seconds until the first event loop turn after the window was shown, and in the whole process."""
    shown, heavy, whole = [], "", []
    for _ in range(TIMES + 1):
        start = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-c", WINDOW], check=True, capture_output=True, text=True, cwd=ROOT
        )
        whole.append(time.perf_counter() - start)
        seconds, heavy = done.stdout.strip().splitlines()[-1].split()
        shown.append(float(seconds))
    return {
        "window_usable_s": statistics.median(shown[1:]),
        "window_process_from_start_to_end_s": statistics.median(whole[1:]),
        "promised_window_usable_s": 2.0,
        "heavy_libraries_loaded": heavy,
    }
