"""`saia evaluate` and `saia compare`: figures beside baselines, on takes that were not learnt from."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studio import cli
from studio.project import Project
from studio.training.loop.train import train
from studio.training.recipe import load_recipe
from tests import toys

MakeProject = Callable[..., Project]
PROMISED = {
    "rmse", "nrmse", "mae", "pearson", "pearson_mouth", "motion_ratio", "std_ratio", "jerk_ratio",
    "closure_recall", "mouth_lag_ms", "blinks_per_minute", "geodesic_deg", "wrist_cm", "head_cm",
    "beat_alignment", "diversity_face", "diversity_body_cm", "frechet",
}  # fmt: skip


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project of two runs, to be copied."""
    made = toys.make(tmp_path_factory.mktemp("trained") / "Toy", ("train", "train", "val", "test"))
    for seed in (1, 2):
        recipe = load_recipe("balanced").with_overrides(
            [
                "units=16",
                "steps=4",
                "crops=4",
                "crop_frames=60",
                "epochs=1",
                "network.body=plain",
                f"seed={seed}",
            ]
        )
        train(made, recipe, on_event=lambda event: None)
    return made.folder


@pytest.fixture
def project(trained: Path, tmp_path: Path) -> Project:
    return toys.copied(trained, tmp_path)


def outcome(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, list[dict[str, Any]]]:
    code = cli.main([*words, "--json"])
    return code, [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_json_keeps_its_promise(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    code, events = outcome(capsys, "evaluate", str(project.folder), "balanced_001")
    assert code == 0
    done = events[-1]
    assert (done["run"], done["split"], done["takes"]) == ("balanced_001", "test", ["Toy_004"])
    assert (done["seed"], done["frames"]) == (1, 180)
    assert done["captured"]["rmse"] == 0
    assert done["metrics"].keys() >= PROMISED
    assert done["per_take"]["Toy_004"] == pytest.approx(done["metrics"])
    assert done["baselines"].keys() == {"zero", "train_mean", "ridge"}
    assert all(figures.keys() >= PROMISED for figures in done["baselines"].values())
    assert done["baselines"]["zero"]["motion_ratio"] == 0
    assert done["baselines"]["ridge"]["pearson"] > 0.3
    assert done["metrics"]["geodesic_deg"] > 0
    assert set(done["per_bone"]) == {"Head", "Hips", "LeftLowerArm", "Spine"}
    kept = json.loads((project.run("balanced_001").folder / "evaluation.json").read_text())
    assert kept["metrics"] == done["metrics"]


def test_the_mean_pose_is_the_training_mean(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    """Test takes never touch the scaling: the baseline's mean differs from the test take's own."""
    _, events = outcome(capsys, "evaluate", str(project.folder), "balanced_001", "--takes", "Toy_001")
    on_train = events[-1]
    assert on_train["split"] == "train"
    assert any("learnt from" in event.get("text", "") for event in events)
    assert 0 < on_train["baselines"]["train_mean"]["rmse"] < on_train["baselines"]["zero"]["rmse"]


@pytest.mark.parametrize("command", ["evaluate", "compare"])
def test_a_take_marked_as_test_only_after_it_was_learnt_from_is_named(
    project: Project, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    from studio.dataset import edits

    cut = edits.split_at(project.dataset, "Toy_002", [2.0], 6.0)
    project.edit("Split", edits.set_split(cut, ["Toy_002.2"], "test"))
    _, events = outcome(capsys, command, str(project.folder), "balanced_001", "--no-baselines")
    assert events[-1]["takes"] == ["Toy_002.2", "Toy_004"]
    assert events[0]["text"] == (
        "balanced_001 learnt from all or part of Toy_002; such figures say nothing about new sound."
    )


@pytest.mark.parametrize("command", ["evaluate", "compare"])
def test_the_simple_guesses_tell_what_they_are_at(
    project: Project, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    _, events = outcome(capsys, command, str(project.folder), "balanced_001")
    told = [event for event in events if event["event"] == "baselines"][1:]
    assert [(e["name"], e["take"]) for e in told] == [
        ("", "Toy_001"), ("", "Toy_002"), ("zero", "Toy_004"), ("train_mean", "Toy_004"), ("ridge", "Toy_004")
    ]  # fmt: skip
    assert [(e["done"], e["of"]) for e in told] == [(step, 5) for step in range(5)]


def test_people_read_a_table(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["evaluate", str(project.folder), "balanced_001"]) == 0
    doing, *lines = capsys.readouterr().out.splitlines()
    assert doing == "Measuring how well it does at each look-ahead ..."
    assert lines[0] == "balanced_001 (seed 1) on Toy_004 (test), 180 frames"
    assert lines[1].split()[:4] == ["RMSE", "r", "r", "mouth"]
    names = [line.split()[0] for line in lines[2:7]]
    assert names == ["balanced_001", "zero", "train_mean", "ridge", "captured"]


def test_all_figures_come_one_a_line(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["evaluate", str(project.folder), "balanced_001", "--all"]) == 0
    _, *lines = capsys.readouterr().out.splitlines()
    assert lines[1].split() == ["balanced_001", "zero", "train_mean", "ridge", "captured"]
    assert lines[2].startswith("RMSE of face and body (lower is nearer)")
    assert any(line.startswith("blinks per minute") for line in lines)
    assert len(lines) > 20


def test_measuring_twice_gives_the_same(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    (_, first), (_, second) = (outcome(capsys, "evaluate", str(project.folder), "balanced_001") for _ in "12")
    assert first == second


def test_an_empty_test_split_falls_back_to_validation_and_says_so(
    project: Project, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.dataset import edits

    project.edit("Split", edits.set_split(project.dataset, ["Toy_004"], ""))
    _, events = outcome(capsys, "evaluate", str(project.folder), "balanced_001", "--no-baselines")
    assert events[0]["text"] == (
        "No take is marked as test; measured on the validation takes, which also chose the best epoch."
    )
    assert events[-1]["split"] == "val"
    assert events[-1]["baselines"] == {}


def test_a_face_only_take_has_no_geodesic_error(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(bones=False)
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=1"])
    run = train(project, recipe, on_event=lambda event: None)
    _, events = outcome(capsys, "evaluate", str(project.folder), run.id, "--split", "val")
    assert events[-1]["metrics"]["geodesic_deg"] is None
    assert events[-1]["metrics"]["pearson_mouth"] is not None


def test_runs_are_compared_on_the_same_takes(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    code, events = outcome(capsys, "compare", str(project.folder), "balanced_001", "balanced_002")
    assert code == 0
    assert events[-1]["runs"].keys() == {"balanced_001", "balanced_002"}
    assert events[-1]["takes"] == ["Toy_004"]
    assert (events[-1]["frames"], events[-1]["seeds"]) == (180, {"balanced_001": 1, "balanced_002": 2})
    assert events[-1]["baselines"].keys() == {"zero", "train_mean", "ridge"}
    assert events[-1]["runs"]["balanced_001"] != events[-1]["runs"]["balanced_002"]
    told = [(e["run"], e["take"], e["done"], e["of"]) for e in events if e["event"] == "progress"]
    assert told == [("balanced_001", "Toy_004", 0, 1), ("balanced_002", "Toy_004", 0, 1)]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["balanced_009"], "There is no run balanced_009 in Toy."),
        (["balanced_001", "--takes", "Nobody"], "There is no take Nobody in Toy."),
    ],
)
def test_a_wrong_request_is_a_sentence(
    project: Project, capsys: pytest.CaptureFixture[str], words: list[str], sentence: str
) -> None:
    assert cli.main(["evaluate", str(project.folder), *words]) == 2
    assert capsys.readouterr().err.startswith(sentence)


def test_a_run_without_weights_is_a_sentence(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    empty = project.new_run_folder("balanced")
    assert cli.main(["evaluate", str(project.folder), empty.name]) == 1
    assert capsys.readouterr().err.startswith(f"The run {empty.name} has no best.safetensors yet.")


@pytest.mark.slow
def test_figures_say_whether_poses_were_drawn_and_a_seed_gives_the_same_again(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_toy_project(("train", "val", "test"))
    recipe = load_recipe("balanced").with_overrides(
        ["network.body=flow", "units=8", "steps=2", "epochs=1", "members=1"]
    )
    run = train(made, recipe, on_event=lambda event: None).id
    words = ("evaluate", str(made.folder), run, "--no-baselines")
    first, again, other, still = (
        outcome(capsys, *words, *more)[1][-1]
        for more in (("--seed=1",), ("--seed=1",), ("--seed=2",), ("--liveliness=0",))
    )
    assert (first["poses"], still["poses"]) == ("drawn", "expected")
    assert first["metrics"] == again["metrics"]
    assert first["metrics"]["geodesic_deg"] != other["metrics"]["geodesic_deg"]
    assert cli.main([*words, "--seed=1"]) == 0
    assert f"{run} (seed 1) on " in (text := capsys.readouterr().out)
    assert ", drawn with seed 1 at liveliness 1\n" in text
