"""Votes are kept, counted whichever side they stood on, and survive nonsense in the file."""

from __future__ import annotations

from studio.project import Project
from studio.training.styles import RunSelection
from studio.ui.review.vote_presenter import FILE, Tally, Vote, save_vote, saved_votes, tally

QUICK, BEST, CALM = RunSelection("quick_001"), RunSelection("best_001"), RunSelection("best_001", "静か")


def test_votes_are_counted_whichever_side_they_stood_on(toy_project: Project) -> None:
    for vote in (
        Vote(QUICK, BEST, "a", "toy_003", "a"),
        Vote(BEST, QUICK, "b", "toy_003", "b"),
        Vote(QUICK, BEST, "", "toy_003", "b"),
        Vote(QUICK, CALM, "b", "toy_003", "b"),
    ):
        save_vote(toy_project, vote)
    found = saved_votes(toy_project)
    assert [vote.better for vote in found] == ["a", "b", "", "b"]
    assert all(vote.at for vote in found)
    assert tally(found, QUICK, BEST) == Tally(2, 0, 1)
    assert tally(found, BEST, QUICK) == Tally(0, 2, 1)
    assert tally(found, CALM, QUICK) == Tally(1, 0, 0)
    assert toy_project.runs == (), "the file of votes is no run"


def test_lines_that_make_no_sense_are_passed_over(toy_project: Project) -> None:
    save_vote(toy_project, Vote(QUICK, BEST, "a", "toy_003", "a"))
    path = toy_project.runs_folder / FILE
    text = path.read_text(encoding="utf-8")
    odd = text.replace('"better": "a"', '"better": "c"')
    path.write_text("\n".join(["[]", text.strip(), '{"a": 1}', "nonsense", odd]), encoding="utf-8")
    assert len(saved_votes(toy_project)) == 1


def test_a_result_comes_with_the_probability_of_chance() -> None:
    assert Tally(5, 0, 3).chance == 2 / 32
    assert Tally(0, 6, 0).chance == 2 / 64
    assert Tally(3, 3, 9).chance == 1.0
    assert Tally(0, 0, 2).chance == 1.0
