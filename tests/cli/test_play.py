from __future__ import annotations

import json
import socket
from pathlib import Path

import numpy as np
import pytest

from studio.cli import main
from studio.motion import Motion
from studio.take.motion_file import write_motion


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    times = np.arange(30) / 60
    path = tmp_path / "動き.arrow"
    write_motion(path, Motion.build(times, ("A",), np.linspace(0, 1, 30)[:, None], ("Hips", "Head")))
    return path


def test_a_motion_is_sent_to_two_targets_and_counted(
    motion: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    listeners = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    words = ["play", str(motion), "--json"]
    for listener in listeners:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(30.0)
        words += ["--to", f"127.0.0.1:{listener.getsockname()[1]}"]
    assert main(words) == 0
    for listener in listeners:
        assert b"/VMC/Ext/Bone/Pos" in listener.recv(65536)
        listener.close()
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert done["event"] == "done"
    assert done["sent"] > 0
    assert done["seconds"] == pytest.approx(29 / 60, abs=0.02)


@pytest.mark.parametrize("target", ["here", "127.0.0.1:", "127.0.0.1:99999", ":39539"])
def test_a_target_that_is_none_is_named(
    motion: Path, target: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["play", str(motion), "--to", target]) == 2
    expected = f"{target} is not an address. Write HOST:PORT, such as 127.0.0.1:39539.\n"
    assert capsys.readouterr().err == expected


def test_a_missing_motion_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "none.arrow"
    assert main(["play", str(path)]) == 2
    assert capsys.readouterr().err == f"There is no motion at {path}. Check how the path is written.\n"


def test_a_file_of_another_kind_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("hello")
    assert main(["play", str(path)]) == 2
    assert capsys.readouterr().err == (
        "notes.txt is no motion the studio can read. "
        "Choose a take's folder, or a file that ends in one of: .arrow, .bvh, .csv, .vmd, .vrma.\n"
    )


def test_an_impossible_rate_is_named(motion: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["play", str(motion), "--fps", "0"]) == 2
    assert capsys.readouterr().err == "0 frames per second is not possible. Choose 1 to 240.\n"


def test_nobody_listening_is_said_once(motion: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    assert main(["play", str(motion), "--to", f"127.0.0.1:{port}", "--json"]) == 0
    notices = [e for e in map(json.loads, capsys.readouterr().out.splitlines()) if e["event"] == "notice"]
    assert [n["what"] for n in notices] == [f"Nothing is receiving on 127.0.0.1 port {port}."]
