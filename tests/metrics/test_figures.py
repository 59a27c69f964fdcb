"""Figures of closures, timing, blinks, places, beats and variety whose answers are known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from studio.cli._measure import MAIN, MORE
from studio.metrics import body
from studio.metrics import face as metrics_face
from studio.metrics.comparison import all_figures as full
from studio.metrics.scores import Pair
from studio.motion import Motion, rotation
from studio.motion.lag import speech_level

RATE = 16000
T = np.arange(600) / 30


def face(values: np.ndarray, *names: str) -> Motion:
    return Motion.build(T[: len(values)], names, values.reshape(len(values), len(names)))


def bursts(times: np.ndarray) -> np.ndarray:
    """Syllables 0.3 s long at irregular moments."""
    starts = np.cumsum(np.random.default_rng(4).uniform(0.5, 0.9, 28))
    return np.exp(-0.5 * ((times[:, None] - starts[None] - 0.15) / 0.06) ** 2).sum(axis=1)


def voice() -> np.ndarray:
    n = np.arange(20 * RATE) / RATE
    noise = np.random.default_rng(1).normal(0, 0.2, len(n))
    return speech_level((noise * bursts(n)).astype(np.float32), RATE)


def hum() -> np.ndarray:
    return speech_level(np.random.default_rng(1).normal(0, 0.1, 20 * RATE).astype(np.float32), RATE)


@pytest.mark.parametrize("name", ["jawOpen", "mouth_stretch_c", "A"])
def test_closures_are_found_and_missed(name: str) -> None:
    truth = 0.6 * (np.arange(600) % 20 >= 5).astype(float)  # closed a quarter of the time
    half = truth.copy()
    half[300:] = 0.6  # never closes in the second half
    half[5:15] = 0.0  # and closes where it should not
    recall, precision = metrics_face.closures([Pair(face(truth, name), face(half, name), voice=hum())])
    assert recall == pytest.approx(0.5)
    assert precision == pytest.approx(75 / 85)


def test_a_mouth_shut_for_good_is_seen_in_precision() -> None:
    truth = 0.6 * (np.arange(600) % 20 >= 5).astype(float)
    pair = Pair(face(truth, "jawOpen"), face(np.zeros(600), "jawOpen"), voice=hum())
    assert metrics_face.closures([pair]) == (1.0, pytest.approx(0.25))


def test_the_times_the_lips_close_are_counted_beside_the_captured_ones() -> None:
    truth = 0.6 * (np.arange(600) % 20 >= 5).astype(float)  # closes thirty times
    half = truth.copy()
    half[300:] = 0.6  # never closes in the second half
    half[8:12] = 0.0  # and closes where it should not
    trembling = truth + 0.05 * (np.arange(600) % 2) * (truth == 0)  # closes as often, unsteadily
    assert metrics_face.closings(Pair(face(truth, "A"), face(half, "A"))) == (15, 30, 1)
    assert metrics_face.closings(Pair(face(trembling, "A"), face(truth, "A"))) == (30, 30, 0)
    late = np.roll(truth, 2)
    assert metrics_face.closings(Pair(face(truth, "A"), face(late, "A"))) == (30, 30, 0), "67 ms late"
    valid = (np.arange(600) < 400).astype(float)
    assert metrics_face.closings(Pair(face(truth, "A"), face(half, "A"), valid)) == (15, 20, 1)
    shut, apart = np.full((2, 600), 0.5)
    shut[60:90] = shut[150:180] = apart[60:180] = 0.0
    valid = (np.arange(600) < 90) | (np.arange(600) >= 150)
    assert metrics_face.closings(Pair(face(shut, "A"), face(shut, "A"), valid)) == (2, 2, 0), "two, not one"
    apart[60:94] = apart[146:180] = 0.5
    assert metrics_face.closings(Pair(face(shut, "A"), face(apart, "A"), valid)) == (0, 2, 0), (
        "in what is left out"
    )
    still = face(np.zeros(600), "A")
    assert metrics_face.closings(Pair(still, face(truth, "A"))) is None, "there is none to be found"
    assert metrics_face.closings(Pair(face(truth, "browInnerUp"), face(truth, "browInnerUp"))) is None


def test_sealed_lips_close_an_open_jaw() -> None:
    motion = face(np.tile([0.4, 0.4], (600, 1)), "jawOpen", "mouthClose")
    opening = metrics_face.opening(motion)
    assert opening is not None
    np.testing.assert_allclose(opening, 0, atol=1e-6)
    assert metrics_face.opening(face(T, "browInnerUp")) is None


def test_silence_is_not_speaking_and_a_short_stop_is() -> None:
    samples = np.random.default_rng(1).normal(0, 0.1, 20 * RATE).astype(np.float32)
    samples[: 2 * RATE] = 0
    samples[5 * RATE : round(5.12 * RATE)] = 0  # the stop of a p
    samples[8 * RATE : 9 * RATE] = 0  # a pause
    motion = face(T, "A")
    said = metrics_face.speaking(Pair(motion, motion, voice=speech_level(samples, RATE)))
    assert not said[:58].any()
    assert said[145:160].all()
    assert not said[243:267].any()


@pytest.mark.parametrize("delay_ms", [-60.0, 0.0, 80.0])
def test_the_mouths_delay_is_measured(delay_ms: float) -> None:
    late = face(bursts(T - delay_ms / 1000), "jawOpen")
    found = metrics_face.mouth_lag_ms([Pair(face(bursts(T), "jawOpen"), late, voice=voice())])
    assert found == pytest.approx(delay_ms, abs=12.0)


def test_a_still_mouth_has_no_delay() -> None:
    still = face(np.full(600, 0.2), "jawOpen")
    assert metrics_face.mouth_lag_ms([Pair(still, still, voice=voice())]) is None


def test_blinks_are_counted_not_the_trembling_within_one() -> None:
    eyes = np.zeros(600)
    for at in (30, 130, 400):
        eyes[at : at + 5] = [0.4, 0.9, 0.45, 0.8, 0.2]
    pair = Pair(face(eyes, "eyeBlinkLeft"), face(eyes, "eyeBlinkLeft"))
    assert metrics_face.blinks_per_minute([pair]) == pytest.approx(9.0)
    assert metrics_face.blinks_per_minute([Pair(face(eyes, "A"), face(eyes, "A"))]) is None


def test_motion_made_for_another_sound_is_told_from_its_own() -> None:
    truth = bursts(T)
    other = np.roll(truth, 290)
    rng = np.random.default_rng(3)

    def match(values: np.ndarray) -> float:
        found = metrics_face.sync_match([Pair(face(truth, "jawOpen"), face(values, "jawOpen"))])
        assert found is not None
        return found

    assert match(0.3 * truth + 0.2) == 1.0  # calmer and ajar, but in time
    assert match(truth + rng.normal(0, 0.3, 600)) > 0.9
    assert abs(match(other) - 0.5) < 0.2
    assert match(np.full(600, truth.mean())) == 0.5  # the mean pose fits no sound better than another
    truth[300:] = 0.0
    assert match(truth) == 1.0  # silence, in which nothing can be told, does not count


def test_a_body_that_moves_with_its_sound_is_told_from_one_that_does_not() -> None:
    lively = np.cumsum(np.abs(bursts(T))) / 30
    own = metrics_face.sync_match([Pair(arm(lively), arm(0.5 * lively))])
    swapped = metrics_face.sync_match([Pair(arm(lively), arm(np.roll(lively, 290)))])
    assert own == 1.0
    assert swapped is not None
    assert swapped < 0.75


def arm(angles: np.ndarray) -> Motion:
    bones = ("Hips", "LeftUpperArm", "LeftLowerArm", "LeftHand", "Head")
    turns = np.tile(rotation.IDENTITY, (len(angles), 5, 1))
    turns[:, 1] = rotation.from_axis_angle(np.array([[0.0, 0.0, 1.0]]), angles)
    return Motion.build(T[: len(angles)], bone_names=bones, rotations=turns)


def test_a_turned_shoulder_moves_the_wrist_along_its_circle() -> None:
    figures = body.place_errors([Pair(arm(np.zeros(90)), arm(np.full(90, np.pi / 2)))])
    assert figures["wrist_cm"] == pytest.approx(48 * np.sqrt(2), abs=0.01)  # 25 + 23 cm of arm
    assert figures["head_cm"] == pytest.approx(0.0, abs=1e-6)


def test_frames_that_do_not_count_do_not_move_the_wrist() -> None:
    valid, angles = np.ones(90), np.zeros(90)
    angles[40:50], valid[40:50] = 1.0, 0
    assert body.place_errors([Pair(arm(np.zeros(90)), arm(angles), valid)])["wrist_cm"] == 0


def test_a_face_has_no_places() -> None:
    pair = Pair(face(T, "A"), face(T, "A"), voice=voice())
    assert body.place_figures([pair]) == {"head_cm": None, "wrist_cm": None, "beat_alignment": None}


def test_gestures_on_the_beat_score_higher_than_beside_it_and_stillness_zero() -> None:
    beats = body.onsets(voice())
    assert 20 <= len(beats) <= 35

    def pausing_at(moments: np.ndarray) -> Pair:
        away = np.abs(T[:, None] - moments[None]).min(axis=1)
        return Pair(arm(T), arm(np.cumsum(np.minimum(away, 0.2)) / 3), voice=voice())

    on, beside = (body.beat_alignment([pausing_at(beats + by)]) for by in (0.0, 0.3))
    assert on is not None
    assert beside is not None
    assert on > 0.8
    assert beside < 0.5
    still = Pair(arm(T), arm(np.zeros(600)), voice=voice())
    assert body.beat_alignment([still]) == 0.0
    silent = Pair(arm(T), arm(T), voice=speech_level(np.zeros(20 * RATE, np.float32), RATE))
    assert body.beat_alignment([silent]) is None


def test_diversity_is_half_the_mean_distance_of_pairs() -> None:
    poses = np.random.default_rng(0).normal(size=(40, 3))
    apart = np.abs(poses[:, None] - poses[None]).sum()
    assert body.l1_diversity([poses[:25], poses[25:]]) == pytest.approx(apart / (2 * 40 * 39))
    assert body.l1_diversity([np.ones((9, 3))]) == pytest.approx(0.0)
    assert body.l1_diversity([np.zeros((9, 0))]) is None


def test_the_frechet_distance_of_a_frozen_mean_is_one_and_of_the_same_is_zero() -> None:
    rng = np.random.default_rng(0)
    values = 0.5 + 0.1 * np.cumsum(rng.normal(size=(600, 3)), axis=0) / 10
    truth, mean = face(values, "A", "B", "C"), face(np.tile(values.mean(axis=0), (600, 1)), "A", "B", "C")
    assert body.frechet([Pair(truth, truth)]) == pytest.approx(0.0, abs=1e-6)
    assert body.frechet([Pair(truth, mean)]) == pytest.approx(1.0, abs=0.02)
    beyond = face(np.where(values > 0.5, 1e37, values), "A", "B", "C")
    assert body.frechet([Pair(truth, beyond)]) is None
    backwards = face(values[::-1].copy(), "A", "B", "C")  # other frames, the same poses
    found = body.frechet([Pair(truth, backwards)])
    assert found is not None
    assert found < 0.05


def test_the_captured_motion_held_against_itself_is_perfect_in_everything() -> None:
    motion = face(bursts(T), "jawOpen")
    figures = full([Pair(motion, motion, voice=voice())])
    assert figures["closure_recall"] == figures["closure_precision"] == 1.0
    assert figures["mouth_lag_ms"] == pytest.approx(0.0, abs=12.0)
    assert figures["frechet"] == pytest.approx(0.0, abs=1e-6)
    assert figures["wrist_cm"] is None


def test_every_figure_has_its_place_in_the_table_and_comes_out_the_same_twice() -> None:
    names, axis = ("Head", "LeftHand", "Hips"), np.tile([1.0, 0.0, 0.0], (len(T), 3, 1))
    turns = rotation.from_axis_angle(axis, 0.2 * np.sin(T)[:, None])
    both = Motion.build(T, ("jawOpen", "eyeBlinkLeft"), np.stack([bursts(T)] * 2, axis=1), names, None, turns)
    pairs = [Pair(both, both, voice=voice())]
    figures = full(pairs)
    assert set(figures) == {key for key, _, _ in MAIN + MORE}
    assert figures == full(pairs)


def test_nothing_to_compare_gives_no_figures() -> None:
    empty = face(np.zeros((0, 1)), "A")
    assert all(value is None for value in full([Pair(empty, empty)]).values())
    assert all(value is None for value in full([]).values())
    short = face(np.zeros((2, 1)), "A")
    assert full([Pair(short, short, voice=speech_level(np.zeros(900, np.float32), RATE))])["rmse"] == 0
