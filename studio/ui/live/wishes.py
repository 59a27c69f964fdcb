"""Switches that were just pressed: what the child told of itself before it heard must not press them back."""

from __future__ import annotations

import time
from collections.abc import Callable

HEARD_S = 1.0
"""Seconds within which a child that is well has heard a wish and told how it stands since."""


class PendingSwitches:
    """What was wished lately, by the switch's name.

    Args:
        now: a clock in seconds.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._wished: dict[str, tuple[bool, float]] = {}

    def wish(self, name: str, on: bool) -> None:
        """A switch was pressed."""
        self._wished[name] = on, self._now()

    def shown(self, name: str, told: bool) -> bool:
        """How a switch is to be shown where the child tells it stands so."""
        on, at = self._wished.get(name, (told, float("-inf")))
        return on if self._now() - at < HEARD_S else told

    def forget(self) -> None:
        """Nobody is there any more to answer."""
        self._wished.clear()
