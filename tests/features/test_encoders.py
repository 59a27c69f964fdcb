"""wav2vec 2.0 in Hugging Face's layout: equal to transformers, nothing executed, found again by digest."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import torch

from studio.errors import RequestError, StudioError
from studio.features.audio import rows
from studio.features.audio_spec import AudioSpec
from studio.features.encoders import (
    RATE,
    bring,
    home_of,
    installed,
    load_encoder,
    speech_rows,
    with_resolved_encoder,
)
from tests.features import wav2vec2_example as example

GOLDEN = Path(__file__).parent.parent / "golden" / "wav2vec2_tokens.json"
LARGE = example.CONFIG | example.LARGE
SPEC = AudioSpec(kind="speech", steps_per_frame=2, window=2)


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SAIA_ENCODERS", str(tmp_path / "encoders"))
    return tmp_path / "encoders"


@pytest.mark.parametrize("pickled", [True, False], ids=["pytorch_model.bin", "model.safetensors"])
@pytest.mark.parametrize("bare", [True, False], ids=["bare", "with a head"])
@pytest.mark.parametrize("kind", ["base", "large"])
def test_it_hears_what_transformers_hears(tmp_path: Path, kind: str, pickled: bool, bare: bool) -> None:
    """Tokens as transformers 5.23.0 gives them for the same made-up weights."""
    kept = json.loads(GOLDEN.read_text(encoding="utf-8"))[kind]
    config = example.CONFIG if kind == "base" else LARGE
    found = bring(example.write(tmp_path / "tiny", config, pickled=pickled, bare=bare))
    sound = example.voice(2.0)
    tokens = load_encoder(found.name, found.digest).tokens(sound)
    assert len(tokens) == kept["tokens"]
    np.testing.assert_allclose(tokens[kept["rows"]], np.array(kept["values"]), atol=1e-4)


def test_a_folder_is_brought_once_and_named_in_the_recipe(tmp_path: Path, home: Path) -> None:
    folder = example.write(tmp_path / "声 with spaces")
    spec = with_resolved_encoder(replace(SPEC, encoder=str(folder)))
    assert (spec.encoder, spec.encoder_width, spec.width) == (folder.name, 16, 16)
    assert [one.name for one in installed()] == [folder.name]
    assert bring(folder) == installed()[0]
    assert with_resolved_encoder(replace(SPEC, encoder=folder.name)) == spec
    other = bring(example.write(tmp_path / "b" / folder.name, seed=5))
    assert other.name.startswith(f"{folder.name}-")
    assert len(installed()) == 2
    assert not list(home.rglob("*.new"))


def test_rows_are_exact_in_time_and_the_same_in_pieces(tmp_path: Path) -> None:
    spec = with_resolved_encoder(replace(SPEC, encoder=str(example.write(tmp_path / "tiny"))))
    quiet = example.voice(45.0) * 0
    click = quiet.copy()
    click[30 * RATE] = 1.0
    change = np.abs(rows(click, spec, Fraction(30), 1740, 120) - rows(quiet, spec, Fraction(30), 1740, 120))
    # It is normalised over a window, so all of it changes; most where the click is.
    assert abs(int(change.sum(axis=1).argmax()) - 60) <= 2
    whole = rows(example.voice(45.0), spec, Fraction(30), 1390, 100)
    part = speech_rows(example.voice(45.0)[21 * RATE :], spec, Fraction(30), 1441, 49, 21 * RATE)
    np.testing.assert_allclose(part, whole[51:], atol=1e-4)
    assert np.isfinite(rows(quiet, spec, Fraction(30), 0, 10)).all()


class Bomb:
    """What a hostile pickle does when it is loaded as any pickle is."""

    def __init__(self, at: Path) -> None:
        self.at = at

    def __reduce__(self) -> tuple:
        return (Path.touch, (self.at,))


def test_a_hostile_pickle_is_not_executed(tmp_path: Path) -> None:
    folder = example.write(tmp_path / "bad", pickled=True)
    with (folder / "pytorch_model.bin").open("wb") as file:
        pickle.dump({"a": Bomb(tmp_path / "ran")}, file)
    with pytest.raises(StudioError, match=r"pytorch_model\.bin is damaged, or holds more than weights\."):
        bring(folder)
    torch.save({"a": Bomb(tmp_path / "ran")}, folder / "pytorch_model.bin")
    with pytest.raises(StudioError, match=r"holds more than weights"):
        bring(folder)
    assert not (tmp_path / "ran").exists()
    assert installed() == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"model_type": "bert"}, "its model_type is bert, not wav2vec2"),
        ({"hidden_size": 10**9}, "its hidden_size makes no sense"),
        ({"hidden_size": "wide"}, "config.json is damaged"),
        ({"conv_stride": [5, 8]}, "its convolutions make no sense"),
        ({"num_attention_heads": 3}, "its attention heads do not share its width"),
        ({"intermediate_size": 25}, "its weights do not fit its config.json"),
        ({"num_hidden_layers": 3}, "its weights do not fit its config.json"),
    ],
)
def test_a_config_that_makes_no_sense_is_a_sentence(tmp_path: Path, change: dict, words: str) -> None:
    folder = example.write(tmp_path / "odd")
    (folder / "config.json").write_text(json.dumps(example.CONFIG | change), encoding="utf-8")
    with pytest.raises(RequestError) as caught:
        bring(folder)
    assert str(caught.value) == (
        f"odd is not a wav2vec 2.0 folder as Hugging Face lays it out: {words}. "
        "Choose a folder with its config.json and model.safetensors or pytorch_model.bin."
    )


@pytest.mark.parametrize("name", ["config.json", "model.safetensors"])
@pytest.mark.parametrize("content", [b"", b"{", b"\xff" * 100, None])
def test_damaged_and_missing_files_are_a_sentence(tmp_path: Path, name: str, content: bytes | None) -> None:
    folder = example.write(tmp_path / "broken")
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_bytes(content)
    with pytest.raises(
        RequestError, match=r"^broken is not a wav2vec 2\.0 folder as Hugging Face lays it out: "
    ):
        bring(folder)


def test_a_run_finds_its_encoder_by_digest_and_says_where_it_is_missing(tmp_path: Path, home: Path) -> None:
    spec = with_resolved_encoder(replace(SPEC, encoder=str(example.write(tmp_path / "mine"))))
    # On another computer the same weights may have another name.
    moved = home_of("theirs")
    home_of("mine").rename(moved)
    (moved / "encoder.json").write_text(
        json.dumps({"version": 1, "name": "theirs", "sha256": spec.encoder_digest}), encoding="utf-8"
    )
    assert load_encoder("mine", spec.encoder_digest).width == 16
    (moved / "encoder.json").unlink()
    with pytest.raises(RequestError) as caught:
        load_encoder("mine", spec.encoder_digest)
    assert str(caught.value) == (
        "The speech encoder mine is not on this computer. "
        'Get it with `saia encoder "mine"`, or give a folder that contains it.'
    )


def test_other_weights_of_the_same_name_are_not_used(tmp_path: Path) -> None:
    spec = with_resolved_encoder(replace(SPEC, encoder=str(example.write(tmp_path / "a" / "mine"))))
    other = example.write(tmp_path / "b" / "mine", seed=9)
    for name in ("model.safetensors", "encoder.json"):
        (home_of("mine") / name).unlink()
    bring(other)
    with pytest.raises(StudioError) as caught:
        load_encoder("mine", spec.encoder_digest)
    assert caught.value.what == (
        "The speech encoder mine on this computer is not the one this was trained with."
    )


def test_weights_that_changed_afterwards_are_noticed(tmp_path: Path) -> None:
    spec = with_resolved_encoder(replace(SPEC, encoder=str(example.write(tmp_path / "mine"))))
    example.write(home_of("mine"), seed=9)
    with pytest.raises(StudioError) as caught:
        load_encoder("mine", spec.encoder_digest)
    assert str(caught.value) == (
        'The speech encoder mine is damaged. Get it again with `saia encoder "mine"`.'
    )


def test_an_encoder_nobody_brought_is_named() -> None:
    with pytest.raises(RequestError) as caught:
        with_resolved_encoder(replace(SPEC, encoder="facebook/wav2vec2-base"))
    assert caught.value.what == "The speech encoder facebook/wav2vec2-base is not on this computer."


def test_other_kinds_of_rows_need_no_encoder() -> None:
    plain = AudioSpec()
    assert with_resolved_encoder(plain) is plain
    assert "encoder" not in plain.cache_key  # cached rows of other kinds keep their names
    with pytest.raises(RequestError) as caught:
        with_resolved_encoder(AudioSpec(encoder="facebook/wav2vec2-base"))
    assert str(caught.value) == (
        "log_mel needs no speech encoder, so sound.encoder would change nothing. "
        "Add --set form=pretrained (FaceFormer) or form=speech, or leave it out."
    )
