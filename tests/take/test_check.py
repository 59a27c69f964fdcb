"""What is wrong with a take, in words."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from studio.motion import Motion, Skeleton, rotation
from studio.sound.sound_file import Sound, write_sound
from studio.take import Take, TakeInfo
from studio.take.check import check_take, proof_of
from studio.take.folder import save_take
from studio.take.motion_file import write_motion

RATE = 16000
SECONDS = 24.0
BONES = ("Head", "Hips", "Neck", "Spine")


def syllables(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """How open a speaking mouth is: bursts of uneven lengths with pauses."""
    wave = np.sin(2 * np.pi * 2.3 * t) + np.sin(2 * np.pi * 3.7 * t + 1) + np.sin(2 * np.pi * 0.31 * t)
    return np.clip(wave / 2, 0, 1)


def voice(noise: float = 0.0005, gain: float = 0.5) -> NDArray[np.float32]:
    t = np.arange(int(SECONDS * RATE)) / RATE
    rng = np.random.default_rng(1)
    tone = gain * syllables(t) * np.sin(2 * np.pi * 180 * t)
    return np.asarray(tone + noise * rng.normal(size=len(t)), dtype=np.float32)


def motion(late: float = 0.0, fps: float = 60.0) -> Motion:
    t = np.arange(int(SECONDS * fps)) / fps
    blink = ((t % 4) < 0.15).astype(float)
    nod = rotation.from_axis_angle([1.0, 0.0, 0.0], 0.1 * np.sin(t))
    turns = np.tile(rotation.IDENTITY, (len(t), 4, 1))
    turns[:, 0] = nod
    positions = np.tile(Skeleton.humanoid(BONES).rest_positions, (len(t), 1, 1))
    return Motion.build(t, ("A", "Blink"), np.stack([syllables(t - late), blink], 1), BONES, positions, turns)


def take_of(
    folder: Path, moves: Motion | None = None, samples: NDArray[np.float32] | None = None, rate: int = RATE
) -> Take:
    audio = None
    if samples is not None:
        audio = folder / "in.wav"
        write_sound(audio, Sound(samples[:, None], rate))
    return save_take(folder / "takes" / "a_001", TakeInfo("a"), moves, audio)


def kinds(take: Take) -> dict[str, str]:
    return {finding.kind: finding.what for finding in check_take(take).findings}


def test_a_good_take_is_an_a(tmp_path: Path) -> None:
    report = check_take(take_of(tmp_path, motion(), voice()))
    assert (report.grade, report.reason) == ("A", "No problems found.")
    assert report.findings == ()
    assert report.fps == pytest.approx(60, abs=0.1)
    assert report.jitter_ms < 0.1
    assert report.offset_ms == pytest.approx(0, abs=8)
    assert report.confidence > 0.9


@pytest.mark.parametrize("late", [0.2, -0.15, 0.45])
def test_a_late_mouth_is_found_and_measured(tmp_path: Path, late: float) -> None:
    report = check_take(take_of(tmp_path, motion(late), voice()))
    assert report.offset_ms == pytest.approx(-late * 1000, abs=8)
    finding = next(f for f in report.findings if f.kind == "offset")
    assert finding.severity == ("major" if abs(late) > 0.3 else "minor")
    assert "too late" in finding.what if late > 0 else "too early" in finding.what
    assert finding.remedy == "Press Align to move the motion, or set the offset by hand."


def test_a_mouth_of_another_recording_is_noticed(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    good = motion()
    shapes = good.shapes.copy()
    steps = np.repeat(rng.random(len(good) // 12 + 1), 12)[: len(good)]
    shapes[:, 0] = steps
    other = replace(good, shapes=shapes)
    assert kinds(take_of(tmp_path, other, voice()))["mouth"] == "The mouth does not follow the voice."


def test_gaps_are_told_with_their_place(tmp_path: Path) -> None:
    whole = motion()
    keep = (whole.times < 5.0) | (whole.times > 7.5)
    holed = Motion.build(
        whole.times[keep],
        whole.shape_names,
        whole.shapes[keep],
        BONES,
        whole.positions[keep],
        whole.rotations[keep],
    )
    report = check_take(take_of(tmp_path, holed, voice()))
    gap = next(f for f in report.findings if f.kind == "gap")
    assert gap.severity == "major"
    assert gap.at == pytest.approx(5.0, abs=0.05)
    assert gap.what == "Motion has a gap of 2.53 s."
    assert report.grade == "C"


def test_motion_that_ended_is_told_as_that_and_its_rest_is_left_out(tmp_path: Path) -> None:
    take = take_of(tmp_path, motion().cut(0.0, 6.0), voice())
    assert take.info.left_out == ((6.0, 24.0, "No motion"),)
    report = check_take(replace(take, info=replace(take.info, frames_lost=60)))
    first, second = report.findings[:2]
    assert (first.kind, first.severity, first.at, first.until) == ("ends", "major", 6.0, 24.0)
    assert (first.what, report.reason) == ("Motion ended at 0:06 of 0:24.",) * 2
    assert first.remedy == "The rest is left out of training; record again if you need it."
    assert second.kind == "lost"
    assert proof_of(take, report).what == first.what
    older = check_take(replace(take, info=replace(take.info, left_out=())))
    assert older.findings[0].remedy == "Cut the rest off, or record again."


def test_frames_that_were_never_sent_are_not_lost(tmp_path: Path) -> None:
    whole = motion()
    rows = np.flatnonzero((whole.times < 5.0) | (whole.times > 13.0))
    take = take_of(tmp_path, whole.at_rows(rows), voice())
    ((start, end, why),) = take.info.left_out
    assert (round(start), round(end), why) == (5, 13, "No motion")
    found = kinds(replace(take, info=replace(take.info, frames_lost=480)))
    assert "lost" not in found
    assert found["gap"] == "Motion has a gap of 8.03 s."
    assert "lost" in kinds(replace(take, info=replace(take.info, frames_lost=580)))


def test_stuck_motion_is_told_apart_from_a_gap(tmp_path: Path) -> None:
    whole = motion()
    index = np.arange(len(whole))
    held = np.where((whole.times > 5) & (whole.times < 10), np.searchsorted(whole.times, 5.0), index)
    stuck = replace(whole, shapes=whole.shapes[held], rotations=whole.rotations[held])
    found = kinds(take_of(tmp_path, stuck, voice()))
    assert found["frozen"].startswith("All motion stands still for 5.0")
    assert "gap" not in found


def test_motion_that_never_moves_is_of_no_use(tmp_path: Path) -> None:
    whole = motion()
    still = replace(
        whole, shapes=whole.shapes * 0, rotations=np.tile(whole.rotations[:1], (len(whole), 1, 1))
    )
    report = check_take(take_of(tmp_path, still, voice()))
    assert report.grade == "D"
    assert report.reason == "Nothing moves in the take."


def test_uneven_and_slow_frames_are_told(tmp_path: Path) -> None:
    slow = motion(fps=20.0)
    rng = np.random.default_rng(3)
    uneven = replace(slow, times=slow.times + rng.uniform(-0.023, 0.023, len(slow)))
    report = check_take(take_of(tmp_path, uneven, voice()))
    found = {f.kind: f.what for f in report.findings}
    assert found["rate"] == f"Motion came at only {report.fps:.0f} frames a second."
    assert "jitter" in found
    assert report.jitter_ms > 10


def test_non_unit_rotations_and_numbers_that_are_none(tmp_path: Path) -> None:
    take = take_of(tmp_path, motion(), voice())
    good = motion()
    rotations, shapes = good.rotations.copy(), good.shapes.copy()
    rotations[60] *= 1.5
    shapes[120, 0] = np.nan
    assert take.motion_path is not None
    write_motion(take.motion_path, replace(good, rotations=rotations, shapes=shapes))
    report = check_take(take)
    found = {f.kind: f for f in report.findings}
    assert found["non_unit"].what == "1 frame holds rotations that are not of length one."
    assert found["non_unit"].at == pytest.approx(1.0, abs=0.01)
    assert found["values"].what == "1 frame holds values that are no numbers."


def test_eyes_that_never_blink(tmp_path: Path) -> None:
    good = motion()
    shapes = good.shapes.copy()
    shapes[:, 1] *= 0.1
    assert (
        kinds(take_of(tmp_path, replace(good, shapes=shapes), voice()))["no_blink"] == "The eyes never blink."
    )


def test_a_still_head(tmp_path: Path) -> None:
    good = motion()
    still = replace(good, rotations=np.tile(good.rotations[:1], (len(good), 1, 1)))
    assert kinds(take_of(tmp_path, still, voice()))["frozen_bones"] == "Head and back do not move."


def test_clipping_is_told_with_its_place(tmp_path: Path) -> None:
    samples = voice()
    samples[5 * RATE : 5 * RATE + 60] = 1.0
    report = check_take(take_of(tmp_path, motion(), samples))
    finding = next(f for f in report.findings if f.kind == "clipping")
    assert finding.what == "The sound is clipped in 60 samples."
    assert finding.at == pytest.approx(5.0, abs=0.001)
    assert report.grade == "B"


@pytest.mark.parametrize(
    ("samples", "kind", "what"),
    [
        (np.zeros(RATE * 24, np.float32), "silence", "The sound is silent."),
        (np.zeros(0, np.float32), "silence", "The sound is empty."),
        (voice(noise=0.05), "noise", "Background noise is only 17 dB below your voice."),
        (voice(gain=0.02, noise=0.00002), "quiet", "The sound is quiet: its peak is -34 dBFS."),
    ],
    ids=["silent", "empty", "noisy", "quiet"],
)
def test_levels(tmp_path: Path, samples: NDArray[np.float32], kind: str, what: str) -> None:
    assert kinds(take_of(tmp_path, motion(), samples))[kind] == what


@pytest.mark.parametrize(
    ("source", "what"),
    [("imported (video)", "This film is nearly silent."), ("imported (wav)", "This sound is nearly silent.")],
)
def test_what_was_brought_in_silent_is_not_blamed_on_a_microphone(
    tmp_path: Path, source: str, what: str
) -> None:
    take = take_of(tmp_path, motion(), np.zeros(RATE * 24, np.float32))
    found = check_take(replace(take, info=replace(take.info, source=source))).findings[0]
    assert (found.what, found.remedy) == (what, "Choose one in which the voice is heard.")


def test_of_a_short_take_it_is_not_said_that_the_mouth_follows_nothing(tmp_path: Path) -> None:
    # Under four seconds no offset is looked for at all, and none found was taken for a mouth of another take.
    take = take_of(tmp_path, motion().cut(0.0, 3.8), voice()[: int(3.8 * RATE)])
    report = check_take(take)
    assert (report.grade, report.correlation) == ("A", None)


def test_low_rate_and_lengths_that_differ(tmp_path: Path) -> None:
    samples = voice()[::2][: 8000 * 20]
    found = kinds(take_of(tmp_path, motion(), samples, rate=8000))
    assert found["rate"] == "The sound was recorded at 8000 Hz, too low for clear consonants."
    assert found["ends"] == "The sound ends 4.0 s before the motion."


def test_damaged_and_missing_files_are_findings(tmp_path: Path) -> None:
    take = take_of(tmp_path, motion(), voice())
    assert take.motion_path is not None
    assert take.audio_path is not None
    take.motion_path.write_bytes(b"ARROW1")
    take.audio_path.unlink()
    report = check_take(take)
    assert report.grade == "D"
    assert {f.what for f in report.findings} >= {
        "motion.arrow in a_001 is damaged.",
        "The sound file audio.wav is missing.",
    }


def test_what_the_recorder_counted_is_told(tmp_path: Path) -> None:
    take = take_of(tmp_path, motion(), voice())
    info = replace(
        take.info,
        frames_lost=100,
        packets=1000,
        packets_bad=20,
        drift_ppm=700.0,
        extra={"late": "90", "packets_lost": "30", "damage": "Near 4.5 s."},
    )
    found = kinds(replace(take, info=info))
    assert found["lost"] == "Lost 100 frames of motion (6.5%)."
    assert found["packets"] == "Could not understand 20 packets."
    assert found["drift"] == "The clocks of sound and motion drift by 700 parts in a million."
    assert found["late"] == "The motion paused 90 times."
    assert found["dropped"] == "This computer was too busy for 30 packets of motion."
    assert found["journal"] == "Near 4.5 s."


def test_a_take_recorded_without_motion_is_no_a(tmp_path: Path) -> None:
    report = check_take(take_of(tmp_path, None, voice()))
    assert (report.grade, report.reason) == ("D", "No motion was recorded.")
    assert report.findings[0].remedy == (
        "Start your tracking app and record it again. Sound only: use it in Review, not for training."
    )


def test_a_take_recorded_without_sound_is_no_a(tmp_path: Path) -> None:
    report = check_take(take_of(tmp_path, motion()))
    assert (report.grade, report.reason) == ("D", "No sound was recorded.")
    assert report.findings[0].remedy == (
        "Choose a microphone and record it again. Nothing can be learnt from it."
    )


def test_a_voice_that_was_imported_alone_is_told_what_it_is_for(tmp_path: Path) -> None:
    take = take_of(tmp_path, None, voice())
    report = check_take(replace(take, info=replace(take.info, source="imported (wav)")))
    assert (report.grade, report.reason) == ("C", "The take has no motion.")
    assert report.findings[0].remedy == "Sound only: use it in Review, not for training."


def test_a_tracker_lost_in_mid_take_is_told_with_its_place(tmp_path: Path) -> None:
    whole = motion()
    held = np.where(
        (whole.times > 5) & (whole.times < 12), np.searchsorted(whole.times, 5.0), np.arange(len(whole))
    )
    rotations = whole.rotations.copy()
    rotations[:, 2] = rotations[:, 0][held]
    report = check_take(take_of(tmp_path, replace(whole, rotations=rotations), voice()))
    (finding,) = [f for f in report.findings if f.kind == "stuck_bones"]
    assert finding.what == "Neck stands still for 7.0 s."
    assert (finding.at, finding.until) == (pytest.approx(5.0, abs=0.1), pytest.approx(12.0, abs=0.1))


def test_a_leg_may_stand_still(tmp_path: Path) -> None:
    whole, bones = motion(), ("Head", "Hips", "RightLowerLeg", "RightLowerArm")
    held = np.where(
        (whole.times > 5) & (whole.times < 12), np.searchsorted(whole.times, 5.0), np.arange(len(whole))
    )
    rotations = whole.rotations.copy()
    rotations[:, 2] = rotations[:, 3] = rotations[:, 0][held]
    standing = Motion.build(whole.times, whole.shape_names, whole.shapes, bones, whole.positions, rotations)
    report = check_take(take_of(tmp_path, standing, voice()))
    (finding,) = [f for f in report.findings if f.kind == "stuck_bones"]
    assert finding.what == "Right lower arm stands still for 7.0 s."


def test_a_whole_take_is_verified_and_one_that_lost_something_is_not(tmp_path: Path) -> None:
    take = take_of(tmp_path, motion(), voice())
    proof = proof_of(take, check_take(take))
    assert (proof.good, proof.what) == (True, "Verified: 24.0 s, 60 fps, nothing lost.")
    one = replace(take, info=replace(take.info, frames_lost=1))
    assert proof_of(one, check_take(one)).what == "Verified: 24.0 s, 60 fps, 1 frame lost."
    many = replace(take, info=replace(take.info, frames_lost=90))
    assert proof_of(many, check_take(many)).what == "Lost 90 frames of motion (5.9%)."
    silent = replace(take, info=replace(take.info, notes=("Sound was lost for 80 ms at 3.0 s.",)))
    assert not proof_of(silent, check_take(silent)).good
    shaky = replace(take, info=replace(take.info, drift_ppm=9000.0))
    assert not proof_of(shaky, check_take(shaky)).good


def test_files_that_hold_less_than_was_recorded_are_found_out(tmp_path: Path) -> None:
    take = take_of(tmp_path, motion(), voice())
    write_motion(take.motion_path, motion().cut(0.0, 10.0))
    proof = proof_of(take, check_take(take))
    assert (proof.good, proof.what) == (False, "Only 601 of 1440 frames of motion are in the file.")
    write_motion(take.motion_path, motion())
    write_sound(take.audio_path, Sound(voice()[: RATE * 5, None], RATE))
    proof = proof_of(take, check_take(take))
    assert proof.what == "Only 5.0 of 24.0 s of sound are in the file."
    assert proof.remedy == "Check the disk, then record the take again."


def filmed(
    folder: Path, moves: Motion, spans: tuple[tuple[float, float, str], ...] = (), **facts: str
) -> Take:
    folder.mkdir(exist_ok=True)
    audio = folder / "in.wav"
    write_sound(audio, Sound(voice()[:, None], RATE))
    info = TakeInfo("a", source="imported (video)", left_out=spans, extra=dict(facts))
    return save_take(folder / "takes" / "a_001", info, moves, audio)


def test_a_gap_that_is_left_out_already_is_told_once(tmp_path: Path) -> None:
    whole = motion(fps=30.0)
    rows = np.flatnonzero((whole.times < 8) | (whole.times > 11))
    spans = ((7.93, 8.07, "Cut"), (8.0, 11.0, "No face"))
    report = check_take(filmed(tmp_path, whole.at_rows(rows), spans, face_seen="0.875"))
    assert [(f.kind, f.severity, f.what) for f in report.findings] == [
        ("face_lost", "minor", "A face was seen in 88% of the pictures.")
    ]
    assert "gap" in kinds(filmed(tmp_path / "bare", whole.at_rows(rows)))


@pytest.mark.parametrize(
    ("facts", "severity", "what"),
    [
        (
            {"phone": True, "lag_ms": 20.4, "jaw": 0.93, "mouth": None, "blinks": 0.81},
            "note",
            "Your webcam follows the phone closely: jaw .93, blinks .81, 20 ms later.",
        ),
        (
            {"phone": False, "lag_ms": -8.0, "jaw": 1.0, "mouth": 0.4, "blinks": 0.5},
            "note",
            "Your webcam follows the other tracker roughly: jaw 1.00, mouth .40, blinks .50, 8 ms earlier.",
        ),
        (
            {"phone": True, "lag_ms": None, "jaw": -0.2, "mouth": 0.1, "blinks": None},
            "minor",
            "Your webcam hardly follows the phone: jaw -.20, mouth .10.",
        ),
    ],
)
def test_a_webcam_beside_a_phone_is_compared_in_words(
    tmp_path: Path, facts: dict[str, object], severity: str, what: str
) -> None:
    report = check_take(filmed(tmp_path, motion(fps=30.0), (), beside=json.dumps(facts)))
    assert [(f.severity, f.what) for f in report.findings] == [(severity, what)]


@pytest.mark.parametrize(
    "text",
    [
        "{", "[]", '{"phone": true}', '{"phone": 1, "lag_ms": "x"}', "NaN", "[" * 100_000,
        '{"phone": 1, "lag_ms": 1' + "0" * 400 + ', "jaw": 0, "mouth": 0, "blinks": 0}',
    ],
    ids=range(7),
)  # fmt: skip
def test_a_comparison_that_makes_no_sense_is_none(tmp_path: Path, text: str) -> None:
    assert check_take(filmed(tmp_path, motion(fps=30.0), (), beside=text)).findings == ()


def test_what_the_pictures_lack_is_said(tmp_path: Path) -> None:
    shares = {
        "face_seen": "1.0",
        "face_blurred": "0.7",
        "face_turned": "0.15",
        "face_dark": "0",
        "face_small": "x",
        "mouth_hidden": "0.05",
    }
    report = check_take(filmed(tmp_path, motion(fps=30.0), ((2.0, 3.0, "Mouth hidden"),), **shares))
    assert [(f.kind, f.severity, f.what) for f in report.findings] == [
        ("face_blurred", "major", "The picture is blurred in 70% of the frames."),
        ("face_turned", "minor", "The head is turned too far from the camera in 15% of the frames."),
        ("mouth_hidden", "minor", "The mouth is hidden in 5% of the frames."),
    ]
    assert (report.findings[-1].at, report.findings[-1].until) == (2.0, 3.0)
