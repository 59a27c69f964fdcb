"""A cache is kept to its size: what was used longest ago goes, also while others work in it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.features.audio_spec import AudioSpec
from studio.features.examples import cached_rows
from studio.files import cache
from studio.files.cache import trim, used
from tests.tolerance import LAST_BITS_DB


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
    # Made anew, so not to the last bit.
    assert np.allclose(rows(sounds[1]), first[1], atol=LAST_BITS_DB), "what is gone is made again"


def test_two_processes_may_fill_and_trim_one_folder(tmp_path: Path) -> None:
    work = (
        "import sys; from fractions import Fraction; from pathlib import Path; import numpy as np\n"
        "from studio.features.audio import AudioSpec; from studio.features.examples import cached_rows\n"
        "from studio.files.cache import trim\n"
        "folder = Path(sys.argv[1])\n"
        "for number in range(60):\n"
        "    sound = np.full(800, 0.01 * (number % 7), dtype=np.float32)\n"
        "    made = cached_rows(sound, AudioSpec(), Fraction(30), 0, 20, folder)\n"
        "    assert made.shape == (20, AudioSpec().width), made.shape\n"
        "    anew = cached_rows(sound, AudioSpec(), Fraction(30), 0, 20, None)\n"
        f"    assert np.allclose(made, anew, atol={LAST_BITS_DB})\n"
        "    trim(folder, 8000)\n"
    )
    children = [
        subprocess.Popen([sys.executable, "-c", work, str(tmp_path)], stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    told = [child.communicate()[1] for child in children]
    assert [child.returncode for child in children] == [0, 0], told
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 8000


def _keep(sound: Path, text: str) -> None:
    with cache.keeping(sound, "facts.txt") as file:
        file.write_text(text, encoding="utf-8")


def test_what_is_kept_lies_beside_the_sound_and_is_found(tmp_path: Path) -> None:
    sound = tmp_path / "声.wav"
    sound.write_bytes(b"abc" * 1000)
    assert cache.find(sound, "facts.txt") is None
    _keep(sound, "one")
    found = cache.find(sound, "facts.txt")
    assert found is not None
    assert found.parent == tmp_path / ".cache"
    assert found.read_text(encoding="utf-8") == "one"


def test_another_content_is_another_sound(tmp_path: Path) -> None:
    sound = tmp_path / "a.wav"
    sound.write_bytes(b"abc" * 100_000)
    _keep(sound, "one")
    changed = bytearray(sound.read_bytes())
    changed[-1] ^= 1
    sound.write_bytes(changed)
    os.utime(sound, ns=(1, 1))
    assert cache.find(sound, "facts.txt") is None


def test_a_moved_sound_keeps_its_own(tmp_path: Path) -> None:
    (tmp_path / "take").mkdir()
    sound = tmp_path / "take" / "a.wav"
    sound.write_bytes(b"abc")
    _keep(sound, "one")
    (tmp_path / "take").rename(tmp_path / "moved")
    assert cache.find(tmp_path / "moved" / "a.wav", "facts.txt") is not None


def test_where_the_folder_cannot_be_written_the_users_cache_keeps_it(tmp_path: Path) -> None:
    sound = tmp_path / "a.wav"
    sound.write_bytes(b"abc")
    (tmp_path / ".cache").write_text("a file where the folder would be")
    _keep(sound, "one")
    found = cache.find(sound, "facts.txt")
    assert found is not None
    assert not found.is_relative_to(tmp_path)


def test_a_missing_sound_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        cache.fingerprint(tmp_path / "gone.wav")
    assert error.value.what == "The sound file gone.wav is missing."
    assert cache.find(tmp_path / "gone.wav", "facts.txt") is None
