"""The face follows the sound: closures, vowels, lids, moods."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from studio.motion import Motion
from studio.motion.channels import VRM0_SHAPES
from studio.motion.lag import speech_level, voice_offset
from studio.performer import speech
from studio.performer.curves import GRID_FPS, grid
from studio.performer.face import lids
from studio.performer.performance import ScriptedPerformance, perform_script
from studio.performer.script import Line, Script

MOUTH = [VRM0_SHAPES.index(name) for name in speech.MOUTH]


@functools.cache
def performed(seed: int, fps: float = 120.0, seconds: float = 40.0) -> ScriptedPerformance:
    return perform_script(Script(seed, voice_source="bundled"), seconds, fps)


def phones(found: ScriptedPerformance) -> list[tuple[float, float, str]]:
    lag = Script(0, voice_source="bundled").style.lag
    return [
        (p.t + lag, p.end + lag, p.name)
        for line in found.lines
        for p in line.phones()
        if p.end + 0.3 < found.motion.times[-1]
    ]


@pytest.mark.parametrize("seed", [0, 3])
def test_mouth_and_voice_measure_as_aligned(seed: int) -> None:
    found = performed(seed)
    alignment = voice_offset(speech_level(found.samples, found.sample_rate), found.motion)
    assert abs(alignment.offset) < 0.015
    assert alignment.confidence > 0.5


def part(motion: Motion, start: float, end: float) -> np.ndarray:
    return motion.shapes[(motion.times >= start) & (motion.times <= end)]


@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
def test_lips_close_on_m_b_p(fps: float) -> None:
    found = performed(0, fps)
    closed = [
        part(found.motion, start - 0.04, max(end, start + 0.05))[:, MOUTH].sum(axis=1).min()
        for start, end, name in phones(found)
        if set(name) & set("mbpɸβ")
    ]
    assert len(closed) > 20
    # At 30 Hz a frame may just miss the middle of a short b.
    assert np.mean(np.array(closed) < 0.08) > (0.9 if fps == 30 else 0.99)


def test_lips_are_open_on_open_vowels() -> None:
    found = performed(0)
    wide = [
        part(found.motion, start, end)[:, MOUTH].sum(axis=1).max()
        for start, end, name in phones(found)
        if name[:1] in ("ɑ", "æ", "a") and end - start > 0.08
    ]
    assert len(wide) > 8
    assert np.median(wide) > 0.5


@pytest.mark.parametrize(
    ("shape", "letters"), [("A", "ɑaæʌ"), ("I", "i"), ("U", "uw"), ("E", "ɛe"), ("O", "ɔo")]
)
def test_each_shape_follows_its_sounds(shape: str, letters: str) -> None:
    found = performed(0)
    weights = found.motion.shapes[:, VRM0_SHAPES.index(shape)]
    speaks = np.zeros(len(weights))
    for start, end, name in phones(found):
        if name and name[0] in letters:
            speaks[(found.motion.times >= start) & (found.motion.times <= end)] = 1.0
    assert speaks.sum() > 0
    assert np.corrcoef(weights, speaks)[0, 1] > 0.35
    assert weights[speaks > 0].mean() > 2.5 * weights[speaks == 0].mean()


def test_coarticulation_makes_the_same_sound_look_different() -> None:
    found = performed(0)
    seen = [
        part(found.motion, start, end)[:, MOUTH].mean(axis=0)
        for start, end, name in phones(found)
        if name == "ə"
    ]
    assert np.std(np.array(seen), axis=0).max() > 0.04


def test_mouth_rests_between_sentences() -> None:
    found = performed(0)
    for line in found.lines[:-1]:
        quiet = part(found.motion, line.voice_end + 0.25, line.end)
        if len(quiet):
            assert quiet[:, MOUTH].sum(axis=1).max() < 0.12


def test_weights_stay_within_bounds_and_never_jump() -> None:
    shapes = performed(1).motion.shapes
    assert shapes.min() >= 0.0
    assert shapes.max() <= 1.0
    assert np.abs(np.diff(shapes, axis=0)).max() * 120 < 40


def lines(seed: int, minutes: float) -> list[Line]:
    script, found = Script(seed, voice_source="bundled"), []
    while not found or found[-1].end < 60 * minutes:
        found.append(script.next_line())
    return found


@pytest.mark.parametrize("seed", [0, 3])
def test_blinks_as_often_and_as_long_as_people_do(seed: int) -> None:
    said = lines(seed, 4.0)
    script = Script(seed, voice_source="bundled")
    times = grid(0.0, said[-1].end)
    shut = lids(times, said, script.style)["Blink"]
    below = shut > 0.5
    starts = np.flatnonzero(below[1:] & ~below[:-1])
    ends = np.flatnonzero(~below[1:] & below[:-1])
    a_minute = len(starts) / (times[-1] / 60)
    assert 14 < a_minute < 34
    half_closed = (ends[: len(starts)] - starts[: len(ends)]) / GRID_FPS
    assert 0.08 < np.median(half_closed) < 0.25
    gaps = np.diff(starts) / GRID_FPS
    assert 0.3 < np.std(gaps) / np.mean(gaps) < 1.0, "neither a metronome nor pure chance"


def test_lids_never_close_more_than_shut() -> None:
    shapes = performed(2).motion.shapes
    both, left, right = (shapes[:, VRM0_SHAPES.index(name)] for name in ("Blink", "Blink_L", "Blink_R"))
    assert (both + left).max() <= 1.0 + 1e-6
    assert (both + right).max() <= 1.0 + 1e-6
    assert both.max() > 0.85


def test_moods_rise_with_their_sentences_and_leave_the_rest_to_neutral() -> None:
    found = performed(0)
    names = ("Joy", "Fun", "Sorrow", "Angry", "Surprised")
    total = sum(found.motion.shapes[:, VRM0_SHAPES.index(name)] for name in names)
    neutral = found.motion.shapes[:, VRM0_SHAPES.index("Neutral")]
    assert neutral == pytest.approx(np.clip(1 - total, 0, 1), abs=1e-5)
    moods = [line for line in found.lines if line.speech.sentence.mood != "Neutral" and line.end < 40]
    assert moods
    for line in moods:
        weights = found.motion.shapes[:, VRM0_SHAPES.index(line.speech.sentence.mood)]
        middle = (line.voice_start + line.voice_end) / 2
        assert weights[np.searchsorted(found.motion.times, middle)] > 0.15
