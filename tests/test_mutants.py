"""A few dozen damaged files of every kind that is read: nothing, or one sentence, and never anything else.

`make bench` tries thousands of them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.errors import StudioError
from tests.mutants import mutants
from tests.readers import READERS, tried

COUNT = 24


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_refused_in_one_sentence(name: str, tmp_path: Path) -> None:
    for done, _, error in tried(name, tmp_path, 1, COUNT):
        if error is not None and not isinstance(error, StudioError):
            raise AssertionError(f"{name}: {done}") from error
        assert error is None or done != "nothing", error
        assert error is None or (error.what.endswith((".", "?")) and "\n" not in str(error)), (done, error)


@pytest.mark.parametrize("data", [b"\0\1\2\xff" * 100, b'{"a": 1.5, "b": [true, null]}\n' * 10, b"x"])
def test_the_same_seed_gives_the_same_mutants_and_another_gives_others(data: bytes) -> None:
    first, again, other = (list(mutants(data, seed, 200)) for seed in (1, 1, 2))
    assert first == again != other
    assert len({mutant for _, mutant in first} - {data}) > 20
