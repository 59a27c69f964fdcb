"""BVH, as VirtualMotionCapture writes it and UniVRM, Blender and three.js read it.

Centimetres; X reversed (right-handed); R = Ry Rx Rz; rotations are changes from the T-pose.
Source: VirtualMotionCapture's BVH recorder; UniVRM's BVH importer.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, counted, say, together
from studio.formats import Imported, _bvh_text
from studio.formats._any_skeleton import to_humanoid
from studio.formats._bones import BoneTables, UnknownSkeleton, corrected, humanoid_names, pairs
from studio.formats._bvh_text import JOINT_CHANNELS, ROOT_CHANNELS, Bvh, Joint
from studio.formats._table import check_suffix
from studio.formats._writing import DEFAULT_FPS, checked, grounded_body, on_grid
from studio.formats.saia_csv import find_audio
from studio.motion import Motion, Skeleton, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN

TITLE = "BVH"
SUFFIX = ".bvh"
BONES_ONLY = True
NOTE = (
    "Body only: no blend shapes, no sound. Frame 1 is the first moment of the sound. Blender, UniVRM and "
    "three.js read it; for FBX or a Unity .anim go through Blender or Unity."
)

# BVH has no unit; the programs that read ours take centimetres.
METRES = 0.01
# As VirtualMotionCapture writes it; some readers refuse a joint without an end.
END_SITE_CM = 5.0
_TOLERANCE_CM = 0.05
_FRAMES_COMPARED = 1000

Array = NDArray[np.float64]


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write the bones on an even grid from the sound's first moment on.

    Args:
        path: ends in .bvh.
        motion: its median rate becomes the file's frame time; missing Hips stand at rest.
        audio: not written; a BVH has no sound.

    Returns:
        The file, read back and compared by forward kinematics.
    """
    check_suffix(path, SUFFIX)
    body = grounded_body(motion)
    if body is None:
        what = say("There is no body motion to write to {name}.", name=path.name)
        raise RequestError(what, "Export it as SAIA CSV instead.")
    fps = motion.fps or DEFAULT_FPS
    even = on_grid(body, fps)
    skeleton = body.skeleton
    order = _depth_first(skeleton)
    joints = _joints(skeleton, order)
    frames = _frames(even, order)
    return checked(
        path,
        lambda beside: _bvh_text.write(beside, Bvh(joints, 1.0 / fps, frames)),
        lambda beside: _fits(_bvh_text.read(beside), frames, even, order),
    )


def read(path: Path, audio: Path | None = None, tables: BoneTables | None = None) -> Imported:
    """Read a BVH of any humanoid: joints are matched to bones by the names that common programs use.

    Args:
        path: the file.
        audio: its sound; the file of the same base name beside it where None.
        tables: which joint is which bone, where a person has said so.

    Raises:
        StudioError: it is damaged; UnknownSkeleton: too few of its joints are known bones.
    """
    bvh = _bvh_text.read(path)
    if not len(bvh.frames):
        raise StudioError(say("{name} holds no frames.", name=path.name), "Choose a file with motion.")
    names = [joint.name for joint in bvh.joints]
    # What a person said wins over every guess.
    corrections = tables.of(names) if tables else {}
    bones = corrected(names, humanoid_names(names), corrections)
    if "Hips" not in bones or len(bones) < 2:
        raise UnknownSkeleton(path.name, pairs(names, bones))
    notes = _name_notes(bvh, bones, path, frozenset(corrections))
    motion, guesses = to_humanoid(bvh, bones, _skeleton(bvh))
    notes += [say("{name}: {guess}.", name=path.name, guess=guess) for guess in guesses]
    audio = audio or find_audio(path)
    if audio is None:
        notes.append(say("No sound was found for {name}.", name=path.stem))
    guessed = any(_is_guess(bone, names[j]) and names[j] not in corrections for bone, j in bones.items())
    return Imported(path.stem, motion, audio, tuple(notes), {}, pairs(names, bones), guessed)


def joints(path: Path) -> tuple[str, ...]:
    """Names of a file's joints, parents before children; StudioError where it is no BVH."""
    return tuple(joint.name for joint in _bvh_text.read_joints(path))


def matched(path: Path, tables: BoneTables | None = None) -> tuple[tuple[str, str], ...]:
    """(joint, the bone it would be taken for or "") of a file; StudioError where it is no BVH."""
    names = joints(path)
    return pairs(names, corrected(names, humanoid_names(names), tables.of(names) if tables else {}))


def _depth_first(skeleton: Skeleton) -> list[int]:
    """Bones in the order of a BVH file, children after their parent; Hips takes those without one."""
    hips = skeleton.bone_names.index("Hips")
    order: list[int] = []

    def visit(bone: int) -> None:
        order.append(bone)
        for child, parent in enumerate(skeleton.parents):
            if child != hips and (hips if parent < 0 else parent) == bone:
                visit(child)

    visit(hips)
    return order


def _joints(skeleton: Skeleton, order: list[int]) -> tuple[Joint, ...]:
    place = {bone: j for j, bone in enumerate(order)}
    hips = order[0]
    offsets = skeleton.rest_positions * MIRROR / METRES
    parents = {bone: hips if skeleton.parents[bone] < 0 else skeleton.parents[bone] for bone in order[1:]}
    with_children = set(parents.values())
    joints = [Joint("Hips", -1, (0.0, 0.0, 0.0), ROOT_CHANNELS)]
    for bone in order[1:]:
        end = None if bone in with_children else _end_site(offsets[bone])
        joints.append(
            Joint(skeleton.bone_names[bone], place[parents[bone]], _three(offsets[bone]), JOINT_CHANNELS, end)
        )
    if len(joints) == 1:
        # A file of Hips alone still needs an end site.
        joints[0] = Joint("Hips", -1, (0.0, 0.0, 0.0), ROOT_CHANNELS, (0.0, END_SITE_CM, 0.0))
    return tuple(joints)


def _end_site(offset: Array) -> tuple[float, float, float]:
    """5 cm on in the bone's own direction."""
    length = float(np.linalg.norm(offset))
    return _three(offset / length * END_SITE_CM) if length > 1e-6 else (0.0, END_SITE_CM, 0.0)


def _three(values: Array) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


def _frames(motion: Motion, order: list[int]) -> Array:
    """Channel values (T, 3 + 3 J)."""
    turned = motion.rotations[:, order] * MIRROR_TURN
    # In the order of the channels, Yrotation Xrotation Zrotation, which is R = Ry Rx Rz.
    y, x, z = rotation.to_euler_yxz(turned)
    angles = np.degrees(np.stack([y, x, z], axis=-1)).reshape(len(motion), -1)
    hips = motion.positions[:, order[0]] * MIRROR / METRES
    return np.concatenate([hips, angles], axis=1)


def _fits(bvh: Bvh, written: Array, motion: Motion, order: list[int]) -> bool:
    """Whether a file holds what was to be written.

    Every number of every frame must be the one written, and on frames all over the file every bone must
    stand where the motion has it.
    """
    fits = bvh.frames.shape == written.shape and len(bvh.joints) == len(order)
    if fits and float(np.abs(bvh.frames - written).max(initial=0.0)) < 1e-3:
        rows = np.unique(np.linspace(0, len(motion) - 1, _FRAMES_COMPARED).astype(int))
        # Bones that move against their parent (only Hips may in a BVH) are held at their rest offset.
        positions = np.tile(motion.skeleton.rest_positions, (len(rows), 1, 1))
        positions[:, order[0]] = motion.positions[rows, order[0]]
        skeleton = _rooted(motion.skeleton, order[0])
        expected = skeleton.forward(positions, motion.rotations[rows])[0][:, order] * MIRROR / METRES
        part = Bvh(bvh.joints, bvh.frame_time, bvh.frames[rows])
        got = _skeleton(bvh).forward(*part.local())[0]
        return float(np.abs(got - expected).max(initial=0.0)) < _TOLERANCE_CM
    return False


def _rooted(skeleton: Skeleton, hips: int) -> Skeleton:
    parents = tuple(hips if p < 0 and j != hips else p for j, p in enumerate(skeleton.parents))
    return Skeleton(skeleton.bone_names, parents, skeleton.rest_positions, skeleton.rest_rotations)


def _skeleton(bvh: Bvh) -> Skeleton:
    offsets = np.array([joint.offset for joint in bvh.joints])
    identity = np.tile(rotation.IDENTITY, (len(bvh.joints), 1))
    names = tuple(joint.name for joint in bvh.joints)
    return Skeleton(names, tuple(joint.parent for joint in bvh.joints), offsets, identity)


def _is_guess(bone: str, joint: str) -> bool:
    return joint.split(":")[-1].lower() != bone.lower()


def _name_notes(bvh: Bvh, bones: dict[str, int], path: Path, corrections: frozenset[str]) -> list[str]:
    """Which joints were taken for which bones, and which for none."""
    notes: list[str] = []
    other = [joint.name for j, joint in enumerate(bvh.joints) if j not in bones.values()]
    if other:
        notes.append(
            say(
                "{name}: {joints} folded into the others, such as {joint}.",
                name=path.name,
                joints=counted(len(other), "joint"),
                joint=other[0],
            )
        )
    names = {bone: bvh.joints[j].name for bone, j in bones.items()}
    guessed = {b: name for b, name in names.items() if _is_guess(b, name) and name not in corrections}
    if guessed:
        pairs = [say("{joint} as {bone}", joint=name, bone=bone) for bone, name in guessed.items()][:4]
        known = together(", ", *pairs)
        if len(guessed) > 4:
            known = say("{pairs} and others", pairs=known)
        notes.append(
            say("{name}: joints were taken for bones by name: {pairs}.", name=path.name, pairs=known)
        )
    if bvh.decimal_commas:
        notes.append(say("{name} is written with decimal commas; they were read as such.", name=path.name))
    if corrections:
        what = say(
            "{name}: {joints} taken as the project's table of bones says.",
            name=path.name,
            joints=counted(len(corrections), "joint"),
        )
        notes.append(what)
    return notes
