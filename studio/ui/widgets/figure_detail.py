"""How finely a figure is drawn: where pictures take too long, in fewer pixels, for motion matters more."""

from __future__ import annotations

from collections import deque

SHARES = (1.0, 0.7, 0.5)
"""Of a picture's height and width that are drawn; the rest is scaled up."""
SLOW, EASY = 0.025, 0.018
"""Seconds: a picture that takes longer is drawn coarser; one that would take no longer finer, finer again."""
_KEPT = 12


class Detail:
    """Chooses the share by what pictures took."""

    def __init__(self) -> None:
        self._step = 0
        self._costs: deque[float] = deque(maxlen=_KEPT)

    @property
    def share(self) -> float:
        """Of the height and width to draw."""
        return SHARES[self._step]

    def saw(self, cost: float) -> None:
        """A picture took so many seconds."""
        self._costs.append(cost)
        if len(self._costs) < _KEPT:
            return
        # The quickest counts: a computer that is held up by something else for a while is not slow.
        quickest = min(self._costs)
        if quickest > SLOW and self._step < len(SHARES) - 1:
            self._go(self._step + 1)
        elif self._step and max(self._costs) * (SHARES[self._step - 1] / self.share) ** 2 < EASY:
            self._go(self._step - 1)

    def begin_anew(self) -> None:
        """Something else is drawn, or in another size."""
        self._go(0)

    def _go(self, step: int) -> None:
        self._step = step
        self._costs.clear()
