"""The run that comes with the studio: in every project, and nobody's to change."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio import cli
from studio.errors import RequestError
from studio.inference.offline import load_predictor
from studio.metrics.face import blinks_per_minute, opening
from studio.metrics.scores import Pair
from studio.project import Project
from studio.project.run import base_voice
from studio.take.motion_file import load_motion_file
from studio.training.styles import newest
from tests.inference.live.runs import add_run

RATE = 16_000


def vowel(seconds: float) -> np.ndarray:
    """An "ah" of a hundred and forty hertz: harmonics, strong about 750, 1200 and 2600 Hz."""
    t = np.arange(int(seconds * RATE)) / RATE
    hertz = 140.0 * np.arange(1, 40)
    formants = ((750, 120, 1.0), (1200, 150, 0.5), (2600, 300, 0.15))
    strength = sum(g * np.exp(-(((hertz - f) / width) ** 2)) for f, width, g in formants) + 0.01
    sound = (strength[:, None] * np.sin(2 * np.pi * hertz[:, None] * t)).sum(axis=0)
    return (0.1 * sound / sound.std()).astype(np.float32)


@pytest.fixture
def spoken(tmp_path: Path) -> Path:
    """Four seconds of room, ten of a vowel that comes and goes, four of room."""
    room = 1e-3 * np.random.default_rng(0).standard_normal(18 * RATE).astype(np.float32)
    loud = np.repeat([0, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 0, 0, 0, 0], RATE).astype(np.float32)
    loud = np.convolve(loud, np.hanning(800) / np.hanning(800).sum(), mode="same")
    soundfile.write(tmp_path / "ah.wav", room + loud * vowel(18.0), RATE)
    return tmp_path / "ah.wav"


def test_it_is_small_and_knows_nobody() -> None:
    run = base_voice()
    assert run.has_weights
    assert run.status == "done"
    assert sum(file.stat().st_size for file in run.folder.iterdir()) <= 4_000_000
    assert not run.facts.styles
    assert load_predictor(run.folder).model.network.look_aheads == (0, 100, 200)


def test_a_vowel_opens_the_mouth_and_silence_keeps_it_shut() -> None:
    predictor = load_predictor(base_voice().folder)
    room = 1e-3 * np.random.default_rng(0).standard_normal(4 * RATE).astype(np.float32)
    # The same rest after a sound as before one: seconds of it, since each take ends with them.
    sound = np.concatenate([room, vowel(1.0), room])
    mouth = opening(predictor.generate_samples(sound))
    digital = opening(predictor.generate_samples(np.zeros(8 * RATE, dtype=np.float32)))
    assert mouth is not None
    assert digital is not None
    assert mouth[130:145].mean() > 0.4
    assert mouth[:105].mean() < 0.06
    assert mouth[180:].mean() < 0.06
    assert digital.mean() < 0.06


def test_every_project_has_it_last_and_no_table_of_runs_shows_it(tmp_path: Path) -> None:
    project = Project.create(tmp_path / "New")
    assert project.runs == ()
    assert [run.id for run in project.usable_runs] == ["base_voice"]
    assert newest(project.usable_runs).is_shipped
    own = add_run(project)
    assert [run.id for run in project.usable_runs] == [own.id, "base_voice"]
    assert newest(project.usable_runs) == own, "however new the studio's own files are"
    assert project.run("base_voice") == base_voice()
    with pytest.raises(RequestError):
        project.run("base_voice_2")


def test_it_generates_and_blinks_in_a_project_without_a_take(tmp_path: Path, spoken: Path) -> None:
    project = Project.create(tmp_path / "New")
    file = tmp_path / "ah.arrow"
    assert cli.main(["generate", str(project.folder), "base_voice", str(spoken), "-o", str(file)]) == 0
    motion = load_motion_file(file)
    assert motion is not None
    assert len(motion) == pytest.approx(18 * 30, abs=1)
    assert 5 < (blinks_per_minute([Pair(motion, motion)]) or 0) < 40
    assert not list(project.runs_folder.iterdir())


def test_it_performs_live_in_a_project_without_a_take(
    tmp_path: Path, spoken: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = Project.create(tmp_path / "New")
    words = ["--file", str(spoken), "--output", "none", "--to", "none", "--seconds", "1"]
    assert cli.main(["live", str(project.folder), "base_voice", *words, "--json"]) == 0
    first = json.loads(capsys.readouterr().out.splitlines()[0])
    assert (first["event"], first["run"], first["look_aheads"]) == ("ready", "base_voice", [0, 100, 200])


def test_measuring_it_writes_nothing_beside_it(make_toy_project: Callable[..., Project]) -> None:
    project = make_toy_project(splits=("train", "test"))
    before = sorted(path.name for path in base_voice().folder.iterdir())
    assert cli.main(["evaluate", str(project.folder), "base_voice", "--no-baselines"]) == 0
    assert cli.main(["suggest", str(project.folder), "--run", "base_voice", "--only-run"]) == 0
    assert sorted(path.name for path in base_voice().folder.iterdir()) == before


def test_its_training_cannot_go_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    project = Project.create(tmp_path / "New")
    assert cli.main(["train", str(project.folder), "--resume", "base_voice"]) == 2
    assert capsys.readouterr().err.startswith(
        "The base voice comes with the studio; its training cannot go on. "
        "Leave --resume out to train a run of your own."
    )


def test_nobodys_style_is_kept_in_it(
    make_toy_project: Callable[..., Project], capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(splits=("train",))
    words = ["style", str(project.folder), "base_voice", "Toy_001", "--from", "0", "--to", "5"]
    assert cli.main(words) == 2
    assert capsys.readouterr().err.startswith(
        "The base voice comes with the studio and learns nobody's style. "
        "Train a run of your own, and show it the style."
    )
