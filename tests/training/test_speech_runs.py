"""Runs that hear with a speech encoder: learnt, used in any pieces, told of where the encoder is missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.errors import StudioError
from studio.features import encoders
from studio.features.encoders import WHISPER_SHA256, with_resolved_encoder
from studio.inference.offline import load_predictor
from studio.motion import concatenate
from studio.project import Project
from studio.training.loop.train import train
from studio.training.recipe import load_recipe
from tests.features import wav2vec2_example as example

MakeProject = Callable[..., Project]
TINY = ["steps=2", "crops=2", "crop_frames=45", "epochs=1"]


def run_of(project: Project, name: str, *changes: str) -> Path:
    recipe = load_recipe(name).with_overrides([*TINY, *changes])
    recipe = replace(recipe, sound=with_resolved_encoder(recipe.sound))
    return train(project, recipe, on_event=lambda event: None).folder


@pytest.mark.slow
@pytest.mark.parametrize("recipe", ["balanced", "best"])
def test_a_run_hears_with_whisper_in_any_pieces_and_says_where_it_is_missing(
    make_toy_project: MakeProject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recipe: str
) -> None:
    folder = run_of(make_toy_project(), recipe, "form=speech", "units=8")
    predictor = load_predictor(folder)
    assert predictor.model.recipe.sound.encoder_digest == WHISPER_SHA256
    sound = example.voice(3.0)
    whole = predictor.generate_samples(sound)
    blocks = (sound[first : first + 7000] for first in range(0, len(sound), 7000))
    parts = concatenate(list(predictor.stream(blocks, 0.7)))
    np.testing.assert_allclose(parts.shapes, whole.shapes, atol=1e-4)
    encoders._cached_by_name.cache_clear()
    encoders.streaming_whisper.cache_clear()
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    monkeypatch.setattr("sys.path_importer_cache", {})
    with pytest.raises(StudioError) as caught:
        load_predictor(folder).generate_samples(sound)
    assert caught.value.what == "This needs the speech encoder Whisper, which is not installed."


@pytest.mark.slow
def test_faceformer_hears_with_a_wav2vec_and_any_length(
    make_toy_project: MakeProject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SAIA_ENCODERS", str(tmp_path / "encoders"))
    encoder = f"encoder={example.write(tmp_path / 'tiny')}"
    folder = run_of(make_toy_project(), "faceformer", "form=pretrained", encoder, "width=16", "heads=2")
    predictor = load_predictor(folder)
    assert predictor.model.recipe.sound.encoder == "tiny"
    sound = example.voice(29.0)  # over the border of two windows
    whole = predictor.generate_samples(sound)
    parts = concatenate(list(predictor.stream([sound[:200_000], sound[200_000:]], 2.0)))
    assert len(whole) == 29 * 30
    np.testing.assert_allclose(parts.shapes, whole.shapes, atol=1e-4)
    (tmp_path / "encoders").rename(tmp_path / "gone")
    encoders._cached_by_name.cache_clear()
    with pytest.raises(StudioError, match=r"^The speech encoder tiny is not on this computer\."):
        load_predictor(folder).generate_samples(sound)


def test_balanced_hears_with_whisper_where_it_is_and_plain_sound_where_it_is_not(
    make_toy_project: MakeProject, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project()
    words = ["train", str(project.folder), *(w for change in (*TINY, "units=8") for w in ("--set", change))]
    assert cli.main(words) == 0
    assert "not installed" not in capsys.readouterr().out
    monkeypatch.setattr(encoders, "PACKAGE", "not_installed_anywhere")
    assert cli.main(words) == 0
    assert "Whisper, which knows speech, is not installed: this hears plain sound." in capsys.readouterr().out
    assert cli.main([*words, "--set", "form=plain"]) == 0
    assert "not installed" not in capsys.readouterr().out
    kept = [load_predictor(run.folder).model.recipe for run in project.runs]
    assert [recipe.form for recipe in kept] == ["speech", "", ""]
    assert [recipe.sound.streams and recipe.sound.uses_encoder for recipe in kept] == [True, False, False]
