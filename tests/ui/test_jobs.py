"""Jobs: real children running the real command line."""

import sys

import pytest

from studio.ui.jobs import Job

SCRIPT = """
import json, sys, time
print("a library chats")
print(json.dumps({"event": "progress", "fraction": 0.5}), flush=True)
sys.stderr.write("a detail\\n")
mode = sys.argv[1]
if mode == "wait":
    line = sys.stdin.readline()
    print(json.dumps({"event": "done", "said": line.strip()}), flush=True)
elif mode == "sleep":
    time.sleep(60)
elif mode == "die":
    sys.stderr.write("out of memory\\n")
    sys.exit(3)
"""


class ScriptJob(Job):
    """A job whose child is the script above instead of the studio."""

    def run_script(self, mode: str) -> None:
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
    with qtbot.waitSignal(job.event_received, timeout=20_000) as event:
        job.run_script("wait")
    assert event.args[0] == {"event": "progress", "fraction": 0.5}
    with qtbot.waitSignal(job.done, timeout=20_000) as done:
        job.stop()
    assert done.args[0]["said"] == "stop"
    assert "a library chats" in job.log
    assert "a detail" in job.log


def test_cancel_is_not_failure(job, qtbot) -> None:
    failures = []
    job.failed.connect(lambda what, remedy: failures.append(what))
    with qtbot.waitSignal(job.event_received, timeout=20_000):
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


def test_closing_the_window_ends_the_child(job, qtbot) -> None:
    with qtbot.waitSignal(job.event_received, timeout=20_000):
        job.run_script("sleep")
    job.close()
    assert not job.running
