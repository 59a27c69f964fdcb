from __future__ import annotations

import os
from pathlib import Path

import pytest

from studio.errors import StudioError
from studio.take import kept


def _keep(sound: Path, text: str) -> None:
    with kept.keeping(sound, "facts.txt") as file:
        file.write_text(text, encoding="utf-8")


def test_what_is_kept_lies_beside_the_sound_and_is_found(tmp_path: Path) -> None:
    sound = tmp_path / "声.wav"
    sound.write_bytes(b"abc" * 1000)
    assert kept.find(sound, "facts.txt") is None
    _keep(sound, "one")
    found = kept.find(sound, "facts.txt")
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
    assert kept.find(sound, "facts.txt") is None


def test_a_moved_sound_keeps_its_own(tmp_path: Path) -> None:
    (tmp_path / "take").mkdir()
    sound = tmp_path / "take" / "a.wav"
    sound.write_bytes(b"abc")
    _keep(sound, "one")
    (tmp_path / "take").rename(tmp_path / "moved")
    assert kept.find(tmp_path / "moved" / "a.wav", "facts.txt") is not None


def test_where_the_folder_cannot_be_written_the_users_cache_keeps_it(tmp_path: Path) -> None:
    sound = tmp_path / "a.wav"
    sound.write_bytes(b"abc")
    (tmp_path / ".cache").write_text("a file where the folder would be")
    _keep(sound, "one")
    found = kept.find(sound, "facts.txt")
    assert found is not None
    assert not found.is_relative_to(tmp_path)


def test_a_missing_sound_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        kept.fingerprint(tmp_path / "gone.wav")
    assert error.value.what == "The sound file gone.wav is missing."
    assert kept.find(tmp_path / "gone.wav", "facts.txt") is None
