"""A run in words: each sentence follows from figures, and changes with them."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from studio.evaluation.learning_curve import FILE, CurvePoint, LearningCurve, load_curve
from studio.evaluation.verdict import RunVerdict, better_of, curve_text, verdict
from studio.project import Project, Run, RunReport

GOOD = {"rmse": 0.045, "pearson_mouth": 0.46, "motion_ratio": 0.7, "closure_recall": 0.5}


def run_of(folder: Path, report: dict[str, Any], evaluation: dict[str, Any] | None = None) -> Run:
    folder = folder / "quick_001"
    folder.mkdir(exist_ok=True)
    RunReport(**report).save(folder)
    (folder / "best.safetensors").touch()
    if evaluation is not None:
        (folder / "evaluation.json").write_text(json.dumps(evaluation), encoding="utf-8")
    return Run.load(folder)


def curve(*found: float) -> LearningCurve:
    points = tuple(CurvePoint(240.0 * 2**i / 2 ** (len(found) - 1), r) for i, r in enumerate(found))
    return LearningCurve(points, ("A", "B"), "test", ("C",))


def test_a_run_is_praised_for_what_it_does_and_told_what_it_was_measured_on(tmp_path: Path) -> None:
    told = verdict(run_of(tmp_path, {"minutes": 4.0, "best_val": GOOD, "val": ("Chat_003",)}))
    assert told.grade == "good"
    assert told.quality == "Follows your mouth well, moves a little less than you."
    assert told.help == "Four more minutes would probably help most."
    assert told.basis == (
        "Measured on Chat_003. The best version was chosen by it too: new speech may go a little worse."
    )


@pytest.mark.parametrize(("measured", "known"), [(7, True), (5, False), (None, False)])
def test_figures_count_for_the_weights_they_were_measured_of_whatever_the_files_times(
    tmp_path: Path, measured: int | None, known: bool
) -> None:
    found = {"metrics": GOOD | {"pearson_mouth": 0.7}, "split": "test", "takes": ["Chat_004"]}
    run = run_of(tmp_path, {"best_val": GOOD, "best_epoch": 7}, found | {"best_epoch": measured})
    # As after unpacking a project, or after the run was shown a style.
    os.utime(run.folder / "evaluation.json", (1e9, 1e9))
    assert ("closely" in verdict(run).quality) is known


@pytest.mark.parametrize(
    ("changed", "grade", "told"),
    [
        ({"pearson_mouth": 0.7}, "good", "Follows your mouth closely, moves a little less than you."),
        (
            {"pearson_mouth": 0.3, "motion_ratio": 1.0},
            "fair",
            "Follows your mouth roughly, moves as much as you.",
        ),
        ({"pearson_mouth": 0.1}, "poor", "Hardly follows your mouth, moves a little less than you."),
        ({"motion_ratio": 0.02}, "poor", "Barely moves: 2% as much as you do."),
        ({"motion_ratio": 3.67}, "poor", "Follows your mouth well, trembles."),
        ({"motion_ratio": 2.3, "jerk_ratio": 7.4}, "poor", "Follows your mouth well, trembles."),
        (
            {"motion_ratio": 1.7, "jerk_ratio": 1.7},
            "fair",
            "Follows your mouth well, moves much more than you.",
        ),
        ({"motion_ratio": 12.0, "jerk_ratio": 12.0}, "poor", "Follows your mouth well, trembles."),
        (
            {"pearson_mouth": None, "pearson": -0.3, "rmse_body": 0.07, "motion_ratio": 1.1},
            "good",
            "Moves as much as you.",
        ),
        (
            {"closure_recall": 0.08},
            "fair",
            "Follows your mouth well, moves a little less than you. The lips rarely close.",
        ),
        ({"pearson_mouth": None, "pearson": 0.5}, "good", "Follows you well, moves a little less than you."),
    ],
)
def test_the_words_are_those_of_the_figures(
    tmp_path: Path, changed: dict[str, float | None], grade: str, told: str
) -> None:
    found = verdict(run_of(tmp_path, {"minutes": 4.0, "best_val": GOOD | changed}))
    assert (found.grade, found.quality) == (grade, told)


def test_test_takes_come_before_those_that_chose_the_version(tmp_path: Path) -> None:
    evaluation = {
        "split": "test",
        "takes": ["Chat_004"],
        "metrics": GOOD | {"pearson_mouth": 0.3},
        "baselines": {"ridge": {"rmse": 0.044}},
    }
    told = verdict(run_of(tmp_path, {"minutes": 4.0, "best_val": GOOD}, evaluation))
    assert told.quality.startswith("Follows your mouth roughly")
    assert told.quality.endswith("no closer to your motion than a simple guess from the sound.")
    assert told.basis == "Measured on Chat_004, which it never learnt from."


def test_a_body_that_gestures_is_not_blamed_for_being_elsewhere(tmp_path: Path) -> None:
    evaluation = {
        "split": "test",
        "takes": ["Chat_004"],
        "metrics": GOOD | {"rmse": 0.093, "rmse_face": 0.04, "rmse_body": 0.1},
        "baselines": {"ridge": {"rmse": 0.067, "rmse_face": 0.045, "rmse_body": 0.07}},
    }
    told = verdict(run_of(tmp_path, {"minutes": 4.0, "best_val": GOOD}, evaluation))
    assert (told.grade, told.quality) == ("good", "Follows your mouth well, moves a little less than you.")
    alone = {"rmse": 0.093, "rmse_face": None, "rmse_body": 0.093, "pearson": -0.3, "motion_ratio": 1.0}
    evaluation["metrics"] = alone
    evaluation["baselines"] = {"ridge": alone | {"rmse": 0.03, "rmse_body": 0.03}}
    told = verdict(run_of(tmp_path, {"minutes": 4.0, "best_val": alone}, evaluation))
    assert (told.grade, told.quality) == ("good", "Moves as much as you.")


def test_the_kind_that_errs_most_is_asked_for(tmp_path: Path) -> None:
    evaluation = {
        "split": "test",
        "takes": ["C", "D"],
        "metrics": GOOD,
        "per_take": {"C": {"rmse": 0.03}, "D": {"rmse": 0.06}},
    }
    run = run_of(tmp_path, {"minutes": 4.0, "train": ("A", "B")}, evaluation)
    kinds = {"C": {"statements": 20.0}, "D": {"questions": 20.0}}
    assert verdict(run, None, kinds).help == "Four more minutes of questions would probably help most."
    assert verdict(run, curve(0.2, 0.3, 0.38), kinds).help.startswith("Four more minutes of questions")
    enough = verdict(run, curve(0.36, 0.38, 0.38), kinds).help
    assert enough == (
        "You have enough takes of this kind: more of the same would hardly help. Questions would help most."
    )


def test_a_curve_of_other_takes_is_passed_over(tmp_path: Path) -> None:
    run = run_of(tmp_path, {"minutes": 4.0, "train": ("A", "Z"), "best_val": GOOD})
    assert "probably" in verdict(run, curve(0.2, 0.3, 0.38)).help


def test_what_is_not_known_is_not_judged(tmp_path: Path) -> None:
    assert verdict(run_of(tmp_path, {})) == RunVerdict()
    assert verdict(run_of(tmp_path, {"best_val": {"rmse": 0.1}})) == RunVerdict()


def test_a_learning_curve_says_when_it_is_enough() -> None:
    rising, flat, falling = curve(0.2, 0.3, 0.38), curve(0.37, 0.38, 0.385), curve(0.3, 0.4, 0.35)
    assert rising.next_gain == pytest.approx(0.064)
    assert rising.enough_seconds == 240.0 * 4, (
        "0.064, 0.032, 0.016: after two doublings it is less than worth"
    )
    assert not rising.is_enough
    assert flat.is_enough
    assert falling.is_enough, "a training that was worse of more takes promises nothing"
    assert curve_text(rising).startswith("More takes would help: twice as much would bring about 0.06")
    assert curve_text(flat).startswith("Enough")
    assert LearningCurve().next_gain is None


def test_the_better_run_is_named_with_the_reason() -> None:
    a, b = GOOD | {"rmse": 0.040}, GOOD | {"rmse": 0.048}
    assert better_of({"quick_001": b, "best_001": a}) == (
        "best_001 is better than quick_001: it comes closer to your motion."
    )
    near = GOOD | {"rmse": 0.0405}
    assert better_of({"quick_001": near, "best_001": a}).endswith(
        "the differences are no larger than chance."
    )
    still = {"rmse": 0.03, "pearson_mouth": 0.0, "motion_ratio": 0.02}
    assert better_of({"saia_001": still, "best_001": a}) == "best_001 is better: saia_001 barely moves."
    livelier = b | {"motion_ratio": 1.0}
    assert better_of({"best_001": a, "x": livelier}) == (
        "About equal: best_001 comes closer to your motion, but x moves more like you."
    )
    assert better_of({"best_001": a}) == ""
    body = {"rmse": 0.01, "rmse_face": None, "rmse_body": 0.01, "pearson_mouth": None, "motion_ratio": 0.7}
    assert "closer" not in better_of({"best_001": a | {"rmse_face": 0.05}, "body_001": body})


def test_a_lead_that_the_takes_do_not_share_is_chance() -> None:
    a, b = GOOD | {"rmse": 0.040}, GOOD | {"rmse": 0.048}
    takes = {
        "a": {"C": a, "D": b, "E": b},
        "b": {"C": b, "D": a, "E": a},
    }
    assert better_of({"a": a, "b": b}, takes).endswith("no larger than chance.")


def test_figures_that_nothing_measured_are_passed_over(tmp_path: Path) -> None:
    """Files come from anybody: numbers without end must not end the window."""
    huge = 10**400
    assert verdict(run_of(tmp_path, {}, {"metrics": {"pearson": huge, "motion_ratio": huge}})) == RunVerdict()
    project = Project.create(tmp_path / "Toy")
    project.runs_folder.mkdir(exist_ok=True)
    for point in ('"seconds": 1e400, "follow": 0.4', '"seconds": NaN', '"seconds": 9, "follow": 1e308'):
        (project.runs_folder / FILE).write_text(f'{{"points": [{{{point}}}]}}', encoding="utf-8")
        assert load_curve(project) is None
    newer = '{"version": 2, "points": [{"seconds": 9, "follow": 0.4}]}'
    (project.runs_folder / FILE).write_text(newer, encoding="utf-8")
    assert load_curve(project) is None
    project.close()
