"""A journal that is good up to its last whole block."""

from pathlib import Path

import numpy as np
import pytest

from studio.capture import journal
from studio.capture.journal import Journal
from studio.capture.rows import Names, Row


def write(folder: Path) -> None:
    """Two flushes: three rows, then two rows with a further shape."""
    book = Journal(folder, {"slate": "桜", "number": 3})
    one, two = Names(("A",), ("Hips",)), Names(("A", "I"), ("Hips",))
    for i in range(3):
        book.add_row(Row(float(i), i / 60, one, np.full(one.width, i, dtype=np.float32)))
    book.add_clock(0.0, 10.0)
    book.flush({"packets": 3})
    for i in range(3, 5):
        book.add_row(Row(float(i), i / 60, two, np.full(two.width, i, dtype=np.float32)))
    book.add_clock(0.5, 10.5)
    book.flush({"packets": 5})
    book.sync()
    book.close()


def rows(told: journal.Told) -> list[float]:
    return [float(t) for _, arrivals, _ in told.runs for t in arrivals]


def test_all_that_was_flushed_is_told(tmp_path: Path) -> None:
    write(tmp_path)
    told = journal.read(tmp_path)
    assert told.head == {"slate": "桜", "number": 3}
    assert told.facts == {"packets": 5}
    assert rows(told) == [0, 1, 2, 3, 4]
    assert [run[0].shapes for run in told.runs] == [("A",), ("A", "I")]
    assert told.runs[1][2][1].tolist() == [4.0] * told.runs[1][0].width
    assert told.clock.tolist() == [[0.0, 10.0], [0.5, 10.5]]
    assert not told.torn


def test_cut_off_anywhere_it_never_raises_and_keeps_what_is_whole(tmp_path: Path) -> None:
    write(tmp_path)
    data = (tmp_path / journal.FILE).read_bytes()
    kept = []
    for length in range(0, len(data), 3):
        (tmp_path / journal.FILE).write_bytes(data[:length])
        kept.append(len(rows(journal.read(tmp_path))))
    assert kept == sorted(kept)
    assert {0, 3, 5} >= set(kept) >= {0, 3}


def test_a_flipped_bit_ends_it_there(tmp_path: Path) -> None:
    write(tmp_path)
    data = bytearray((tmp_path / journal.FILE).read_bytes())
    data[-200] ^= 1
    (tmp_path / journal.FILE).write_bytes(data)
    told = journal.read(tmp_path)
    assert told.torn
    assert len(rows(told)) < 5


@pytest.mark.parametrize("content", [b"", b"SAIA", b"something else entirely"])
def test_what_is_no_journal_tells_nothing(tmp_path: Path, content: bytes) -> None:
    (tmp_path / journal.FILE).write_bytes(content)
    told = journal.read(tmp_path)
    assert told.torn
    assert told.runs == []


def test_a_journal_is_abandoned_only_when_its_writer_is_gone(tmp_path: Path) -> None:
    assert not journal.abandoned(tmp_path)
    book = Journal(tmp_path, {})
    assert not journal.abandoned(tmp_path)
    book.close()
    assert journal.abandoned(tmp_path)
