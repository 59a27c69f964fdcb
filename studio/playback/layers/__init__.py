"""What is laid over a motion without changing it: strength, smoothing, blinks, gaze, breath, masks, feet.

`tuned` is for a whole motion, `PieceTuner` for one that is still growing, `Tuner` for one pose after another;
all do the same.

apply      Applies a tuning to a whole motion, or to a stream of poses
blinks     Blinks at human intervals, on top of those a motion has
foot_lock  Root lock, and foot lock by two-bone inverse kinematics while the hips move
gaze       Eye darts: the gaze leaves the viewer for a moment and comes back, as it does in talk
idle       Breath and sway: what a body does that does nothing. Sums of slow waves, so a function of time
           alone
presets    Tunings with a name, kept as JSON: some that come with the studio, others in a project's folder
regions    Regions of the body: which shape or bone belongs where, what is masked, and the posture they
           refer to
schedule   Random events that are a function of time and a seed: any moment has one answer
smoothing  Calmer motion in which lips still meet and blinks stay blinks: of a whole motion, and of a stream
strength   Strength of motion: blend shapes scaled, bones swung further or less far about their mean
tuning     Tuning: settings of the layers over a motion, with their limits
"""

from studio.playback.layers.apply import PieceTuner, Tuner, tuned
from studio.playback.layers.regions import Reference
from studio.playback.layers.tuning import ShapeTuning, Tuning

__all__ = ["PieceTuner", "Reference", "ShapeTuning", "Tuner", "Tuning", "tuned"]
