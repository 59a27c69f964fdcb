from __future__ import annotations

import pytest

from studio.playback.transport import MOVING, TABLE, Event, TransportState, after


def test_every_state_answers_every_event() -> None:
    assert set(TABLE) == {(state, event) for state in TransportState for event in Event}


@pytest.mark.parametrize("event", list(Event))
def test_closed_is_for_good(event: Event) -> None:
    assert after(TransportState.CLOSED, event) is TransportState.CLOSED


@pytest.mark.parametrize("state", list(TransportState))
def test_close_closes_from_anywhere(state: TransportState) -> None:
    assert after(state, Event.CLOSE) is TransportState.CLOSED


@pytest.mark.parametrize("state", [s for s in TransportState if s is not TransportState.CLOSED])
def test_play_always_ends_up_moving(state: TransportState) -> None:
    assert after(state, Event.PLAY) in MOVING


@pytest.mark.parametrize("state", list(TransportState))
def test_pause_never_leaves_it_moving(state: TransportState) -> None:
    assert after(state, Event.PAUSE) not in MOVING


@pytest.mark.parametrize("state", list(TransportState))
def test_seeking_neither_starts_nor_stops(state: TransportState) -> None:
    assert (after(state, Event.SEEK) in MOVING) == (state in MOVING)


def test_only_play_sets_it_moving() -> None:
    starts = {event for (state, event), to in TABLE.items() if state not in MOVING and to in MOVING}
    assert starts == {Event.PLAY}


def test_a_seek_while_rolling_waits_for_the_ear_again() -> None:
    assert after(TransportState.ROLLING, Event.SEEK) is TransportState.STARTING
    assert after(TransportState.STARTING, Event.PLAYED) is TransportState.ROLLING
