"""The transport's state machine as a table of (state, event) to the next state.

The position of the sound that is heard leads; this table only says whether it moves.
Source: the form is Ardour's (transport_fsm.h): states, events, one table, nothing implied.
"""

from __future__ import annotations

from enum import StrEnum


class TransportState(StrEnum):
    """Where the transport stands."""

    STOPPED = "stopped"
    """Silent at a position."""
    STARTING = "starting"
    """Asked to roll; the first sound is on its way to the ear."""
    ROLLING = "rolling"
    """Heard and moving."""
    ENDED = "ended"
    """Silent at the end; playing again begins at the start."""
    CLOSED = "closed"
    """Done for good; everything is ignored."""


class Event(StrEnum):
    """What can happen to a transport."""

    PLAY = "play"
    PAUSE = "pause"
    SEEK = "seek"
    PLAYED = "heard"
    """The first sample after a start or a seek reached the ear."""
    END = "end"
    CLOSE = "close"


_S, _E = TransportState, Event

TABLE: dict[tuple[TransportState, Event], TransportState] = {
    (_S.STOPPED, _E.PLAY): _S.STARTING,
    (_S.STOPPED, _E.PAUSE): _S.STOPPED,
    (_S.STOPPED, _E.SEEK): _S.STOPPED,
    (_S.STOPPED, _E.PLAYED): _S.STOPPED,  # a last block arriving after the pause
    (_S.STOPPED, _E.END): _S.STOPPED,
    (_S.STARTING, _E.PLAY): _S.STARTING,
    (_S.STARTING, _E.PAUSE): _S.STOPPED,
    (_S.STARTING, _E.SEEK): _S.STARTING,
    (_S.STARTING, _E.PLAYED): _S.ROLLING,
    (_S.STARTING, _E.END): _S.ENDED,
    (_S.ROLLING, _E.PLAY): _S.ROLLING,
    (_S.ROLLING, _E.PAUSE): _S.STOPPED,
    (_S.ROLLING, _E.SEEK): _S.STARTING,
    (_S.ROLLING, _E.PLAYED): _S.ROLLING,
    (_S.ROLLING, _E.END): _S.ENDED,
    (_S.ENDED, _E.PLAY): _S.STARTING,
    (_S.ENDED, _E.PAUSE): _S.ENDED,
    (_S.ENDED, _E.SEEK): _S.STOPPED,
    (_S.ENDED, _E.PLAYED): _S.ENDED,
    (_S.ENDED, _E.END): _S.ENDED,
    **{(state, _E.CLOSE): _S.CLOSED for state in _S},
    **{(_S.CLOSED, event): _S.CLOSED for event in _E},
}
"""Every state with every event; a pair that is missing is a fault of this file (a test counts them)."""

MOVING = frozenset({TransportState.STARTING, TransportState.ROLLING})
"""States in which sound is on its way or heard."""


def after(state: TransportState, event: Event) -> TransportState:
    """The state that follows."""
    return TABLE[state, event]
