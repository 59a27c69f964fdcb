"""saia performer as people and programs call it."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from studio.cli import main
from studio.vmc.assemble import FrameAssembler
from studio.vmc.udp import bind


def events(text: str) -> list[dict[str, object]]:
    return [json.loads(line) for line in text.splitlines()]


@pytest.mark.slow
def test_performs_over_udp_and_says_what_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    with bind(0) as channel:
        port = channel.getsockname()[1]
        words = [
            "performer",
            "--to",
            f"127.0.0.1:{port}",
            "--seconds",
            "1.5",
            "--fps",
            "30",
            "--device",
            "none",
        ]
        assert main([*words, "--voice", "bundled", "--json"]) == 0
        channel.setblocking(False)
        assembler, frames = FrameAssembler(), 0
        while True:
            try:
                frames += len(assembler.feed(0.0, channel.recv(65536)))
            except BlockingIOError:
                break
    told = events(capsys.readouterr().out)
    assert [event["event"] for event in told] == ["started", "line", "done"]
    assert told[1]["text"]
    due = int(str(told[-1]["frames"])) + int(str(told[-1]["frames_dropped"]))  # a busy machine drops some
    assert due == pytest.approx(45, abs=5)
    assert frames >= int(str(told[-1]["frames"])) - 1


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--to", "127.0.0.1"], "127.0.0.1 is not an address. Write HOST:PORT, such as 127.0.0.1:39539."),
        (["--to", "a:99999"], "a:99999 is not an address. Write HOST:PORT, such as 127.0.0.1:39539."),
        (["--to", "a:1", "--loss", "7"], "A loss of 7 is not a share. Choose a number from 0 to 1."),
        (["--to", "a:1", "--seed", "-4"], "-4 is not a seed. Choose 0 or a number above it."),
    ],
)
def test_wrong_words_are_told(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["performer", *words]) == 2
    assert capsys.readouterr().err.strip() == sentence


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for children")
def test_interrupt_ends_an_endless_performance_well() -> None:
    import signal

    words = ["performer", "--to", "127.0.0.1:39998", "--device", "none", "--voice", "bundled", "--json"]
    child = subprocess.Popen([sys.executable, "-m", "studio", *words], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    seen = [json.loads(child.stdout.readline())["event"] for _ in range(2)]
    child.send_signal(signal.SIGINT)
    rest, _ = child.communicate(timeout=120)
    assert seen == ["started", "line"]
    assert json.loads(rest.splitlines()[-1])["event"] == "done"
    assert child.returncode == 0


@pytest.mark.slow
def test_stop_on_stdin_ends_it_well() -> None:
    words = ["performer", "--to", "127.0.0.1:39998", "--device", "none", "--voice", "bundled", "--json"]
    child = subprocess.Popen(
        [sys.executable, "-m", "studio", *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    assert json.loads(child.stdout.readline())["event"] == "started"
    out, _ = child.communicate("stop\n", timeout=120)
    assert json.loads(out.splitlines()[-1])["event"] == "done"
    assert child.returncode == 0
