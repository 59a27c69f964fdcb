"""Removed runs: aside, back again, and not for ever."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from studio.errors import StudioError
from studio.project.trash import bring_run_back, put_run_away, thin_out


def run(project: Path, name: str, content: str = "") -> Path:
    folder = project / "runs" / name
    folder.mkdir(parents=True)
    (folder / "best.safetensors").write_text(content or name)
    return folder


def test_a_removed_run_comes_back_as_it_was(tmp_path: Path) -> None:
    folder = run(tmp_path, "quick_001", "weights")
    kept = put_run_away(folder)
    assert not folder.exists()
    assert kept == tmp_path / ".trash" / "runs" / "quick_001"
    assert bring_run_back(kept, tmp_path / "runs") == folder
    assert (folder / "best.safetensors").read_text() == "weights"


def test_a_run_whose_name_was_taken_meanwhile_comes_back_under_a_new_one(tmp_path: Path) -> None:
    first = put_run_away(run(tmp_path, "quick_001", "old"))
    second = put_run_away(run(tmp_path, "quick_001", "newer"))
    assert first != second
    run(tmp_path, "quick_001", "newest")
    back = [bring_run_back(kept, tmp_path / "runs") for kept in (first, second)]
    assert [folder.name for folder in back] == ["quick_002", "quick_003"]
    assert [(folder / "best.safetensors").read_text() for folder in back] == ["old", "newer"]
    assert (tmp_path / "runs" / "quick_001" / "best.safetensors").read_text() == "newest"


def test_the_trash_keeps_the_newest_runs_and_all_takes(tmp_path: Path) -> None:
    (tmp_path / ".trash" / "take_001").mkdir(parents=True)
    for number in range(5):
        kept = put_run_away(run(tmp_path, f"quick_{number:03d}"))
        os.utime(kept, (number, number))
    thin_out(tmp_path, most=2)
    assert sorted(path.name for path in (tmp_path / ".trash" / "runs").iterdir()) == [
        "quick_003",
        "quick_004",
    ]
    assert (tmp_path / ".trash" / "take_001").is_dir()
    thin_out(tmp_path / "empty")  # nothing there is nothing to do


def test_a_run_that_is_gone_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as caught:
        put_run_away(tmp_path / "runs" / "quick_001")
    assert caught.value.what == "quick_001 could not be written: No such file or directory."
