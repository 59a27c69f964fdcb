"""`saia live` as a person or the window runs it: it hears, sends, listens to wishes and ends well."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from studio.cli import main
from studio.errors import RequestError
from studio.ipc.commands import Command, read_live
from studio.project import Project
from studio.take.check import check_take
from tests.inference.live.runs import add_run
from tests.inference.live.test_steps import speech
from tests.patience import until

RATE = 16_000


@pytest.fixture
def project(make_toy_project: Callable[..., Project]) -> Iterator[Project]:
    made = make_toy_project(splits=("train",), seconds=2.0)
    add_run(made, "look_aheads=0 100 200 500", train=["Toy_001"])
    yield made
    made.close()


@pytest.fixture
def voice(tmp_path: Path) -> Path:
    path = tmp_path / "声 voice.wav"
    soundfile.write(path, speech(2.0), RATE)
    return path


@pytest.fixture
def speaker(tmp_path: Path) -> Path:
    """Speaks for longer than any test takes: a file that is over ends the command, too."""
    path = tmp_path / "話 speaker.wav"
    soundfile.write(path, np.tile(speech(2.0), 150), RATE)
    return path


class Child:
    """The command in a process of its own, its events as they come."""

    def __init__(self, *words: str) -> None:
        command = [sys.executable, "-m", "studio", "live", *words, "--json"]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
        )
        self.events: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        self.events.extend(json.loads(line) for line in self.process.stdout)

    def has(self, kind: str, **facts: object) -> bool:
        return any(
            e["event"] == kind and all(e.get(k) == v for k, v in facts.items()) for e in list(self.events)
        )

    def tell(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def end(self) -> int:
        assert self.process.stdin is not None
        self.process.stdin.close()
        code = self.process.wait(60)
        self._reader.join(60)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return code


@pytest.mark.slow
def test_a_file_is_performed_for_a_program_that_listens_and_wishes_are_heeded(
    project: Project, speaker: Path
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(60.0)
        child = Child(
            str(project.folder), "balanced_001", "--file", str(speaker), "--output", "none", "--poses",
            "--to", f"127.0.0.1:{listener.getsockname()[1]}",
        )  # fmt: skip
        heard = listener.recv(65_536)
        assert b"/VMC/Ext/" in heard
        until(lambda: child.has("ready") and child.has("pose") and child.has("state"))
        until(lambda: any(e.get("seconds", 0.0) > 2.0 for e in list(child.events)))
        child.tell("keep")
        until(lambda: child.has("kept"))
        for wish in (
            "mute on",
            "freeze",
            "neutral",
            "look-ahead 480",
            "dance",
            "voice-to default",
            'tune {"mouth": 0.5}',
            "tune x",
        ):
            child.tell(wish)
        until(lambda: child.has("state", muted=True, frozen=True, neutral=True, look_ahead_ms=500))
        until(lambda: child.has("notice", what="The tuning was not understood."))
        child.tell("stop")
        assert child.end() == 0
    assert project.refresh() == ("Live_001",)
    take, selection = project.take("Live_001"), project.dataset["Live_001"]
    assert (take.info.source, selection.split) == ("predicted by balanced_001", "")
    assert take.info.duration > 1.0
    assert take.info.audio_seconds == pytest.approx(take.info.duration, abs=0.1)
    # What an untrained mouth does is no fault of the take.
    findings = [one for one in check_take(take).findings if one.kind != "mouth"]
    assert not [one for one in findings if one.severity in ("major", "fatal")]
    ready = next(e for e in child.events if e["event"] == "ready")
    assert ready["look_aheads"] == [0, 100, 200, 500]
    assert ready["look_ahead_ms"] == 100
    assert child.has("look_ahead", look_ahead_ms=500)
    assert child.has("notice", what="There is no dance while it is live.")
    assert child.has("switch", name="mute", on=True)
    assert child.has("notice", what="A file already plays in sync with the avatar.")
    done = child.events[-1]
    assert done["event"] == "done"
    assert done["sent"] > 0


@pytest.mark.slow
def test_it_ends_with_the_file_and_when_its_parent_goes(project: Project, voice: Path, speaker: Path) -> None:
    child = Child(
        str(project.folder), "balanced_001", "--file", str(voice), "--output", "none", "--to", "none"
    )
    until(lambda: child.has("done"), 90)
    assert child.end() == 0
    assert child.events[-1]["frames"] > 0
    longer = Child(
        str(project.folder), "balanced_001", "--file", str(speaker), "--output", "none", "--to", "none",
        "--seconds", "600",
    )  # fmt: skip
    until(lambda: longer.has("ready"))
    longer.tell("look-ahead 200")
    assert longer.end() == 0  # its standard input was closed: nobody is there any more
    assert longer.has("done")
    assert longer.has("look_ahead", look_ahead_ms=200)  # what was wished before is heeded


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--to", "here"], "here is not an address. Write HOST:PORT, such as 127.0.0.1:39539.\n"),
        (["--fps", "500"], "500 frames per second is not possible. Choose 1 to 240.\n"),
        (["--look-ahead", "-5"], "-5 ms is no look-ahead. Choose 0 (fastest) to 2000 (finest).\n"),
        (["--seconds", "0"], "0 s is no length of a performance. Give seconds above 0.\n"),
        (["--style", "nobody"], "balanced_001 knows no style called nobody. It was trained without styles;"
         " leave --style out.\n"),
        (["--liveliness", "9"], "A liveliness of 9 is not possible. Choose 0 (still) to 3; 1 is as"
         " trained.\n"),
    ],
)  # fmt: skip
def test_a_wrong_wish_is_named_before_anything_is_opened(
    project: Project, words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["live", str(project.folder), "balanced_001", *words]) == 2
    assert capsys.readouterr().err == sentence


def test_a_missing_sound_and_a_missing_run_are_named(
    project: Project, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = tmp_path / "gone.wav"
    assert main(["live", str(project.folder), "balanced_001", "--file", str(gone)]) == 2
    assert str(gone) in capsys.readouterr().err
    assert main(["live", str(project.folder), "balanced_999"]) != 0
    assert "balanced_999" in capsys.readouterr().err


def test_wishes_are_read_as_they_are_written() -> None:
    assert read_live("mute on\n") == Command("mute", "on")
    assert read_live("  \n") is None
    assert Command("mute", "").switched_to(False)
    assert not Command("mute", "off").switched_to(True)
    with pytest.raises(RequestError, match="mute cannot be maybe"):
        Command("mute", "maybe").switched_to(False)
    with pytest.raises(RequestError, match="There is no dance while it is live"):
        read_live("dance")
