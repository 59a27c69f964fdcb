"""Many files one after another: what fails or is no longer wanted stops nothing else."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from pathlib import Path

import pytest

from studio import formats
from studio.errors import StudioError
from studio.export.clip import ExportClip, ExportSource
from studio.export.options import RenderOptions
from studio.export.queue import Entry, Queue, entries_of, progress_shares
from studio.export.range import ExportRange
from studio.ipc.events import ChildEvent, EntryEvent, QueueProgressEvent
from tests.formats.examples import a_motion

Report = Callable[[float], None]


def made(name: str, seen: list[str], then: Callable[[Report], None] = lambda report: None) -> Entry:
    def make(report: Report) -> list[Path]:
        seen.append(name)
        then(report)
        return [Path(name)]

    return Entry(name, 1.0, make)


def silent(event: ChildEvent) -> None:
    pass


def ending(queue: Queue) -> tuple[list[str], list[str], list[str]]:
    return [str(file) for file in queue.files], [one.name for one in queue.failed], queue.cancelled


def test_failures_are_kept_with_their_sentence_and_the_rest_goes_on() -> None:
    def fail(report: Report) -> None:
        raise StudioError("The disk is full.", "Free some space.")

    def stumble(report: Report) -> None:
        raise ValueError("odd")

    seen: list[str] = []
    entries = [made("a", seen, fail), made("b", seen, stumble), made("c", seen)]
    events: list[ChildEvent] = []
    queue = Queue(entries, events.append)
    queue.run()
    assert ending(queue) == (["c"], ["a", "b"], [])
    failed = {one.name: one for one in events if isinstance(one, EntryEvent) and one.state == "failed"}
    assert (failed["a"].what, failed["a"].remedy) == ("The disk is full.", "Free some space.")
    assert failed["b"].what == "Something unexpected happened: ValueError: odd."


def test_one_is_left_out_before_its_turn_and_one_in_the_midst_of_it() -> None:
    cancelled, seen, events = set[int](), list[str](), list[ChildEvent]()

    def unwanted(report: Report) -> None:
        cancelled.update((2, 0))
        report(0.5)
        raise AssertionError("it goes on although nobody wants it")

    entries = [made("a", seen, unwanted), made("b", seen), made("c", seen)]
    queue = Queue(entries, events.append, cancelled.__contains__)
    queue.run()
    assert ending(queue) == (["b"], [], ["a", "c"])
    assert seen == ["a", "b"]
    assert events[-1] == QueueProgressEvent(1.0, 0.0, 2, 1.0)


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
    Queue(entries, silent, {1, 3, 5}.__contains__).run()
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
    Queue(entries, silent).run()
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
