"""A training cut off at any moment: what is kept is complete, and it goes on to the same end."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from safetensors.torch import load_file

from studio.ipc.events import EpochEvent, NoteEvent, StepEvent
from studio.ipc.events import TrainingEvent as Event
from studio.project import Project, Run
from studio.training.loop.train import resumed_recipe, train
from studio.training.recipe import Recipe, load_recipe
from tests import toys
from tests.tolerance import same_figures, same_weights

OF_EACH_SITTING = ("run", "seconds", "step_s", "check_s", "notes", "pid", "host")


def tiny() -> Recipe:
    small = ["units=16", "steps=6", "crops=4", "crop_frames=60", "epochs=4", "average=0.5"]
    return load_recipe("balanced").with_overrides(small)


def quiet(event: Event) -> None:
    pass


def facts(run: Run) -> dict[str, Any]:
    """What two equal trainings report alike."""
    assert run.report is not None
    return {key: value for key, value in run.report.to_plain().items() if key not in OF_EACH_SITTING}


def same(a: Run, b: Run) -> bool:
    """Whether two runs hold the same weights, figures and report."""
    told = [[{**e, "seconds": 0, "eta_s": 0} for e in run.epochs()] for run in (a, b)]
    return (
        same_figures(facts(a), facts(b))
        and same_figures(told[0], told[1])
        and same_weights(a.folder / "best.safetensors", b.folder / "best.safetensors")
    )


MOMENTS = ((1, 3), (3, 2), (4, None))
"""Epochs and their steps; None is an epoch's end."""


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project whose run balanced_001 nothing interrupted.

    Beside it lies what a power cut would have left of that run: (1, 3) at one of the moments, best_2 behind
    an epoch that was the best so far.
    """
    project = toys.make(tmp_path_factory.mktemp("trained") / "Toy")

    def copy(event: Event) -> None:
        if isinstance(event, EpochEvent | StepEvent):
            step = event.step if isinstance(event, StepEvent) else None
            if (event.epoch, step) in MOMENTS:  # the disk as it is then is all there will be
                _keep(project, f"{(event.epoch, step)}")
            if isinstance(event, EpochEvent) and event.best:
                _keep(project, f"best_{event.epoch}")

    train(project, tiny(), on_event=copy, step_seconds=0.0)
    return project.folder


def _keep(project: Project, name: str) -> None:
    shutil.copytree(project.runs_folder / "balanced_001", project.folder.parent / name)


@pytest.fixture
def project(trained: Path, tmp_path: Path) -> Project:
    return toys.copied(trained, tmp_path)


def left(project: Project, kept: Path) -> Run:
    """The run that a power cut left in a project."""
    shutil.copytree(kept, project.runs_folder / "balanced_050")
    run = project.run("balanced_050")
    assert run.status == "running"  # by its report, whose process happens to live
    return run


def test_ctrl_c_keeps_a_complete_model_and_resuming_gives_the_same_end(project: Project) -> None:
    def interrupted(event: Event) -> None:
        if isinstance(event, EpochEvent) and event.epoch == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(project, tiny(), on_event=interrupted)
    cut = project.run("balanced_002")
    assert cut.status == "stopped"
    assert cut.report is not None
    assert cut.report.best_val == cut.epochs()[cut.report.best_epoch - 1]["val"]
    assert (load_file(cut.folder / "best.safetensors")["gain"] != 1).any()
    notes: list[Event] = []
    again = train(project, resumed_recipe(cut), on_event=notes.append, resume=cut)
    assert [n.text for n in notes if isinstance(n, NoteEvent)] == ["balanced_002 goes on after epoch 2."]
    assert same(again, project.run("balanced_001"))


@pytest.mark.parametrize("moment", MOMENTS)
def test_after_a_power_cut_it_goes_on_to_the_end_of_one_that_had_none(
    trained: Path, project: Project, moment: tuple[int, int | None]
) -> None:
    cut = left(project, trained.parent / f"{moment}")
    notes: list[Event] = []
    again = train(project, resumed_recipe(cut), on_event=notes.append, resume=cut)
    done = moment[0] - (moment[1] is not None)
    said = f"goes on after epoch {done}." if done else "had not finished an epoch and begins anew."
    assert [n.text for n in notes if isinstance(n, NoteEvent)] == [f"balanced_050 {said}"]
    assert same(again, project.run("balanced_001"))


def test_a_cut_between_two_files_of_an_epoch_changes_nothing(trained: Path, project: Project) -> None:
    first, second = sorted(trained.parent.glob("best_*"))[:2]
    cut = left(project, first)
    # The weights of the later epoch were written, where it stands was not.
    shutil.copyfile(second / "best.safetensors", cut.folder / "best.safetensors")
    again = train(project, resumed_recipe(cut), on_event=quiet, resume=cut)
    assert same(again, project.run("balanced_001"))


def test_the_figures_while_training_are_those_of_the_model_that_is_kept(project: Project) -> None:
    run = project.run("balanced_001")
    measured = figures_of(project, run)
    best = run.facts.best_val
    assert best is not None
    for name in ("rmse", "pearson", "motion_ratio", "motion_ratio_head", "std_ratio"):
        assert measured[name] == pytest.approx(best[name], rel=1e-3), name


def figures_of(project: Project, run: Run) -> dict[str, Any]:
    """What `saia evaluate` measures on the validation takes."""
    from studio.cli._measure import measure
    from studio.cli._output import Output
    from studio.evaluation.evaluation_set import choose_evaluation_set

    out = Output(as_json=True)
    return measure(run, choose_evaluation_set(project, None, "val", out.note), out).metrics
