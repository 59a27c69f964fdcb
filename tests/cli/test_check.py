"""`saia check`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.project import Project
from studio.take import TakeInfo
from tests.formats.examples import a_motion, a_sound


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project = Project.create(tmp_path / "p")
    sound = a_sound(tmp_path / "in.wav", 4.0)
    project.add_take("good", TakeInfo("good"), a_motion(240), sound)
    project.add_take("mute", TakeInfo("mute"), a_motion(240), None)
    return project.folder


def test_every_take_gets_a_grade_and_its_findings(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(folder), "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert done["event"] == "done"
    assert set(done["takes"]) == {"good", "mute"}
    mute = done["takes"]["mute"]
    assert mute["grade"] == "D"
    assert mute["fps"] == pytest.approx(60)
    assert {"grade", "findings", "fps", "jitter_ms", "offset_ms"} <= set(mute)
    first = mute["findings"][0]
    assert (first["kind"], first["severity"], first["what"]) == (
        "no_sound",
        "fatal",
        "No sound was recorded.",
    )
    assert first["remedy"]


def test_a_finding_that_ends_somewhere_is_told_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = Project.create(tmp_path / "p")
    whole = a_motion(240)
    rows = np.flatnonzero((whole.times < 1.0) | (whole.times > 2.0))
    project.add_take("gap", TakeInfo("gap"), whole.at_rows(rows), a_sound(tmp_path / "in.wav", 4.0))
    assert cli.main(["check", str(project.folder), "--json"]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    gap = next(event for event in events if event.get("kind") == "gap")
    assert (gap["at"], gap["until"]) == pytest.approx((1.0, 2.0), abs=0.05)


def test_one_take_in_words(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(folder), "mute"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "D  mute: No sound was recorded."
    assert lines[-1] == "1 take checked."


def test_checking_is_allowed_beside_an_open_window(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*")}
    assert cli.main(["check", str(folder)]) == 0
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*")} == before


def test_an_unknown_take(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(folder), "zz"]) == 2
    assert capsys.readouterr().err == "There is no take zz in p. Takes there: good, mute.\n"


def test_an_empty_project(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Project.create(tmp_path / "p")
    assert cli.main(["check", str(tmp_path / "p"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["takes"] == {}


def test_a_damaged_project_file_is_said_on_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Project.create(tmp_path / "P").close()
    (tmp_path / "P" / "project.json").write_text("{", encoding="utf-8")
    assert cli.main(["check", str(tmp_path / "P")]) == 0
    assert "project.json" in capsys.readouterr().out
