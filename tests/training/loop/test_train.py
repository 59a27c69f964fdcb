"""Training for real, on takes of a few seconds: it learns, stops, resumes and repeats."""

from __future__ import annotations

import json
import math
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from studio.dataset import edits
from studio.errors import RequestError, StudioError
from studio.ipc.events import EpochEvent, NoteEvent, StartedEvent
from studio.ipc.events import TrainingEvent as Event
from studio.motion import Motion
from studio.project import Project, Run
from studio.take import TakeInfo
from studio.training.loop.setup import learning_rate
from studio.training.loop.train import resumed_recipe, train
from studio.training.loop.validation import CALMEST, LIVELIEST
from studio.training.recipe import Recipe, TrainingSettings, load_recipe, read_recipe
from tests import toys
from tests.tolerance import same_figures, same_weights

MakeProject = Callable[..., Project]

TINY = ["units=16", "steps=6", "crops=4", "crop_frames=60"]


def tiny(*overrides: str, name: str = "balanced") -> Recipe:
    return load_recipe(name).with_overrides([*TINY, *overrides])


def trained(
    project: Project, recipe: Recipe, stop: Callable[[], bool] = lambda: False, resume: Run | None = None
) -> tuple[Run, list[Event]]:
    events: list[Event] = []
    return train(project, recipe, on_event=events.append, stop=stop, resume=resume), events


def epochs(events: list[Event]) -> list[EpochEvent]:
    return [event for event in events if isinstance(event, EpochEvent)]


def notes(events: list[Event]) -> list[str]:
    return [event.text for event in events if isinstance(event, NoteEvent)]


@pytest.fixture(scope="module")
def two_epochs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Event]]:
    """A project with one run, to be copied, and what was told of that."""
    project = toys.make(tmp_path_factory.mktemp("trained") / "Toy")
    _, events = trained(project, tiny("epochs=2"))
    return project.folder, events


@pytest.fixture
def project(two_epochs: tuple[Path, list[Event]], tmp_path: Path) -> Project:
    return toys.copied(two_epochs[0], tmp_path)


@pytest.fixture
def run(project: Project) -> Run:
    return project.run("balanced_001")


@pytest.mark.slow
def test_a_toy_is_learnt_and_moves(make_toy_project: MakeProject) -> None:
    run, events = trained(make_toy_project(), tiny("epochs=12", "steps=20", "units=32"))
    told = epochs(events)
    assert [e.epoch for e in told] == list(range(1, 13))
    assert told[-1].train_loss < 0.6 * told[0].train_loss
    best = next(e for e in reversed(told) if e.best)
    assert best.val["pearson"] is not None
    assert best.val["pearson"] > 0.4
    assert best.val["motion_ratio"] is not None
    assert best.val["motion_ratio"] > 0.4
    assert run.status == "done"
    assert run.report is not None
    assert run.report.best_epoch == best.epoch
    assert run.report.best_val == best.val


def test_the_run_folder_holds_what_others_read(run: Run, two_epochs: tuple[Path, list[Event]]) -> None:
    _, events = two_epochs
    started = next(event for event in events if isinstance(event, StartedEvent))
    assert (started.run, started.of, started.val) == (run.id, 2, ("Toy_003",))
    assert {path.name for path in run.folder.iterdir()} >= {
        "recipe.toml", "metrics.jsonl", "best.safetensors", "last.safetensors", "report.json",
    }  # fmt: skip
    assert replace(read_recipe(run.folder / "recipe.toml"), name="balanced") == tiny("epochs=2")
    assert [event["epoch"] for event in run.epochs()] == [1, 2]
    assert run.epochs()[0]["event"] == "epoch"
    assert run.report is not None
    assert run.report.train == ("Toy_001", "Toy_002")
    assert run.report.seed == 1
    assert run.has_weights


def test_two_runs_with_one_seed_are_equal_and_with_another_are_not(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    (a, of_a), (b, of_b), (c, _) = (trained(project, tiny("epochs=2", f"seed={seed}")) for seed in (4, 4, 5))
    assert same_figures([e.val for e in epochs(of_a)], [e.val for e in epochs(of_b)])
    assert same_weights(a.folder / "last.safetensors", b.folder / "last.safetensors")
    assert not same_weights(a.folder / "last.safetensors", c.folder / "last.safetensors")


@pytest.mark.parametrize("average", ["average=0", "average=0.9"])
def test_a_resumed_run_ends_like_one_that_was_never_interrupted(
    make_toy_project: MakeProject, average: str
) -> None:
    project = make_toy_project()
    whole, of_whole = trained(project, tiny("epochs=4", average))
    asked = 0

    def after_two_epochs() -> bool:
        nonlocal asked
        asked += 1
        return asked == 2 * 6 + 3  # in the midst of the third

    half, _ = trained(project, tiny("epochs=4", average), stop=after_two_epochs)
    assert half.status == "stopped"
    assert [e["epoch"] for e in half.epochs()] == [1, 2]
    again, events = trained(project, resumed_recipe(half), resume=half)
    assert notes(events) == [f"{half.id} goes on after epoch 2."]
    assert again.id == half.id
    assert again.status == "done"
    assert [e["epoch"] for e in again.epochs()] == [1, 2, 3, 4]
    assert same_figures(epochs(events)[-1].val, epochs(of_whole)[-1].val)
    assert same_weights(whole.folder / "last.safetensors", again.folder / "last.safetensors")
    assert same_weights(whole.folder / "best.safetensors", again.folder / "best.safetensors")


def test_a_stop_keeps_the_best_weights_even_in_the_first_epoch(make_toy_project: MakeProject) -> None:
    run, events = trained(make_toy_project(), tiny("epochs=50"), stop=lambda: True)
    assert len(epochs(events)) == 1
    assert run.status == "stopped"
    assert run.has_weights


def test_a_run_killed_between_its_files_goes_on_from_the_last_whole_epoch(project: Project, run: Run) -> None:
    with (run.folder / "metrics.jsonl").open("a") as file:
        file.write('{"event": "epoch", "epoch": 3}\n{"event": "epo')
    (run.folder / "report.json").unlink()
    again, events = trained(
        project, replace(resumed_recipe(run), training=tiny("epochs=3").training), resume=run
    )
    assert notes(events) == [f"{run.id} goes on after epoch 2."]
    assert [e["epoch"] for e in again.epochs()] == [1, 2, 3]
    assert again.epochs()[2]["val"]


def test_a_run_killed_before_its_first_epoch_begins_anew(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    folder = project.new_run_folder("balanced")
    (folder / "recipe.toml").write_text(tiny("epochs=1").as_toml(), encoding="utf-8")
    run = project.run(folder.name)
    again, events = trained(project, resumed_recipe(run), resume=run)
    assert notes(events) == [f"{run.id} had not finished an epoch and begins anew."]
    assert again.status == "done"


def test_the_best_weights_are_those_of_the_best_epoch(make_toy_project: MakeProject) -> None:
    project, told = make_toy_project(), list[EpochEvent]()
    at_best: dict[str, torch.Tensor] = {}

    def note(event: Event) -> None:
        nonlocal at_best
        if isinstance(event, EpochEvent):
            told.append(event)
            if event.best:
                at_best = load_file(project.runs_folder / "balanced_001" / "last.safetensors")

    # A rate this high soon makes an epoch worse than the one before it; which one is up to the processor.
    wild = tiny("epochs=100", "learning_rate=0.3", "schedule=constant", "average=0")
    run = train(project, wild, on_event=note, stop=lambda: bool(told) and not told[-1].best)
    best = min(told, key=lambda e: e.val_loss)
    assert told[-1] is not best
    assert run.report is not None
    assert run.report.best_epoch == best.epoch
    learnt = load_file(run.folder / "best.safetensors")
    del learnt["gain"]
    assert all(torch.equal(tensor, at_best[f"network.{name}"]) for name, tensor in learnt.items())


def test_a_cycle_is_not_judged_by_a_lucky_epoch_of_its_fast_part(make_toy_project: MakeProject) -> None:
    project, lucky = make_toy_project(), False
    # At a rate this high an early epoch may well be the best one; of which seeds is up to the processor.
    for seed in range(1, 20):
        run, events = trained(project, tiny("epochs=5", "learning_rate=0.3", f"seed={seed}"))
        told = epochs(events)
        assert told[-1].best
        assert run.report is not None
        assert run.report.best_epoch == 5
        assert run.report.best_val == told[-1].val
        lucky = min(told, key=lambda e: e.val_loss).epoch < 5
        if lucky:
            break
    assert lucky


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("audio2face", ["units=8", "dense=8"]),
        ("audio2face", ["form=learns", "units=8", "dense=8"]),
        ("faceformer", ["width=16", "hearing=2", "steps=3"]),
        ("faceformer", ["form=paper", "width=16", "hearing=2", "steps=3"]),
        ("saia", ["units=8"]),
        ("saia", ["form=reports", "units=8"]),
        ("saia", ["form=mixture", "units=8", "mixtures=3"]),
        ("quick", ["units=8", "steps=3"]),
        ("best", ["units=8", "steps=3"]),
    ],
)
def test_every_recipe_trains(make_toy_project: MakeProject, name: str, overrides: list[str]) -> None:
    recipe = load_recipe(name).with_overrides([*overrides, "epochs=1"])
    run, events = trained(make_toy_project(("train", "val"), seconds=5.0), recipe)
    assert math.isfinite(epochs(events)[-1].val_loss)
    assert run.has_weights
    assert run.recipe == name


def test_the_figures_of_a_model_that_draws_are_those_of_what_it_draws(make_toy_project: MakeProject) -> None:
    drawing, plain = (
        load_recipe("saia").with_overrides(
            [f"mixtures={mixtures}", "units=8", "epochs=1", "learning_rate=1e-9"]
        )
        for mixtures in (3, 1)
    )
    project = make_toy_project(("train", "val"))
    (_, of_drawing), (_, of_plain) = (trained(project, recipe) for recipe in (drawing, plain))
    motion = [epochs(events)[-1].val["motion_ratio"] for events in (of_drawing, of_plain)]
    assert motion[0] is not None
    assert motion[1] is not None
    assert motion[0] > 0.3 > motion[1]  # unlearnt expected poses stand still, unlearnt drawn ones do not


def test_mixed_takes_train_together(make_toy_project: MakeProject, tmp_path: Path) -> None:
    project = make_toy_project(("train", "val"))
    face = make_toy_project(("train",), bones=False, name="Face", fps=60.0)
    body = make_toy_project(("train",), shapes=False, name="Body", fps=25.0)
    from studio.take.motion_file import read_motion

    for other, name in ((face, "Only_face"), (body, "Only_body")):
        source = other.takes[0]
        assert source.motion_path is not None
        project.add_take(name, TakeInfo("x"), read_motion(source.motion_path), source.audio_path)
        project.edit("Split", edits.set_split(project.dataset, [name], "train"))
    _, events = trained(project, tiny("epochs=2"))
    assert all(math.isfinite(e.train_loss) for e in epochs(events))
    assert epochs(events)[-1].val["geodesic_deg"] is not None


def test_without_validation_the_end_of_a_take_is_held_back(make_toy_project: MakeProject) -> None:
    _, events = trained(make_toy_project(("train", "train")), tiny("epochs=1"))
    assert notes(events) == [
        "No take is marked for validation: the last 0.9 s of Toy_001 are held back for it."
    ]
    started = next(event for event in events if isinstance(event, StartedEvent))
    assert started.train == ("Toy_001", "Toy_002")
    assert started.val == ("Toy_001 (end)",)


def test_no_training_take_is_a_sentence(make_toy_project: MakeProject) -> None:
    with pytest.raises(RequestError) as caught:
        trained(make_toy_project(("val", "test")), tiny())
    assert str(caught.value) == (
        "No take with sound and motion is marked for training. Mark at least one as train in Curate, "
        "or with `saia split PROJECT --train TAKE`."
    )


def test_too_little_to_learn_from_is_a_sentence(make_toy_project: MakeProject) -> None:
    with pytest.raises(RequestError) as caught:
        trained(make_toy_project(("train", "val"), seconds=1.0), tiny())
    assert str(caught.value) == (
        "The training takes hold only 1.0 s of sound with motion; 4 s are needed. "
        "Record or import more, or mark more takes for training in Curate."
    )


def test_values_that_are_no_numbers_are_mended_before_learning(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    t = np.arange(300) / 30
    values = np.sin(t)[:, None] ** 2
    values[7] = np.nan
    source = project.takes[0].audio_path
    project.add_take("Broken", TakeInfo("x"), Motion.build(t, ("A",), values), source)
    project.edit("Split", edits.set_split(project.dataset, ["Broken"], "train"))
    run, _ = trained(project, tiny("epochs=1"))
    assert [math.isfinite(epoch["train_loss"]) for epoch in run.epochs()] == [True]


def test_takes_without_sound_or_motion_are_left_out_and_named(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    t = np.arange(90) / 30
    project.add_take("Mute", TakeInfo("x"), Motion.build(t, ("A",), np.sin(t)[:, None] ** 2), None)
    project.add_take("Radio", TakeInfo("x"), None, project.takes[0].audio_path)
    project.edit("Split", edits.set_split(project.dataset, ["Mute", "Radio"], "train"))
    _, events = trained(project, tiny("epochs=1"))
    assert notes(events) == [
        "Mute has no sound and is left out.",
        "Radio has no motion and is left out.",
    ]


def test_a_training_that_goes_astray_keeps_its_run(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    recipe = tiny("epochs=3", "schedule=constant", "clip=0", "optimiser=adam")
    hopeless = replace(recipe, training=replace(recipe.training, learning_rate=1e30))
    with pytest.raises(StudioError) as caught:
        trained(project, hopeless)
    assert caught.value.remedy == "Lower training.learning_rate; the best weights so far are kept."
    assert project.runs[0].status == "failed"


def test_the_alarm_sounds_for_a_model_that_stays_still(make_toy_project: MakeProject) -> None:
    still = tiny("epochs=4", "learning_rate=1e-9", "network.body=plain")
    _, events = trained(make_toy_project(), still)
    assert all(e.still for e in epochs(events))
    assert epochs(events)[0].advice != ""  # a quarter of four is the first
    assert epochs(events)[-1].advice.startswith("The model hardly moves yet.")


def test_liveliness_matches_the_best_models_motion_to_the_capture(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    plain, _ = trained(project, tiny("epochs=2", "liveliness=0"))
    lively, _ = trained(project, tiny("epochs=2", "liveliness=1"))
    gain = load_file(lively.folder / "best.safetensors")["gain"]
    assert (load_file(plain.folder / "best.safetensors")["gain"] == 1).all()
    assert (gain > 1.5).any()  # two epochs leave it far too still
    assert (gain >= CALMEST).all()
    assert (gain <= LIVELIEST).all()


def test_a_run_cut_off_after_its_last_epoch_still_gets_its_liveliness(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    # As a power cut would leave it: all epochs are there, the gains are not.
    cut_off, _ = trained(project, tiny("epochs=2", "liveliness=0"))
    done, events = trained(project, tiny("epochs=2", "liveliness=1"), resume=cut_off)
    assert epochs(events) == []
    assert (load_file(done.folder / "best.safetensors")["gain"] > 1.5).any()


def test_one_cycle_rises_and_falls() -> None:
    settings = TrainingSettings(learning_rate=1.0)
    rates = [learning_rate(settings, step, 100) for step in range(100)]
    assert rates[0] == pytest.approx(0.04)
    assert max(rates) == pytest.approx(1.0)
    assert int(np.argmax(rates)) == 29
    assert rates[-1] == pytest.approx(4e-6)


def test_epoch_lines_are_json(run: Run) -> None:
    for line in (run.folder / "metrics.jsonl").read_text().splitlines():
        facts = json.loads(line)
        assert {"epoch", "of", "train_loss", "val_loss", "val", "seconds", "eta_s"} <= facts.keys()
        assert {"rmse", "pearson", "motion_ratio", "std_ratio"} <= facts["val"].keys()


def test_a_run_whose_process_was_killed_is_interrupted_and_a_living_one_is_running(
    project: Project, run: Run
) -> None:
    path = run.folder / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    assert "pid" not in report  # it ended by itself

    def status(**facts: object) -> str:
        path.write_text(json.dumps(report | {"status": "running"} | facts), encoding="utf-8")
        return project.run(run.id).status

    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    here = platform.node()
    assert status(pid=ended.pid, host=here) == "interrupted"
    assert status(pid=os.getpid(), host=here) == "running"
    assert status(pid=ended.pid, host=f"not {here}") == "running"  # nobody here can tell
    assert status() == "interrupted"
