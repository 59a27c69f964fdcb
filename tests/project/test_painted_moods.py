"""What was painted is there again, wherever the project lies by then."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from studio.errors import StudioError
from studio.motion.moods import MoodSpan
from studio.project import Project
from studio.project.painted_moods import FILE, PaintedMoods, read_moods, write_moods


def test_what_was_painted_comes_back_also_where_the_project_moved(tmp_path: Path) -> None:
    here, there = tmp_path / "ここ", tmp_path / "there"
    Project.create(here).close()
    assert read_moods(here) == PaintedMoods()
    spans = (MoodSpan("happy", 1.0, 2.5), MoodSpan("calm*2", 3.0))
    write_moods(
        here,
        PaintedMoods({"take:A_001": spans, f"sound:{here / 'sounds' / '声.wav'}": spans[:1]}, {"happy": 0.5}),
    )
    shutil.copytree(here, there)
    found = read_moods(there)
    assert found.spans == {"take:A_001": spans, f"sound:{there / 'sounds' / '声.wav'}": spans[:1]}
    assert found.of("take:A_001")[0] == MoodSpan("happy", 1.0, 2.5, 0.5)


@pytest.mark.parametrize(
    "text",
    [
        '{"painted": {"take:A": ["a:5-2", 3, "calm"]}, "strengths": {"calm": NaN, "happy": true, "sad": 9}}',
        '{"painted": {"take:A": ["calm"], "take:B": 7}, "strengths": []}',
    ],
)
def test_what_makes_no_sense_is_passed_over(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE).write_text(text, encoding="utf-8")
    assert read_moods(tmp_path) == PaintedMoods({"take:A": (MoodSpan("calm"),)})


def test_a_newer_file_is_said_and_a_project_that_went_is_not_made_again(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('{"version": 2}', encoding="utf-8")
    with pytest.raises(StudioError, match="was written by a newer Saia Studio"):
        read_moods(tmp_path)
    (tmp_path / FILE).unlink()
    write_moods(tmp_path / "gone", PaintedMoods({"take:A": (MoodSpan("calm"),)}))
    assert not (tmp_path / "gone").exists()


def test_a_damaged_file_is_set_aside_once_something_is_painted(tmp_path: Path) -> None:
    Project.create(tmp_path / "P").close()
    file = tmp_path / "P" / FILE
    file.write_bytes(b"{half")
    with pytest.raises(StudioError, match="is damaged"):
        read_moods(file.parent)
    painted = PaintedMoods({"take:A": (MoodSpan("calm"),)})
    write_moods(file.parent, painted)
    assert read_moods(file.parent) == painted
    assert file.with_name(f"{FILE}.damaged-1").read_bytes() == b"{half"
    file.write_text('{"version": 2}', encoding="utf-8")
    with pytest.raises(StudioError, match="newer"):
        write_moods(file.parent, painted)
