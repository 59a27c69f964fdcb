"""What moves: channel names, the humanoid skeleton, rotations, and Motion itself."""

from studio.motion.clip import Motion, Pose, concatenate
from studio.motion.skeleton import Skeleton

__all__ = ["Motion", "Pose", "Skeleton", "concatenate"]
