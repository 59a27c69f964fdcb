"""`saia import`, as written on the command line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio import cli
from studio.project import Project
from studio.sound.sound_file import Sound, read_sound, write_sound
from tests.formats.examples import a_motion, a_sound, needs_data


def lines(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def a_layout(folder: Path, *names: str) -> Path:
    from studio.formats import saia_csv

    for name in names:
        saia_csv.write(folder / f"{name}.csv", a_motion(), a_sound(folder.parent / "in" / "voice.wav"))
    return folder


def test_a_layout_becomes_takes_of_a_new_project(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = a_layout(tmp_path / "撮影 1", "Hello_001", "Hello_002")
    assert cli.main(["import", str(tmp_path / "新 project"), str(source), "--json"]) == 0
    done = lines(capsys)[-1]
    assert done["event"] == "done"
    assert done["takes"] == ["Hello_001", "Hello_002"]
    project = Project.open(tmp_path / "新 project")
    info = project.take("Hello_002").info
    assert (info.slate, info.number, info.frames, info.source) == ("Hello", 2, 30, "imported (saia_csv)")
    assert [s.split for s in project.dataset.selections] == ["train", "train"]
    audio = project.take("Hello_001").audio_path
    assert audio is not None
    assert audio.read_bytes() == (source / "Audio" / "Hello_001.wav").read_bytes()


@pytest.mark.parametrize("inside", ["Blendshapes", "Audio", "Blendshapes/a.csv", "Bones/a.csv"])
def test_any_part_of_a_layout_leads_to_the_whole_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], inside: str
) -> None:
    source = a_layout(tmp_path / "s", "a")
    assert cli.main(["import", str(tmp_path / "p"), str(source / inside), "--json"]) == 0
    assert lines(capsys)[-1]["takes"] == ["a"]
    info = Project.open(tmp_path / "p").take("a").info
    assert (len(info.shape_names), len(info.bone_names), info.audio_file) == (18, 54, "audio.wav")


def test_one_bad_recording_does_not_cost_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = a_layout(tmp_path / "s", "a", "b")
    (source / "Blendshapes" / "a.csv").write_text("Time,A\n0,x\n")
    assert cli.main(["import", str(tmp_path / "p"), str(source), "--json"]) == 0
    events = lines(capsys)
    problem = next(event for event in events if event["event"] == "problem")
    assert problem["what"] == "a.csv has 'x' where a number should be, in column A, row 2."
    assert events[-1]["takes"] == ["b"]
    assert sorted(p.name for p in (tmp_path / "p" / "takes").iterdir()) == ["b"]


def test_only_bad_recordings_fail_and_leave_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("Time,A\n0,1\n0.1\n")
    assert cli.main(["import", str(tmp_path / "p"), str(bad), "--json"]) == 2
    last = lines(capsys)[-1]
    assert last["event"] == "error"
    assert last["what"] == "Row 3 of bad.csv has 1 values where the header names 2 columns."
    assert not (tmp_path / "p").exists()


def test_what_fails_leaves_a_project_that_was_there_as_it_was(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Project.create(tmp_path / "p").close()
    (tmp_path / "bad.csv").write_text("Time,A\n0,1\n0.1\n")
    assert cli.main(["import", str(tmp_path / "p"), str(tmp_path / "bad.csv")]) == 2
    assert Project.open(tmp_path / "p").takes == ()


def test_what_fails_leaves_the_folders_as_they_were(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "p").mkdir()
    (tmp_path / "bad.csv").write_text("Time,A\n0,1\n0.1\n")
    for project in (tmp_path / "p", tmp_path / "new" / "deeper"):
        assert cli.main(["import", str(project), str(tmp_path / "bad.csv")]) == 2
    assert list((tmp_path / "p").iterdir()) == []
    assert not (tmp_path / "new").exists()


def test_a_file_in_place_of_the_project_is_a_wrong_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = a_sound(tmp_path / "voice.wav")
    assert cli.main(["import", str(source), str(source)]) == 2
    expected = "voice.wav is a file, not a folder. Choose another place for the project.\n"
    assert capsys.readouterr().err == expected


def test_the_help_names_what_can_be_brought_in() -> None:
    from studio import formats

    kinds = {"vrma": "VRMA", "vmd": "VMD", "bvh": "BVH", "saia_csv": "SAIA CSV", "livelink": "Live Link Face"}
    assert kinds.keys() <= formats.readers().keys()
    assert all(kind in cli.VERBS["import"] for kind in (*kinds.values(), "WAV"))


def test_what_was_guessed_is_told_and_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.csv").write_text("Time;A\n0,0;0,5\n0,1;1,0\n")
    assert cli.main(["import", str(tmp_path / "p"), str(tmp_path / "x.csv"), "--json"]) == 0
    notes = [event["note"] for event in lines(capsys) if event["event"] == "note"]
    assert notes == [
        "x.csv is written with decimal commas; they were read as such.",
        "No sound was found for x.",
    ]
    assert Project.open(tmp_path / "p").take("x").info.notes == tuple(notes)


@pytest.mark.parametrize(
    ("suffix", "kept"), [(".wav", "audio.wav"), (".flac", "audio.flac"), (".ogg", "audio.flac")]
)
@pytest.mark.parametrize(("rate", "channels"), [(8000, 1), (192000, 2)])
def test_sound_alone_becomes_a_take_without_motion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str, kept: str, rate: int, channels: int
) -> None:
    rate = 48000 if suffix == ".ogg" else rate
    source = a_sound(tmp_path / f"voice{suffix}", 1.0, rate, channels)
    assert cli.main(["import", str(tmp_path / "p"), str(source), "--json"]) == 0
    assert lines(capsys)[-1]["takes"] == ["voice"]
    take = Project.open(tmp_path / "p").take("voice")
    assert (take.info.audio_file, take.info.sample_rate, take.info.audio_channels) == (kept, rate, channels)
    assert take.info.motion_file is None
    if suffix != ".ogg":
        assert take.audio_path is not None
        assert take.audio_path.read_bytes() == source.read_bytes()


def test_importing_twice_keeps_both(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = a_sound(tmp_path / "voice.wav")
    for _ in range(2):
        assert cli.main(["import", str(tmp_path / "p"), str(source), "--json"]) == 0
    assert lines(capsys)[-1]["takes"] == ["voice_2"]


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["nowhere"], "There is nothing at nowhere."),
        (["empty"], "Nothing in empty can be imported."),
        (["prices.csv"], "prices.csv is not a recording: its first column is neither Time nor Timecode."),
        (["picture.csv"], "picture.csv is not a text file."),
    ],
)
def test_wrong_requests(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    what: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "prices.csv").write_text("name,price\ntea,3\n")
    (tmp_path / "picture.csv").write_bytes(bytes(range(256)) * 8)
    assert cli.main(["import", str(tmp_path / "p"), *words]) == 2
    assert capsys.readouterr().err.startswith(what)
    assert not (tmp_path / "p").exists()


def test_an_empty_wav_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = a_sound(tmp_path / "voice.wav", seconds=0)
    assert cli.main(["import", str(tmp_path / "p"), str(source)]) == 2
    assert capsys.readouterr().err.startswith("The sound file voice.wav is empty. Choose another file.")


@pytest.mark.parametrize("name", ["voice.mp3", "voice.wav", "moves.arrow"])
def test_a_file_of_nonsense_is_a_wrong_request_without_a_log(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    (tmp_path / name).write_bytes(bytes(range(256)) * 40)
    assert cli.main(["import", str(tmp_path / "p"), str(tmp_path / name)]) == 2
    told = capfd.readouterr().err
    assert name in told
    assert "Details are in" not in told
    assert len(told.splitlines()) == 1


def test_what_can_be_read_of_a_damaged_flac_is_kept_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "voice.flac"
    noise = np.random.default_rng(2).standard_normal((64000, 1), dtype=np.float32) * np.float32(0.1)
    write_sound(source, Sound(noise, 16000))
    content = bytearray(source.read_bytes())
    content[60000:64000] = np.random.default_rng(3).bytes(4000)
    source.write_bytes(content)
    assert cli.main(["import", str(tmp_path / "p"), str(source), "--json"]) == 0
    take = next(event for event in lines(capsys) if event["event"] == "take")
    assert take["notes"] == ["voice.flac is damaged; everything readable was kept."]
    assert read_sound(tmp_path / "p" / "takes" / "voice" / "audio.flac").duration > 3.0


def test_files_of_systems_and_hidden_ones_are_passed_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = a_layout(tmp_path / "s", "a")
    shutil.copytree(source / "Blendshapes", source / "__MACOSX" / "Blendshapes")
    shutil.copy(source / "Audio" / "a.wav", source / "Audio" / "._a.wav")
    assert cli.main(["import", str(tmp_path / "p"), str(source), "--json"]) == 0
    assert lines(capsys)[-1]["takes"] == ["a"]


def test_the_real_sets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [str(needs_data(name)) for name in ("facegood", "livelink_pair")]
    assert cli.main(["import", str(tmp_path / "p"), *folders, "--json"]) == 0
    assert lines(capsys)[-1]["takes"] == ["2_01", "2_02", "2_03", "2_04", "3_15", "testset"]
    take = Project.open(tmp_path / "p").take("testset")
    assert (
        take.info.notes[0]
        == "audio.wav was taken as the sound of testset.csv: they are alone in their folder."
    )
    assert take.info.sample_rate == 44100


def test_motion_that_cannot_be_read_is_not_left_out_in_silence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    a_sound(tmp_path / "in" / "Audio" / "one.wav", 1.0)
    (tmp_path / "in" / "Blendshapes").mkdir()
    (tmp_path / "in" / "Blendshapes" / "one.csv").write_text("A,E\n0.1,0.2\n", encoding="utf-8")
    assert cli.main(["import", str(tmp_path / "P"), str(tmp_path / "in")]) == 2
    assert "one.csv" in capsys.readouterr().err
