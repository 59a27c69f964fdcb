"""What is laid over a motion without changing it: strength, smoothing, blinks, gaze, breath, masks, feet.

`tuned` is for a whole motion, `Tuner` for one pose after another; both do the same.
"""

from studio.playback.layers.apply import Tuner, tuned
from studio.playback.layers.reference import Reference
from studio.playback.layers.tuning import ShapeTuning, Tuning

__all__ = ["Reference", "ShapeTuning", "Tuner", "Tuning", "tuned"]
