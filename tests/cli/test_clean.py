"""`saia clean`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.dataset.history import selection_from_plain
from studio.dataset.material import load_material
from studio.motion import Motion
from studio.project import Project
from studio.sound.sound_file import Sound, write_sound
from studio.take import TakeInfo
from tests.take.speech import RATE, talk
from tests.tolerance import LAST_BITS


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project = Project.create(tmp_path / "話")
    sound, _ = talk(gap=1.2, noise=0.01, sentences=1)
    write_sound(tmp_path / "in.wav", Sound(sound[:, None], RATE))
    for name in ("one", "two"):
        project.add_take(name, TakeInfo(name), None, tmp_path / "in.wav")
    project.add_take("mute", TakeInfo("mute"), Motion.build([0.0, 1.0]), None)
    project.close()
    return project.folder


@pytest.mark.slow
def test_a_choice_is_what_training_hears_and_can_be_undone(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["clean", str(folder), "one", "--way", "voice", "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    shares = [line["fraction"] for line in lines if line["event"] == "progress"]
    assert shares == sorted(shares)
    assert Path(lines[-1]["takes"]["one"]).is_file()
    project = Project.open(folder)
    assert [s.clean for s in project.dataset.selections] == ["voice", "", ""]
    chosen, other = (
        load_material(project.dataset[name], project.take(name), RATE).samples for name in ("one", "two")
    )
    assert len(chosen) == len(other)
    pause = slice(0, RATE)
    assert np.abs(chosen[pause]).mean() < 0.2 * np.abs(other[pause]).mean()
    assert project.undo() == "Clean the sound of one"
    heard = load_material(project.dataset["one"], project.take("one"), RATE).samples
    np.testing.assert_array_equal(heard, other)


@pytest.mark.slow
def test_a_cache_that_went_is_made_again_for_training(folder: Path) -> None:
    assert cli.main(["clean", str(folder), "one", "--way", "voice"]) == 0
    project = Project.open(folder)
    first = load_material(project.dataset["one"], project.take("one"), RATE).samples
    for path in (folder / "takes" / "one" / ".cache").iterdir():
        path.unlink()
    again = load_material(project.dataset["one"], project.take("one"), RATE).samples
    np.testing.assert_allclose(again, first, atol=LAST_BITS)


@pytest.mark.slow
def test_preparing_chooses_nothing_and_off_chooses_the_recording(folder: Path) -> None:
    assert cli.main(["clean", str(folder), "one", "--way", "voice", "--prepare"]) == 0
    assert {s.clean for s in Project.open(folder).dataset.selections} == {""}
    assert cli.main(["clean", str(folder), "one", "--way", "voice"]) == 0
    assert Project.open(folder).dataset["one"].clean == "voice"
    assert cli.main(["clean", str(folder), "one", "--way", "off"]) == 0
    assert Project.open(folder).dataset["one"].clean == ""


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("mute", "mute has no sound. Choose a take with sound."),
        ("nobody", "There is no take nobody in 話. Takes there: mute, one, two."),
    ],
)
def test_what_is_wrong_is_said(
    folder: Path, capsys: pytest.CaptureFixture[str], name: str, sentence: str
) -> None:
    assert cli.main(["clean", str(folder), name]) == 2
    assert capsys.readouterr().err.strip() == sentence


@pytest.mark.parametrize("value", ["magic", 3, None, ["noise"]])
def test_a_choice_of_another_version_counts_as_the_recording(value: object) -> None:
    found = selection_from_plain({"id": "a", "take": "a", "clean": value})
    assert found.clean == ""
    assert selection_from_plain({"id": "a", "take": "a", "clean": "noise"}).clean == "noise"
    assert selection_from_plain({"id": "a", "take": "a"}).clean == "", "projects of before open as they were"
