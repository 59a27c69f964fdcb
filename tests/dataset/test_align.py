"""Offsets between mouth and voice, on what is known and on the real takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.dataset import Dataset, Selection
from studio.dataset.align import align_takes, take_offset
from studio.formats import saia_csv
from studio.motion import Motion
from studio.motion.lag import Alignment, speech_level, voice_offset
from studio.project import Project
from studio.sound.sound_file import Sound, read_sound, write_sound
from studio.take import TakeInfo
from tests.formats.examples import needs_data


def find_offset(sound: Sound, motion: Motion) -> Alignment:
    return voice_offset(speech_level(sound.mono(), sound.sample_rate), motion)


def speech(seconds: float = 30.0, rate: int = 16000, late: float = 0.0) -> tuple[Sound, Motion]:
    """Bursts of noise, and a jaw that opens with them, late by some seconds."""
    rng = np.random.default_rng(2)
    t = np.arange(int(seconds * rate)) / rate

    def level(t: np.ndarray) -> np.ndarray:
        return np.clip((np.sin(9.1 * t) + np.sin(14.3 * t + 1) + np.sin(1.9 * t)) / 2, 0, 1)

    samples = (0.4 * level(t) * rng.normal(size=len(t))).astype(np.float32)
    times = np.arange(int(seconds * 60)) / 60
    smile = 0.5 + 0.5 * np.sin(0.3 * times)
    jaw = level(times - late)
    return Sound(samples[:, None], rate), Motion.build(
        times, ("jawOpen", "mouthSmileLeft"), np.stack([jaw, smile], 1)
    )


@pytest.mark.parametrize("late", [0.0, 0.035, -0.2, 0.6])
@pytest.mark.parametrize("rate", [8000, 44100])
def test_a_known_offset_is_found(late: float, rate: int) -> None:
    found = find_offset(*speech(rate=rate, late=late))
    assert found.offset == pytest.approx(-late, abs=0.005)
    assert found.confidence > 0.8
    assert found.curve.shape == found.offsets.shape
    assert found.offsets[np.argmax(found.curve)] == pytest.approx(found.offset, abs=0.01)


def test_another_recording_gives_no_confidence() -> None:
    sound, motion = speech()
    rng = np.random.default_rng(9)
    other = replace(motion, shapes=np.repeat(rng.random((90, 2)), 20, axis=0).astype(np.float32))
    assert find_offset(sound, other).confidence < 0.2


@pytest.mark.parametrize("seconds", [0.5, 30.0])
def test_silence_a_still_mouth_or_too_little_give_nothing(seconds: float) -> None:
    sound, motion = speech(seconds)
    still = replace(motion, shapes=motion.shapes * 0)
    silent = Sound(sound.samples * 0, sound.sample_rate)
    pairs = [(silent, motion), (sound, still)] + ([(sound, motion)] if seconds < 1 else [])
    for pair in pairs:
        found = find_offset(*pair)
        assert (found.offset, found.confidence) == (0.0, 0.0)


def test_only_sure_offsets_are_set() -> None:
    sure, unsure = find_offset(*speech(late=0.1)), replace(find_offset(*speech()), confidence=0.1)
    dataset = Dataset((Selection("a.1", "a"), Selection("a.2", "a"), Selection("b", "b", offset=0.5)))
    new, left = align_takes(dataset, [("a", sure), ("b", unsure)])
    assert [s.offset for s in new.selections] == pytest.approx([-0.1, -0.1, 0.5], abs=0.005)
    assert left == ("b",)


@pytest.mark.parametrize("take", ["2_01", "2_02", "2_03", "2_04", "3_15"])
def test_the_real_labels_lag_the_sound_a_little(take: str) -> None:
    folder = needs_data("facegood")
    imported = saia_csv.read(folder / "Blendshapes" / f"{take}.csv")
    assert imported.motion is not None
    sound = read_sound(folder / "Audio" / f"{take}.wav")
    found = find_offset(sound, imported.motion)
    assert -0.06 < found.offset < -0.005
    assert found.confidence > 0.9
    moved = find_offset(sound, imported.motion.shifted(0.25))
    assert moved.offset == pytest.approx(found.offset - 0.25, abs=0.005)


def test_a_real_face_of_another_take_is_not_trusted() -> None:
    folder = needs_data("facegood")
    imported = saia_csv.read(folder / "Blendshapes" / "2_04.csv")
    assert imported.motion is not None
    assert find_offset(read_sound(Path(folder / "Audio" / "2_01.wav")), imported.motion).confidence < 0.2


def test_blocks_and_the_whole_sound_align_alike(tmp_path: Path) -> None:
    sound, motion = speech(45.0, rate=44_100, late=0.1)
    project = Project.create(tmp_path / "p")
    write_sound(tmp_path / "in.wav", sound)
    take = project.add_take("long", TakeInfo("long"), motion, tmp_path / "in.wav")
    found = take_offset(take)
    assert found is not None
    whole = find_offset(read_sound(tmp_path / "in.wav"), motion)
    assert found.offset == pytest.approx(whole.offset, abs=0.002)
    assert found.confidence == pytest.approx(whole.confidence, abs=0.05)
    by_clap = take_offset(take, "clap")
    assert by_clap is not None
    assert by_clap.confidence == 0.0, "a motion without arms has no claps"
