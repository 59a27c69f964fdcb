"""A command hears what its window says, and notices when it is gone."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from studio.cli._stdin import CancelRequests


def test_stop_leaves_out_all_that_is_left_and_skip_one() -> None:
    requests = CancelRequests()
    requests.process("skip 1\n")
    assert [requests.is_cancelled(index) for index in range(3)] == [False, True, False]
    requests.process("stop")
    assert all(requests.is_cancelled(index) for index in range(3))


CHILD = """
import sys, time
from pathlib import Path
from studio.cli._stdin import CancelRequests
requests = CancelRequests(watched=True)
Path(sys.argv[1]).touch()
end = time.monotonic() + 60
while time.monotonic() < end and not requests.is_cancelled(0):
    time.sleep(0.02)
print("stopped" if requests.is_cancelled(0) else "goes on", flush=True)
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
    requests = CancelRequests(watched)
    assert requests.reader is not None
    if watched:
        requests.close()  # the parent lives: it waits until there is nothing left to stop
    assert requests.reader.join(60)
    assert [requests.is_cancelled(index) for index in (0, 1)] == [False, True]
