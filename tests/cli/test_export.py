"""`saia export`: takes as files of other programs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from studio import cli
from studio.dataset import edits
from studio.files import cache
from studio.formats import bvh, saia_csv
from studio.project import Project
from studio.sound.sound_file import read_sound
from studio.take import TakeInfo
from studio.take.motion_file import read_motion
from tests.formats.examples import a_motion, a_sound, assert_same_motion
from tests.patience import until


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project = Project.create(tmp_path / "p")
    sound = a_sound(tmp_path / "in.wav", 2.0)
    project.add_take("full", TakeInfo("full"), a_motion(120), sound)
    project.add_take("voice", TakeInfo("voice"), None, sound)
    return project.folder


def done(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert events[0] == {"event": "progress", "fraction": 0.0, "eta_s": None}
    assert events[-2]["event"] == "progress"
    assert events[-2]["fraction"] == 1.0
    return events[-1]


def test_a_whole_take_in_every_format(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "書き出し"
    for suffix, files in {
        ".bvh": ["x.bvh"],
        ".arrow": ["x.arrow"],
        ".wav": ["x.wav"],
        ".csv": ["Blendshapes/x.csv", "Bones/x.csv", "Audio/x.wav"],
    }.items():
        assert cli.main(["export", str(folder), "full", "-o", str(out / f"x{suffix}"), "--json"]) == 0
        event = done(capsys)
        assert event["event"] == "done"
        assert event["files"] == [str(out / file) for file in files]
    assert_same_motion(saia_csv.read(out / "Blendshapes" / "x.csv").motion, a_motion(120))
    assert_same_motion(read_motion(out / "x.arrow"), a_motion(120))
    assert len(bvh.read(out / "x.bvh").motion or ()) == 120


def test_points_and_offset_are_applied(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = Project.open(folder)
    dataset = edits.set_offset(edits.trim(project.dataset, "full", 0.5, 1.5), ["full"], 0.1)
    project.edit("Trim", dataset)
    assert cli.main(["export", str(folder), "full", "-o", str(tmp_path / "x.csv")]) == 0
    back = saia_csv.read(tmp_path / "Blendshapes" / "x.csv")
    assert back.motion is not None
    assert back.audio is not None
    np.testing.assert_allclose(back.motion.pose(0.5).shapes, a_motion(120).pose(0.9).shapes, atol=1e-4)
    assert read_sound(back.audio).duration == pytest.approx(1.0)


@pytest.mark.parametrize("trim", [False, True])
def test_cleaned_sound_goes_along_where_it_was_chosen(folder: Path, tmp_path: Path, trim: bool) -> None:
    project = Project.open(folder)
    recorded = project.take("full").audio_path
    assert recorded is not None
    quiet = read_sound(recorded)
    with cache.keeping(recorded, "clean1-noise.flac") as beside:  # as if it had been made
        soundfile.write(str(beside), quiet.samples * 0.25, quiet.sample_rate, "PCM_24", format="FLAC")
    dataset = edits.update(project.dataset, ["full"], lambda s: replace(s, clean="noise"))
    project.edit("Clean", edits.trim(dataset, "full", 0.5, 1.5) if trim else dataset)
    assert cli.main(["export", str(folder), "full", "-o", str(tmp_path / "x.csv")]) == 0
    found = read_sound(tmp_path / "Audio" / "x.wav")
    wanted = quiet.samples[len(quiet.samples) // 4 : -len(quiet.samples) // 4] if trim else quiet.samples
    np.testing.assert_allclose(found.samples, wanted * 0.25, atol=1e-3)


def test_another_frame_rate(folder: Path, tmp_path: Path) -> None:
    assert cli.main(["export", str(folder), "full", "-o", str(tmp_path / "x.bvh"), "--fps", "30"]) == 0
    assert "Frame Time: 0.03333333" in (tmp_path / "x.bvh").read_text()


@pytest.mark.parametrize(
    ("what", "out", "code", "sentence"),
    [
        ("zz", "x.bvh", 2, "There is no take zz in p. Takes there: full, voice."),
        ("full", "x.fbx", 2, "The studio cannot write files like x.fbx."),
        ("voice", "x.bvh", 2, "voice has no motion to export. Generate it first: RUN:voice."),
        ("saia_001:voice", "x.bvh", 2, "There is no run saia_001 in p. Runs there: none yet."),
    ],
)
def test_wrong_requests(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    what: str,
    out: str,
    code: int,
    sentence: str,
) -> None:
    assert cli.main(["export", str(folder), what, "-o", str(tmp_path / out)]) == code
    assert capsys.readouterr().err.startswith(sentence)
    assert not (tmp_path / out).exists()


@pytest.mark.parametrize(("out", "there"), [("x.bvh", "x.bvh"), ("x.csv", "Bones/x.csv")])
def test_a_file_that_is_there_is_written_over_only_by_force(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], out: str, there: str
) -> None:
    old = tmp_path / there
    old.parent.mkdir(exist_ok=True)
    old.write_text("a week of work")
    assert cli.main(["export", str(folder), "full", "-o", str(tmp_path / out)]) == 2
    assert capsys.readouterr().err == (
        f"{old} is there already. Choose another name with -o, or add --force to write over it.\n"
    )
    assert old.read_text() == "a week of work"
    assert cli.main(["export", str(folder), "full", "-o", str(tmp_path / out), "--json"]) == 2
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (told["event"], told["there"]) == ("error", old.name), "a program need not read the sentence"
    assert cli.main(["export", str(folder), "full", "-o", str(tmp_path / out), "--force"]) == 0
    assert old.read_text() != "a week of work"


def test_a_file_in_place_of_the_folder_is_said_before_the_work(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "in.wav" / "deeper" / "x.bvh"
    assert cli.main(["export", str(folder), "full", "-o", str(out)]) == 2
    expected = f"{tmp_path / 'in.wav'} is a file, not a folder. Choose another folder with -o.\n"
    assert capsys.readouterr().err == expected


def test_a_take_is_never_written_over(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = folder / "takes" / "full" / "audio.wav"
    before = own.read_bytes()
    assert cli.main(["export", str(folder), "voice", "-o", str(own), "--force"]) == 2
    assert capsys.readouterr().err == (
        "audio.wav would lie among the project's own takes and runs, which are never altered. "
        "Choose another folder with -o.\n"
    )
    assert own.read_bytes() == before


def test_a_run_without_weights_says_so(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Project.open(folder).new_run_folder("saia")
    assert cli.main(["export", str(folder), "saia_001:voice", "-o", str(tmp_path / "x.bvh")]) == 2
    assert capsys.readouterr().err.startswith("saia_001 has no trained weights yet. Train it first")


def test_what_a_run_makes_of_a_takes_sound(
    make_toy_project: Callable[..., Project], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.training.loop.train import train
    from studio.training.recipe import load_recipe

    project = make_toy_project(("train", "val"))
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=1"])
    run = train(project, recipe, on_event=lambda event: None)
    selection, take = project.selected("val")[0]
    words = [
        "export",
        str(project.folder),
        f"{run.id}:{selection.id}",
        "-o",
        str(tmp_path / "x.bvh"),
        "--json",
    ]
    assert cli.main(words) == 0
    assert done(capsys)["files"] == [str(tmp_path / "x.bvh")]
    motion = bvh.read(tmp_path / "x.bvh").motion
    assert motion is not None
    assert motion.duration == pytest.approx(take.info.audio_seconds, abs=0.1)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Windows knows no kill that asks nobody")
def test_what_a_killed_export_left_is_gone_after_the_next(folder: Path, tmp_path: Path) -> None:
    scratch, out = tmp_path / "temporary", tmp_path / "out"
    scratch.mkdir()
    out.mkdir()
    words = [sys.executable, "-m", "studio", "export", str(folder), "full", "-o"]
    how = {"cwd": Path(__file__).resolve().parents[2], "env": {**os.environ, "TMPDIR": str(scratch)}}
    with subprocess.Popen([*words, str(out / "film.mp4"), "--size", "1280x720"], **how) as child:
        until(lambda: any(out.iterdir()) or child.poll() is not None)
        child.kill()
    assert [path.suffix for path in out.iterdir()] == [".new"]
    assert list(scratch.glob("saia-export-*"))
    assert subprocess.run([*words, str(out / "x.bvh")], **how, check=False).returncode == 0
    assert [path.name for path in out.iterdir()] == ["x.bvh"]
    assert not list(scratch.glob("saia-*"))
