"""The text of a BVH file: joints, channels and frames, to and from arrays."""

from __future__ import annotations

import codecs
import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.motion import rotation

Array = NDArray[np.float64]

ROOT_CHANNELS = ("Xposition", "Yposition", "Zposition", "Yrotation", "Xrotation", "Zrotation")
JOINT_CHANNELS = ROOT_CHANNELS[3:]
_AGAIN = "Export it again from the program it came from."
# Seconds a frame; whatever puts the motion on a finer grid would fill the memory.
_SLOWEST = 1.0
# Units and degrees that no figure reaches; the square of what is damaged may overflow.
_FARTHEST = 1e6
_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class Joint:
    """One joint as the file names it.

    Args:
        name: its name.
        parent: index of its parent, -1 for a root.
        offset: from the parent, in the file's unit.
        channels: names in the file's order.
        end: offset of its End Site, None where it has children.
    """

    name: str
    parent: int
    offset: tuple[float, float, float]
    channels: tuple[str, ...]
    end: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class Bvh:
    """A whole file.

    Args:
        joints: parents before children.
        frame_time: seconds a frame.
        frames: one row of channel values a frame (T, channels).
        decimal_commas: whether its numbers were written with commas.
    """

    joints: tuple[Joint, ...]
    frame_time: float
    frames: Array
    decimal_commas: bool = False

    def local(self) -> tuple[Array, Array]:
        """Local positions (T, J, 3) in the file's unit and rotations (T, J, 4), channels in their order."""
        count = len(self.frames)
        positions = np.tile(np.array([joint.offset for joint in self.joints]), (count, 1, 1))
        rotations = np.tile(rotation.IDENTITY, (count, len(self.joints), 1))
        column = 0
        for j, joint in enumerate(self.joints):
            for channel in joint.channels:
                axis, values = _AXES[channel[0].lower()], self.frames[:, column]
                if channel.lower().endswith("position"):
                    positions[:, j, axis] = values
                else:
                    turn = rotation.from_axis_angle(np.eye(3)[axis], np.radians(values))
                    rotations[:, j] = rotation.multiply(rotations[:, j], turn)
                column += 1
        return positions, rotations


def write(path: Path, bvh: Bvh) -> None:
    """Write a file: dots for decimals, four of them."""
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    lines = ["HIERARCHY", *_joint_lines(bvh.joints, 0, 0)]
    lines += ["MOTION", f"Frames: {len(bvh.frames)}", f"Frame Time: {bvh.frame_time:.8f}"]
    # Adding zero turns -0.0 into 0.0.
    values = np.round(bvh.frames, 4) + 0.0
    table = pa.table({f"c{i}": np.ascontiguousarray(values[:, i]) for i in range(values.shape[1])})
    options = arrow_csv.WriteOptions(include_header=False, delimiter=" ")
    with path.open("wb") as file:
        file.write(("\n".join(lines) + "\n").encode())
        arrow_csv.write_csv(table, file, options)


def read(path: Path) -> Bvh:
    """Read any BVH file.

    Raises:
        StudioError: it is missing, no BVH, or cut short.
    """
    joints, found, data = _head(path)
    frame_time = _frame_time(found, path)
    width = sum(len(joint.channels) for joint in joints)
    frames = _numbers(data[found.end() :], width, path)
    if len(frames) < int(found[1]):
        what = say("{name} ends after {n} of {all} frames.", name=path.name, n=len(frames), all=int(found[1]))
        raise StudioError(what, _AGAIN)
    return Bvh(tuple(joints), frame_time, frames[: int(found[1])], b"," in found[2])


def read_joints(path: Path) -> tuple[Joint, ...]:
    """Only the skeleton of a file; raises as `read`."""
    return tuple(_head(path)[0])


def _head(path: Path) -> tuple[list[Joint], re.Match[bytes], bytes]:
    """The joints, where the frames begin, and all of the file."""
    try:
        data = _as_ascii(path.read_bytes())
    except OSError as error:
        raise StudioError(
            say("{name} cannot be read.", name=path.name),
            say("Check the file in {folder}.", folder=path.parent),
        ) from error
    found = re.search(rb"MOTION\s+Frames:\s*(\d{1,18})\s+Frame Time:\s*([0-9.,eE+-]+)[^\n]*\n?", data)
    if found and b"," in found[2]:
        # Of the same length, so that `found` still fits.
        data = re.sub(rb"(?<=\d),(?=\d)", b".", data)
    if not data.lstrip().upper().startswith(b"HIERARCHY"):
        raise StudioError(
            say("{name} is not a BVH file.", name=path.name), "Choose a file that begins with HIERARCHY."
        )
    if not found:
        raise StudioError(_without_frames(data, path.name), _AGAIN)
    try:
        joints = _joints(_decoded(data[: found.start()]).lstrip())
    except (ValueError, IndexError) as error:
        raise StudioError(say("The skeleton in {name} is damaged.", name=path.name), _AGAIN) from error
    return joints, found, data


def _without_frames(data: bytes, name: str) -> str:
    """What is wrong with a BVH file whose frames are not announced as they should be."""
    for number, line in enumerate(data.splitlines(), 1):
        if line.strip().upper() == b"MOTION":
            return say(
                "{name} is damaged: after MOTION in line {number}, Frames or Frame Time is missing.",
                name=name,
                number=number,
            )
    return say("{name} is damaged: it ends without its frames (there is no line MOTION).", name=name)


def _as_ascii(data: bytes) -> bytes:
    """A file in UTF-16 as UTF-8; any other as it is, without a mark at its head."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", errors="replace").encode()
    return data.removeprefix(codecs.BOM_UTF8)


def _decoded(data: bytes) -> str:
    """Names of joints may be in UTF-8 or in Shift-JIS."""
    for encoding in ("utf-8", "cp932"):
        try:
            return data.decode(encoding)
        except UnicodeDecodeError:
            continue
    return data.decode("utf-8", errors="replace")


def _frame_time(found: re.Match[bytes], path: Path) -> float:
    try:
        frame_time = float(found[2].replace(b",", b"."))
    except ValueError:
        frame_time = 0.0
    if not 1e-5 < frame_time <= _SLOWEST:
        what = say(
            "{name} has a frame time of {seconds} s.",
            name=path.name,
            seconds=found[2].decode(errors="replace"),
        )
        raise StudioError(what, _AGAIN)
    return frame_time


def _numbers(data: bytes, width: int, path: Path) -> Array:
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    # Frames are separated by any white space; the fast reader wants exactly one between numbers.
    data = data.strip()
    if b"\t" in data or b"  " in data or b" \n" in data or b" \r" in data:
        data = re.sub(rb"[ \t]+", b" ", data)
        data = re.sub(rb" ?\r?\n ?", b"\n", data).strip()
    if not data.strip() or width == 0:
        return np.zeros((0, width))
    names = [f"c{i}" for i in range(width)]
    types: dict[str, Any] = dict.fromkeys(names, pa.float64())
    try:
        table = arrow_csv.read_csv(
            io.BytesIO(data),
            read_options=arrow_csv.ReadOptions(column_names=names),
            parse_options=arrow_csv.ParseOptions(delimiter=" "),
            convert_options=arrow_csv.ConvertOptions(column_types=types),
        )
    except pa.ArrowException as error:
        raise StudioError(
            say("A frame in {name} is damaged or cut short.", name=path.name), _AGAIN
        ) from error
    frames = np.column_stack([column.to_numpy() for column in table.columns])
    # Nor is what is no number.
    if not (np.abs(frames) <= _FARTHEST).all():
        raise StudioError(say("A frame in {name} is damaged or cut short.", name=path.name), _AGAIN)
    return frames


@dataclass
class _Draft:
    """A joint while its lines are read."""

    name: str
    parent: int
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    channels: tuple[str, ...] = ()
    end: tuple[float, ...] | None = None


def _joints(text: str) -> list[Joint]:
    """The joints of the HIERARCHY part, parents before children; ValueError where it makes no sense."""
    drafts: list[_Draft] = []
    open_joints: list[int] = []
    in_end = False
    for line in text.replace("{", "\n{\n").replace("}", "\n}\n").splitlines()[1:]:
        words = line.split()
        word = words[0].upper() if words else ""
        if word in ("ROOT", "JOINT"):
            drafts.append(_Draft(" ".join(words[1:]), open_joints[-1] if open_joints else -1))
            open_joints.append(len(drafts) - 1)
        elif word == "END":
            in_end = True
        elif word == "OFFSET":
            offset = tuple(float(value) for value in words[1:4])
            if in_end:
                drafts[open_joints[-1]].end = offset
            else:
                drafts[open_joints[-1]].offset = offset
        elif word == "CHANNELS":
            drafts[open_joints[-1]].channels = _channels(words)
        elif word == "}":
            if not in_end:
                open_joints.pop()
            in_end = False
        elif word not in ("", "{"):
            raise ValueError(words[0])
    if not drafts or open_joints:
        raise ValueError("unfinished")
    return [
        Joint(d.name, d.parent, _three(d.offset), d.channels, _three(d.end) if d.end else None)
        for d in drafts
    ]


def _channels(words: list[str]) -> tuple[str, ...]:
    names = tuple(words[2:])
    if len(names) != int(words[1]) or not {n.lower() for n in names} <= {n.lower() for n in ROOT_CHANNELS}:
        raise ValueError(words)
    return names


def _three(values: tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = values
    if not all(abs(value) <= _FARTHEST for value in values):
        raise ValueError(values)
    return x, y, z


def _joint_lines(joints: tuple[Joint, ...], index: int, depth: int) -> list[str]:
    joint, tab = joints[index], "\t" * depth
    lines = [f"{tab}{'JOINT' if depth else 'ROOT'} {joint.name}", f"{tab}{{"]
    lines += [f"{tab}\tOFFSET {_numbers_text(joint.offset)}"]
    lines += [f"{tab}\tCHANNELS {len(joint.channels)} {' '.join(joint.channels)}"]
    for child, other in enumerate(joints):
        if other.parent == index:
            lines += _joint_lines(joints, child, depth + 1)
    if joint.end is not None:
        lines += [
            f"{tab}\tEnd Site",
            f"{tab}\t{{",
            f"{tab}\t\tOFFSET {_numbers_text(joint.end)}",
            f"{tab}\t}}",
        ]
    return [*lines, f"{tab}}}"]


def _numbers_text(values: tuple[float, float, float]) -> str:
    return " ".join(f"{round(value, 4) + 0.0:.4f}" for value in values)
