"""What Record says of the capture: nothing is called fine that is said to be wrong beside it."""

from __future__ import annotations

import pytest

from studio.capture.snapshot import RecorderState, Snapshot
from studio.ui.record.health_presenter import findings, strip_motion, strip_sound
from studio.ui.record.input_tests_presenter import sync_text
from studio.ui.record.inputs_presenter import motion_text, sound_health

SILENT = frozenset({"sound", "silent"})


def _snapshot(**facts: object) -> Snapshot:
    alive = {
        "motion_alive": True,
        "audio_alive": True,
        "port": 39539,
        "device": "default",
        "hold_dbfs": -20.0,
    }
    return Snapshot(**({"state": RecorderState.ARMED} | alive | facts))  # type: ignore[arg-type]


def _sentences(snap: Snapshot) -> list[str]:
    return [what for what, _, _ in findings(snap, {}, microphone=True)]


def test_all_is_well() -> None:
    assert _sentences(_snapshot()) == ["Motion looks good.", "Sound looks good."]


def test_a_silent_microphone_is_not_fine_and_has_its_name() -> None:
    snap = _snapshot(problems=(("No sound from default.", "Unmute it."),), troubled=SILENT)
    assert _sentences(snap) == ["No sound from the default microphone.", "Motion looks good."]


def test_lost_frames_are_not_steady_motion() -> None:
    what = "Your tracker dropped 9 frames in the last few seconds."
    assert _sentences(_snapshot(problems=((what, ""),), troubled=frozenset({"motion"}))) == [
        what,
        "Sound looks good.",
    ]


def test_the_strip_says_what_is_so() -> None:
    loud = _snapshot(frames_per_s=60.0, hold_dbfs=-12.0)
    assert strip_motion(loud) == ("VMC 60.0/s", "good")
    assert strip_sound(loud) == ("Mic -12 dBFS", "good")
    silent = _snapshot(hold_dbfs=-90.0, problems=(("No sound from default.", ""),), troubled=SILENT)
    assert strip_sound(silent) == ("Mic silent", "warn")
    closed = _snapshot(port=None, motion_alive=False)
    assert strip_motion(closed) == ("motion port in use", "warn")
    assert motion_text(closed) == ("not open", "warn")


def test_the_microphone_has_a_light() -> None:
    assert sound_health(_snapshot(), {}) == "good"
    assert sound_health(_snapshot(clipped=True), {}) == "warn"
    assert sound_health(_snapshot(audio_alive=False), {}) == "warn"
    assert sound_health(_snapshot(device=None), {}) == ""
    assert sound_health(_snapshot(device=None), {"sound": ("It is taken.", "")}) == "warn"


@pytest.mark.parametrize(
    "what",
    [
        "Motion stopped 2 s ago.",
        "The motion is frozen: nothing has moved for 3 s.",
    ],
)
def test_motion_with_a_problem_is_not_steady(what: str) -> None:
    assert _sentences(_snapshot(problems=((what, ""),), troubled=frozenset({"motion"}))) == [
        what,
        "Sound looks good.",
    ]


@pytest.mark.parametrize(
    ("offset", "said", "health"),
    [
        (2.0, "-2 ms  in sync", "good"),
        (40.0, "-40 ms  in sync", "good"),  # late sound is noticed later than early sound
        (-40.0, "+40 ms  corrected", "warn"),
        (80.0, "-80 ms  corrected", "warn"),
        (200.0, "-200 ms  far off, corrected", "bad"),
    ],
)
def test_the_offset_is_judged_by_what_people_notice(offset: float, said: str, health: str) -> None:
    assert sync_text(_snapshot(offset_ms=offset)) == (said, health)


def test_while_nobody_speaks_sync_is_not_judged() -> None:
    assert sync_text(_snapshot(offset_ms=2.0, hold_dbfs=-90.0)) == ("needs your voice", "")
    assert _sentences(_snapshot(hold_dbfs=-90.0))[1] == "No voice yet. Say something to check the microphone."


def test_without_motion_nothing_is_in_or_out_of_sync() -> None:
    assert sync_text(_snapshot(offset_ms=20.0, motion_alive=False)) == ("needs sound and motion", "")


def test_a_take_without_motion_is_said_while_it_is_recorded() -> None:
    still = _snapshot(motion_alive=False)
    before, while_rolling = (findings(still, {}, True, rolling)[0] for rolling in (False, True))
    assert before == ("No motion signal yet.", "", "")
    assert while_rolling[0] == "No motion signal. This take has sound only so far."
    assert while_rolling[2] == "warn"
