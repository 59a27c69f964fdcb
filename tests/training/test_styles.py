"""Which takes share a style, which style is the default, and that a learnt style does what it should."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.dataset import edits
from studio.dataset.dataset import Selection
from studio.errors import RequestError
from studio.inference.offline import load_predictor
from studio.project import Project
from studio.take.motion_file import read_motion
from studio.training.loop.train import resumed_recipe, train
from studio.training.recipe import load_recipe
from studio.training.styles import RunSelection, index_of, styles_of
from tests.tolerance import LAST_BITS

MakeProject = Callable[..., Project]


def selections(*performers: str) -> list[Selection]:
    return [Selection(f"T{i}", f"T{i}", performer=name) for i, name in enumerate(performers)]


def test_a_take_is_a_style_unless_performers_have_several_each() -> None:
    assert styles_of(selections("", ""), "auto") == ("T0", "T1")
    assert styles_of(selections("Ann", "Ann"), "auto") == ("T0", "T1")
    assert styles_of(selections("Ann", "Ben", "Ben"), "auto") == ("T0", "T1", "T2")
    assert styles_of(selections("Ann", "Ben", "Ann", "", "Ben"), "auto") == ("Ann", "Ben", "Ann", "", "Ben")


def test_styles_can_be_asked_for_and_one_alone_is_none() -> None:
    assert styles_of(selections("Ann", "Ben"), "performer") == ("Ann", "Ben")
    assert styles_of(selections("Ann", "Ben"), "none") == ("", "")
    assert styles_of(selections("Ann", "Ann"), "performer") == ("", "")
    assert styles_of(selections(""), "take") == ("",)


def test_an_unknown_style_is_a_sentence() -> None:
    assert index_of(None, ("a", "b"), "b", "Run_1") == 2
    assert index_of("average", ("a", "b"), "b", "Run_1") == 0
    with pytest.raises(RequestError) as caught:
        index_of("c", ("a", "b"), "", "Run_1")
    assert str(caught.value) == "Run_1 knows no style called c. Choose one of: average, a, b."
    with pytest.raises(RequestError) as caught:
        index_of("c", (), "", "Run_1")
    assert str(caught.value) == (
        "Run_1 knows no style called c. It was trained without styles; leave --style out."
    )


def test_files_of_two_mixes_have_names_of_their_own() -> None:
    a, b = (RunSelection("quick_001", mix=(("average", x), ("Ann", 1 - x))) for x in (0.5, 0.25))
    assert (a.name, b.name) == ("quick_001_mix_average-50_Ann-50", "quick_001_mix_average-25_Ann-75")
    assert a.title == b.title


def two_styles(make_toy_project: MakeProject) -> Project:
    """Takes of the same kind of sound, in one of which the jaw opens a third as far."""
    project = make_toy_project(("train", "train", "val"), seconds=12.0, bones=False)
    template = project.take("Toy_002")
    assert template.motion_path is not None
    motion = read_motion(template.motion_path)
    shapes = motion.shapes.copy()
    shapes[:, 0] /= 3
    calm = replace(motion, shapes=shapes)
    take = project.add_take("Calm_001", template.info, calm, template.audio_path)
    changed = edits.set_split(project.dataset, [take.id], "train")
    project.edit("Split", edits.set_split(changed, ["Toy_002"], ""))
    return project


@pytest.mark.slow
def test_a_style_moves_as_its_take_did_and_the_average_is_the_default(
    make_toy_project: MakeProject,
) -> None:
    project = two_styles(make_toy_project)
    recipe = load_recipe("balanced").with_overrides(
        ["units=32", "members=1", "epochs=20", "steps=20", "crops=4", "crop_frames=90"]
    )
    run = train(project, recipe, on_event=lambda event: None)
    predictor = load_predictor(run.folder)
    assert predictor.styles == ("average", "Toy_001", "Calm_001")
    assert predictor.style == "average"  # although the validation take moves as Toy_001 does
    assert run.report is not None
    assert run.report.style == "average"
    assert run.report.styles == ("Toy_001", "Calm_001")
    sound = project.take("Toy_003").audio_path
    assert sound is not None
    wide = {
        style: float(predictor.generate(sound, style=style).shapes[:, 0].std())
        for style in ("Toy_001", "Calm_001")
    }
    assert wide["Calm_001"] < 0.6 * wide["Toy_001"]
    by_default, by_name = predictor.generate(sound), predictor.generate(sound, style="average")
    np.testing.assert_allclose(by_default.shapes, by_name.shapes, atol=LAST_BITS)


@pytest.mark.slow
def test_a_performer_of_the_face_and_one_of_the_body_learn_from_each_other(
    make_toy_project: MakeProject,
) -> None:
    project = make_toy_project(("train", "train", "val"), bones=False, seconds=12.0)
    body = make_toy_project(("train", "train", "val"), shapes=False, seconds=12.0, name="Body")
    bodies = []
    for number, take in enumerate(body.takes):
        assert take.motion_path is not None
        motion = read_motion(take.motion_path)
        bodies.append(project.add_take(f"Body_{number}", take.info, motion, take.audio_path).id)
    dataset = edits.set_performer(project.dataset, ["Toy_001", "Toy_002"], "Ann")
    dataset = edits.set_performer(dataset, bodies[:2], "Ben")
    dataset = edits.set_split(edits.set_split(dataset, bodies[:2], "train"), bodies[2:], "val")
    project.edit("Split", dataset)
    recipe = load_recipe("balanced").with_overrides(
        ["units=32", "members=1", "epochs=6", "steps=20", "crops=4", "crop_frames=90"]
    )
    run = train(project, recipe, on_event=lambda event: None)
    assert run.report is not None
    assert run.report.performers == ("Ann", "Ben")
    predictor = load_predictor(run.folder)
    assert predictor.styles == ("average", "Ann", "Ben")
    sound = project.take(bodies[2]).audio_path
    assert sound is not None
    nods = motion.rotations[:, motion.bone_names.index("Head"), 0]
    for style in predictor.styles:  # Ann's body does what Ben's taught, Ben's face what Ann's did
        made = predictor.generate(sound, style=style).at(motion.times)
        nod = made.rotations[:, made.bone_names.index("Head"), 0]
        assert np.corrcoef(nod, nods)[0, 1] > 0.6
        assert np.corrcoef(made.shapes[:, 0], nods)[0, 1] > 0.6


def test_a_resumed_run_keeps_the_styles_it_began_with(make_toy_project: MakeProject) -> None:
    project = make_toy_project(("train", "train", "val", "val"))
    recipe = load_recipe("balanced").with_overrides(
        ["units=8", "epochs=2", "steps=3", "crops=2", "crop_frames=30"]
    )
    asked = 0

    def in_the_second_epoch() -> bool:
        nonlocal asked
        asked += 1
        return asked == 4

    half = train(project, recipe, on_event=lambda event: None, stop=in_the_second_epoch)
    project.edit("Split", edits.set_split(project.dataset, ["Toy_004"], "train"))
    again = train(project, resumed_recipe(half), on_event=lambda event: None, resume=half)
    assert again.report is not None
    assert again.report.styles == ("Toy_001", "Toy_002")
    assert load_predictor(Path(again.folder)).styles == ("average", "Toy_001", "Toy_002")
