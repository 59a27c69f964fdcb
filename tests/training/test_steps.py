"""A long epoch says that it goes on."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

from studio.ipc.events import EpochEvent, StepEvent
from studio.ipc.events import TrainingEvent as Event
from studio.project import Project
from studio.training.loop.run_folder import Progress
from studio.training.loop.train import train
from studio.training.recipe import load_recipe


def test_each_step_can_be_told_of_and_short_epochs_tell_none(
    make_toy_project: Callable[..., Project],
) -> None:
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=3", "epochs=2"])
    project = make_toy_project(("train", "val"))
    events: list[Event] = []
    train(project, recipe, on_event=events.append, step_seconds=0.0, after_s=100.0)
    told = [event for event in events if isinstance(event, StepEvent | EpochEvent)]
    assert [(e.epoch, e.step if isinstance(e, StepEvent) else None) for e in told] == [
        (1, 1), (1, 2), (1, 3), (1, None), (2, 1), (2, 2), (2, 3), (2, None),
    ]  # fmt: skip
    steps = [event for event in told if isinstance(event, StepEvent)]
    assert all((e.of, e.steps) == (2, 3) and e.seconds > 0 for e in steps)
    # No step is left, yet the last validation is, and what comes after.
    assert steps[-1].eta_s > 100.0
    assert told[-1].eta_s == 100.0
    events.clear()
    train(project, recipe, on_event=events.append, step_seconds=1e9)
    assert not [event for event in events if isinstance(event, StepEvent)]


def test_the_time_left_follows_the_pace_of_the_last_epochs_and_counts_what_comes_after() -> None:
    now = time.monotonic()
    # Ten epochs of a second each, then five of ten seconds, as if a stream had begun meanwhile.
    slower = Progress(epoch=15, learnt=[1.0] * 10 + [10.0] * 5)
    assert slower.eta(20, 1) == 50.0
    held_up = Progress(epoch=5, learnt=[2.0, 2.0, 90.0, 2.0, 2.0])
    assert held_up.eta(10, 1) == 10.0
    first = Progress(epoch=0, epoch_began=now - 10)
    assert first.eta(4, 1, part=0.5) == pytest.approx(70, rel=0.2)
    # Validations of 3 s after epochs 6, 8, 10, and two as long for the look-aheads.
    checked = Progress(epoch=5, learnt=[1.0] * 5, checked=[3.0] * 3, after=2.0)
    assert checked.eta(10, 2) == 5 * 1.0 + 3 * 3.0 + 2 * 3.0
    checked.epoch = 10
    assert checked.eta(10, 2) == 6.0
    checked.after_s = 40.0  # an earlier training knows
    assert checked.eta(10, 2) == 40.0
