"""The report of what a machine has."""

import json
import socket
from pathlib import Path

import pytest

from studio import cli
from studio.cli import doctor
from studio.ipc.events import SystemCheckEvent
from tests.ports import free_port

NAMES = [
    "system", "sound in", "sound out", "screen", "OpenGL", "motion", "PyTorch", "voice", "speech", "camera",
    "disk",
]  # fmt: skip


@pytest.mark.slow
def test_the_report_keeps_its_promise(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["doctor", "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[-1]["event"] == "done"
    checks = lines[-1]["checks"]
    assert [check["name"] for check in checks] == NAMES
    assert all(set(check) == {"name", "ok", "what", "remedy", "in_window"} for check in checks)
    assert all(bool(check["remedy"]) is not check["ok"] for check in checks), "a remedy where, and only where"
    found = {check["name"]: check for check in checks}
    assert found["PyTorch"]["ok"]
    assert found["OpenGL"]["ok"]


def test_a_taken_port_is_named() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        check = doctor.check_port(other.getsockname()[1])
        assert not check.ok
        taken = other.getsockname()[1]
        assert check.what == f"Port {taken} is used by another program, such as VSeeFace or a second studio."
        assert check.remedy == "Close it, or choose another port in Record (or with --port)."


def test_a_free_port_is_well() -> None:
    port = free_port()
    assert doctor.check_port(port) == SystemCheckEvent("motion", True, f"Port {port} is free for motion.")


@pytest.mark.parametrize("port", [0, -1, 65536])
def test_a_port_that_does_not_exist(port: int) -> None:
    check = doctor.check_port(port)
    assert (check.ok, check.what) == (False, f"Port {port} does not exist.")


def test_the_virtual_device_is_found(virtual_audio: str) -> None:
    for check in (doctor.check_sound_in(), doctor.check_sound_out()):
        assert check.ok, check
        assert virtual_audio in check.what


def test_a_crashing_probe_is_a_finding_not_a_crash() -> None:
    check = doctor.check_opengl("import os; os.abort()")
    assert not check.ok
    assert check.what.startswith("Drawing in 3D failed: ")
    assert check.remedy == "Update the graphics driver, or install libgl1, libegl1 and libgl1-mesa-dri."


def test_a_missing_library_is_a_finding() -> None:
    check = doctor.check_torch("import no_such_library")
    assert check.what == ("PyTorch does not work: ModuleNotFoundError: No module named 'no_such_library'.")
    assert check.remedy == "Run the set-up again (make setup)."


def test_a_probe_that_hangs_is_ended() -> None:
    check = doctor.check_torch("import time; time.sleep(60)", timeout_s=0.2)
    assert check.what == "PyTorch does not work: it did not answer within 0 s."


def test_a_full_disk_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    check = doctor.check_disk(least_bytes=10**18)
    assert check.what.startswith("Only ")
    assert check.remedy == "Free some space before recording."


def test_a_machine_without_a_screen_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("PATH", "")
    check = doctor.check_screen()
    assert (check.what, check.remedy) == ("There is no screen.", "Start the studio in a desktop session.")


def test_people_read_a_line_a_check() -> None:
    lines = [doctor.line(SystemCheckEvent("disk", False, "Only 1 GB are free here.", "Free some space."))]
    lines.append(doctor.line(SystemCheckEvent("motion", True, "Port 39539 is free for motion.")))
    assert lines == [
        "!!  disk       Only 1 GB are free here. Free some space.",
        "ok  motion     Port 39539 is free for motion.",
    ]
