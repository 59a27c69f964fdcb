"""A switch that was just pressed stays as it was pressed until the child can have heard of it."""

from __future__ import annotations

from studio.ui.live.model import ANSWER_S, PendingSwitches


class Clock:
    """Seconds that pass when told to."""

    def __init__(self) -> None:
        self.seconds = 100.0

    def __call__(self) -> float:
        return self.seconds


def test_a_state_sent_before_a_switch_was_read_undoes_nothing() -> None:
    clock = Clock()
    switches = PendingSwitches(clock)
    assert not switches.shown("mute", False)
    switches.press("mute", True)
    assert switches.shown("mute", False)
    assert not switches.shown("freeze", False)
    switches.press("mute", False)
    assert not switches.shown("mute", True)


def test_after_a_while_the_child_is_right() -> None:
    clock = Clock()
    switches = PendingSwitches(clock)
    switches.press("mute", True)
    clock.seconds += ANSWER_S
    assert not switches.shown("mute", False)
    switches.press("neutral", True)
    switches.clear()
    assert not switches.shown("neutral", False)
