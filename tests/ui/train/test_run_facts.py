from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from studio.evaluation.learning_curve import CurvePoint, LearningCurve, save_curve
from studio.ipc.events import EpochEvent
from studio.project import Project, Run
from studio.ui.train.run_facts import VerdictReader, curves, epochs_of, run_facts


def _epoch(
    number: int, val_loss: float, motion: float | None = 1.0, best: bool = False, advice: str = ""
) -> EpochEvent:
    val = {"rmse": 0.09, "rmse_face": 0.04, "pearson": 0.3, "motion_ratio": motion}
    return EpochEvent(number, 10, 0.1, val_loss, val, 2.0 * number, 8.0, best, advice=advice)


def test_no_epochs_know_nothing() -> None:
    facts = run_facts([])
    assert (facts.epochs, facts.best, facts.life) == (0, None, "")


def test_the_epoch_marked_best_is_best() -> None:
    events = [_epoch(1, 0.5, best=True), _epoch(2, 0.6), _epoch(3, 0.4, best=True), _epoch(4, 0.3)]
    assert run_facts(events).best == 3


def test_without_marks_the_lowest_validation_loss_is_best() -> None:
    assert run_facts([_epoch(1, 0.5), _epoch(2, 0.2), _epoch(3, math.nan)]).best == 2


def test_the_pace_is_seconds_an_epoch_not_seconds_in_all() -> None:
    assert run_facts([_epoch(n, 0.5) for n in range(1, 6)]).seconds == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("ratio", "life"),
    [(0.1, "still"), (0.5, "calm"), (1.0, "alive"), (1.7, "lively"), (3.5, "shaky"), (None, "")],
)
def test_life_is_read_from_the_motion_ratio(ratio: float | None, life: str) -> None:
    assert run_facts([_epoch(1, 0.5, ratio)]).life == life


def test_stillness_is_not_told_while_a_model_is_young() -> None:
    assert run_facts([_epoch(1, 0.5, 0.1, advice="Train longer.")]).advice == ""
    old = [_epoch(n, 0.5, 0.1, advice="Train longer.") for n in range(1, 6)]
    assert run_facts(old).advice == "Train longer."


def test_curves_hold_losses_and_metrics_and_leave_null_out() -> None:
    found = curves([_epoch(1, 0.5), _epoch(2, float("nan"))])
    assert found["val_loss"] == [(1, 0.5), (2, None)]
    assert found["motion_ratio"] == [(1, 1.0), (2, 1.0)]


def test_lines_that_make_no_sense_are_passed_over(tmp_path: Path) -> None:
    lines = [{"event": "note", "text": "x"}, {"epoch": "one"}, {"epoch": 1, "of": "many", "val_loss": None}]
    (tmp_path / "metrics.jsonl").write_text(
        "\n".join(map(json.dumps, lines)) + "\nno JSON\n", encoding="utf-8"
    )
    facts = run_facts(epochs_of(Run.load(tmp_path)))
    assert (facts.epochs, facts.of, facts.best) == (1, None, None)


def test_the_learning_curve_is_read_again_only_where_its_file_changed(tmp_path: Path) -> None:
    project, reader = Project.create(tmp_path / "P"), VerdictReader()
    assert reader.curve(project) is None
    save_curve(project, LearningCurve((CurvePoint(30.0, 0.4),), ("A",), "test", ("B",)))
    first = reader.curve(project)
    assert first is not None
    assert reader.curve(project) is first
    save_curve(project, LearningCurve((CurvePoint(30.0, 0.4), CurvePoint(60.0, 0.5)), ("A",), "test", ("B",)))
    second = reader.curve(project)
    assert second is not None
    assert second.seconds == 60.0
    project.close()
