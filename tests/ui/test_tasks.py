"""Background work: results come back on the GUI thread, or not at all."""

import sys
import threading
from pathlib import Path

import pytest
from PySide6.QtCore import QObject

from studio.errors import StudioError
from studio.files import lock
from studio.ipc.events import ProgressEvent, TrainDone
from studio.ui import tasks
from studio.ui.tasks import ChildTask


def test_the_result_comes_back_on_the_gui_thread(qtbot) -> None:
    seen = []

    def done(value: int) -> None:
        seen.append((value, threading.current_thread() is threading.main_thread()))

    tasks.run(lambda: 42, done)
    qtbot.waitUntil(lambda: bool(seen))
    assert seen == [(42, True)]


def test_work_leaves_the_gui_thread(qtbot) -> None:
    seen = []
    tasks.run(lambda: threading.current_thread() is threading.main_thread(), seen.append)
    qtbot.waitUntil(lambda: bool(seen))
    assert seen == [False]


def test_an_error_comes_back_as_it_was_raised(qtbot) -> None:
    seen = []

    def fail() -> None:
        raise StudioError("The disk is full.", "Make room.")

    tasks.run(fail, lambda _r: None, seen.append)
    qtbot.waitUntil(lambda: bool(seen))
    assert str(seen[0]) == "The disk is full. Make room."


def test_nobody_is_told_once_the_owner_is_gone(qtbot) -> None:
    seen, begun, go = [], threading.Event(), threading.Event()
    owner = QObject()

    def work() -> int:
        begun.set()
        go.wait(60)
        return 1

    tasks.run(work, seen.append, owner=owner)
    assert begun.wait(60)
    from shiboken6 import delete

    delete(owner)
    go.set()
    assert tasks.wait(60_000)
    after = []
    tasks.run(lambda: 2, after.append)
    qtbot.waitUntil(lambda: after == [2])
    assert seen == []


def test_forgotten_work_tells_nobody(qtbot) -> None:
    seen, after = [], []
    tasks.run(lambda: 1, seen.append).forget()
    tasks.run(lambda: 2, after.append)
    qtbot.waitUntil(lambda: after == [2])
    assert seen == []


def test_the_latest_request_wins(qtbot) -> None:
    owner, seen, closed = QObject(), [], []
    latest = tasks.LatestTask(owner)

    def fail() -> None:
        raise ValueError("of an older request")

    latest.run(fail, seen.append, seen.append)
    latest.run(lambda: "older", seen.append, unwanted=closed.append)
    latest.run(lambda: "newest", seen.append)
    qtbot.waitUntil(lambda: bool(seen and closed))
    tasks.wait()
    latest.run(lambda: "dropped", seen.append, unwanted=closed.append)
    latest.drop()
    qtbot.waitUntil(lambda: len(closed) == 2)
    assert (seen, closed) == (["newest"], ["older", "dropped"])


SCRIPT = """
import json, sys, time
print("a library chats")
print(json.dumps({"event": "progress", "fraction": 0.5}), flush=True)
sys.stderr.write("a detail\\n")
mode = sys.argv[1]
if mode == "wait":
    line = sys.stdin.readline()
    print(json.dumps({"event": "done", "run": line.strip()}), flush=True)
elif mode == "sleep":
    time.sleep(60)
elif mode == "other":
    print(json.dumps({"event": "done", "stopped": "perhaps"}), flush=True)
elif mode == "die":
    sys.stderr.write("out of memory\\n")
    sys.exit(3)
"""


@pytest.fixture
def task(qtbot):
    """One whose child is the script above instead of the studio; started with ["train", mode]."""
    made = ChildTask(command=lambda arguments: (sys.executable, "-c", SCRIPT, *arguments[1:]))
    yield made
    made.close()


def test_a_command_ends_with_its_facts(qtbot) -> None:
    task = ChildTask()
    with qtbot.waitSignal(task.ended, timeout=30_000), qtbot.waitSignal(task.failed) as failed:
        task.start(["check", "/nowhere at all"])
    error = failed.args[0]
    assert error.what == "There is no project at /nowhere at all."
    assert error.remedy == "Choose a folder with a project.json, or create a project there."
    assert error.code == "request"


def test_stop_is_read_by_the_child_and_ends_well(task, qtbot) -> None:
    with qtbot.waitSignal(task.told, timeout=20_000) as event:
        task.start(["train", "wait"])
    assert event.args[0] == ProgressEvent(0.5)
    with qtbot.waitSignal(task.done, timeout=20_000) as done:
        task.stop()
    assert done.args[0] == TrainDone("stop")
    assert "a library chats" in task.log
    assert "a detail" in task.log


def test_cancel_is_not_failure(task, qtbot) -> None:
    failures = []
    task.failed.connect(failures.append)
    with qtbot.waitSignal(task.told, timeout=20_000):
        task.start(["train", "sleep"])
    with qtbot.waitSignal(task.cancelled, timeout=20_000):
        task.cancel()
    assert not failures
    assert not task.running


def test_a_child_that_no_signal_reaches_is_told_to_end(qtbot) -> None:
    """As on Windows: a console program hears of no request to end, and would go on until it is killed."""
    script = SCRIPT.replace(
        "import json", "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN)\nimport json"
    )
    task = ChildTask(
        command=lambda arguments: (sys.executable, "-c", script, *arguments[1:]), hears_terminate=False
    )
    with qtbot.waitSignal(task.told, timeout=20_000):
        task.start(["train", "wait"])
    with qtbot.waitSignal(task.done, timeout=20_000) as done:
        task.cancel()
    assert done.args == [TrainDone("stop")]


def test_a_crash_shows_the_last_lines(task, qtbot) -> None:
    with qtbot.waitSignal(task.failed, timeout=20_000) as failed:
        task.start(["train", "die"])
    error = failed.args[0]
    assert error.what == "This task ended unexpectedly (code 3)."
    # Which of its two pipes is read first is the system's choice.
    assert sorted(error.remedy.split(" / ")) == ["a detail", "a library chats", "out of memory"]


def test_a_last_line_in_another_form_is_a_stated_failure(task, qtbot) -> None:
    with qtbot.waitSignal(task.failed, timeout=20_000) as failed:
        task.start(["train", "other"])
    assert failed.args[0].what.startswith("saia train told of done in another form: ")


def test_closing_the_window_ends_the_child(task, qtbot) -> None:
    with qtbot.waitSignal(task.told, timeout=20_000):
        task.start(["train", "sleep"])
    task.close()
    assert not task.running
    assert task.pid == 0


def test_a_newer_request_ends_the_one_before_without_a_word(task, qtbot) -> None:
    ends, reported = [], []
    task.ended.connect(lambda: ends.append(1))
    task.done.connect(reported.append)
    task.failed.connect(reported.append)
    with qtbot.waitSignal(task.told, timeout=20_000):
        task.start(["train", "sleep"])
    first = task.pid
    with qtbot.waitSignal(task.told, timeout=20_000):
        task.start(["train", "wait"])
    assert task.pid not in (0, first)
    task.stop()
    qtbot.waitUntil(lambda: bool(ends), timeout=20_000)
    assert (ends, reported) == ([1], [TrainDone("stop")])
    qtbot.waitUntil(lambda: lock.began(first) == 0, timeout=20_000)


def test_its_scratch_folder_goes_with_the_child(qtbot, tmp_path) -> None:
    task, folders, errors = ChildTask(), [], []
    task.failed.connect(errors.append)

    def prepare(folder: Path) -> list[str]:
        folders.append(folder)
        (folder / "a.txt").write_text("a")
        return ["check", str(folder / "none")]

    with qtbot.waitSignal(task.ended, timeout=60_000):
        task.prepare_and_start(prepare)
    assert isinstance(errors[0], StudioError)
    assert not folders[0].exists()
    assert not task.running


def test_cancelled_while_it_is_prepared_no_child_begins_and_nothing_stays(qtbot) -> None:
    task, folders, begun, go = ChildTask(), [], threading.Event(), threading.Event()
    failures, cancels = [], []
    task.failed.connect(failures.append)
    task.cancelled.connect(lambda: cancels.append(1))

    def prepare(folder: Path) -> list[str]:
        folders.append(folder)
        begun.set()
        go.wait(60)
        return ["check", str(folder)]

    task.prepare_and_start(prepare)
    assert begun.wait(60)
    task.cancel()
    assert (cancels, failures, task.running) == ([1], [], False)
    go.set()
    qtbot.waitUntil(lambda: not folders[0].exists(), timeout=60_000)
    assert task.pid == 0


def test_preparing_that_fails_is_the_tasks_failure(qtbot) -> None:
    task, folders, failures = ChildTask(), [], []
    task.failed.connect(failures.append)

    def prepare(folder: Path) -> list[str]:
        folders.append(folder)
        raise StudioError("The disk is full.", "Make room.")

    with qtbot.waitSignal(task.ended, timeout=60_000):
        task.prepare_and_start(prepare)
    assert [str(error) for error in failures] == ["The disk is full. Make room."]
    assert not folders[0].exists()
