"""Many files one after another: what fails or is no longer wanted stops nothing else."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studio.cli._output import Output
from studio.cli._queue import Entry, Queue, Wishes
from studio.errors import StudioError

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
    queue = Queue(entries, Output(as_json=True), Wishes())
    queue.run()
    assert ending(queue) == (["c"], ["a", "b"], [])
    told = {event["name"]: event for event in events(capsys) if event.get("state") == "failed"}
    assert (told["a"]["what"], told["a"]["remedy"]) == ("The disk is full.", "Free some space.")
    assert told["b"]["what"] == "Something unexpected happened: ValueError: odd."


def test_one_is_taken_out_before_its_turn_and_one_in_the_midst_of_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    wishes, seen = Wishes(), list[str]()

    def unwanted(report: Report) -> None:
        wishes.take("skip 2")
        wishes.take("skip 0\n")
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
    wishes, seen = Wishes(), list[str]()
    first = made("a", seen, lambda report: wishes.take("stop"))
    queue = Queue([first, made("b", seen), made("c", seen)], Output(as_json=True), wishes)
    queue.run()
    assert ending(queue) == (["a"], [], ["b", "c"])
