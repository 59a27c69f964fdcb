"""Weights on disk: whole, never executed, damage told in a sentence."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from studio.errors import StudioError
from studio.features.motion import fit
from studio.motion import Motion
from studio.training import checkpoint
from studio.training.checkpoint import Model, TrainingState
from studio.training.recipe import load_recipe
from studio.training.styles import FittedStyle
from tests.inference.live.test_steps import untrained


def small_model() -> Model:
    t = np.arange(60) / 30
    layout = fit([Motion.build(t, ("A", "口"), np.stack([np.sin(t) ** 2, np.cos(t) ** 2], axis=1))])
    recipe = load_recipe("balanced").with_overrides(["units=8"])
    network = checkpoint.build_network(recipe, layout, Fraction(30))
    return Model(network.eval(), recipe, layout, Fraction(30), 7)


def header(path: Path) -> dict[str, Any]:
    with safe_open(str(path), framework="pt") as file:
        return json.loads(file.metadata()["saia"])


def rewrite(path: Path, facts: dict[str, Any]) -> None:
    with safe_open(str(path), framework="pt") as file:
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    save_file(tensors, str(path), metadata={"saia": json.dumps(facts)})


def test_a_model_comes_back_as_it_was(tmp_path: Path) -> None:
    made, path = small_model(), tmp_path / "best.safetensors"
    checkpoint.save_model(path, made)
    again = checkpoint.load_model(path)
    assert again.recipe == made.recipe
    assert again.epoch == 7
    assert again.layout.shape_names == ("A", "口")
    for name, tensor in made.network.state_dict().items():
        torch.testing.assert_close(again.network.state_dict()[name], tensor, rtol=0, atol=0)


def test_styles_that_were_shown_come_back_and_a_file_of_before_has_none(tmp_path: Path) -> None:
    made, path = small_model(), tmp_path / "best.safetensors"
    shown = FittedStyle("静か", np.array([0.3, 1.0]), np.array([0.1, -0.2]))
    checkpoint.save_model(path, replace(made, fitted=(shown,)))
    again = checkpoint.load_model(path)
    assert again.style_names == ("average", "静か")
    assert checkpoint.fitted_names(path) == ("静か",)
    styled, number = again.in_style(1)
    assert number == 0
    natural = made.layout.natural(np.array([[0.5, 0.5]]) * shown.gain + shown.shift)
    np.testing.assert_allclose(styled.layout.natural(np.array([[0.5, 0.5]])), natural)
    rewrite(path, {name: fact for name, fact in header(path).items() if name != "fitted"})
    assert checkpoint.load_model(path).style_names == checkpoint.fitted_names(path) == ()


@pytest.mark.parametrize(
    "style",
    [
        {"name": "a", "gain": [1.0], "shift": [0.0]},
        {"name": "a", "gain": [1.0, 1e9], "shift": [0.0, 0.0]},
        {"name": "a", "gain": [1.0, float("nan")], "shift": [0.0, 0.0]},
        {"name": "a", "gain": [1.0, 1.0], "shift": [0.0, float("inf")]},
        {"name": "a", "gain": "loud", "shift": [0.0, 0.0]},
        {"gain": [1.0, 1.0], "shift": [0.0, 0.0]},
        "calm",
    ],
)
def test_a_style_that_nobody_can_have_shown_is_damage(tmp_path: Path, style: object) -> None:
    path = tmp_path / "Run_001" / "best.safetensors"
    checkpoint.save_model(path, small_model())
    rewrite(path, header(path) | {"fitted": [style]})
    with pytest.raises(StudioError, match=r"best\.safetensors of the run Run_001 is damaged"):
        checkpoint.load_model(path)


def test_best_weights_do_not_follow_the_live_ones(tmp_path: Path) -> None:
    """SAIA's notebook kept a reference to the weights as "best", which therefore were the last."""
    made, path = small_model(), tmp_path / "best.safetensors"
    before = {name: tensor.clone() for name, tensor in made.network.state_dict().items()}
    checkpoint.save_model(path, made)
    with torch.no_grad():
        for parameter in made.network.parameters():
            parameter.add_(1.0)
    kept = checkpoint.load_model(path).network.state_dict()
    for name, tensor in before.items():
        torch.testing.assert_close(kept[name], tensor, rtol=0, atol=0)


@pytest.mark.parametrize("length", [0, 7, 100, 4000])
def test_a_file_cut_short_is_a_sentence(tmp_path: Path, length: int) -> None:
    path = tmp_path / "Run_001" / "best.safetensors"
    checkpoint.save_model(path, small_model())
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(StudioError) as caught:
        checkpoint.load_model(path)
    assert str(caught.value) == (
        "best.safetensors of the run Run_001 is damaged. Train again, or restore it from a backup."
    )


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1e30])
def test_weights_that_nobody_can_have_learnt_are_damage(tmp_path: Path, value: float) -> None:
    """They would become motion without end, and figures that no metric can be computed of."""
    path = tmp_path / "Run_001" / "best.safetensors"
    made = small_model()
    next(made.network.parameters()).detach().view(-1)[3] = value
    checkpoint.save_model(path, made)
    with pytest.raises(StudioError, match=r"best\.safetensors of the run Run_001 is damaged"):
        checkpoint.load_model(path)


def test_a_pickle_is_not_opened(tmp_path: Path) -> None:
    touched = tmp_path / "touched"

    class Hostile:
        def __reduce__(self) -> tuple[Any, ...]:
            return (Path.touch, (touched,))

    path = tmp_path / "best.safetensors"
    path.write_bytes(pickle.dumps(Hostile()))
    with pytest.raises(StudioError):
        checkpoint.load_model(path)
    assert not touched.exists()


@pytest.mark.parametrize(("overrides", "version"), [((), 4), (("network.body=flow",), 3)])
def test_a_body_that_plays_takes_is_newer_to_older_programs(
    tmp_path: Path, overrides: tuple[str, ...], version: int
) -> None:
    path = tmp_path / "best.safetensors"
    checkpoint.save_model(path, untrained("balanced", "30", *overrides))
    assert header(path)["version"] == version


def test_a_newer_file_says_so(tmp_path: Path) -> None:
    path = tmp_path / "Run_001" / "best.safetensors"
    checkpoint.save_model(path, small_model())
    rewrite(path, header(path) | {"version": 5})
    with pytest.raises(StudioError) as caught:
        checkpoint.load_model(path)
    assert str(caught.value) == (
        "best.safetensors in Run_001 was written by a newer Saia Studio. Update Saia Studio to open it."
    )


@pytest.mark.parametrize(
    "change",
    [
        {"recipe": {"name": "x", "model": "../../os"}},
        {"recipe": {"name": "x", "network": {"units": 10**9}}},
        {"recipe": {"name": "x", "network": {"units": "many"}}},
        {"layout": {}},
        {"layout": None},
        {"fps": [30, 0]},
        {"fps": "fast"},
        {"fps": [float("inf"), 1]},
        {"recipe": [1]},
        {"epoch": "last"},
        {"epoch": float("inf")},
    ],
)
def test_hostile_headers_are_refused(tmp_path: Path, change: dict[str, Any]) -> None:
    path = tmp_path / "best.safetensors"
    checkpoint.save_model(path, small_model())
    rewrite(path, header(path) | change)
    with pytest.raises(StudioError):
        checkpoint.load_model(path)


def test_where_a_training_stands_comes_back(tmp_path: Path) -> None:
    network = torch.nn.Linear(3, 2)
    optimiser = torch.optim.AdamW(network.parameters())
    network(torch.ones(4, 3)).sum().backward()
    optimiser.step()
    state = TrainingState(
        network.state_dict(), checkpoint.optimiser_tensors(optimiser), {"weight": torch.ones(2)}, {"epoch": 3}
    )
    checkpoint.save_state(tmp_path / "last.safetensors", state)
    again = checkpoint.load_state(tmp_path / "last.safetensors")
    assert again.facts["epoch"] == 3
    other = torch.optim.AdamW(network.parameters())
    checkpoint.restore_optimiser(other, again.optimiser)
    for index, values in optimiser.state_dict()["state"].items():
        for name, value in values.items():
            torch.testing.assert_close(other.state_dict()["state"][index][name], value)


def test_a_run_without_weights_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as caught:
        checkpoint.load_model(tmp_path / "Run_001" / "best.safetensors")
    assert str(caught.value) == (
        "The run Run_001 has no best.safetensors yet. Train it, or choose another run."
    )


def test_a_file_from_before_styles_still_opens(tmp_path: Path) -> None:
    path = tmp_path / "best.safetensors"
    checkpoint.save_model(path, small_model())
    facts = header(path) | {"version": 1}
    del facts["styles"], facts["style"]
    for section, key in (("training", "style_by"), ("training", "style_dropout"), ("loss", "balance")):
        del facts["recipe"][section][key]
    del facts["recipe"]["network"]["style_width"]
    rewrite(path, facts)
    assert checkpoint.load_model(path).styles == ()


OLD_NAMES = {
    "encoder.project.": "ear.widen.",
    "encoder.": "ear.",
    "self_qkv.": "look.",
    "self_out.": "looked.",
    "cross_q.": "ask.",
    "cross_kv.": "sound.",
    "cross_out.": "listened.",
    "ffn_in.": "widen.",
    "ffn_out.": "narrow.",
}
"""What FaceFormer's weights are called today, and were called up to version 2 of the file."""


def old_name(name: str) -> str:
    for new, old in OLD_NAMES.items():
        name = name.replace(new, old)
    return name


def test_weights_with_the_names_of_version_2_still_open(tmp_path: Path) -> None:
    one = small_model()
    recipe = load_recipe("faceformer").with_overrides(["width=16", "hearing=2"])
    network = checkpoint.build_network(recipe, one.layout, one.fps, 1)
    weights = network.state_dict()
    old = {old_name(name): tensor for name, tensor in weights.items()}
    assert {"ear.widen.bias", "layers.0.look.weight", "layers.0.narrow.bias"} <= old.keys()
    best, last = tmp_path / "best.safetensors", tmp_path / "last.safetensors"
    checkpoint.save_model(best, Model(network, recipe, one.layout, one.fps, 3, ("a",)), old)
    rewrite(best, header(best) | {"version": 2})
    checkpoint.save_state(last, TrainingState(old, {"3.exp_avg": torch.ones(2)}, old, {"epoch": 3}))
    rewrite(last, header(last) | {"version": 2})
    state = checkpoint.load_state(last)
    for found in (checkpoint.load_model(best).network.state_dict(), state.network, state.average):
        assert found.keys() == weights.keys()
        for name, tensor in weights.items():
            torch.testing.assert_close(found[name], tensor, rtol=0, atol=0)
    assert state.optimiser.keys() == {"3.exp_avg"}


def test_styles_come_back_with_the_model(tmp_path: Path) -> None:
    made, path = small_model(), tmp_path / "best.safetensors"
    network = checkpoint.build_network(made.recipe, made.layout, made.fps, 2)
    checkpoint.save_model(path, replace(made, network=network, styles=("Ann", "口"), style="口"))
    again = checkpoint.load_model(path)
    assert (again.styles, again.style) == (("Ann", "口"), "口")
    rewrite(path, header(path) | {"style": "Ben"})
    with pytest.raises(StudioError):
        checkpoint.load_model(path)
