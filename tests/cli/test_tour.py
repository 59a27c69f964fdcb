"""The whole job through the real window, in a process of its own as a person starts it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from studio import cli, virtual_devices
from tests.poison import Poison


def test_a_file_is_no_place_for_a_tour(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "tour.txt"
    place.write_text("", encoding="utf-8")
    assert cli.main(["tour", "--out", str(place)]) == 2
    assert capsys.readouterr().err == "tour.txt is a file. Name a folder with --out.\n"


def test_without_any_screen_the_tour_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("PATH", "")
    if virtual_devices.has_screen():
        pytest.skip("this system always has a screen")
    assert cli.main(["tour", "--out", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert error.startswith(
        "There is no screen and no virtual one. Install the package xvfb, or start this in a window."
    )


@pytest.mark.slow
@pytest.mark.skipif(not virtual_devices.sound_available(), reason="needs a sound device that hears itself")
def test_the_whole_job_happens(tmp_path: Path) -> None:
    poison, tmp_path = (
        Poison(tmp_path / "hostile"),
        tmp_path / "out",
    )  # started where code lies that must not run
    command = [sys.executable, "-P", "-m", "studio", "tour", "--out", str(tmp_path), "--json"]
    done = subprocess.run(
        command,
        cwd=poison.folder,
        env=poison.plain(),
        capture_output=True,
        text=True,
        check=False,
        timeout=850,
    )
    assert poison.ran == ""
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0, f"{lines[-1]}\n{done.stderr}"
    last = lines[-1]
    assert last["event"] == "done"
    assert len(last["steps"]) >= 10
    assert all(step["ok"] for step in last["steps"])
    files = [Path(name) for name in last["files"]]
    assert all(file.exists() for file in files)
    pictures = {file.name for file in files if file.suffix == ".png"}
    for room in ("record", "curate", "train", "review"):
        for size in ("1280x800", "1920x1080"):
            assert f"{room}_{size}.png" in pictures
    assert {".bvh", ".csv"} <= {file.suffix for file in files}
    assert any((file / "take.json").is_file() for file in files)
    assert any((file / "best.safetensors").is_file() for file in files)
    assert "Traceback" not in done.stderr
