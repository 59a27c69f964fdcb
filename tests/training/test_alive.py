"""Bodies from training to export: drawn by chance, a plain face, and nothing new for faces alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from studio.inference.offline import load_predictor
from studio.model._network import SamplingOptions
from studio.project import Project, Run
from studio.training.checkpoint import BEST
from studio.training.loop.train import train
from studio.training.recipe import load_recipe
from studio.training.run_file import pack_run, unpack_run
from tests.tolerance import LAST_BITS, same_weights

MakeProject = Callable[..., Project]
SMALL = ("units=8", "steps=2", "epochs=1")


def trained(project: Project, *overrides: str, recipe: str = "balanced") -> Run:
    chosen = load_recipe(recipe).with_overrides([*overrides, *SMALL])
    return train(project, chosen, on_event=lambda event: None)


def speech() -> np.ndarray:
    return np.random.default_rng(0).normal(0, 0.1, 32_000).astype(np.float32)


@pytest.mark.parametrize("recipe", ["balanced", "best"])
def test_a_run_draws_its_bodies_by_seed_and_liveliness(make_toy_project: MakeProject, recipe: str) -> None:
    run = trained(make_toy_project(("train", "val")), recipe=recipe)
    assert run.report is not None
    assert run.report.draws is True
    predictor = load_predictor(run.folder)
    first, again, other, still = (
        predictor.generate_samples(speech(), sampling=sampling)
        for sampling in (SamplingOptions(1), SamplingOptions(1), SamplingOptions(2), SamplingOptions(2, 0.0))
    )
    np.testing.assert_allclose(first.rotations, again.rotations, atol=LAST_BITS)
    assert np.abs(first.rotations - other.rotations).max() > 1e-3
    assert np.abs(still.rotations - other.rotations).max() > 1e-3
    np.testing.assert_allclose(first.shapes, still.shapes, atol=1e-6)


def test_a_run_file_carries_the_head(make_toy_project: MakeProject, tmp_path: Path) -> None:
    run = trained(make_toy_project(("train", "val")))
    file = tmp_path / "alive.saiarun"
    pack_run(run, file)
    elsewhere = Project.create(tmp_path / "another computer")
    again = unpack_run(file, elsewhere)
    here, there = (
        load_predictor(one.folder).generate_samples(speech(), sampling=SamplingOptions(3))
        for one in (run, again)
    )
    np.testing.assert_allclose(here.rotations, there.rotations, atol=LAST_BITS)


def test_faces_alone_are_learnt_as_with_a_plain_body(make_toy_project: MakeProject) -> None:
    project = make_toy_project(("train", "val"), bones=False)
    alive, plain = trained(project), trained(project, "network.body=plain")
    assert alive.report is not None
    assert alive.report.draws is False
    assert same_weights(alive.folder / BEST, plain.folder / BEST)


def test_takes_without_bodies_are_learnt_beside_those_with(make_toy_project: MakeProject) -> None:
    from studio.dataset import edits
    from studio.take.motion_file import read_motion
    from studio.take.take import TakeInfo

    project = make_toy_project(("train", "val"))
    other = make_toy_project(("train",), bones=False, name="Face")
    source = other.takes[0]
    assert source.motion_path is not None
    project.add_take("Only_face", TakeInfo("x"), read_motion(source.motion_path), source.audio_path)
    project.edit("Split", edits.set_split(project.dataset, ["Only_face"], "train"))
    run = trained(project)
    made = load_predictor(run.folder).generate_samples(speech(), sampling=SamplingOptions(1))
    assert np.isfinite(made.rotations).all()
    assert np.isfinite(run.epochs()[-1]["train_loss"])
