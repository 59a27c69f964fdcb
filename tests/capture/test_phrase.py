"""A phrase from the microphone: it waits for a voice, and ends at a pause or when it is long enough."""

from __future__ import annotations

import numpy as np
import pytest

from studio.capture.phrase import LONGEST_S, PAUSE_S, PhraseEnd, nothing_heard

RATE, BLOCK = 16_000, 800


def listen(seconds: float, voice: list[tuple[float, float]], room: float = 0.002) -> PhraseEnd:
    """A room's noise, and a voice in spans of seconds, block by block until it ends."""
    random, end = np.random.default_rng(0), PhraseEnd(RATE)
    for number in range(int(seconds * RATE / BLOCK)):
        t = number * BLOCK / RATE
        level = 0.2 if any(a <= t < b for a, b in voice) else room
        if end.feed((level * random.normal(size=(BLOCK, 1))).astype(np.float32)).ended:
            break
    return end


@pytest.mark.parametrize("room", [0.0, 0.002, 0.01])
def test_a_pause_ends_it_and_a_breath_does_not(room: float) -> None:
    state = listen(9.0, [(1.0, 2.0), (2.8, 4.0)], room).state
    assert state.spoken
    assert state.ended
    assert state.duration == pytest.approx(4.0 + PAUSE_S, abs=0.1)


def test_it_waits_for_a_voice_and_says_that_none_came() -> None:
    end = listen(5.0, [])
    assert not end.state.ended
    assert not end.state.spoken
    assert listen(12.0, []).state.ended


def test_who_never_pauses_is_stopped() -> None:
    state = listen(15.0, [(0.0, 15.0)]).state
    assert state.ended
    assert state.duration == pytest.approx(LONGEST_S, abs=0.1)


def test_a_microphone_that_heard_nothing_is_named_as_people_know_it() -> None:
    remedy = "Check that it is switched on, or type a sentence."
    assert str(nothing_heard("default")) == f"Nothing was heard from the default microphone. {remedy}"
    assert str(nothing_heard("USB Mic")) == f"Nothing was heard from USB Mic. {remedy}"
