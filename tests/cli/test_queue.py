"""Many files one after another: what fails or is no longer wanted stops nothing else."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studio import formats
from studio.cli._clip import ExportClip
from studio.cli._export_args import ExportRange, RenderOptions
from studio.cli._output import Output
from studio.cli._outputs import ExportSource, entries_of, progress_shares
from studio.cli._queue import CancelRequests, Entry, Queue
from studio.errors import StudioError
from tests.formats.examples import a_motion

Report = Callable[[float], None]


def made(name: str, seen: list[str], then: Callable[[Report], None] = lambda report: None) -> Entry:
    def make(report: Report) -> list[Path]:
        seen.append(name)
        then(report)
        return [Path(name)]

    return Entry(name, 1.0, make)


def events(capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def ending(queue: Queue) -> tuple[list[str], list[str], list[str]]:
    return [str(file) for file in queue.files], [one.name for one in queue.failed], queue.cancelled


def test_failures_are_kept_with_their_sentence_and_the_rest_goes_on(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(report: Report) -> None:
        raise StudioError("The disk is full.", "Free some space.")

    def stumble(report: Report) -> None:
        raise ValueError("odd")

    seen: list[str] = []
    entries = [made("a", seen, fail), made("b", seen, stumble), made("c", seen)]
    queue = Queue(entries, Output(as_json=True), CancelRequests())
    queue.run()
    assert ending(queue) == (["c"], ["a", "b"], [])
    told = {event["name"]: event for event in events(capsys) if event.get("state") == "failed"}
    assert (told["a"]["what"], told["a"]["remedy"]) == ("The disk is full.", "Free some space.")
    assert told["b"]["what"] == "Something unexpected happened: ValueError: odd."


def test_one_is_taken_out_before_its_turn_and_one_in_the_midst_of_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    wishes, seen = CancelRequests(), list[str]()

    def unwanted(report: Report) -> None:
        wishes.process("skip 2")
        wishes.process("skip 0\n")
        report(0.5)
        raise AssertionError("it goes on although nobody wants it")

    queue = Queue([made("a", seen, unwanted), made("b", seen), made("c", seen)], Output(as_json=True), wishes)
    queue.run()
    assert ending(queue) == (["b"], [], ["a", "c"])
    assert seen == ["a", "b"]
    assert events(capsys)[-1] == {
        "event": "progress",
        "fraction": 1.0,
        "eta_s": 0.0,
        "index": 2,
        "entry": 1.0,
    }


def test_stop_takes_out_all_that_is_left() -> None:
    wishes, seen = CancelRequests(), list[str]()
    first = made("a", seen, lambda report: wishes.process("stop"))
    queue = Queue([first, made("b", seen), made("c", seen)], Output(as_json=True), wishes)
    queue.run()
    assert ending(queue) == (["a"], [], ["b", "c"])


def test_a_skipped_format_keeps_no_motion_of_a_source_that_is_over(tmp_path: Path) -> None:
    """An hour of motion is large: with one format skipped the clip of every source stayed to the end."""
    made_before: list[weakref.ref[ExportClip]] = []
    alive: list[int] = []

    def source(name: str) -> ExportSource:
        def clip(report: Report) -> ExportClip:
            alive.append(sum(one() is not None for one in made_before))
            found = ExportClip(a_motion(10), None)
            made_before.append(weakref.ref(found))
            return found

        return ExportSource(name, 1.0, clip)

    modules = [formats.load("npz"), formats.load("arrow")]
    sources = [source(name) for name in "abc"]
    entries = entries_of(sources, modules, tmp_path / "out", ExportRange(), RenderOptions(), force=False)
    wishes = CancelRequests()
    for index in (1, 3, 5):
        wishes.process(f"skip {index}")
    Queue(entries, Output(as_json=True), wishes).run()
    assert alive == [0, 0, 0]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.npz", "b.npz", "c.npz"]


def test_every_format_of_a_source_is_made_of_one_reading(tmp_path: Path) -> None:
    read: list[str] = []

    def clip(report: Report) -> ExportClip:
        read.append("once")
        return ExportClip(a_motion(10), None)

    modules = [formats.load("npz"), formats.load("arrow")]
    entries = entries_of(
        [ExportSource("a", 1.0, clip)], modules, tmp_path, ExportRange(), RenderOptions(), force=False
    )
    Queue(entries, Output(as_json=True), CancelRequests()).run()
    assert read == ["once"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.arrow", "a.npz"]


@pytest.mark.parametrize(("name", "reading"), [("mp4", 0.1), ("bvh", 0.95)])
def test_reading_and_writing_share_the_progress(name: str, reading: float) -> None:
    told: list[float] = []
    first, second = progress_shares(formats.load(name), told.append)
    for part in (first, second):
        part(0.0)
        part(1.0)
    assert told == pytest.approx([0.0, reading, reading, 1.0])


CHILD = """
import sys, time
from pathlib import Path
from studio.cli._queue import CancelRequests
wishes = CancelRequests(watched=True)
Path(sys.argv[1]).touch()
end = time.monotonic() + 60
while time.monotonic() < end and not wishes.is_cancelled(0):
    time.sleep(0.02)
print("stopped" if wishes.is_cancelled(0) else "goes on", flush=True)
"""


@pytest.mark.skipif(os.name == "nt", reason="on Windows the end of the pipe alone says so")
def test_a_queue_stops_when_the_window_that_began_it_is_gone(tmp_path: Path) -> None:
    up = tmp_path / "up"
    window = (
        "import os, subprocess, sys, time\n"
        f"subprocess.Popen([sys.executable, '-c', {CHILD!r}, {str(up)!r}], stdin=subprocess.PIPE)\n"
        f"while not os.path.exists({str(up)!r}): time.sleep(0.02)\n"
        "os._exit(1)\n"
    )
    died = subprocess.run([sys.executable, "-c", window], stdout=subprocess.PIPE, text=True, check=False)
    assert died.stdout.strip() == "stopped"


@pytest.mark.skipif(os.name == "nt", reason="on Windows the end of the pipe alone says so")
@pytest.mark.parametrize("watched", [False, True], ids=["nohup", "script"])
def test_an_end_of_input_alone_takes_nothing_out(monkeypatch: pytest.MonkeyPatch, watched: bool) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("skip 1\n"))
    wishes = CancelRequests(watched)
    assert wishes._reader is not None
    if watched:
        wishes.close()  # the parent lives: it waits until there is nothing left to stop
    wishes._reader.join(60)
    assert not wishes._reader.is_alive()
    assert [wishes.is_cancelled(index) for index in (0, 1)] == [False, True]
