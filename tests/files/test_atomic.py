"""Sizes as people read them, and disks that ran out of room."""

import errno
from pathlib import Path

import pytest

from studio.files.atomic import free_bytes, is_full, size_text


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (0, "0 bytes"),
        (1, "1 byte"),
        (999, "999 bytes"),
        (1000, "1.0 KB"),
        (5_912_000, "5.9 MB"),
        (9_960_000, "10 MB"),
        (999_400, "999 KB"),
        (999_600, "1.0 MB"),
        (67_108_864, "67 MB"),
        (1_540_000_000, "1.5 GB"),
        (512_000_000_000, "512 GB"),
        (2e12, "2.0 TB"),
    ],
)
def test_a_size_is_written_in_the_unit_that_suits_it(size: float, text: str) -> None:
    assert size_text(size) == text


def test_room_is_known_of_a_folder_that_is_still_to_be_made(tmp_path: Path) -> None:
    assert (free_bytes(tmp_path / "not" / "yet") or 0) > 0


def test_only_want_of_room_is_a_full_disk() -> None:
    assert is_full(OSError(errno.ENOSPC, "No space left on device"))
    assert not is_full(OSError(errno.EIO, "Input/output error"))
