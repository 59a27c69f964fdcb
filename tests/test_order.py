"""The order of the tests themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import order

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("file", order.LONGEST)
def test_what_begins_first_is_there_and_slow(file: str) -> None:
    assert "mark.slow" in (ROOT / file).read_text(encoding="utf-8")


def test_a_file_that_the_order_comes_to_twice_has_two_parts() -> None:
    ids = ["a.py::x", "a.py::y[1::2]", "b.py::x", "a.py::z"]
    assert dict(order.parts_of_files(ids)) == dict(
        zip(ids, ["a.py 1", "a.py 1", "b.py 1", "a.py 2"], strict=True)
    )
