"""Background work: results come back on the GUI thread, or not at all."""

import sys
import threading

import pytest
from PySide6.QtCore import QObject

from studio.errors import StudioError
from studio.ipc.events import ProgressEvent, TrainDone
from studio.ui import tasks
from studio.ui.tasks import Job


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


class ScriptJob(Job):
    """A job whose child is the script above instead of the studio."""

    def run_script(self, mode: str) -> None:
        self._verb = "train"
        self._process.start(sys.executable, ["-c", SCRIPT, mode])


@pytest.fixture
def job(qtbot):
    made = ScriptJob()
    yield made
    made.close()


def test_a_command_ends_with_its_facts(qtbot) -> None:
    job = Job()
    with qtbot.waitSignal(job.ended, timeout=30_000), qtbot.waitSignal(job.failed) as failed:
        job.start(["check", "/nowhere at all"])
    assert failed.args[0] == "There is no project at /nowhere at all."
    assert failed.args[1] == "Choose a folder with a project.json, or create a project there."


def test_stop_is_read_by_the_child_and_ends_well(job, qtbot) -> None:
    with qtbot.waitSignal(job.told, timeout=20_000) as event:
        job.run_script("wait")
    assert event.args[0] == ProgressEvent(0.5)
    with qtbot.waitSignal(job.done, timeout=20_000) as done:
        job.stop()
    assert done.args[0] == TrainDone("stop")
    assert "a library chats" in job.log
    assert "a detail" in job.log


def test_cancel_is_not_failure(job, qtbot) -> None:
    failures = []
    job.failed.connect(lambda what, remedy: failures.append(what))
    with qtbot.waitSignal(job.told, timeout=20_000):
        job.run_script("sleep")
    with qtbot.waitSignal(job.cancelled, timeout=20_000):
        job.cancel()
    assert not failures
    assert not job.running


def test_a_crash_shows_the_last_lines(job, qtbot) -> None:
    with qtbot.waitSignal(job.failed, timeout=20_000) as failed:
        job.run_script("die")
    what, remedy = failed.args
    assert what == "The work ended unexpectedly (code 3)."
    # Which of its two pipes is read first is the system's choice.
    assert sorted(remedy.split(" / ")) == ["a detail", "a library chats", "out of memory"]


def test_a_last_line_in_another_form_is_a_stated_failure(job, qtbot) -> None:
    with qtbot.waitSignal(job.failed, timeout=20_000) as failed:
        job.run_script("other")
    assert failed.args[0].startswith("saia train told of done in another form: ")


def test_closing_the_window_ends_the_child(job, qtbot) -> None:
    with qtbot.waitSignal(job.told, timeout=20_000):
        job.run_script("sleep")
    job.close()
    assert not job.running
