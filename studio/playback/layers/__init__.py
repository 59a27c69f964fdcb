"""What is laid over a motion without changing it: strength, smoothing, blinks, gaze, breath, masks, feet.

`tuned` is for a whole motion, `PieceTuner` for one that is still growing, `Tuner` for one pose after another;
all do the same.

apply      Applies a tuning to a whole motion, or to a stream of poses
foot_lock  Root lock, and foot lock by two-bone inverse kinematics while the hips move
idle       What a body does by itself: blinks, eye darts, breath and sway, each a function of time and a seed
presets    Tunings with a name, kept as JSON: some that come with the studio, others in a project's folder
regions    Regions of the body: which shape or bone belongs where, what is masked, and the posture they
           refer to
strength   Strength and smoothing of motion: shapes scaled, bones swung further or less far, jitter taken out
tuning     Tuning: settings of the layers over a motion, with their limits
"""

from studio.playback.layers.apply import PieceTuner, Tuner, tuned
from studio.playback.layers.regions import Reference
from studio.playback.layers.tuning import ShapeTuning, Tuning

__all__ = ["PieceTuner", "Reference", "ShapeTuning", "Tuner", "Tuning", "tuned"]
