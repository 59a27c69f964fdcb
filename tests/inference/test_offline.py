"""Generating: any length, in bounded memory, the same in pieces as in one, exactly in time."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import soundfile
import torch

from studio.errors import Cancelled, RequestError, StudioError
from studio.features.motion import fit
from studio.inference.offline import Predictor, load_predictor
from studio.model._network import SamplingOptions
from studio.motion import Motion, concatenate, rotation
from studio.training import checkpoint
from studio.training.checkpoint import Model
from studio.training.recipe import load_recipe
from tests.tolerance import LAST_BITS

RATE = 16000


def predictor(name: str = "balanced", fps: str = "30", *overrides: str) -> Predictor:
    """An untrained model: how it maps time does not depend on what it has learnt."""
    t = np.arange(90) / 30
    turns = rotation.from_axis_angle(np.tile([1.0, 0, 0], (90, 1, 1)), np.sin(3 * t)[:, None])
    shapes = np.stack([np.sin(5 * t) ** 2, np.cos(4 * t) ** 2, np.full(90, 0.25)], axis=1)
    layout = fit([Motion.build(t, ("A", "O", "Neutral"), shapes, ("Head",), None, turns)])
    small = ["width=16", "hearing=2"] if name == "faceformer" else ["units=8"]
    recipe = load_recipe(name).with_overrides([*small, *overrides])
    torch.manual_seed(1)
    network = checkpoint.build_network(recipe, layout, Fraction(fps)).eval()
    network.row_mean.fill_(-60.0)
    network.row_deviation.fill_(20.0)
    return Predictor(Model(network, recipe, layout, Fraction(fps)))


def speech(seconds: float) -> np.ndarray:
    rng = np.random.default_rng(8)
    n = np.arange(int(seconds * RATE))
    return (rng.normal(0, 0.1, len(n)) * (0.5 + 0.5 * np.sin(n / 2500))).astype(np.float32)


def pieces(sound: np.ndarray, length: int) -> Iterator[np.ndarray]:
    for first in range(0, len(sound), length):
        yield sound[first : first + length]


@pytest.mark.parametrize("block", [160, 4321, 50_000])
@pytest.mark.parametrize("piece_seconds", [1 / 30, 0.7, 20.0])
@pytest.mark.parametrize("name", ["balanced", "faceformer"])
def test_streaming_equals_offline(name: str, block: int, piece_seconds: float) -> None:
    made, sound = predictor(name), speech(5.0)
    whole = made.generate_samples(sound)
    streamed = concatenate(list(made.stream(pieces(sound, block), piece_seconds)))
    np.testing.assert_array_equal(streamed.times, whole.times)
    np.testing.assert_allclose(streamed.shapes, whole.shapes, atol=1e-5)
    np.testing.assert_allclose(streamed.rotations, whole.rotations, atol=1e-5)


BOTH = "both_directions=yes"


@pytest.mark.parametrize(
    ("name", "overrides"), [("audio2face", []), ("saia", []), ("best", []), ("balanced", [BOTH])]
)
def test_the_blocks_sound_comes_in_do_not_matter(name: str, overrides: list[str]) -> None:
    made, sound = predictor(name, "30", *overrides), speech(5.0)
    whole = made.generate_samples(sound)
    streamed = concatenate(list(made.stream(pieces(sound, 5000))))
    np.testing.assert_allclose(streamed.shapes, whole.shapes, atol=1e-5)


@pytest.mark.parametrize(("name", "overrides"), [("saia", []), ("balanced", [BOTH])])
def test_pieces_of_models_that_hear_everything_join_without_a_step(name: str, overrides: list[str]) -> None:
    made, sound = predictor(name, "30", *overrides), speech(16.0)
    whole = concatenate(list(made.stream([sound], 100.0)))
    in_pieces = concatenate(list(made.stream([sound], 4.0)))
    np.testing.assert_allclose(in_pieces.shapes, whole.shapes, atol=2e-3)


@pytest.mark.parametrize("fps", ["30", "30000/1001", "25", "60"])
@pytest.mark.parametrize("seconds", [0.01, 1.0, 7.3])
def test_motion_is_as_long_as_the_sound(fps: str, seconds: float) -> None:
    motion = predictor("balanced", fps).generate_samples(speech(seconds))
    exact = float(Fraction(fps))
    assert len(motion) == int(np.ceil(round(seconds * RATE) / RATE * exact - 1e-9))
    np.testing.assert_allclose(motion.times, np.arange(len(motion)) / exact, atol=1e-9)


def test_a_click_in_minute_29_moves_the_frame_where_it_is() -> None:
    """All the way from samples to times; a coarse ear keeps the half hour short."""
    made = predictor(
        "balanced", "30000/1001", "sample_rate=1000", "bands=4", "steps_per_frame=1", "sound.window=1",
        "window_ms=40", "look_ahead_ms=0", "kernel=1", "layers=1",
    )  # fmt: skip
    click, seconds = 29 * 60 + 17, 29 * 60 + 20
    quiet = np.zeros(seconds * 1000, np.float32)
    loud = quiet.copy()
    loud[click * 1000] = 1.0
    with_click, without = (made.generate_samples(sound) for sound in (loud, quiet))
    moved = np.flatnonzero(np.abs(with_click.shapes - without.shapes).max(axis=1) > 1e-6)
    assert abs(with_click.times[moved[0]] - click) < 0.05


def test_memory_does_not_grow_with_the_sound() -> None:
    made, block = predictor(), speech(30.0)

    def peak(minutes: int) -> int:
        tracemalloc.start()
        for _ in made.stream(block for _ in range(2 * minutes)):
            pass
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(1)
    assert peak(8) < 1.2 * peak(2)


def test_a_file_of_any_rate_is_resampled(tmp_path: Path) -> None:
    import soxr

    made, sound = predictor(), speech(3.0)
    soundfile.write(tmp_path / "口 16.wav", sound, RATE, subtype="FLOAT")
    soundfile.write(tmp_path / "48.flac", np.stack([soxr.resample(sound, RATE, 48000)] * 2, axis=1), 48000)
    told: list[float] = []
    plain = made.generate(tmp_path / "口 16.wav", told.append)
    stereo = made.generate(tmp_path / "48.flac")
    assert told
    assert told == sorted(told)
    assert len(plain) == len(stereo) == 90
    np.testing.assert_allclose(plain.shapes, stereo.shapes, atol=0.02)
    np.testing.assert_allclose(plain.shapes, made.generate_samples(sound).shapes, atol=1e-5)


def test_static_channels_come_out_as_they_were() -> None:
    motion = predictor().generate_samples(speech(1.0))
    assert motion.shape_names == ("A", "O", "Neutral")
    np.testing.assert_allclose(motion.shapes[:, 2], 0.25)


def test_bad_sound_is_a_sentence(tmp_path: Path) -> None:
    made = predictor()
    soundfile.write(tmp_path / "no samples.wav", np.zeros(0), RATE)
    with pytest.raises(StudioError) as caught:
        made.generate(tmp_path / "no samples.wav")
    assert str(caught.value) == "The sound file no samples.wav is empty. Choose another file."
    with pytest.raises(StudioError) as caught:
        made.generate_samples(np.full(RATE, np.nan, np.float32))
    assert str(caught.value) == "The sound contains values that are not numbers. Export it again as WAV."
    assert len(made.generate_samples(np.zeros(0, np.float32))) == 0


def test_cancelling_is_not_failing(tmp_path: Path) -> None:
    soundfile.write(tmp_path / "a.wav", speech(2.0), RATE)

    def cancel(_: float) -> None:
        raise Cancelled("Generating was cancelled.")

    with pytest.raises(Cancelled):
        predictor().generate(tmp_path / "a.wav", cancel)


@pytest.mark.parametrize("name", ["audio2face", "balanced", "faceformer", "saia"])
def test_a_kept_model_generates_the_same(tmp_path: Path, name: str) -> None:
    made = predictor(name)
    checkpoint.save_model(tmp_path / "best.safetensors", made.model)
    again = load_predictor(tmp_path)
    first, second = (one.generate_samples(speech(2.0)) for one in (made, again))
    np.testing.assert_allclose(second.shapes, first.shapes, atol=LAST_BITS)


def test_streaming_equals_offline_in_a_style() -> None:
    plain, sound = predictor(), speech(5.0)
    torch.manual_seed(3)
    network = checkpoint.build_network(plain.model.recipe, plain.model.layout, plain.model.fps, 2).eval()
    network.row_mean.fill_(-60.0)
    network.row_deviation.fill_(20.0)
    made = Predictor(replace(plain.model, network=network, styles=("a", "b"), style="b"))
    whole = made.generate_samples(sound, "a")
    streamed = concatenate(list(made.stream(pieces(sound, 4321), 0.7, "a")))
    np.testing.assert_allclose(streamed.shapes, whole.shapes, atol=1e-5)
    by_default = made.generate_samples(sound)
    np.testing.assert_allclose(by_default.shapes, made.generate_samples(sound, "b").shapes, atol=LAST_BITS)
    assert np.abs(by_default.shapes - whole.shapes).max() > 10 * LAST_BITS


def test_drawn_motion_is_repeated_by_its_seed_in_any_pieces() -> None:
    made, sound = predictor("saia", "30", "layers=1", "mixtures=3"), speech(12.0)
    first, again, other = (made.generate_samples(sound, sampling=SamplingOptions(seed)) for seed in (5, 5, 6))
    np.testing.assert_allclose(first.shapes, again.shapes, atol=LAST_BITS)
    assert np.abs(first.shapes - other.shapes).max() > 0.01
    in_pieces = concatenate(list(made.stream(pieces(sound, 5000), 4.0, sampling=SamplingOptions(5))))
    np.testing.assert_allclose(in_pieces.shapes, first.shapes, atol=2e-3)


def test_liveliness_widens_a_model_without_chance_too() -> None:
    made, sound = predictor("balanced", "30", "network.body=plain"), speech(3.0)
    still, plain, wide = (
        made.generate_samples(sound, sampling=SamplingOptions(0, x)).shapes for x in (0.0, 1.0, 1.5)
    )
    assert np.ptp(still, axis=0).max() < 1e-5
    np.testing.assert_allclose(plain, made.generate_samples(sound).shapes, atol=LAST_BITS)
    assert (wide.std(axis=0) > plain.std(axis=0)).any()


@pytest.mark.parametrize(
    ("sampling", "sentence"),
    [
        (
            SamplingOptions(0, 4.0),
            "A liveliness of 4 is not possible. Choose 0 (still) to 3; 1 is as trained.",
        ),
        (
            SamplingOptions(0, float("nan")),
            "A liveliness of nan is not possible. Choose 0 (still) to 3; 1 is as trained.",
        ),
        (SamplingOptions(-1), "A seed of -1 is not possible. Choose a whole number from 0 on."),
    ],
)
def test_a_chance_that_is_not_possible_is_a_sentence(sampling: SamplingOptions, sentence: str) -> None:
    with pytest.raises(RequestError) as caught:
        predictor().generate_samples(speech(0.1), sampling=sampling)
    assert str(caught.value) == sentence
