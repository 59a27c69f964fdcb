"""`saia cut`."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from studio import cli
from studio.project import Project
from studio.sound.sound_file import Sound, write_sound
from studio.take import TakeInfo
from tests.take.speech import RATE, talk

OpenElsewhere = Callable[[Path], AbstractContextManager[int]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project = Project.create(tmp_path / "話")
    sound, _ = talk(gap=1.2)
    write_sound(tmp_path / "in.wav", Sound(sound[:, None], RATE))
    project.add_take("talk", TakeInfo("talk"), None, tmp_path / "in.wav")
    project.close()
    return project.folder


def test_a_take_becomes_parts_with_one_step_of_undo(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["cut", str(folder), "talk", "--pause", "0.8", "--shortest", "1", "--padding", "0.2"]
    assert cli.main([*words, "--look"]) == 0
    assert capsys.readouterr().out.endswith("1 take would become 3 parts; nothing was changed.\n")
    assert [s.id for s in Project.open(folder, read_only=True).dataset.selections] == ["talk"]
    assert cli.main([*words, "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    _, spans = talk(gap=1.2)
    for (start, end), part in zip(spans, done["takes"]["talk"], strict=True):
        assert part[0] == pytest.approx(start - 0.2, abs=0.2)
        assert part[1] == pytest.approx(end + 0.2, abs=0.3)
    project = Project.open(folder)
    assert [s.id for s in project.dataset.selections] == ["talk.1", "talk.2", "talk.3"]
    assert project.undo() == "Cut talk where nobody speaks"
    assert [s.id for s in project.dataset.selections] == ["talk"]


def test_without_a_pause_nothing_changes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["cut", str(folder), "talk", "--pause", "30"]) == 0
    assert capsys.readouterr().out.endswith("There is no pause long enough to cut in; nothing was changed.\n")


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["nobody"], 2, "There is no take nobody in 話. Takes there: talk."),
        (["talk", "--pause", "-1"], 2, "A length in seconds cannot be below 0. Give 0 or more."),
    ],
)
def test_what_is_wrong_is_said(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], code: int, sentence: str
) -> None:
    assert cli.main(["cut", str(folder), *words]) == code
    assert capsys.readouterr().err.strip() == sentence


def test_a_take_without_sound_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from studio.motion import Motion

    project = Project.open(folder)
    project.add_take("mute", TakeInfo("mute"), Motion.build([0.0, 1.0]), None)
    project.close()
    assert cli.main(["cut", str(folder), "mute"]) == 2
    assert capsys.readouterr().err == "mute has no sound. Choose a take with sound.\n"


def test_a_project_open_elsewhere_is_left_alone(
    folder: Path, open_elsewhere: OpenElsewhere, capsys: pytest.CaptureFixture[str]
) -> None:
    with open_elsewhere(folder) as window:
        assert cli.main(["cut", str(folder), "talk"]) == 1
        assert capsys.readouterr().err.startswith(f"話 is open in another window (process {window}).")
        assert cli.main(["cut", str(folder), "talk", "--look"]) == 0
    assert [s.id for s in Project.open(folder).dataset.selections] == ["talk"]
