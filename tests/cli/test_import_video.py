"""`saia import` of videos: sound and motion of one file, and a sentence where one of them is missing."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.project import Project
from studio.take.check import check_take
from studio.tracking import raw
from studio.tracking.raw import BlockStore
from tests.small_disk import small_disk
from tests.tracking.faces import (
    GONE,
    OPENS,
    SECONDS,
    Look,
    bursts,
    needs_tracking,
    use_model,
    write_talk,
    write_video,
)

needs_tracking_here = needs_tracking()
NOBODY = [Look(gone=True)] * 20


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    return use_model(monkeypatch, tmp_path)


def imported(tmp_path: Path, *words: str) -> Project:
    assert cli.main(["import", str(tmp_path / "p"), *words]) == 0
    return Project.open(tmp_path / "p")


@needs_tracking_here
def test_a_video_becomes_a_take_with_its_lost_face_left_out(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    talk = write_talk(tmp_path)
    project = imported(tmp_path, str(talk), "--json")
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert next(e["path"] for e in events if e["event"] == "progress") == str(talk)
    assert events[-1]["takes"] == ["talk"]
    take = project.take("talk")
    assert take.trains
    assert take.info.audio_seconds == pytest.approx(SECONDS, abs=0.15)
    assert take.info.source == "imported (video)"
    (start, end), *more = project.dataset["talk"].excluded
    assert (not more, start <= GONE[0], end >= GONE[1] - 0.04) == (True, True, True)
    labels = project.dataset["talk"].labels
    assert {(label.tier, label.text) for label in labels} == {("problem", "Cut"), ("problem", "No face")}
    kinds = {finding.kind for finding in check_take(take).findings}
    assert "face_lost" in kinds
    assert not kinds & {"gap", "jump", "frozen"}
    project.close()


@needs_tracking_here
def test_a_disk_that_is_full_at_the_end_costs_no_tracking(model: Path, tmp_path: Path) -> None:
    # Noise, which no FLAC makes small.
    sound = np.random.default_rng(0).uniform(-0.3, 0.3, 16_000 * 10).astype(np.float32)
    film = write_video(tmp_path / "a.mp4", [Look(roll=i / 3) for i in range(20)], sound)
    with small_disk(tmp_path / "tiny", "200k") as tiny:
        assert cli.main(["import", str(tiny / "p"), str(film)]) == 1
    store = BlockStore(film, None)
    assert len(raw.joined(store.load()).times) == 20
    imported(tmp_path, str(film)).close()
    assert store.load() == []


@pytest.fixture
def no_model(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SAIA_FACE_MODEL", str(tmp_path / "nowhere" / "face_landmarker.task"))


@pytest.mark.usefixtures("no_model")
def test_without_the_model_the_sound_comes_alone_and_says_why(tmp_path: Path) -> None:
    film = write_video(tmp_path / "a.mp4", NOBODY, bursts(0.7, [0.1]))
    project = imported(tmp_path, str(film))
    (note,) = project.take("a").info.notes
    assert note.startswith("Only the sound of a.mp4 was imported. ")
    lacks = importlib.util.find_spec("mediapipe") is None
    assert ("pip install mediapipe" if lacks else "saia camera --get-model") in note
    project.close()


@pytest.mark.usefixtures("no_model")
def test_without_model_and_sound_it_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    film = write_video(tmp_path / "a.mp4", NOBODY)
    assert cli.main(["import", str(tmp_path / "p"), str(film)]) != 0
    assert "saia camera --get-model" in capsys.readouterr().err or not importlib.util.find_spec("mediapipe")
    assert not (tmp_path / "p").exists()


def test_the_sound_alone_where_that_was_asked_for(tmp_path: Path) -> None:
    film = write_video(tmp_path / "a.mp4", NOBODY, bursts(0.7, [0.1]))
    project = imported(tmp_path, str(film), "--sound-only")
    assert project.take("a").info.notes == ()
    assert project.take("a").info.motion_file is None
    project.close()


@needs_tracking_here
def test_a_video_without_a_face_is_its_sound_and_without_either_it_is_refused(
    model: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    film = write_video(tmp_path / "a.mp4", NOBODY, bursts(0.7, [0.1]))
    project = imported(tmp_path, str(film))
    assert project.take("a").info.notes == ("No face was seen in a.mp4; only its sound was imported.",)
    project.close()
    mute = write_video(tmp_path / "mute.mp4", NOBODY)
    assert cli.main(["import", str(tmp_path / "p"), str(mute)]) != 0
    assert "No face was seen in mute.mp4, and it has no sound." in capsys.readouterr().err


@needs_tracking_here
def test_a_video_without_sound_is_its_motion(model: Path, tmp_path: Path) -> None:
    film = write_video(tmp_path / "mute.mp4", [Look(roll=i / 3) for i in range(20)])
    project = imported(tmp_path, str(film))
    take = project.take("mute")
    assert take.info.notes == ("mute.mp4 has no sound; only its motion was imported.",)
    assert take.info.frames == 20
    project.close()


def test_a_box_that_cannot_be_is_a_wrong_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    film = write_video(tmp_path / "a.mp4", NOBODY[:2], bursts(0.1, [0.0]))
    for words in (("--box", "80,0,30,30"), ("--box", "left"), ("--face", "-1")):
        assert cli.main(["import", str(tmp_path / "p"), str(film), *words]) == 2
    assert "80,0,30,30 is no box in the picture." in capsys.readouterr().err


def test_the_sound_of_a_film_is_copied_as_it_is_heard(tmp_path: Path) -> None:
    from studio.sound.sound_file import read_sound

    film = write_video(tmp_path / "a.mp4", NOBODY[:2], bursts(2.0, OPENS))
    project = imported(tmp_path, str(film), "--sound-only")
    audio = project.take("a").audio_path
    assert audio is not None
    kept, heard = read_sound(audio), read_sound(film)
    assert kept.samples.shape == heard.samples.shape
    assert np.abs(kept.samples - heard.samples).max() < 1e-4
    project.close()
