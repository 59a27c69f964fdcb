"""The automatic gain: towards the level of the takes, by speech alone, without a jump."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.inference.live.preprocess import HIGHEST_DB, USUAL_DBFS, Gain, level_of_takes, speech_level

RATE = 16_000


def voice(seconds: float, dbfs: float) -> np.ndarray:
    rng = np.random.default_rng(4)
    return (rng.normal(0, 10 ** (dbfs / 20), int(seconds * RATE))).astype(np.float32)


def through(gain: Gain, sound: np.ndarray, speaking: bool = True) -> np.ndarray:
    return np.concatenate([gain.feed(sound[i : i + 160], speaking) for i in range(0, len(sound), 160)])


@pytest.mark.parametrize("dbfs", [-40.0, -26.0, -15.0])
def test_a_voice_comes_to_the_level_of_the_takes(dbfs: float) -> None:
    gain = Gain(-26.0, RATE)
    given = through(gain, voice(15.0, dbfs))
    assert 20 * np.log10(np.std(given[-RATE:])) == pytest.approx(-26.0, abs=1.0)


def test_it_moves_without_a_jump() -> None:
    gain = Gain(-20.0, RATE)
    steps = []
    for _ in range(1000):
        before = gain.db
        gain.feed(voice(0.01, -40.0), True)
        steps.append(abs(gain.db - before))
    assert 0 < max(steps) < 0.1


def test_silence_and_noise_teach_it_nothing() -> None:
    gain = Gain(-26.0, RATE)
    through(gain, voice(10.0, -60.0), speaking=False)
    assert gain.db == 0.0


def test_a_whisper_is_not_raised_without_end() -> None:
    gain = Gain(-26.0, RATE)
    through(gain, voice(20.0, -75.0))
    assert gain.db == pytest.approx(HIGHEST_DB, abs=0.01)


def test_switched_off_it_changes_nothing() -> None:
    gain, sound = Gain(-26.0, RATE, on=False), voice(5.0, -50.0)
    assert through(gain, sound) is not None
    np.testing.assert_array_equal(through(gain, sound), sound)


def test_switched_while_live_it_goes_there_without_a_jump() -> None:
    gain, one = Gain(-26.0, RATE), np.full(160, 0.001, np.float32)
    through(gain, voice(15.0, -50.0))
    for on, goal in ((False, 0.0), (True, 24.0)):
        before, gain.on = 20 * np.log10(gain.feed(one, False)[-1] / one[0]), on
        given = 20 * np.log10(np.concatenate([gain.feed(one, False) for _ in range(100)]) / one[0])
        assert abs(given[0] - before) < 0.1
        assert np.abs(np.diff(given)).max() < 0.1
        assert given[-1] == pytest.approx(goal, abs=0.2)


def test_pauses_do_not_lower_the_level_of_speech() -> None:
    sound = voice(4.0, -20.0)
    with_pauses = np.concatenate([sound, np.zeros(8 * RATE, np.float32), sound])
    assert speech_level(with_pauses, RATE) == pytest.approx(speech_level(sound, RATE), abs=0.3)
    assert speech_level(np.zeros(RATE, np.float32), RATE) is None


def test_the_level_of_takes_passes_over_those_that_are_gone(tmp_path: Path) -> None:
    soundfile.write(tmp_path / "a.wav", voice(3.0, -30.0), RATE)
    level = level_of_takes([tmp_path / "gone.wav", tmp_path / "a.wav"])
    assert level == pytest.approx(-30.0, abs=1.0)
    assert level_of_takes([tmp_path / "gone.wav"]) == USUAL_DBFS
