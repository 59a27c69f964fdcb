from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from studio import cli
from studio.project import Project

MakeProject = Callable[..., Project]


def test_a_card_is_written_and_the_project_left_alone(
    make_toy_project: MakeProject, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train", "val"), seconds=3.0)
    before = (project.folder / "dataset.json").read_bytes()
    target = tmp_path / "out" / "card.html"
    assert cli.main(["card", str(project.folder), "-o", str(target), "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (done["event"], done["takes"], done["files"]) == ("done", 2, [str(target)])
    text = target.read_text(encoding="utf-8")
    assert "Grades" in text
    assert "Validation" in text
    assert (project.folder / "dataset.json").read_bytes() == before


def test_another_ending_is_refused(
    make_toy_project: MakeProject, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train",), seconds=2.0)
    assert cli.main(["card", str(project.folder), "-o", str(tmp_path / "card.pdf")]) == 2
    assert "card.pdf does not end in .html. Choose a name that ends in .html." in capsys.readouterr().err
