"""Health in whole sentences, each with its remedy."""

from dataclasses import replace

import pytest

from studio.capture.device_names import PERFORMER_TITLE
from studio.capture.health import InputStatus, losses, problems, troubled
from studio.take.take import TakeInfo
from studio.vmc.senders import Flood

WELL = InputStatus(
    port=39539, listening_for=10, packets=5000, frameless_for=0.01, fps=60, bones=54, shapes=18,
    device="USB Microphone",
)  # fmt: skip


def test_when_all_is_well_nothing_is_said() -> None:
    assert problems(WELL) == ()
    assert problems(InputStatus()) == ()
    assert problems(replace(WELL, frames_lost=3)) == ()  # one in two hundred is no news


def test_a_sender_that_was_ended_on_purpose_is_missed_in_a_take_alone() -> None:
    ended = replace(WELL, frameless_for=4.2, dismissed=True)
    assert (problems(ended), troubled(ended)) == ((), frozenset())
    rolling = replace(ended, rolling=True)
    what, remedy = problems(rolling)[0]
    assert what == "You stopped the practice performer. The take goes on without motion."
    assert remedy == "Start it again, or stop the take."
    assert problems(replace(rolling, device=PERFORMER_TITLE))[0][0].endswith("without motion and voice.")
    assert troubled(rolling) == {"motion"}
    assert problems(replace(rolling, awaited=True)) == (), "it gets ready again"


def test_nobody_is_told_to_turn_on_what_gets_ready() -> None:
    nothing = replace(WELL, packets=0, frameless_for=None)
    assert problems(nothing)
    assert problems(replace(nothing, awaited=True)) == ()


def test_a_sender_is_never_told_to_send_more_and_fewer_frames() -> None:
    few = replace(WELL, fps=12)
    assert [remedy for _, remedy in problems(few)] == ["Raise the sender's frame rate to 30 or 60."]
    for local in (True, False):
        remedies = [remedy for _, remedy in problems(replace(few, frames_lost=20, local=local))]
        assert len(remedies) == 1
        assert "lower" in remedies[0]


@pytest.mark.parametrize(
    ("signs", "what", "remedy"),
    [
        (
            replace(WELL, packets=0, frameless_for=None),
            "No motion arrives on port 39539.",
            "Turn on VMC sending in your tracking program, to this computer's address and port 39539.",
        ),
        (
            replace(WELL, frameless_for=None),
            "Packets arrive on port 39539, but there is no motion in them.",
            "Choose VMC (OSC) as the protocol in the sender.",
        ),
        (
            replace(WELL, frameless_for=None, faceless=True),
            "The camera sees no face.",
            "Sit in front of it, in good light, and look into it.",
        ),
        (
            replace(WELL, frameless_for=4.2, faceless=True),
            "The camera sees no face.",
            "Sit in front of it, in good light, and look into it.",
        ),
        (
            replace(WELL, frameless_for=4.2),
            "Motion stopped 4 s ago.",
            "Check that the sender still runs and that its tracking is on.",
        ),
        (
            replace(WELL, frozen_for=5.0),
            "The motion is frozen: nothing has moved for 5 s.",
            "Check the tracker's camera or batteries, or wake the tracking up in the sender.",
        ),
        (
            replace(WELL, packets_lost=12),
            "This computer had no time for 12 packets of motion.",
            "Close heavy programs, or let the sender bundle its messages.",
        ),
        (
            replace(WELL, frames_lost=4),
            "4 frames of the last seconds were lost on the way.",
            "Use a cable instead of Wi-Fi, or lower the sender's frame rate.",
        ),
        (
            replace(WELL, missing=("LeftHand",)),
            "1 bone has stopped coming: LeftHand.",
            "Check those trackers, or their settings in the sender.",
        ),
        (
            replace(WELL, missing=("Hips", "Spine", "Chest", "Head")),
            "4 bones have stopped coming: Hips, Spine, Chest and 1 more.",
            "Check those trackers, or their settings in the sender.",
        ),
        (
            replace(WELL, packets_bad=90_000, flood=Flood(12_300.4, "10.0.0.7:5511")),
            "Another program floods port 39539: 12,300 packets a second are thrown away.",
            "Close the program that sends from 10.0.0.7:5511, or receive motion on another port.",
        ),
        (
            replace(WELL, flood=Flood(300.0)),
            "Another program floods port 39539: 300 packets a second are thrown away.",
            "Close the programs that send there, or receive motion on another port.",
        ),
        (
            replace(WELL, fps=600, frames_thinned=100),
            "The sender makes 600 frames a second; 500 of them are kept.",
            "Set its frame rate to 60: more makes no motion smoother.",
        ),
        (
            replace(WELL, packets_bad=400),
            "400 packets could not be read in full.",
            "Let only a VMC sender send to port 39539.",
        ),
        (
            replace(WELL, fps=12),
            "Only 12 frames a second arrive.",
            "Raise the sender's frame rate to 30 or 60.",
        ),
        (
            replace(WELL, shapes=0),
            "No blend shapes arrive, only bones.",
            "Turn on expressions (blend shapes) in the sender.",
        ),
        (
            replace(WELL, bones=0),
            "No bones arrive, only blend shapes.",
            "Turn on sending of bones in the sender.",
        ),
        (
            replace(WELL, quiet_for=5),
            "No sound from USB Microphone.",
            "Unmute it, turn its level up, or choose another device.",
        ),
        (
            replace(WELL, clipped=True),
            "The sound is clipped.",
            "Turn the microphone's level down and speak again.",
        ),
        (
            replace(WELL, soundless_for=3),
            "No sound has come from USB Microphone for 3 s.",
            "Check its plug and the sound settings; it is opened again by itself.",
        ),
        (
            replace(WELL, gone=True, rolling=True),
            "USB Microphone is gone.",
            "The motion is still being recorded; plug it in again, then its sound goes on by itself.",
        ),
        (
            replace(WELL, gone=True),
            "USB Microphone is gone.",
            "Plug it in again, then its sound goes on by itself.",
        ),
        (
            replace(WELL, overruns=1),
            "Sound was lost once.",
            "Close heavy programs; the lost moments are kept silent.",
        ),
        (
            replace(WELL, seconds_left=150),
            "The disk has room for 2 more minutes.",
            "Delete what is no longer needed, or keep the project on another disk.",
        ),
        (
            replace(WELL, seconds_left=90),
            "The disk has room for 1 more minute.",
            "Delete what is no longer needed, or keep the project on another disk.",
        ),
    ],
)
def test_each_problem_is_a_sentence_with_a_remedy(signs: InputStatus, what: str, remedy: str) -> None:
    assert problems(signs) == ((what, remedy),)


def test_a_sender_is_given_time_to_start() -> None:
    assert problems(replace(WELL, packets=0, frameless_for=None, listening_for=0.5)) == ()


def test_frames_a_program_here_left_out_are_not_blamed_on_the_network() -> None:
    signs = InputStatus(
        port=39539, packets=100, frameless_for=0.1, bones=54, shapes=18, frames_lost=15, local=True
    )
    assert problems(signs) == (
        (
            "Your tracker dropped 15 frames in the last few seconds.",
            "Close demanding apps, or lower the tracker's frame rate.",
        ),
    )
    assert (
        problems(replace(signs, packets_lost=3))[1][0]
        == "15 frames of the last seconds were lost on the way."
    )


def test_what_a_take_lacks_is_told_in_sentences() -> None:
    assert losses(TakeInfo("Hello", 1, extra={"packets_lost": "0"})) == ()
    lacking = {"packets_lost": "393", "packets_refused": "881638", "frames_thinned": "1"}
    assert losses(TakeInfo("Hello", 1, extra=lacking)) == (
        "881,638 packets of another program, no motion, were thrown away.",
        "This computer had no time for 393 packets.",
        "1 frame was left out, beyond 500 a second.",
    )
