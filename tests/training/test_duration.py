"""How long a training takes here: what real trainings took is remembered, and used for the next."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from studio import cli
from studio.errors import Text
from studio.project import Project
from studio.settings import settings_folder
from studio.training.duration import FILE, Expected, Lengths, TrainingTime, TrainingTimes, kind_of
from studio.training.recipe import load_recipe, usual_recipe

TOY = ("units=8", "steps=2", "crops=2", "crop_frames=45", "epochs=2")


def test_a_training_is_remembered_and_the_next_of_its_kind_is_expected_to_take_as_long(
    make_toy_project: Callable[..., Project], capsys: pytest.CaptureFixture[str]
) -> None:
    (settings_folder() / FILE).unlink(missing_ok=True)
    project, recipe = make_toy_project(), load_recipe("quick").with_overrides(TOY)
    words = [word for change in TOY for word in ("--set", change)]
    assert cli.main(["train", str(project.folder), "--recipe", "quick", *words]) == 0
    times, report = TrainingTimes(settings_folder()), project.run("quick_001").facts
    found = times.expected(recipe)
    assert found.trainings == 1
    # The training itself with what came before and after it.
    assert found.seconds > (report.seconds or 0.0) > 0.0
    longer = times.expected(recipe.with_overrides(["epochs=22"])).seconds - found.seconds
    assert longer == pytest.approx(20 * (2 * (report.step_s or 0.0) + (report.check_s or 0.0)), rel=1e-3)
    assert times.expected(usual_recipe("quick")).trainings == 0  # a network of another size


def kept(folder: Path, *, device: str = "cpu", step_s: float = 1e-4) -> TrainingTimes:
    times = TrainingTimes(folder)
    kind = kind_of(usual_recipe("quick"))
    times.remember(
        TrainingTime(kind, device, step_s, check_s=1.0, before_s=8.0, after_s=2.0, val_s=20.0, takes_s=100.0)
    )
    return TrainingTimes(folder)


def test_it_grows_with_epochs_and_takes_and_one_slow_afternoon_is_no_rule(tmp_path: Path) -> None:
    recipe = usual_recipe("quick")
    settings = recipe.training
    learning = settings.epochs * settings.steps * settings.crops * settings.crop_frames * 1e-4
    for step_s in (1e-4, 1e-4, 9e-4):
        times = kept(tmp_path, step_s=step_s)
    assert times.expected(recipe) == Expected(pytest.approx(learning + settings.epochs + 10.0), 3)
    twice = times.expected(recipe, Lengths(150.0, 40.0, 10.0)).seconds
    assert twice == pytest.approx(learning + 2 * settings.epochs + 20.0)
    assert times.expected_after_s(recipe, Lengths(150.0, 40.0, 10.0)) == pytest.approx(4.0)
    # Nothing is marked for validation: as much is held back as then.
    assert times.expected(recipe, Lengths(100.0, 0.0)).seconds == times.expected(recipe).seconds


def test_a_graphics_card_counts_from_its_first_training_on(tmp_path: Path) -> None:
    kept(tmp_path)
    times = kept(tmp_path, device="cuda", step_s=1e-6)
    assert times.expected(usual_recipe("quick")).trainings == 1


def test_what_another_recipe_took_tells_how_slow_this_computer_is(tmp_path: Path) -> None:
    quick, best = usual_recipe("quick"), usual_recipe("best")
    times = kept(tmp_path)
    share = times.expected(quick).seconds / quick.minutes
    found = times.expected(best)
    assert (found.seconds, found.trainings) == (pytest.approx(share * best.minutes), 0)


def test_a_first_training_moves_the_guess_for_others_by_a_part_and_makes_it_surer(tmp_path: Path) -> None:
    """No estimate leaps because one recipe was measured."""
    quick, best = usual_recipe("quick"), usual_recipe("best")
    times = TrainingTimes(tmp_path)
    times.probe()
    before, guess = times.expected(best), times.expected(quick)
    assert before.least_s < before.seconds < before.most_s == pytest.approx(3 * before.seconds)
    widths = [before.most_s / before.least_s]
    for _ in range(3):
        times = kept(tmp_path)
        off = times.expected(quick).seconds / guess.seconds
        after = times.expected(best)
        assert min(1.0, off) < after.seconds / before.seconds < max(1.0, off)
        widths.append(after.most_s / after.least_s)
    assert widths == sorted(widths, reverse=True)
    # The first of them: half way, in proportions.
    (tmp_path / FILE).unlink()
    times = TrainingTimes(tmp_path)
    times.probe()
    guess, before = times.expected(quick), times.expected(best)
    times.remember(
        TrainingTime(kind_of(quick), "cpu", 0.0, 0.0, 4 * guess.seconds, 0.0, val_s=1.0, takes_s=1.0)
    )
    assert times.expected(best).seconds == pytest.approx(2 * before.seconds)


def test_nothing_remembered_is_probed_once_and_a_spoilt_file_is_no_matter(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('{"version": 1, "trainings": [{"kind": 3}], "probe_s": "x"}')
    times = TrainingTimes(tmp_path)
    assert times.needs_probe
    assert times.expected(usual_recipe("quick")).seconds == 60 * usual_recipe("quick").minutes
    times.probe()
    assert not TrainingTimes(tmp_path).needs_probe
    assert TrainingTimes(tmp_path).expected(usual_recipe("quick")).seconds > 0


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(40, "under a minute"), (80, "about 1 minute"), (900, "about 15 minutes"), (7200, "about 2 hours")],
)
def test_it_is_said_in_words(seconds: float, words: str) -> None:
    assert Expected(seconds).words == words


@pytest.mark.parametrize(
    ("guess", "words"),
    [
        (Expected(36, 0, 25, 108), "up to 2 minutes"),
        (Expected(144, 0, 101, 432), "2 to 8 minutes"),
        (Expected(20, 0, 14, 60), "under a minute"),
        (Expected(7200, 0, 5040, 21600), "1 to 6 hours"),
        (Expected(4000, 0, 1200, 7000), "up to 2 hours"),
        # Narrowed by many trainings, its ends are one figure.
        (Expected(110, 0, 107, 119), "about 2 minutes"),
        (Expected(3 * 3600, 0, 2.6 * 3600, 2.9 * 3600), "about 3 hours"),
    ],
)
def test_a_guess_is_said_as_a_range(guess: Expected, words: str) -> None:
    said = guess.words
    assert said == words
    assert isinstance(said, Text), "it can be translated"


@pytest.mark.parametrize("bad", ["NaN", "-1", "1e400"])
def test_times_that_cannot_be_are_passed_over(tmp_path: Path, bad: str) -> None:
    good = kept(tmp_path).expected(usual_recipe("quick"))
    text = (tmp_path / FILE).read_text(encoding="utf-8")
    one = json.dumps(json.loads(text)["trainings"][0])
    spoilt = one.replace('"step_s": 0.0001', f'"step_s": {bad}')
    assert spoilt != one
    (tmp_path / FILE).write_text(f'{{"probe_s": {bad}, "trainings": [{one}, {spoilt}]}}', encoding="utf-8")
    times = TrainingTimes(tmp_path)
    assert times.expected(usual_recipe("quick")) == good
    (tmp_path / FILE).write_text(f'{{"probe_s": {bad}, "trainings": [{spoilt}]}}', encoding="utf-8")
    assert TrainingTimes(tmp_path).needs_probe
