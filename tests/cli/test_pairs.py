"""Motion and sound of one name come in as one take, and every format goes out and comes back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from studio import cli, formats
from studio.project import Project
from studio.take import TakeInfo
from tests.formats.examples import a_motion, a_sound


def last(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(capsys.readouterr().out.splitlines()[-1])
    return found


@pytest.mark.parametrize("name", ["bvh", "vrma", "vmd", "livelink"])
def test_motion_and_sound_of_one_name_are_one_take(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module = formats.load(name)
    source = tmp_path / "素材"
    module.write(source / f"歌う{formats.written_suffix(module)}", a_motion(), None)
    a_sound(source / "歌う.wav")
    a_sound(source / "other.wav")
    assert cli.main(["import", str(tmp_path / "p"), str(source), "--json"]) == 0
    assert last(capsys)["takes"] == ["歌う", "other"]
    info = Project.open(tmp_path / "p").take("歌う").info
    assert info.audio_file == "audio.wav"
    assert info.frames > 10
    assert not any("No sound" in note for note in info.notes)


@pytest.mark.parametrize("ending", [".vrma", ".vmd", ".livelink.csv", ".npz", ".parquet"])
def test_a_take_goes_out_with_its_note(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = Project.create(tmp_path / "p")
    project.add_take("full", TakeInfo("full"), a_motion(120), a_sound(tmp_path / "in.wav", 2.0))
    out = tmp_path / f"x{ending}"
    assert cli.main(["export", str(project.folder), "full", "-o", str(out), "--fps", "30", "--json"]) == 0
    done = last(capsys)
    assert done["files"] == [str(out)]
    assert done["note"] == formats.writer_for(out).NOTE


@pytest.mark.parametrize("ending", [".vrma", ".vmd"])
def test_a_damaged_file_leaves_nothing_behind(
    ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"bad{ending}"
    path.write_bytes(b"glTF" + bytes(200))
    assert cli.main(["import", str(tmp_path / "p"), str(path), "--json"]) != 0
    assert last(capsys)["event"] == "error"
    assert not list((tmp_path / "p").glob("takes/*"))
