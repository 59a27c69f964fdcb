"""Out of memory: one sentence with the smaller batch that may fit, and the run kept."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch

from studio.errors import StudioError
from studio.ipc.events import EpochEvent, ListeningEvent, OutOfMemoryEvent
from studio.ipc.events import TrainingEvent as Event
from studio.project import Project
from studio.project.run import base_voice
from studio.training.checkpoint import BEST, load_model
from studio.training.gather import gather
from studio.training.loop.setup import fresh_model, is_out_of_memory, smaller_batch
from studio.training.loop.train import resumed_recipe, train
from studio.training.recipe import Recipe, load_recipe

MakeProject = Callable[..., Project]


def tiny(*overrides: str) -> Recipe:
    return load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=3", *overrides])


def test_every_way_of_running_out_of_memory_is_known() -> None:
    cpu = "[enforce fail at alloc_cpu.cpp:121] . DefaultCPUAllocator: can't allocate memory: you tried to"
    assert is_out_of_memory(MemoryError())
    assert is_out_of_memory(torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2 GiB."))
    assert is_out_of_memory(RuntimeError(cpu))
    assert is_out_of_memory(RuntimeError("MPS backend out of memory (MPS allocated: 8 GB)"))
    assert not is_out_of_memory(RuntimeError("mat1 and mat2 shapes cannot be multiplied"))


def test_memory_that_does_not_suffice_for_the_sound_is_a_sentence_with_a_smaller_batch(
    make_toy_project: MakeProject,
) -> None:
    project, events = make_toy_project(("train", "val")), list[Event]()

    def fills_up(event: Event) -> None:
        events.append(event)
        if isinstance(event, ListeningEvent):
            np.empty(10**16)  # more than any machine has addresses for: it is refused, nothing is filled

    with pytest.raises(StudioError) as caught:
        train(project, tiny("crops=8"), on_event=fills_up)
    assert str(caught.value) == (
        "The memory of this machine was not enough for the training. A smaller batch may fit: "
        f'`saia train "{project.folder}" --recipe quick --set training.crops=4`.'
    )
    assert events == [ListeningEvent("Toy_001", 1, 2), OutOfMemoryEvent("", "training.crops=4")]
    assert project.runs == ()


@pytest.mark.parametrize("refused", [lambda: np.empty(10**16), lambda: torch.empty(10**16)])
def test_a_run_whose_memory_ran_out_is_kept_and_goes_on_with_a_smaller_batch(
    make_toy_project: MakeProject, refused: Callable[[], object]
) -> None:
    project, events = make_toy_project(("train", "val")), list[Event]()

    def fills_up(event: Event) -> None:
        events.append(event)
        if isinstance(event, EpochEvent) and event.epoch == 2:
            refused()  # numpy or torch asks for more than there is, on the training's own thread

    with pytest.raises(StudioError) as caught:
        train(project, tiny("crops=4"), on_event=fills_up)
    assert caught.value.remedy == (
        f'A smaller batch may fit: `saia train "{project.folder}" --resume quick_001 '
        "--set training.crops=2`. What was learnt is kept."
    )
    assert events[-1] == OutOfMemoryEvent("quick_001", "training.crops=2")
    run = project.run("quick_001")
    assert run.status == "failed"
    assert run.has_weights
    smaller = resumed_recipe(run).with_overrides([smaller_batch(resumed_recipe(run))])
    again = train(project, smaller, on_event=events.append, resume=run)
    assert [epoch["epoch"] for epoch in again.epochs()] == [1, 2, 3]
    assert again.status == "done"
    assert resumed_recipe(again).training.crops == 2


def test_a_batch_shrinks_until_there_is_nothing_left_to_take_away() -> None:
    recipe, seen = tiny("crops=3", "crop_frames=150"), []
    while setting := smaller_batch(recipe):
        seen.append(setting)
        recipe = recipe.with_overrides([setting])
    assert seen == ["training.crops=1", "training.crop_frames=75", "training.crop_frames=37"]


@pytest.mark.parametrize(
    ("changes", "begins_there", "said"),
    [
        ((), True, ""),
        (("style_by=take",), True, ""),
        (("start_from=fresh",), False, ""),
        (("units=8",), False, "this recipe's network has other sizes"),
        (("sound.window_ms=20",), False, "this recipe hears sound in another form"),
        (
            ("channels.fps=60",),
            False,
            "that knows 30 frames a second, and your motion has 60",
        ),
    ],
)
def test_a_quick_look_hears_as_the_base_voice_from_the_start_where_it_fits_and_says_where_not(
    make_toy_project: MakeProject, changes: tuple[str, ...], begins_there: bool, said: str
) -> None:
    recipe, notes = load_recipe("quick").with_overrides(changes), list[str]()
    data = gather(make_toy_project(("train", "train", "val")), recipe)
    network = fresh_model(data, recipe, notes.append).network
    told = f"The training starts from scratch and not from the base voice: {said}."
    assert notes == ([told] if said else [])
    own = network.core.state_dict() | {"row_mean": network.row_mean}
    base = load_model(base_voice().folder / BEST).network.state_dict()
    for name in ("row_mean", "convolution.weight", "lstm.weight_ih_l0", "lstm.weight_hh_l1"):
        same = own[name].shape[:1] == base[name].shape[:1] and torch.equal(
            own[name][..., : base[name].shape[-1]], base[name]
        )
        assert same is begins_there, name
    assert own["pose.bias"].shape == (data.layout.width,)
