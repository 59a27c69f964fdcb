"""`saia split`."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.motion import Motion
from studio.project import Project
from studio.take import TakeInfo
from tests.formats.examples import a_sound

OpenElsewhere = Callable[[Path], AbstractContextManager[int]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project = Project.create(tmp_path / "p")
    for name in ("a", "b", "c", "d"):
        moving = Motion.build(np.arange(30) / 30, ("A",), np.linspace(0, 1, 30)[:, None])
        project.add_take(name, TakeInfo(name), moving, a_sound(tmp_path / "in.wav"))
    return project.folder


def test_named_takes_change_and_others_keep_theirs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["split", str(folder), "--val", "b", "--test", "c", "d", "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert {key: done[key] for key in ("train", "val", "test")} == {
        "train": ["a"],
        "val": ["b"],
        "test": ["c", "d"],
    }
    assert cli.main(["split", str(folder), "--train", "c", "--unused", "a"]) == 0
    assert capsys.readouterr().out == "p in all: 1 train, 1 val, 1 test.\n"
    project = Project.open(folder)
    assert [s.split for s in project.dataset.selections] == ["", "val", "train", "test"]
    assert project.undo_name == "Split takes"


@pytest.mark.parametrize(
    ("words", "what"),
    [
        ([], "No take was named."),
        (["--val", "zz"], "There is no take zz in p."),
        (["--val", "a", "--test", "a"], "a was named for two splits."),
    ],
)
def test_wrong_requests_change_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], what: str
) -> None:
    assert cli.main(["split", str(folder), *words]) == 2
    assert capsys.readouterr().err.startswith(what)
    assert {s.split for s in Project.open(folder).dataset.selections} == {"train"}


def test_a_kept_test_take_is_used_otherwise_only_after_unlocking(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["split", str(folder), "--lock", "a", "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (done["test"], done["locked"]) == (["a"], ["a"])
    assert cli.main(["split", str(folder), "--train", "a"]) == 2
    assert capsys.readouterr().err == (
        "a is kept as a test take, so that nothing learns from it by mistake. "
        "Add --unlock a to use it otherwise.\n"
    )
    assert cli.main(["split", str(folder), "--train", "a", "--unlock", "a", "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (done["train"], done["locked"]) == (["a", "b", "c", "d"], [])


def test_beside_a_window_that_has_it_open_nothing_changes(
    folder: Path, open_elsewhere: OpenElsewhere, capsys: pytest.CaptureFixture[str]
) -> None:
    with open_elsewhere(folder) as window:
        assert cli.main(["split", str(folder), "--val", "a"]) == 1
        assert capsys.readouterr().err == (
            f"p is open in another window (process {window}). "
            "Change it there, or close it there and open it here again.\n"
        )
    assert {s.split for s in Project.open(folder).dataset.selections} == {"train"}


def test_a_folder_that_cannot_be_written_is_not_called_open_elsewhere(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / ".lock").unlink()
    (folder / ".lock").mkdir()  # root may write anywhere, but not a file where a folder is
    assert cli.main(["split", str(folder), "--val", "a"]) == 1
    assert capsys.readouterr().err == (
        f"The folder of p cannot be written. "
        f"Copy the folder to a place of your own, or allow writing in {folder}.\n"
    )


def test_a_folder_that_is_no_project(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["split", str(tmp_path), "--val", "a"]) == 2
    assert capsys.readouterr().err.startswith(f"There is no project at {tmp_path}.")
