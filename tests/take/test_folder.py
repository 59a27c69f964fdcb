"""Takes on disk: written once, whole or absent."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from studio.errors import StudioError
from studio.files.atomic import safe_name
from studio.take import TakeInfo
from studio.take.folder import list_takes, load_take, save_take
from tests.formats.examples import a_motion, a_sound


def test_saving_fills_in_what_the_files_tell(tmp_path: Path) -> None:
    audio = a_sound(tmp_path / "in.wav", seconds=1.5, rate=44100, channels=2)
    take = save_take(tmp_path / "takes" / "挨拶 1_001", TakeInfo("挨拶 1"), a_motion(), audio)
    info = take.info
    assert (info.audio_file, info.sample_rate, info.audio_channels) == ("audio.wav", 44100, 2)
    assert (info.audio_seconds, info.duration) == pytest.approx((1.5, 1.5), abs=1e-3)
    assert (info.motion_file, info.frames, info.fps) == ("motion.arrow", 30, 60.0)
    assert len(info.shape_names) == 18
    assert len(info.bone_names) == 54
    assert load_take(take.folder) == take
    assert take.audio_path is not None
    assert take.audio_path.read_bytes() == audio.read_bytes()


def test_a_saved_take_is_never_written_again(tmp_path: Path) -> None:
    take = save_take(tmp_path / "a_001", TakeInfo("a"), a_motion(), None)
    with pytest.raises(StudioError) as error:
        save_take(take.folder, TakeInfo("b"), None, None)
    assert error.value.what == "There is a take a_001 already."
    assert load_take(take.folder) == take


def test_a_recorders_folder_is_completed_in_place(tmp_path: Path) -> None:
    folder = tmp_path / "a_001"
    audio = a_sound(folder / "audio.wav")
    (folder / "journal.bin").write_bytes(b"kept")
    take = save_take(folder, TakeInfo("a"), a_motion(), audio)
    assert take.audio_path == audio
    assert (folder / "journal.bin").exists()


def test_a_take_that_cannot_be_saved_leaves_nothing(tmp_path: Path) -> None:
    bad = tmp_path / "in.wav"
    bad.write_bytes(b"RIFF....not a sound")
    takes = tmp_path / "takes"
    with pytest.raises(StudioError) as error:
        save_take(takes / "a_001", TakeInfo("a"), a_motion(), bad)
    assert error.value.what == "No sound could be read from audio.wav."
    assert list(takes.iterdir()) == []


def test_a_take_file_cannot_reach_outside_its_folder(tmp_path: Path) -> None:
    take = save_take(tmp_path / "a_001", TakeInfo("a"), a_motion(), None)
    path = take.folder / "take.json"
    content = json.loads(path.read_text())
    content["motion_file"] = "../../secret.arrow"
    path.write_text(json.dumps(content))
    assert load_take(take.folder).motion_path == take.folder / "secret.arrow"


def test_unknown_facts_are_passed_over_and_known_ones_checked(tmp_path: Path) -> None:
    take = save_take(tmp_path / "a_001", TakeInfo("a"), a_motion(), None)
    path = take.folder / "take.json"
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, "mood": "sunny"}))
    assert load_take(take.folder) == take
    path.write_text(json.dumps({**content, "frames": "many"}))
    with pytest.raises(StudioError) as error:
        load_take(take.folder)
    assert error.value.what == "take.json in a_001 is damaged."


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("audio_file", True),
        ("audio_file", 3),
        ("audio_file", ".."),
        ("audio_file", "a\0b"),
        ("motion_file", ["motion.arrow"]),
        ("slate", 7),
        ("created", None),
        ("notes", "one."),
        ("notes", [1]),
        ("bone_names", {"Head": 1}),
        ("duration", float("nan")),
        ("duration", "2.5"),
        ("duration", -1.0),
        ("audio_seconds", 1e300),
        ("sample_rate", float("inf")),
        ("frames", True),
        ("frames", []),
        ("number", None),
        ("extra", ["avatar"]),
        ("version", "1"),
        ("left_out", [[0.0, 1.0]]),
        ("left_out", [[0.0, "x", "No face"]]),
    ],
)
def test_a_fact_of_another_kind_is_damage(tmp_path: Path, name: str, value: object) -> None:
    take = save_take(tmp_path / "a_001", TakeInfo("a"), a_motion(), None)
    path = take.folder / "take.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), name: value}))
    with pytest.raises(StudioError) as error:
        load_take(take.folder)
    assert error.value.what == "take.json in a_001 is damaged."


def test_a_measure_that_came_to_nothing_is_no_damage(tmp_path: Path) -> None:
    take = save_take(tmp_path / "a_001", TakeInfo("a"), a_motion(), None)
    path = take.folder / "take.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "drift_ppm": float("nan"), "frames": 30.0}))
    assert load_take(take.folder).info == replace(take.info, drift_ppm=0.0)


def test_problems_are_told_one_by_one(tmp_path: Path) -> None:
    good = save_take(tmp_path / "a_001", TakeInfo("a"), a_motion(), None)
    bad = save_take(tmp_path / "b_001", TakeInfo("b"), a_motion(), None)
    (bad.folder / "take.json").write_text("{")
    told: list[str] = []
    found = list_takes(tmp_path, lambda folder, error: told.append(f"{folder.name}: {error.what}"))
    assert found == (good,)
    assert told == ["b_001: take.json in b_001 is damaged."]


def test_facts_survive_the_way_to_disk_and_back(tmp_path: Path) -> None:
    info = TakeInfo(
        "歌", 3, "2026-01-02T03:04:05", notes=("one.", "two."), extra={"avatar": "さくら"}, drift_ppm=-3.5
    )
    take = save_take(tmp_path / "a_001", info, None, None)
    assert load_take(take.folder).info == replace(info)


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("挨拶 1", "挨拶 1"),
        ("a/b\\c:d", "a_b_c_d"),
        ("..", "take"),
        ("CON", "take_CON"),
        ("line\nbreak", "line_break"),
        ("x" * 200, "x" * 80),
        (" dots. ", "dots"),
        ("--json", "_-json"),
    ],
)
def test_names_that_every_system_accepts(name: str, safe: str) -> None:
    assert safe_name(name) == safe
