"""`saia suggest`: what to look at first, from checks and from a trained run."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from studio import cli
from studio.dataset import edits
from studio.project import Project
from studio.training.loop.train import train
from studio.training.recipe import load_recipe

MakeProject = Callable[..., Project]


def outcome(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, list[dict[str, Any]]]:
    code = cli.main([*words, "--json"])
    return code, [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_takes_are_ranked_by_their_checks(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train", "train"), seconds=3.0)
    sound = project.take("Toy_002").audio_path
    assert sound is not None
    sound.unlink()
    code, events = outcome(capsys, "suggest", str(project.folder))
    assert code == 0
    first = next(event for event in events if event["event"] == "suggestion")
    assert (first["selection"], first["kind"], first["span"]) == ("Toy_002", "damaged", None)
    assert events[-1]["count"] >= 1


def test_takes_that_are_not_used_are_not_looked_at(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train",), seconds=3.0)
    project.edit("Leave out", edits.set_split(project.dataset, ["Toy_001"], ""))
    code, events = outcome(capsys, "suggest", str(project.folder))
    assert (code, [event["event"] for event in events]) == (0, ["done"])


@pytest.mark.slow
def test_a_run_says_where_it_is_furthest_off(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train", "train", "val"))
    recipe = load_recipe("balanced").with_overrides(
        ["units=16", "steps=10", "crops=4", "crop_frames=60", "epochs=3"]
    )
    train(project, recipe, on_event=lambda event: None)
    code, events = outcome(capsys, "suggest", str(project.folder), "--run", "balanced_001", "--only-run")
    assert code == 0
    done = events[-1]
    measured = [event["take"] for event in events if event["event"] == "measured"]
    assert measured == ["Toy_001", "Toy_002", "Toy_003"]
    assert done["count"] == sum(len(spans) for spans in done["worst"].values())
    kept = json.loads((project.run("balanced_001").folder / "worst.json").read_text(encoding="utf-8"))
    assert kept["worst"] == done["worst"]
    for spans in done["worst"].values():
        assert all(0 <= span["start"] < span["end"] <= 6 and span["ratio"] > 1 for span in spans)
