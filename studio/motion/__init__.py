"""What moves: channel names, the humanoid skeleton, rotations, and Motion itself.

avatar          An avatar: a humanoid of its own proportions with the surfaces and expressions it may have
channels        What the channels are called, and in which order: expressions, bones and SAIA's 396 columns
curve_channels  Which motion channels can be drawn as curves, which move at all, and their values. Pure: no
                Qt
expression      An avatar's named faces, and which blend shapes move them
filmed          What pictures say of the motion tracked in them: shares, spans of no use, and a second face
                beside it
grid            Motion on even frames: the rate that was meant, the frames compared and learnt, and which
                of them count
lag             How much later the mouth moves than the voice sounds: mouth opening against speech energy
leg             A leg whose foot is to stand somewhere: how it bends, and by how much its hip is too high
                for it
look_at         What moves an avatar's eyes: bones or expressions, and how far a gaze turns them
material        How an avatar's surfaces look: plain, unlit or as MToon has them
moods           Moods: labelled stretches as something a network is told, and where a person asks for them
motion          Motion: blend shape weights and bone transforms of one performer over time
neutral         The pose an avatar is left in, the way into it, and a wave that shows a connection works
rig             What moves of an avatar beside its bones: nodes that copy or aim at others, and what swings
rotation        Rotations as unit quaternions (x, y, z, w) and their other forms
sanitize        Sanitizes motion: values that are no numbers or impossible, as damaged files have them, are
                replaced
shape_sets      VRM's expressions and ARKit's shapes made of one another. Approximate: mouths differ
skeleton        The humanoid skeleton: hierarchy, rest pose and forward kinematics
springs         What swings from an avatar: hair, skirts and ears, the same at any frame rate
standing        Where a body stands: place and heading told by its feet and put into the root, and feet
                that stay
"""

from studio.motion.motion import Motion, MotionBuffer, Pose, concatenate
from studio.motion.skeleton import Skeleton

__all__ = ["Motion", "MotionBuffer", "Pose", "Skeleton", "concatenate"]
