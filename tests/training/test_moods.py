"""Moods: what a label changes on purpose is there where it is asked for, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.cli import main
from studio.dataset import Label, Selection, edits
from studio.errors import RequestError
from studio.inference.live.steps import LiveSteps, look_ahead_of
from studio.inference.offline import Predictor, load_predictor
from studio.motion.moods import MoodSpan, learnable, weights_at
from studio.project import Run
from studio.take.motion_file import read_motion
from studio.training.gather import moods_of
from studio.training.loop.train import resumed_recipe
from studio.training.styles import run_choice
from tests import toys
from tests.inference.live.test_steps import speech
from tests.tolerance import same_weights
from tests.training.loop.test_train import tiny, trained

HAPPY = (1.5, 4.5)
MIDDLE = slice(66, 84)
"""Frames well within a mood from 2 to 3 s, at 30 frames a second."""


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of takes whose smile is raised where they are labelled happy, and whose sound does not say so."""
    project = toys.make(tmp_path_factory.mktemp("taught") / "Toy", happy=HAPPY)
    recipe = tiny("epochs=10", "steps=25", "crops=6", "members=1", "style_by=take", "units=64")
    return trained(project, recipe)[0]


@pytest.fixture(scope="module")
def predictor(taught: Run) -> Predictor:
    return load_predictor(taught.folder)


def joy(predictor: Predictor, *moods: MoodSpan, **options: object) -> np.ndarray:
    motion = predictor.generate_samples(speech(5.0), moods=moods, **options)  # type: ignore[arg-type]
    return motion.shapes[:, motion.shape_names.index("Joy")]


def test_a_mood_is_there_where_it_is_asked_for_and_not_elsewhere(predictor: Predictor, taught: Run) -> None:
    assert predictor.moods == run_choice(taught).moods == ("happy",)
    neutral, happy = joy(predictor), joy(predictor, MoodSpan("happy"))
    assert neutral[30:].mean() < 0.35  # captured: 0.1
    assert happy[30:].mean() > 0.5  # captured: 0.7
    between = joy(predictor, MoodSpan("happy", 2.0, 3.0))
    assert between[MIDDLE].mean() > 0.5
    assert between[:50] == pytest.approx(neutral[:50], abs=1e-6)
    assert between[120:].mean() < 0.35
    half = joy(predictor, MoodSpan("happy", strength=0.5))
    assert neutral[30:].mean() + 0.05 < half[30:].mean() < happy[30:].mean() - 0.05


@pytest.mark.parametrize("style", [None, [("average", 0.5), ("Toy_001", 0.5)]])
def test_pieces_make_no_difference_to_moods_and_mixes(predictor: Predictor, style: object) -> None:
    moods = [MoodSpan("happy", 1.0, 2.2)]
    options = {"style": style, "moods": moods}
    pieces = predictor.stream([speech(4.0)], piece_seconds=0.7, **options)  # type: ignore[arg-type]
    whole = predictor.generate_samples(speech(4.0), **options)  # type: ignore[arg-type]
    assert np.concatenate([p.shapes for p in pieces]) == pytest.approx(whole.shapes, abs=2e-4)


def test_a_mix_lies_between_its_styles(predictor: Predictor) -> None:
    a, b = joy(predictor, style="Toy_001"), joy(predictor, style="Toy_002")
    assert joy(predictor, style=[("Toy_001", 2.0), ("Toy_002", 0.0)]) == pytest.approx(a, abs=1e-5)
    mixed = joy(predictor, style=[("Toy_001", 1.0), ("Toy_002", 1.0)])
    assert np.abs(mixed - (a + b) / 2).mean() < np.abs(a - b).mean() + 1e-3
    with pytest.raises(RequestError, match="There is nothing of any style in this mix"):
        joy(predictor, style=[("Toy_001", 0.0)])


def test_live_plays_a_mood_as_a_file_does(taught: Run) -> None:
    # Of its own: a look-ahead that is chosen stays with the network.
    predictor, sound = load_predictor(taught.folder), speech(3.0)
    model = predictor.model
    steps = LiveSteps(model, look_ahead_of(model))
    steps.set_mood(np.ones(1, np.float32), at_once=True)
    live = np.concatenate([v for part in np.array_split(sound, 60) for _, v in steps.feed(part)])
    assert look_ahead_of(model).exact
    whole = predictor.generate_samples(sound, moods=[MoodSpan("happy")])
    made = model.layout.motion(live, np.arange(len(live)) / 30)
    assert made.shapes == pytest.approx(whole.shapes[: len(live)], abs=1e-3)
    # Pressed in the midst of it, a mood fades in: at once none of it, after the fade all.
    steps = LiveSteps(model, look_ahead_of(model))
    before = [v for _, v in steps.feed(sound[:16_000])]
    steps.set_mood(np.ones(1, np.float32))
    after = np.concatenate([v for _, v in steps.feed(sound[16_000:])])
    column = list(model.layout.shape_names).index("Joy")
    smile = model.layout.motion(after, np.arange(len(after)) / 30).shapes[:, column]
    assert before
    assert smile[0] < 0.35 < smile[20:].mean()


def test_a_mood_that_is_not_known_is_refused(predictor: Predictor) -> None:
    with pytest.raises(RequestError) as caught:
        joy(predictor, MoodSpan("sad"))
    assert str(caught.value).endswith("knows no mood called sad. Choose one of: happy.")


def test_takes_without_labels_train_exactly_as_before(tmp_path: Path) -> None:
    project = toys.make(tmp_path / "Toy", happy=(1.0, 2.2))  # of two takes: 2.4 s, too little to be learnt
    few, _ = trained(project, tiny("epochs=1"))
    for selection in project.dataset.selections:
        for label in selection.labels:
            project.edit("Clear", edits.remove_label(project.dataset, selection.id, label))
    none, _ = trained(project, tiny("epochs=1"))
    assert load_predictor(few.folder).moods == ()
    for name in ("best.safetensors", "last.safetensors"):
        assert same_weights(few.folder / name, none.folder / name)


def test_a_resumed_run_keeps_its_moods_whatever_the_labels_are_now(taught: Run, tmp_path: Path) -> None:
    project = toys.copied(taught.folder.parent.parent, tmp_path)
    for selection in project.dataset.selections:
        for label in selection.labels:
            project.edit("Clear", edits.remove_label(project.dataset, selection.id, label))
    run = project.run(taught.id)
    further = resumed_recipe(run).with_overrides(["epochs=11"])
    again, _ = trained(project, further, resume=run)
    assert load_predictor(again.folder).moods == run_choice(again).moods == ("happy",)


def test_what_is_written_on_the_command_line_comes_back() -> None:
    for text in ("happy", "happy*0.5", "happy:2.000-5.500", "so: what*1.5:0.000-3.250"):
        assert MoodSpan.read(text).text == text
    for span in (
        MoodSpan("happy", 2.0),
        MoodSpan("happy*2", 1.0, 3.0),
        MoodSpan("happy:1-2"),
        MoodSpan("sad", 0.0, 2.0, 0.00002),
        MoodSpan("a:1-*1", 1.5, strength=0.0),
    ):
        assert MoodSpan.read(span.text) == span, span.text
    for bad in ("", "happy:5-2"):
        with pytest.raises(RequestError, match="is no mood"):
            MoodSpan.read(bad)
    with pytest.raises(RequestError, match="is not possible"):
        MoodSpan.read("happy*9")


def test_two_moods_that_meet_are_one_together() -> None:
    times = np.linspace(0, 4, 81)
    spans = [MoodSpan("a", 0.0, 2.0), MoodSpan("b", 2.0, 4.5)]
    weights = weights_at(spans, ("a", "b"), times)
    assert weights.sum(axis=1) == pytest.approx(1.0)
    assert weights[40] == pytest.approx([0.5, 0.5])
    assert weights[0, 0] == 1.0


def test_labels_count_from_the_in_point_and_only_those_that_say_how_it_is_played() -> None:
    labels = (
        Label(2.0, 5.0, "emotion", "happy"),
        Label(2.0, 5.0, "sentence", "Good morning"),
        Label(3.0, 0.0, "energy", "high"),
        Label(2.0, 5.0, "prompt", "Tell me what you had for breakfast."),
    )
    spans = moods_of(Selection("a", "a", 3.0, 9.0, labels=labels, emotion="calm"), 20.0)
    assert spans == {"happy": [(0.0, 4.0)]}
    assert moods_of(Selection("a", "a", 3.0, 9.0, emotion="calm"), 20.0) == {"calm": [(0.0, 6.0)]}
    valid = np.ones(180)
    valid[60:] = 0
    assert learnable([(spans, valid, 30.0)]) == ()
    assert learnable([(spans, valid, 30.0), (spans, valid, 30.0)]) == ("happy",)


def test_the_command_line_makes_what_the_predictor_makes(
    predictor: Predictor, taught: Run, tmp_path: Path
) -> None:
    project = toys.copied(taught.folder.parent.parent, tmp_path)
    sound, out = tmp_path / "talk.wav", tmp_path / "talk.arrow"
    soundfile.write(sound, speech(4.0), 16_000, subtype="FLOAT")
    asked = ["--mood", "happy:1.0-3.0", "--mix", "average:1", "--mix", "Toy_001:1"]
    assert main(["generate", str(project.folder), taught.id, str(sound), *asked, "-o", str(out)]) == 0
    mix = [("average", 0.5), ("Toy_001", 0.5)]
    wanted = predictor.generate(sound, style=mix, moods=[MoodSpan("happy", 1.0, 3.0)])
    found = read_motion(out)
    columns = [found.shape_names.index(name) for name in wanted.shape_names]
    assert found.shapes[:, columns] == pytest.approx(wanted.shapes, abs=1e-5)
    unknown = ["generate", str(project.folder), taught.id, str(sound), "--mood", "sad"]
    assert main([*unknown, "-o", str(tmp_path / "no.arrow")]) != 0
