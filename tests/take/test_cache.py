"""A cache is kept to its size: what was used longest ago goes, also while others work in it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np

from studio.features.audio import AudioSpec
from studio.features.examples import cached_rows
from studio.take.cache import trim, used


def kept(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def filled(folder: Path, names: str, ago: float = 1000.0) -> Path:
    """Files of 100 bytes, each used later than the one before."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(names):
        path = folder / name
        path.write_bytes(bytes(100))
        when = time.time() - ago + number
        os.utime(path, (when, when))
    return folder


def test_what_was_used_longest_ago_goes_first(tmp_path: Path) -> None:
    filled(tmp_path / "features", "abc")
    filled(tmp_path / "generated" / "quick_001", "de", ago=500)
    used(tmp_path / "features" / "a")
    assert trim(tmp_path, 300) == 200
    assert kept(tmp_path) == ["a", "d", "e"]
    assert trim(tmp_path, 300) == 0
    assert trim(tmp_path / "nowhere", 0) == 0


def test_what_is_being_written_is_left_and_what_a_crash_left_is_not(tmp_path: Path) -> None:
    filled(tmp_path, "a")
    (tmp_path / "b.17.new").write_bytes(bytes(100))
    old = tmp_path / "c.18.new"
    old.write_bytes(bytes(100))
    os.utime(old, (0, 0))
    trim(tmp_path, 0)
    assert kept(tmp_path) == ["b.17.new"]


def test_rows_that_were_used_again_outlive_newer_ones(tmp_path: Path) -> None:
    spec, fps = AudioSpec(), Fraction(30)
    sounds = [np.random.default_rng(seed).normal(0, 0.1, 16000).astype(np.float32) for seed in range(3)]

    def rows(sound: np.ndarray) -> np.ndarray:
        return cached_rows(sound, spec, fps, 0, 100, tmp_path)

    first = [rows(sound) for sound in sounds]
    for path in tmp_path.iterdir():
        os.utime(path, (1, 1))
    again = rows(sounds[0])
    size = next(tmp_path.iterdir()).stat().st_size
    trim(tmp_path, size)
    (left,) = tmp_path.iterdir()
    assert np.array_equal(np.load(left), first[0])
    assert np.array_equal(again, first[0])
    assert np.array_equal(rows(sounds[1]), first[1]), "what is gone is made again"


def test_two_processes_may_fill_and_trim_one_folder(tmp_path: Path) -> None:
    work = (
        "import sys; from fractions import Fraction; from pathlib import Path; import numpy as np\n"
        "from studio.features.audio import AudioSpec; from studio.features.examples import cached_rows\n"
        "from studio.take.cache import trim\n"
        "folder = Path(sys.argv[1])\n"
        "for number in range(60):\n"
        "    sound = np.full(800, 0.01 * (number % 7), dtype=np.float32)\n"
        "    made = cached_rows(sound, AudioSpec(), Fraction(30), 0, 20, folder)\n"
        "    assert made.shape == (20, AudioSpec().width), made.shape\n"
        "    assert np.array_equal(made, cached_rows(sound, AudioSpec(), Fraction(30), 0, 20, None))\n"
        "    trim(folder, 8000)\n"
    )
    children = [
        subprocess.Popen([sys.executable, "-c", work, str(tmp_path)], stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    told = [child.communicate()[1] for child in children]
    assert [child.returncode for child in children] == [0, 0], told
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 8000
