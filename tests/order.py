"""In what order several workers run the tests, and what goes to one of them in one piece."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any

import pytest

LONGEST = (
    "tests/cli/test_tour.py", "tests/test_torture.py", "tests/cli/test_train.py",
    "tests/performer/test_broadcast.py", "tests/cli/test_live.py", "tests/capture/test_recorder.py",
    "tests/ui/train/test_train_tab.py", "tests/ui/test_small_screens.py", "tests/capture/test_input_tests.py",
)  # fmt: skip
"""Files whose slow tests take longest, which begin first: a worker that came to one last would let the others
wait for it."""


def turn(item: pytest.Item) -> int:
    """When a test is run: the fast ones first, then the slow ones, those of LONGEST ahead."""
    if not item.get_closest_marker("slow"):
        return 0
    file = _file_of(item.nodeid)
    return 1 + (LONGEST.index(file) if file in LONGEST else len(LONGEST))


def parts_of_files(nodeids: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Each test with the name of its part: its file, and which time the order comes to it."""
    times: Counter[str] = Counter()
    for file, tests in groupby(nodeids, _file_of):
        times[file] += 1
        for nodeid in tests:
            yield nodeid, f"{file} {times[file]}"


def scheduler(config: pytest.Config, log: Any) -> Any:
    """Deals out parts of files: a file's fast tests go to one worker, its slow ones to one."""
    from xdist.scheduler import LoadFileScheduling

    class PartsOfFiles(LoadFileScheduling):
        parts: dict[str, str] | None = None

        def _split_scope(self, nodeid: str) -> str:
            if self.parts is None:
                self.parts = dict(parts_of_files(self.collection or ()))
            return self.parts[nodeid]

    return PartsOfFiles(config, log)


def _file_of(nodeid: str) -> str:
    return nodeid.split("::", 1)[0]
