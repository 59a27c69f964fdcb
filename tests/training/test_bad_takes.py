"""Takes that cannot be learnt from, and machines too small: one sentence, nothing lost, the rest goes on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.dataset import edits
from studio.errors import RequestError, StudioError
from studio.ipc.events import (
    CleaningEvent,
    ListeningEvent,
    NoteEvent,
    StartedEvent,
)
from studio.ipc.events import TrainingEvent as Event
from studio.motion import Motion
from studio.project import Project, Run
from studio.take import TakeInfo
from studio.training.loop.train import resumed_recipe, train
from studio.training.recipe import Recipe, load_recipe

MakeProject = Callable[..., Project]


def tiny(*overrides: str) -> Recipe:
    return load_recipe("quick").with_overrides(
        ["units=8", "steps=2", "epochs=1", "start_from=fresh", *overrides]
    )


def trained(project: Project, recipe: Recipe, resume: Run | None = None) -> tuple[Run, list[Event]]:
    events: list[Event] = []
    return train(project, recipe, on_event=events.append, resume=resume), events


def added(project: Project, name: str, motion: Motion, sound: np.ndarray, folder: Path) -> None:
    """A take for training of mono sound at 16 kHz."""
    path = folder / f"{name}.wav"
    soundfile.write(path, sound, 16000, subtype="FLOAT")
    project.add_take(name, TakeInfo("x"), motion, path)
    project.edit("Split", edits.set_split(project.dataset, [name], "train"))


def waving(seconds: float, fps: float = 30.0) -> Motion:
    t = np.arange(round(seconds * fps)) / fps
    return Motion.build(t, ("A",), np.sin(3 * t)[:, None] ** 2)


def notes(events: list[Event]) -> list[str]:
    return [event.text for event in events if isinstance(event, NoteEvent)]


def test_cleaned_sound_that_is_not_there_is_made_in_sight(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    name = project.selected("train")[0][0].id
    project.edit("Clean", edits.update(project.dataset, [name], lambda s: replace(s, clean="noise")))
    _, events = trained(project, tiny())
    told = [event for event in events if isinstance(event, CleaningEvent)]
    assert {event.take for event in told} == {name}
    assert told[-1].fraction == 1.0
    heard = [event for event in events if isinstance(event, ListeningEvent)]
    assert [(event.number, event.of) for event in heard] == [
        (i, len(heard)) for i in range(1, len(heard) + 1)
    ]
    kinds = [type(event) for event in events]
    assert kinds.index(StartedEvent) == len(told) + len(heard), "all of it before the training starts"
    _, events = trained(project, tiny())
    assert not any(isinstance(event, CleaningEvent) for event in events), "it is there by now"


def test_parts_of_one_take_on_both_sides_are_told(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    name = project.selected("train")[0][0].id
    cut = edits.split_at(project.dataset, name, [3.0], project.take(name).info.duration)
    project.edit("Cut", edits.set_split(cut, [f"{name}.2"], "val"))
    _, events = trained(project, tiny())
    assert notes(events) == [
        f"Parts of {name} are learnt from and other parts are kept to check the learning: "
        "the figures look better than they are. Press Split automatically in Curate."
    ]


def test_a_silent_take_is_named_and_the_rest_is_learnt(make_toy_project: MakeProject, tmp_path: Path) -> None:
    project = make_toy_project()
    added(project, "Quiet", waving(5.0), np.zeros(5 * 16000), tmp_path)
    run, events = trained(project, tiny())
    assert notes(events) == ["Quiet is silent; nothing can be learnt from its sound."]
    assert all(math.isfinite(epoch["train_loss"]) for epoch in run.epochs())


def test_sound_with_values_that_are_no_numbers_is_mended(
    make_toy_project: MakeProject, tmp_path: Path
) -> None:
    project = make_toy_project()
    sound = np.random.default_rng(0).normal(0, 0.1, 5 * 16000)
    sound[1000:1010], sound[2000] = np.nan, np.inf
    added(project, "Broken", waving(5.0), sound, tmp_path)
    run, _ = trained(project, tiny())
    assert all(math.isfinite(epoch["train_loss"]) for epoch in run.epochs())


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_a_take_of_a_few_frames_does_no_harm(
    make_toy_project: MakeProject, tmp_path: Path, frames: int
) -> None:
    project = make_toy_project()
    added(project, "Blip", waving(frames / 30), np.full(800 * frames, 0.1), tmp_path)
    run, events = trained(project, tiny())
    assert notes(events) == (["Blip has no motion and is left out."] if frames == 1 else [])
    assert all(math.isfinite(epoch["train_loss"]) for epoch in run.epochs())


def test_takes_in_which_nothing_moves_are_a_sentence(make_toy_project: MakeProject, tmp_path: Path) -> None:
    project = make_toy_project(("val",))
    t = np.arange(180) / 30
    frozen = Motion.build(t, ("A", "Blink"), np.tile([0.3, 0.0], (180, 1)), ("Head",))
    added(project, "Statue", frozen, np.random.default_rng(0).normal(0, 0.1, 6 * 16000), tmp_path)
    with pytest.raises(StudioError) as caught:
        trained(project, tiny())
    assert str(caught.value) == (
        "Nothing moves in the training takes. Check that the tracker was sending while they were recorded."
    )
    assert project.runs == ()


def test_a_take_of_two_frames_alone_is_too_little(make_toy_project: MakeProject, tmp_path: Path) -> None:
    project = make_toy_project(())
    added(project, "Short", waving(2 / 30), np.sin(np.arange(96000) / 9), tmp_path)
    with pytest.raises(RequestError) as caught:
        trained(project, tiny())
    assert str(caught.value) == (
        "The training takes hold only 0.0 s of sound with motion; 4 s are needed. "
        "Record or import more, or mark more takes for training in Curate."
    )


def test_silent_takes_alone_are_a_sentence(make_toy_project: MakeProject, tmp_path: Path) -> None:
    project = make_toy_project(())
    added(project, "Silent", waving(6), np.zeros(96000), tmp_path)
    with pytest.raises(RequestError) as caught:
        trained(project, tiny())
    assert str(caught.value) == (
        "The training takes are silent; nothing can be learnt from their sound. "
        "Check the microphone with Test in Record, and record again."
    )


def test_a_take_without_sound_alone_is_named(make_toy_project: MakeProject) -> None:
    project = make_toy_project(())
    project.add_take("Mute", TakeInfo("x"), waving(6), None)
    project.edit("Split", edits.set_split(project.dataset, ["Mute"], "train"))
    with pytest.raises(RequestError) as caught:
        trained(project, tiny())
    assert caught.value.what == "No take with sound and motion is marked for training: Mute has no sound."


def test_one_take_alone_is_enough_its_end_checks_the_rest(make_toy_project: MakeProject) -> None:
    run, events = trained(make_toy_project(("train",)), tiny())
    assert notes(events) == [
        "No take is marked for validation: the last 0.9 s of Toy_001 are held back for it."
    ]
    started = next(event for event in events if isinstance(event, StartedEvent))
    assert (started.train, started.val) == (("Toy_001",), ("Toy_001 (end)",))
    assert run.has_weights


@pytest.mark.parametrize("length", [0, 100, 5000])
def test_a_run_whose_state_is_cut_short_keeps_its_best(make_toy_project: MakeProject, length: int) -> None:
    project = make_toy_project(("train", "val"))
    run, _ = trained(project, tiny("epochs=2"))
    state, best = run.folder / "last.safetensors", (run.folder / "best.safetensors").read_bytes()
    state.write_bytes(state.read_bytes()[:length])
    with pytest.raises(StudioError) as caught:
        trained(project, resumed_recipe(run), resume=run)
    assert str(caught.value) == (
        "last.safetensors of the run quick_001 is damaged. Train again, or restore it from a backup."
    )
    assert (run.folder / "best.safetensors").read_bytes() == best


def test_a_resumed_run_of_a_newer_studio_says_so(make_toy_project: MakeProject) -> None:
    from studio.training import checkpoint

    project = make_toy_project(("train", "val"))
    run, _ = trained(project, tiny())
    path = run.folder / "last.safetensors"
    state = checkpoint.load_state(path)
    checkpoint.save_state(path, replace(state, facts=state.facts | {"version": 99}))
    with pytest.raises(StudioError) as caught:
        trained(project, resumed_recipe(run), resume=run)
    assert caught.value.remedy == "Update Saia Studio to open it."


@pytest.mark.parametrize("hostile", [{"hearing": 8000}, {"reach_s": math.inf}, {"width": 10**9}])
def test_a_faceformer_with_hostile_settings_cannot_be_used(
    make_toy_project: MakeProject, hostile: dict[str, float]
) -> None:
    from studio.training import checkpoint

    project = make_toy_project(("train", "val"))
    small = ["width=16", "hearing=2", "steps=1", "epochs=1"]
    run, _ = trained(project, load_recipe("faceformer").with_overrides(small))
    path = run.folder / "best.safetensors"
    made = checkpoint.load_model(path)
    changed = replace(made.recipe, network={**made.recipe.network, **hostile})
    checkpoint.save_model(path, replace(made, recipe=changed))
    with pytest.raises(StudioError) as caught:
        checkpoint.load_model(path)
    ((name, value),) = hostile.items()
    why = f"{value} is not possible for network.{name}."
    assert caught.value.what == f"The run faceformer_001 cannot be used: {why}"
