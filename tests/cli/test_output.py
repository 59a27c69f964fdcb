"""What a command says when nobody can be told, and when it is stopped before it began."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from studio import launch

FULL = Path("/dev/full")
ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(not FULL.exists(), reason="this system has no device that is full")
@pytest.mark.parametrize("words", [["--help"], ["--version"], ["record", "--help"], ["doctor", "--json"]])
@pytest.mark.parametrize("told", [True, False], ids=["stderr is there", "stderr is full too"])
def test_output_that_cannot_be_written_is_one_sentence(words: list[str], told: bool) -> None:
    with FULL.open("w") as full:
        errors = subprocess.PIPE if told else full
        done = subprocess.run(launch.studio(*words), stdout=full, stderr=errors, cwd=ROOT, check=False)
    assert done.returncode == 1
    if told:
        sentence = "The output could not be written: No space left on device. "
        assert (
            done.stderr.decode() == f"{sentence}Free some space where it goes, or send it somewhere else.\n"
        )


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
@pytest.mark.parametrize("while_loading", ["argparse", "studio.cli._output", "studio.ipc.events"])
def test_a_command_stopped_while_it_loads_says_so_and_no_more(while_loading: str, tmp_path: Path) -> None:
    """Ctrl+C in the first moment, when the command line itself is still being read."""
    (tmp_path / "begin.py").write_text(
        "import os, runpy, signal, sys\n"
        "class Stop:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {while_loading!r}:\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import studio\n"
        f"sys.modules.pop({while_loading!r}, None)\n"
        "sys.meta_path.insert(0, Stop())\n"
        "sys.argv = ['saia', '--version']\n"
        "runpy.run_module('studio', run_name='__main__')\n"
    )
    begin = [sys.executable, str(tmp_path / "begin.py")]
    done = subprocess.run(begin, capture_output=True, env=launch.environment(), cwd=ROOT, check=False)
    assert (done.returncode, done.stdout) == (130, b"")
    assert done.stderr.decode() == "Interrupted. Nothing that was saved is lost.\n"
