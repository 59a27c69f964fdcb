"""The practice performer: a voice and the motion that goes with it, without hardware.

body         All 54 bones: head and torso follow melody, beats and breath; arms beat; legs keep both feet flat
broadcast    The performer live: its voice from a loudspeaker and its motion over VMC, in time with each
             other
curves       Curves that the whole body is made of, each a pure function of absolute time
espeak       Speech with true phoneme times from the espeak-ng library
face         The 18 VRM0 shapes: lips that follow the phonemes, lids, moods, and where the eyes look
loudspeaker  The performer's voice on an output device, and which moment of it is in the ear
performance  A performance: sound and motion of a stretch of a script
prosody      The melody and loudness of a sentence, measured from its sound, and the syllables that stand
             out
sample       The sample project: a few minutes of the practice performer, made on the spot
script       What happens when, and how a performer moves: lines one after another, each with its plan of
             movement
sentences    What the practice performer says: written sentences, an endless grammar, and the bundled clips
speech       One spoken sentence: its sound, when each phoneme begins, and what each phoneme asks of the lips
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion
from studio.performer.broadcast import Broadcast
from studio.performer.performance import ScriptedPerformance, perform_script
from studio.performer.sample import make_sample
from studio.performer.script import Script

__all__ = ["Broadcast", "Script", "ScriptedPerformance", "make_sample", "perform", "perform_script"]


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
