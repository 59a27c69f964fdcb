"""Rows of sound: equal to librosa's, exact in time, the same in pieces."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.features.audio import non_silent_rows, rows
from studio.features.audio_spec import AudioSpec, frame_rate, row_centres, warped_bands

RNG = np.random.default_rng(3)


def noise(seconds: float, rate: int = 16000) -> np.ndarray:
    return (RNG.normal(0, 0.1, int(seconds * rate))).astype(np.float32)


LIBROSAS = Path(__file__).parent.parent / "golden" / "mfcc_librosa.npy"
"""Every fifth of 300 rows (60, 39), by librosa 0.11: melspectrogram(y=sound, sr=16000, n_fft=1024,
win_length=640, hop_length=160, n_mels=64, pad_mode="constant"), power_to_db(top_db=None), mfcc(n_mfcc=39).
Kept, for librosa compiles itself for a quarter of a minute where it is used first."""


def test_mfcc_equal_librosas() -> None:
    ramp = np.linspace(0, 1, 48000).astype(np.float32)
    sound = np.random.default_rng(3).normal(0, 0.1, 48000).astype(np.float32) * ramp
    spec = AudioSpec(kind="mfcc", bands=64, coefficients=39, window_ms=40.0, steps_per_frame=1, window=1)
    ours = rows(sound, spec, Fraction(100), 0, 300)[::5]  # a hop of 160 samples is whole here
    theirs = np.load(LIBROSAS)
    assert np.abs(ours - theirs).max() < 1e-3 * np.abs(theirs).max()
    assert np.abs(ours - theirs).mean() < 1e-3


@pytest.mark.parametrize("fps", [23.976, 25.0, 29.97, 30.0, 59.94, 60.0])
@pytest.mark.parametrize("steps", [1, 4, 16])
def test_row_times_never_drift(fps: float, steps: int) -> None:
    """SAIA's notebook advanced 896 samples a row where rows are 905.2: 18 s off after half an hour."""
    spec = AudioSpec(steps_per_frame=steps, window=steps)
    rate = frame_rate(fps)
    frame = round(29.5 * 60 * fps)
    centres = row_centres(spec, rate, frame * steps, steps)
    exact = Fraction(frame) / rate * spec.sample_rate
    assert abs(float(centres.mean() - exact)) <= 1.0


@pytest.mark.parametrize("minute", [0.5, 29.0, 119.0])
def test_a_click_is_found_in_the_frame_where_it_is(minute: float) -> None:
    spec, fps = AudioSpec(window_ms=10.0), frame_rate(29.97)
    click = round(minute * 60 * spec.sample_rate)
    start = click - spec.sample_rate  # the second around it stands for the hours before
    sound = np.zeros(2 * spec.sample_rate, dtype=np.float32)
    sound[spec.sample_rate] = 1.0
    frame = round(click / spec.sample_rate * fps)
    first = (frame - 10) * spec.steps_per_frame
    found = rows(sound, spec, fps, first, 20 * spec.steps_per_frame, start).sum(axis=1)
    assert first // spec.steps_per_frame + int(found.argmax()) // spec.steps_per_frame == frame


@pytest.mark.parametrize(("steps", "window"), [(1, 64), (2, 64), (16, 64), (4, 4), (1, 33)])
def test_a_window_is_centred_on_its_frame(steps: int, window: int) -> None:
    spec = AudioSpec(steps_per_frame=steps, window=window)
    centres = row_centres(spec, Fraction(25), 50 * steps + (steps - window) // 2, window)
    assert abs(centres.mean() - 2.0 * spec.sample_rate) <= 1.0


def test_rows_in_pieces_equal_rows_in_one() -> None:
    spec, fps, sound = AudioSpec(), Fraction(30), noise(2.0)
    whole = rows(sound, spec, fps, -8, 240)
    pieces = [rows(sound, spec, fps, -8, 100), rows(sound[8000:], spec, fps, 92, 140, 8000)]
    np.testing.assert_allclose(whole[:100], pieces[0], atol=1e-4)
    np.testing.assert_allclose(whole[100:], pieces[1], atol=1e-4)


def test_silence_has_a_floor_and_lies_beyond_the_ends() -> None:
    spec = AudioSpec()
    np.testing.assert_allclose(rows(noise(1.0), spec, Fraction(30), -100, 20), -100.0, atol=1e-4)
    np.testing.assert_allclose(rows(np.zeros(0, np.float32), spec, Fraction(30), 0, 5), -100.0, atol=1e-4)


@pytest.mark.parametrize(("window_ms", "bands"), [(1.8, 78), (4.2, 40), (25.0, 128), (66.7, 64)])
def test_every_mel_band_has_a_bin(window_ms: float, bands: int) -> None:
    """SAIA's notebook put 78 filters over 29 bins, so that most were empty, and another FFT for each file."""
    spec = AudioSpec(window_ms=window_ms, bands=bands)
    loud = rows(noise(0.5), spec, Fraction(30), 20, 4)
    assert (loud > -99).all()
    assert spec.fft_size >= spec.window_samples


def test_impossible_features_are_refused() -> None:
    with pytest.raises(StudioError) as caught:
        AudioSpec(kind="cepstrum")
    assert (
        str(caught.value)
        == "There is no sound feature called cepstrum. Use log_mel, mfcc, speech or log_mel_speech."
    )
    with pytest.raises(StudioError) as caught:
        AudioSpec(kind="mfcc", bands=20, coefficients=39)
    assert str(caught.value) == (
        "39 MFCC cannot come from 20 mel bands. Raise sound.bands or lower sound.coefficients."
    )


@pytest.mark.parametrize("factor", [0.88, 1.12])
def test_a_warped_tone_looks_like_a_tone_of_another_pitch(factor: float) -> None:
    spec = AudioSpec()
    n = np.arange(16000) / 16000
    low, high = (np.sin(2 * np.pi * hz * n).astype(np.float32) for hz in (1000.0, 1000.0 * factor))
    before, after = (rows(sound, spec, Fraction(30), 40, 1)[0] for sound in (low, high))
    # Content at 1000 factor Hz is read where 1000 Hz was.
    bands = warped_bands(spec, factor)
    assert np.interp(bands, np.arange(spec.bands), after).argmax() == before.argmax()


def test_no_warp_reads_each_band_where_it_is() -> None:
    np.testing.assert_allclose(warped_bands(AudioSpec(), 1.0), np.arange(40), atol=1e-9)


@pytest.mark.parametrize("kind", ["log_mel", "mfcc"])
def test_what_is_heard_is_speech_and_not_the_silence_around_it(kind: str) -> None:
    rng = np.random.default_rng(0)
    spec = AudioSpec(kind=kind)
    speech = rng.normal(0, 0.1, 8000).astype(np.float32)
    quiet = rng.normal(0, 1e-5, 8000).astype(np.float32)
    sound = np.concatenate([speech, 0.03 * speech, quiet, np.zeros(8000, np.float32)])
    found = non_silent_rows(rows(sound, spec, Fraction(30), 0, 240), spec)
    assert len(found) == pytest.approx(120, abs=3)  # the loud and the soft second half-second, no more
