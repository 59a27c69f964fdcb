"""A run made ready to perform, and its switches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from studio.errors import RequestError
from studio.inference.live.audio_source import AudioBlock
from studio.inference.live.build import LiveOptions, make
from studio.project import Project
from tests.inference.live.runs import add_run

Toy = Callable[[], Project]


def test_idling_can_be_switched_on_while_it_performs(make_toy_project: Toy) -> None:
    live = make(add_run(make_toy_project()).folder, [], LiveOptions(gate=False))
    assert not live.is_on("gate")
    live.switch("gate", True)
    live.performance.sound.process(AudioBlock(np.zeros(16_000, np.float32), 16_000, 0.0, True))
    assert live.is_on("gate")
    assert not live.facts()["speaking"]


def test_the_gain_learns_nothing_from_silence_without_idling_either(
    make_toy_project: Callable[[], Project],
) -> None:
    live = make(add_run(make_toy_project()).folder, [], LiveOptions(gate=False))
    hiss = np.random.default_rng(1).normal(0.0, 1e-3, 30 * 16_000).astype(np.float32)
    for i, block in enumerate(np.split(hiss, 300)):
        live.performance.sound.process(AudioBlock(block, 16_000, 0.1 * i, i == 0))
    assert live.performance.facts.gain_db == 0.0


def test_a_tuning_tells_of_the_channels_it_leaves(make_toy_project: Toy) -> None:
    live = make(add_run(make_toy_project()).folder, [], LiveOptions())
    whole = live.channel_facts()
    live.tune('{"left_out": true, "moves": ["mouth"]}')
    less = live.channel_facts()
    assert set(less["shape_names"]) <= set(whole["shape_names"])
    assert len(less["bone_names"]) == len(less["positions"]) < len(whole["bone_names"])
    with pytest.raises(RequestError, match="The tuning was not understood"):
        live.tune("{")


def test_a_mood_changes_how_it_moves_and_how_it_rests(make_toy_project: Toy) -> None:
    live = make(add_run(make_toy_project(), moods=("happy", "sad")).folder, [], LiveOptions(mood="sad"))
    sad = live.performance.layers.rest.shapes
    assert (live.mood, live.ready_facts()["moods"], live.facts()["mood"]) == ("sad", ["happy", "sad"], "sad")
    live.set_mood("happy")
    happy = live.performance.layers.rest.shapes
    live.set_mood("")
    none = live.performance.layers.rest.shapes
    assert min(np.abs(sad - happy).max(), np.abs(happy - none).max(), np.abs(sad - none).max()) > 1e-3
    # What it rests in eases over: no jump while nobody speaks.
    first = live.performance.layers.pose(10.0, None, False).shapes
    later = live.performance.layers.pose(10.02, None, False).shapes
    assert np.abs(later - first).max() < np.abs(happy - none).max()
    with pytest.raises(RequestError, match="knows no mood called bored"):
        live.set_mood("bored")
