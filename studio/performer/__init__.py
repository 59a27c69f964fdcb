"""The practice performer: a voice and the motion that goes with it, without hardware."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion
from studio.performer.broadcast import Broadcast
from studio.performer.sample import make_sample
from studio.performer.script import Script
from studio.performer.stage import Performance, perform_script

__all__ = ["Broadcast", "Performance", "Script", "make_sample", "perform", "perform_script"]


def perform(
    what: str | int = 0, seconds: float | None = None, fps: float = 60.0
) -> tuple[NDArray[np.float32], int, Motion]:
    """Speak and move.

    Args:
        what: a text to say (needs espeak-ng), or a number: the performer's seed, for a script of their own.
        seconds: how long; a text is said once where None, a script runs for 20 s.
        fps: frames a second, 30 to 120 as a rule.

    Returns:
        Mono sound (N,), its sample rate, and the motion on the same clock.
    """
    if isinstance(what, str):
        found = perform_script(Script(texts=(what,)), seconds, fps, 1)
    else:
        found = perform_script(Script(performer=what), 20.0 if seconds is None else seconds, fps)
    return found.samples, found.sample_rate, found.motion
