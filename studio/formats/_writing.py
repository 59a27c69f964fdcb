"""What writers share: a humanoid on an even grid, its sound, and files read back before they are named."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from studio.errors import StudioError, say
from studio.files import atomic
from studio.motion import Motion, Skeleton, rotation
from studio.motion.channels import ALL_BONES
from studio.render.drawing import FINER, Drawing, Painter
from studio.sound.sound_file import put_sound, read_sound, sound_info

_ALIKE_SECONDS = 0.01


def put(path: Path, audio: Path) -> None:
    """Write a sound: the same bytes where it is a WAV, else decoded to one."""
    info = sound_info(audio)
    if info.container in ("WAV", "WAVEX"):
        # Byte for byte: decoding and writing again would lose a 32-bit file's headroom.
        shutil.copyfile(audio, path)
    else:
        put_sound(path, read_sound(audio), "PCM_24" if "24" in info.encoding else "PCM_16", "WAV")


def fits(path: Path, audio: Path) -> bool:
    """Whether a file holds as much sound as another, at its rate and with its channels."""
    got, expected = sound_info(path), sound_info(audio)
    same = (got.sample_rate, got.channels) == (expected.sample_rate, expected.channels)
    # Where it was decoded, its length was only an estimate before.
    if got.container != expected.container:
        return same and got.duration > 0
    return same and abs(got.duration - expected.duration) < _ALIKE_SECONDS


# What reading raises of a file that the disk did not keep as it was written.
_UNREADABLE = (
    StudioError, OSError, LookupError, TypeError, AttributeError, struct.error, *atomic.UNREADABLE_ZIP
)  # fmt: skip


def checked(path: Path, put: Callable[[Path], object], fits: Callable[[Path], bool]) -> tuple[Path, ...]:
    """Write a file, and let it take its name once it reads back as it was meant.

    Args:
        path: where to.
        put: writes to the path it is given.
        fits: whether what lies there is what was to be written.

    Raises:
        StudioError: it could not be written, or reads otherwise; a file that was there is untouched.
    """
    # Written under another name first, so that a crash leaves no half file.
    with atomic.written(path) as beside:
        put(beside)
        with reading_back(path.name):
            if not fits(beside):
                raise not_read_back(path.name)
    return (path,)


@contextmanager
def reading_back(name: str) -> Iterator[None]:
    """Within it a file that cannot be read is one that did not keep what was written."""
    try:
        yield
    except _UNREADABLE as error:
        raise not_read_back(name) from error


def not_read_back(name: str) -> StudioError:
    """What to say of a file that reads otherwise than it was written."""
    return StudioError(
        say("{name} did not read back as it was written.", name=name), "Export it again to another disk."
    )


def painter_of(motion: Motion, drawing: Drawing, finer: float = FINER) -> Painter:
    """What draws a motion, with the avatar that was asked for.

    Raises:
        RequestError: the size is not possible.
        StudioError: there is no OpenGL here, or the avatar cannot be read.
    """
    from studio.formats._vrm import avatar

    # Read here and not in render, which knows no file formats.
    read = avatar.read(drawing.avatar) if drawing.avatar is not None else None
    return Painter(motion, drawing, read, finer)


DEFAULT_FPS = 30.0


def grounded_body(motion: Motion) -> Motion | None:
    """The humanoid bones of a motion, the root put into the hips, which are there and above the ground.

    Returns:
        A motion of bones alone; None where it has no bones or no frames.
    """
    bones = [j for j, name in enumerate(motion.bone_names) if name in ALL_BONES]
    if not bones or not len(motion):
        return None
    names = tuple(motion.bone_names[j] for j in bones)
    positions = motion.positions[:, bones].astype(np.float64)
    rotations = motion.rotations[:, bones].astype(np.float64)
    if "Hips" not in names:
        names = ("Hips", *names)
        rest = Skeleton.humanoid(names)
        tops = [j for j in range(1, len(names)) if rest.parents[j] == 0]
        positions = np.concatenate([np.tile(rest.rest_positions[:1], (len(motion), 1, 1)), positions], axis=1)
        positions[:, tops] = rest.rest_positions[tops]
        rotations = np.concatenate([np.tile(rotation.IDENTITY, (len(motion), 1, 1)), rotations], axis=1)
    hips, root = names.index("Hips"), motion.root_rotation
    positions[:, hips] = rotation.rotate(root, positions[:, hips]) + motion.root_position
    rotations[:, hips] = rotation.multiply(root, rotations[:, hips])
    if positions[0, hips, 1] <= 0.01:
        # Readers scale a figure by its first hips height.
        positions[:, hips, 1] += Skeleton.humanoid(("Hips",)).rest_positions[0, 1] - positions[0, hips, 1]
    return Motion.build(motion.times, (), None, names, positions, rotations)


def on_grid(motion: Motion, fps: float = 0.0) -> Motion:
    """A motion on an even grid from the sound's first moment to its own end; itself where it is that already.

    Args:
        motion: of one frame or more.
        fps: of the grid; the motion's own median rate where 0.
    """
    fps = fps or motion.fps or DEFAULT_FPS
    grid = np.arange(int(np.floor(max(float(motion.times[-1]), 0.0) * fps + 1e-6)) + 1) / fps
    is_even = len(grid) == len(motion) and np.allclose(grid, motion.times, rtol=0, atol=1e-6)
    return motion if is_even else motion.at(grid)
