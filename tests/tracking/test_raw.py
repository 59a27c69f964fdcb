"""Blocks of what was tracked, kept until the video is imported: whole, of this very file, or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.motion import rotation
from studio.tracking import raw
from studio.tracking.pictures import PictureFacts
from studio.tracking.raw import BlockStore, RawFaces


@pytest.fixture
def video(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "a.mp4").write_bytes(b"a video" * 99)
    return tmp_path / "a.mp4"


def block(start: float, count: int = 5) -> RawFaces:
    row = raw.row_of(None, rotation.IDENTITY, PictureFacts(90.0, 0.0, 0.0), 0, cut=True, same=False)
    return RawFaces(start + np.arange(count) / 30, np.tile(row, (count, 1)))


def test_blocks_come_back_in_order(video: Path) -> None:
    store = BlockStore(video, "how")
    for number in range(3):
        store.save(number, block(float(number)))
    found = raw.joined(BlockStore(video, "how").load())
    assert len(found.times) == 15
    assert (np.diff(found.times) > 0).all()
    assert found.light[0] == 90.0
    assert found.cuts.all()
    assert not found.seen.any()
    assert not found.same.any()


def test_another_way_or_another_file_begins_anew(video: Path) -> None:
    BlockStore(video, "how").save(0, block(0.0))
    assert BlockStore(video, "otherwise").load() == []
    video.write_bytes(b"another" * 99)
    assert BlockStore(video, "how").load() == []


def test_behind_a_damaged_block_it_is_done_again(video: Path, tmp_path: Path) -> None:
    store = BlockStore(video, "how")
    for number in range(3):
        store.save(number, block(float(number)))
    (damaged,) = (tmp_path / "cache").rglob("00001.npz")
    damaged.write_bytes(damaged.read_bytes()[:40])
    assert len(store.load()) == 1


def test_what_was_imported_is_kept_no_longer(video: Path, tmp_path: Path) -> None:
    store = BlockStore(video, "how")
    store.save(0, block(0.0))
    store.discard()
    assert store.load() == []
    assert not list((tmp_path / "cache").rglob("*.npz"))
