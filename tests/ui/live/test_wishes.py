"""A switch that was just pressed stays as it was pressed until the child can have heard of it."""

from __future__ import annotations

from studio.ui.live.wishes import HEARD_S, PendingSwitches


class Clock:
    """Seconds that pass when told to."""

    def __init__(self) -> None:
        self.seconds = 100.0

    def __call__(self) -> float:
        return self.seconds


def test_what_was_told_before_the_wish_was_heard_undoes_nothing() -> None:
    clock = Clock()
    wishes = PendingSwitches(clock)
    assert not wishes.shown("mute", False)
    wishes.wish("mute", True)
    assert wishes.shown("mute", False)
    assert not wishes.shown("freeze", False)
    wishes.wish("mute", False)
    assert not wishes.shown("mute", True)


def test_after_a_while_the_child_is_right() -> None:
    clock = Clock()
    wishes = PendingSwitches(clock)
    wishes.wish("mute", True)
    clock.seconds += HEARD_S
    assert not wishes.shown("mute", False)
    wishes.wish("neutral", True)
    wishes.forget()
    assert not wishes.shown("neutral", False)
