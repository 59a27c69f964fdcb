"""Written beside, read back, and only then given a name."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.errors import StudioError
from studio.formats import _writing
from studio.formats._writing import checked
from tests.formats.examples import a_sound


def test_a_file_takes_its_name_once_it_was_read_back(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def fits(beside: Path) -> bool:
        assert path.read_text() == "old"
        return beside.read_text() == "new"

    assert checked(path, lambda beside: beside.write_text("new"), fits) == (path,)
    assert path.read_text() == "new"


@pytest.mark.parametrize(
    "cause", [None, StudioError("Damaged.", "Again."), OSError(), KeyError(), EOFError()]
)
def test_one_that_reads_otherwise_leaves_what_was_there(tmp_path: Path, cause: Exception | None) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")

    def fits(beside: Path) -> bool:
        if cause is not None:
            raise cause
        return False

    with pytest.raises(StudioError) as error:
        checked(path, lambda beside: beside.write_text("new"), fits)
    assert error.value.what == "a.txt did not read back as it was written."
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]
    assert path.read_text() == "old"


def test_a_disk_that_takes_nothing_is_named_by_the_files_own_name(tmp_path: Path) -> None:
    def full(beside: Path) -> None:
        raise OSError(28, "Error writing bytes. Detail: [errno 28] No space left on device")

    with pytest.raises(StudioError) as error:
        checked(tmp_path / "a.txt", full, lambda beside: True)
    assert error.value.what == "a.txt could not be written: No space left on device."
    assert list(tmp_path.iterdir()) == []


def test_a_sound_that_lost_its_end_is_another(tmp_path: Path) -> None:
    long, short = a_sound(tmp_path / "a.wav", 1.0), a_sound(tmp_path / "b.wav", 0.8)
    assert _writing.fits(a_sound(tmp_path / "c.wav", 1.0), long)
    assert not _writing.fits(short, long)
    assert not _writing.fits(a_sound(tmp_path / "d.wav", 1.0, rate=8000), long)
