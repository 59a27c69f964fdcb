"""What tests of commands share: another window that has a project open."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest


@pytest.fixture
def open_elsewhere() -> Callable[[Path], AbstractContextManager[int]]:
    """Has a project open in another process while it is entered; gives that process's number."""

    @contextlib.contextmanager
    def hold(folder: Path) -> Iterator[int]:
        opened = f"from studio.project import Project; p = Project.open({str(folder)!r})"
        code = f"{opened}; print(flush=True); input()"
        command = [sys.executable, "-c", code]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as window:
            assert window.stdout is not None
            window.stdout.readline()
            yield window.pid
            window.communicate("\n")

    return hold
