"""Recipes: files anyone can read, changed by key=value, whole sentences for what is not possible."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from studio.errors import RequestError, StudioError
from studio.training.recipe import from_dict, load_recipe, read_recipe, recipes


def test_every_recipe_loads_and_comes_back_from_its_text() -> None:
    for info in recipes():
        recipe = load_recipe(info.name)
        assert recipe.title
        assert recipe.summary
        assert from_dict(tomllib.loads(recipe.as_toml())) == recipe


def test_presets_come_first() -> None:
    found = recipes()
    assert [info.preset for info in found[:3]] == ["Quick look", "Balanced", "Best"]
    assert {info.name for info in found} >= {"quick", "balanced", "best", "audio2face", "saia"}
    assert all(info.minutes > 0 for info in found)


def test_overrides_change_values_of_their_kind() -> None:
    recipe = load_recipe("balanced").with_overrides(
        ["epochs=3", "network.units=32", "both_directions=yes", "learning_rate=1e-3", "loss.point=huber"]
    )
    assert recipe.training.epochs == 3
    assert recipe.network["units"] == 32
    assert recipe.network["both_directions"] is True
    assert recipe.training.learning_rate == 1e-3
    assert recipe.loss.point == "huber"


def test_a_form_comes_before_other_overrides() -> None:
    recipe = load_recipe("audio2face").with_overrides(["epochs=2", "form=learns"])
    assert recipe.network["read"] == "centre"
    assert recipe.loss.face_cosine == 0
    assert recipe.training.epochs == 2
    assert recipe.form == "learns"


def test_faceformer_has_the_papers_decoder_and_in_its_form_the_papers_loss() -> None:
    recipe = load_recipe("faceformer").with_overrides(["form=paper"])
    assert (recipe.network["heads"], recipe.network["layers"], recipe.network["period"]) == (4, 1, 30)
    assert (recipe.network["width"], recipe.network["told"]) == (64, 0.0)
    assert (recipe.loss.point, recipe.loss.velocity) == ("mse", 0.0)
    assert (recipe.training.optimiser, recipe.training.learning_rate) == ("adam", 0.0001)
    assert (recipe.augment.stretch, recipe.augment.warp, recipe.augment.noise_db) == (0.0, 0.0, 0.0)


def test_saia_offers_the_mixture_its_reports_wished_for() -> None:
    assert load_recipe("saia").network["mixtures"] == 1
    assert load_recipe("saia").with_overrides(["form=mixture"]).network["mixtures"] == 5
    assert load_recipe("saia").with_overrides(["mixtures=3"]).network["mixtures"] == 3


def test_audio2face_is_as_published() -> None:
    recipe = load_recipe("audio2face")
    assert (recipe.sound.kind, recipe.sound.coefficients, recipe.sound.window) == ("mfcc", 39, 64)
    assert (recipe.loss.point, recipe.loss.face_cosine, recipe.loss.face_theta) == ("huber", 1.0, 1.0)
    assert (recipe.training.optimiser, recipe.training.learning_rate) == ("adam", 1e-4)
    assert recipe.training.crops * recipe.training.crop_frames == 100


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("epochs", "'epochs' is not a setting. Write it as key=value, e.g. training.epochs=20."),
        ("epochs=many", "'many' is not possible for training.epochs. Give a whole number."),
        ("epochs=0", "0 is not possible for training.epochs. Choose 1 to 100000."),
        ("learning_rate=nan", "'nan' is not possible for training.learning_rate. Give a number."),
        ("loss.point=l3", "'l3' is not possible for loss.point. Choose mse, huber or mae."),
        (
            "both_directions=perhaps",
            "'perhaps' is not possible for network.both_directions. Give yes or no.",
        ),
        ("form=best", "The recipe balanced has no form called best. Forms it has: speech."),
        (
            "sound.kind=wave",
            "There is no sound feature called wave. Use log_mel, mfcc, speech or log_mel_speech.",
        ),
    ],
)
def test_what_is_not_possible_is_a_sentence(override: str, sentence: str) -> None:
    with pytest.raises(RequestError) as caught:
        load_recipe("balanced").with_overrides([override])
    assert str(caught.value) == sentence


def test_an_unknown_setting_suggests_a_near_one() -> None:
    with pytest.raises(RequestError) as caught:
        load_recipe("balanced").with_overrides(["epoch=3"])
    assert str(caught.value).startswith("There is no setting called epoch. Did you mean training.epochs, ")


def test_an_unknown_recipe_is_a_sentence() -> None:
    for name in ("nothing", "../recipes/balanced", ""):
        with pytest.raises(RequestError) as caught:
            load_recipe(name)
        assert caught.value.what == f"There is no recipe called {name}."


def test_a_damaged_recipe_file_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "recipe.toml"
    path.write_text("version = 1\n[training]\nepochs = 'x\n")
    with pytest.raises(StudioError) as caught:
        read_recipe(path)
    assert caught.value.what.startswith("The recipe recipe.toml is damaged")
    path.write_text("version = 2\n")
    with pytest.raises(StudioError) as caught:
        read_recipe(path)
    assert str(caught.value) == (
        "The recipe recipe.toml was written by a newer Saia Studio. Update Saia Studio to use it."
    )
    path.write_text("version = 1\n[training]\nspeed = 3\n")
    with pytest.raises(StudioError):
        read_recipe(path)


def test_the_window_reads_recipes_without_anything_heavy() -> None:
    code = (
        "import studio.training.recipe, studio.ipc.events, sys; "
        "studio.training.recipe.recipes(); "
        "print([m for m in ('torch', 'scipy', 'librosa', 'soxr', 'pyarrow') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_what_an_encoder_is_made_of_is_found_out_and_not_set() -> None:
    with pytest.raises(RequestError, match=r"^There is no setting called encoder_digest\."):
        load_recipe("faceformer").with_overrides(["encoder_digest=x"])
