from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from studio import cli
from studio.project import Project

MakeProject = Callable[..., Project]


def test_a_moved_sound_is_found_put_back_and_undone(
    make_toy_project: MakeProject, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train", "val"), seconds=2.0)
    sound = project.take("Toy_002").audio_path
    assert sound is not None
    (tmp_path / "old").mkdir()
    shutil.move(sound, tmp_path / "old" / "Toy_002.wav")
    project.close()
    assert cli.main(["find", str(project.folder), str(tmp_path / "old"), "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (done["found"], done["missing"]) == (1, 1)
    assert sound.read_bytes() == (tmp_path / "old" / "Toy_002.wav").read_bytes()
    again = Project.open(project.folder)
    assert again.undo() == "Put back missing files"
    assert not sound.exists()
    again.close()


def test_nothing_missing_and_no_folder_are_said(
    make_toy_project: MakeProject, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train",), seconds=2.0)
    project.close()
    assert cli.main(["find", str(project.folder), str(tmp_path)]) == 0
    assert capsys.readouterr().out == "No files are missing.\n"
    assert cli.main(["find", str(project.folder), str(tmp_path / "nowhere")]) == 2
    assert "There is no folder nowhere." in capsys.readouterr().err
