"""A run is shown how to move by some seconds of a take, and moves like them from then on."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.dataset import edits
from studio.errors import RequestError
from studio.features.examples import Example, make_example
from studio.inference.offline import load_predictor
from studio.motion.grid import Grid
from studio.project import Project, Run
from studio.take import TakeInfo
from studio.take.motion_file import read_motion
from studio.training import checkpoint
from studio.training.checkpoint import BEST, Model
from studio.training.fit_style import fit, forget_style, show_style
from studio.training.loop.train import resumed_recipe, train
from studio.training.loop.validation import drawn
from studio.training.recipe import load_recipe
from studio.training.run_file import pack_run, unpack_run
from tests.inference.live.test_steps import speech, untrained
from tests.tolerance import LAST_BITS

MakeProject = Callable[..., Project]
TINY = ["units=8", "epochs=1", "steps=3", "crops=2", "crop_frames=30"]


def with_calm_take(project: Project) -> Project:
    """A take more, nobody learns from, in which the jaw opens a third as far."""
    template = project.take("Toy_002")
    assert template.motion_path is not None
    motion = read_motion(template.motion_path)
    shapes = motion.shapes.copy()
    shapes[:, 0] /= 3
    take = project.add_take("Calm_001", template.info, replace(motion, shapes=shapes), template.audio_path)
    project.edit("Split", edits.set_split(project.dataset, [take.id], ""))
    return project


@pytest.fixture
def project(make_toy_project: MakeProject) -> Project:
    return with_calm_take(make_toy_project(("train", "train", "val"), seconds=6.0, bones=False))


@pytest.fixture
def run(project: Project) -> Run:
    return train(project, load_recipe("quick").with_overrides(TINY), on_event=lambda event: None)


@pytest.mark.slow
def test_a_run_moves_as_a_stretch_of_another_take_does(make_toy_project: MakeProject) -> None:
    project = with_calm_take(make_toy_project(("train", "train", "val"), seconds=12.0, bones=False))
    recipe = load_recipe("balanced").with_overrides(
        ["units=32", "members=1", "epochs=20", "steps=20", "crops=4", "crop_frames=90"]
    )
    run = train(project, recipe, on_event=lambda event: None)
    assert show_style(project, run, "Calm_001", (1.0, 11.0), "calm") == "calm"
    predictor = load_predictor(run.folder)
    sound = project.take("Toy_003").audio_path
    assert sound is not None
    average, calm = (predictor.generate(sound, style=name).shapes for name in ("average", "calm"))
    assert calm[:, 0].std() < 0.6 * average[:, 0].std()
    np.testing.assert_allclose(calm[:, 1:].std(axis=0), average[:, 1:].std(axis=0), rtol=0.3)


def stretch(model: Model, gain: float, shift: float, seconds: float, gap: float = 0.0) -> Example:
    """A take that moves as a model does but for a gain and a shift; `gap` at its end was not captured."""
    sound, frames = speech(seconds), round(seconds * float(model.fps))
    blank = model.layout.motion(np.zeros((frames, model.layout.width)), np.arange(frames) / float(model.fps))
    valid = np.ones(frames, dtype=np.float32)
    example = make_example("T", sound, Grid(blank, valid), model.layout, model.recipe.sound, model.fps, None)
    # As one that was read from a file.
    model.network.requires_grad_(False)
    values = gain * drawn(model.network, example) + shift
    missing = round(gap * float(model.fps))
    valid[frames - missing :], values[frames - missing :] = 0, 100.0
    return replace(example, values=values.astype(np.float32))


def test_the_longer_the_stretch_the_more_it_counts() -> None:
    model = untrained("balanced")
    faces = len(model.layout.learnt_shapes)
    found = [fit("calm", model, stretch(model, 0.4, 0.3, seconds)) for seconds in (4.0, 40.0)]
    shorter, longer = (one.gain[:faces] for one in found)
    assert (np.abs(longer - 0.4) < 0.1).all()
    assert ((longer > 0.4) & (longer < shorter) & (shorter < 1)).all()
    with_gap = fit("calm", model, stretch(model, 0.4, 0.3, 41.0, gap=1.0))
    np.testing.assert_allclose(with_gap.gain[:faces], longer, atol=0.02)


def test_columns_that_a_take_lacks_stay_as_they_were() -> None:
    model = untrained("balanced")
    example = stretch(model, 0.4, 0.3, 5.0)
    faces = len(model.layout.learnt_shapes)
    mask = np.where(np.arange(model.layout.width) < faces, 1, 0).astype(np.float32)
    found = fit("face", model, replace(example, mask=mask))
    np.testing.assert_allclose(found.gain[faces:], 1)
    np.testing.assert_allclose(found.shift[faces:], 0, atol=LAST_BITS)
    assert (found.gain[:faces] < 1).all()


def test_a_body_is_given_how_far_it_moved_and_is_never_frozen() -> None:
    model = untrained("balanced")
    example = stretch(model, 1.0, 0.0, 20.0)
    # As far as predicted, at other moments: of what errs least nothing would be left.
    values = example.values.copy()
    values[10:] = values[:9:-1]
    found = fit("body", model, replace(example, values=values))
    faces = len(model.layout.learnt_shapes)
    np.testing.assert_allclose(found.gain[faces:], 1, atol=0.15)


def test_a_run_of_one_take_can_be_shown_a_style(make_toy_project: MakeProject) -> None:
    project = make_toy_project(("train", "val"), seconds=6.0, bones=False)
    run = train(project, load_recipe("quick").with_overrides(TINY), on_event=lambda event: None)
    assert load_predictor(run.folder).styles == ()
    assert show_style(project, run, "Toy_002", (0.0, 5.0)) == "like Toy_002"
    assert show_style(project, run, "Toy_002", (1.0, 6.0)) == "like Toy_002 2"
    assert load_predictor(run.folder).styles == ("average", "like Toy_002", "like Toy_002 2")


def test_a_style_goes_with_its_run_into_a_file_and_is_forgotten(
    project: Project, run: Run, make_toy_project: MakeProject, tmp_path: Path
) -> None:
    show_style(project, run, "Calm_001", (0.0, 6.0), "静か")
    other = make_toy_project(("train",), name="Other", seconds=4.0)
    there = unpack_run(pack_run(project.run(run.id), tmp_path / "a.saiarun"), other, checkpoint.load_model)
    names = ("Toy_001", "Toy_002", "静か")
    assert there.facts.styles == names
    sound = project.take("Toy_003").audio_path
    assert sound is not None
    here, moved = (load_predictor(one.folder).generate(sound, style="静か") for one in (run, there))
    np.testing.assert_allclose(moved.shapes, here.shapes, atol=LAST_BITS)
    forget_style(there, "静か")
    assert Run.load(there.folder).facts.styles == names[:2] == load_predictor(there.folder).styles[1:]
    with pytest.raises(RequestError) as caught:
        forget_style(there, "Toy_001")
    assert str(caught.value) == f"{there.id} was shown no style called Toy_001. It was shown: none."


def test_a_resumed_run_lists_the_styles_that_it_knows(project: Project) -> None:
    asked = 0

    def in_the_second_epoch() -> bool:
        nonlocal asked
        asked += 1
        return asked == 5

    recipe = load_recipe("quick").with_overrides([*TINY, "epochs=3"])
    half = train(project, recipe, on_event=lambda event: None, stop=in_the_second_epoch)
    show_style(project, half, "Calm_001", (0.0, 6.0), "calm")
    again = train(project, resumed_recipe(half), on_event=lambda event: None, resume=project.run(half.id))
    # Better weights come without it: it was fitted to those before.
    assert again.facts.styles == load_predictor(again.folder).styles[1:]
    assert again.facts.styles[:2] == ("Toy_001", "Toy_002")


def test_a_run_that_is_being_trained_refuses(project: Project, run: Run) -> None:
    replace(run.facts, status="running", pid=os.getpid(), host=platform.node()).save(run.folder)
    with pytest.raises(RequestError) as caught:
        show_style(project, project.run(run.id), "Calm_001", (0.0, 6.0))
    assert str(caught.value) == f"{run.id} is being trained. Wait until it is done, or stop it."


@pytest.mark.parametrize(
    ("take", "span", "name", "sentence"),
    [
        ("Calm_001", (4.0, 2.0), "", "From 4 s to 2 s is no stretch of a take. Let it begin at 0 s or later, "
         "and end after it begins."),
        ("Calm_001", (4.0, 9.0), "", "That stretch of Calm_001 is 2.0 s long, too short to show how it "
         "moves. Choose at least 3 s; ten do better."),
        ("Calm_001", (0.0, 6.0), "Toy_001", "{run} has a style called Toy_001 already. Choose another name."),
        ("Calm_001", (0.0, 6.0), "a\tb", "A style cannot be called that. Choose up to 60 plain letters."),
        ("Silent_001", (0.0, 6.0), "", "There is no sound in Silent_001 between 0 s and 6 s. "
         "Choose a stretch in which somebody speaks."),
        ("Voice_001", (0.0, 6.0), "", "There are less than 3 s of captured motion in Voice_001 between 0 s "
         "and 6 s. Choose a stretch in which the performer was captured."),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_said(
    project: Project, run: Run, take: str, span: tuple[float, float], name: str, sentence: str
) -> None:
    template = project.take("Toy_001")
    assert template.motion_path is not None
    project.add_take("Silent_001", TakeInfo("Silent"), read_motion(template.motion_path), None)
    project.add_take("Voice_001", TakeInfo("Voice"), None, template.audio_path)
    before = (run.folder / BEST).read_bytes()
    with pytest.raises(RequestError) as caught:
        show_style(project, run, take, span, name)
    assert str(caught.value) == sentence.format(run=run.id)
    assert (run.folder / BEST).read_bytes() == before
