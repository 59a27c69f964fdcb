"""Live Link Face: the CSV of Apple's ARKit face capture, with its sound beside it.

Source: Epic Games' Live Link Face app; columns as the app writes them. The timecode counts frames of 60 a
second, its part behind the point being a fraction of a frame.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, counted, say
from studio.formats import Imported
from studio.formats._table import check_suffix, header, read_table
from studio.formats._writing import checked, on_grid
from studio.formats.saia_csv import find_audio
from studio.motion import Motion, rotation
from studio.motion.channels import ARKIT_SHAPES, canonical_shape
from studio.motion.sanitize import credible, forward_filled
from studio.motion.shape_sets import arkit_weights

TITLE = "Live Link Face CSV"
SUFFIX = ".csv"
WRITES = ".livelink.csv"
NOTE = (
    "ARKit's 52 face shapes with the turn of head and eyes; no body, no sound. Shapes that the motion has by "
    "ARKit's names are exact; those made of VRM's expressions (A, Joy, ...) are approximate."
)
BONES_KEPT = frozenset(("Head", "LeftEye", "RightEye"))

TIMECODE_FPS = 60.0
_DAY = 24 * 3600.0
# Seconds before and after it in which a time that falls is the next day's.
_AROUND_MIDNIGHT = 3600.0
_TIMECODE = re.compile(r"([01]?\d|2[0-3]):([0-5]?\d):([0-5]?\d)[:;](\d{1,3})(\.\d+)?")
_TURNS = {"Head": "head", "LeftEye": "lefteye", "RightEye": "righteye"}
_ANGLES = ("yaw", "pitch", "roll")


def recognises(path: Path) -> bool:
    """Whether a CSV file is one of Live Link Face: its first column is Timecode."""
    names = header(path)
    return bool(names) and names[0].lower() == "timecode"


def read(path: Path, audio: Path | None = None) -> Imported:
    """Read one take.

    Args:
        path: its CSV.
        audio: its sound; the file of the same base name beside it where None.

    Raises:
        StudioError: it is empty, damaged, or a timecode makes no sense.
    """
    table = read_table(path, ("timecode",), empty_row=2)
    # Frames in which the phone saw no face have a timecode and the count 0, and nothing more.
    codes = next(iter(table.texts.values()), None)
    if codes is None:
        raise StudioError(
            say("{name} has no Timecode column.", name=path.name), "Export it again from Live Link Face."
        )
    notes = list(table.notes)
    values, empty = forward_filled(table.values)
    if empty:
        notes.append(
            say(
                "{name} has {cells}; the value above was taken.",
                name=path.name,
                cells=counted(empty, "empty cell"),
            )
        )
    times, rows = _times(codes, path, notes)
    columns = {name.lower(): i for i, name in enumerate(table.names)}
    turns = {bone: _turn(values[rows], columns, low) for bone, low in _TURNS.items()}
    found = tuple(bone for bone, q in turns.items() if q is not None)
    angles = {low + angle for low in _TURNS.values() for angle in _ANGLES}
    shapes = [i for i, n in enumerate(table.names) if n.lower() not in angles | {"blendshapecount"}]
    if not shapes:
        raise StudioError(
            say("{name} has no face shapes.", name=path.name), "Export it again from Live Link Face."
        )
    if found:
        notes.append("The turns of head and eyes were read as radians.")
    motion = Motion.build(
        times,
        tuple(canonical_shape(table.names[i]) for i in shapes),
        values[rows][:, shapes],
        found,
        None,
        np.stack([q for q in turns.values() if q is not None], axis=1) if found else None,
    )
    # What the studio wrote as NAME.livelink.csv has its sound in NAME.wav.
    plain = path.with_name(path.name.removesuffix(WRITES) + SUFFIX) if path.name.endswith(WRITES) else path
    audio = audio or find_audio(path) or find_audio(plain)
    if audio is None:
        notes.append(say("No sound was found for {name}.", name=plain.stem))
    extra = {"timecode": codes[0]}
    return Imported(plain.stem, motion, audio, tuple(notes), extra)


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write the face on an even grid from the sound's first moment on; the timecode begins at zero.

    Args:
        path: ends in .livelink.csv, since a plain .csv is SAIA's.
        motion: with blend shapes; the turn of the neck counts as the head's.
        audio: not written.

    Returns:
        The file, read back and compared.
    """
    check_suffix(path, WRITES)
    if not len(motion) or not motion.shape_names:
        raise RequestError(
            say("There is no face to write to {name}.", name=path.name), "Export the body as BVH instead."
        )
    even = on_grid(motion)
    weights, angles = arkit_weights(even), _angles(even)
    names = [*ARKIT_SHAPES, *(bone + angle.capitalize() for bone in _TURNS for angle in _ANGLES)]
    # One format for the whole row: formatting numbers one by one takes most of the time of a long take.
    row = f"%s,{len(names)}," + ",".join(["%.10f"] * len(names)) + "\n"
    values = np.concatenate([weights, *angles.values()], axis=1) + 0.0

    def put(beside: Path) -> None:
        with beside.open("w", encoding="utf-8", newline="") as file:
            file.write(",".join(("Timecode", "BlendshapeCount", *names)) + "\n")
            file.writelines(
                row % (_timecode(t), *line) for t, line in zip(even.times, values.tolist(), strict=True)
            )

    return checked(path, put, lambda beside: _fits(beside, even, weights, angles))


def _timecode(t: float) -> str:
    """HH:MM:SS:FF.mmm, the last part a fraction of a frame of 60 a second."""
    thousandths = round(t * TIMECODE_FPS * 1000)
    seconds, part = divmod(thousandths, int(TIMECODE_FPS) * 1000)
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}:{part / 1000:06.3f}"


def _angles(motion: Motion) -> dict[str, NDArray[np.float64]]:
    """Yaw, pitch and roll (T, 3) in radians of head and eyes; zero for bones that are not there."""
    found = {}
    for bone in _TURNS:
        # ARKit knows no neck: its turn and the head's are one.
        q = np.tile(rotation.IDENTITY, (len(motion), 1))
        for part in ("Neck", "Head") if bone == "Head" else (bone,):
            if part in motion.bone_names:
                q = rotation.multiply(q, motion.rotations[:, motion.bone_names.index(part)])
        y, x, z = rotation.to_euler_yxz(q)
        # Yaw and roll change their sign with the mirrored axis, see `_turn`.
        found[bone] = np.stack([-y, x, -z], axis=1)
    return found


def _fits(
    path: Path, motion: Motion, weights: NDArray[np.float64], angles: dict[str, NDArray[np.float64]]
) -> bool:
    """Whether a file holds what was to be written: every time, every weight, every turn."""
    back = read(path).motion
    if back is None or len(back) != len(motion) or back.shape_names != ARKIT_SHAPES:
        return False
    apart = [np.abs(back.times - motion.times).max(), np.abs(back.shapes - weights).max()]
    for bone, (yaw, pitch, roll) in ((bone, values.T) for bone, values in angles.items()):
        expected = rotation.from_euler_yxz(-yaw, pitch, -roll)
        got = back.rotations[:, back.bone_names.index(bone)]
        apart.append(rotation.angle_between(got, expected).max())
    # Not `any(far > ...)`: NaN compares as false, and must not pass.
    return all(far <= 1e-3 for far in apart)


def _times(codes: list[str], path: Path, notes: list[str]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Seconds from the first row, and the rows whose time can be."""
    seconds = np.array([_seconds(code, row, path) for row, code in enumerate(codes, 2)])
    # A take over midnight: its clock falls back to zero.
    late, early = seconds[:-1] > _DAY - _AROUND_MIDNIGHT, seconds[1:] < _AROUND_MIDNIGHT
    seconds = seconds + _DAY * np.concatenate([[0], np.cumsum(late & early)])
    rows = credible(seconds)
    if len(rows) < len(seconds):
        notes.append(
            say(
                "{name}: {rows} with a wrong time left out.",
                name=path.name,
                rows=counted(len(seconds) - len(rows), "row"),
            )
        )
    return seconds[rows] - seconds[rows[0]], rows


def _seconds(code: str, row: int, path: Path) -> float:
    found = _TIMECODE.fullmatch(code.strip())
    if found is None:
        what = say(
            "{name} has the timecode {code} in row {row}.", name=path.name, code=repr(code[:20]), row=row
        )
        raise StudioError(what, "It should look like 10:13:39:01.936; export the file again.")
    hours, minutes, seconds, frames = (int(found[i]) for i in range(1, 5))
    frame = frames + float(found[5] or 0)
    return hours * 3600 + minutes * 60 + seconds + frame / TIMECODE_FPS


def _turn(values: NDArray[np.floating], columns: dict[str, int], bone: str) -> NDArray[np.floating] | None:
    """Quaternions (T, 4) in Unity's axes from yaw, pitch and roll in radians, None where a column lacks.

    ARKit is right-handed with Y up and the face looking along +Z: pitch about X keeps its sign when X is
    mirrored, yaw about Y and roll about Z change theirs.
    """
    if any(bone + angle not in columns for angle in _ANGLES):
        return None
    yaw, pitch, roll = (values[:, columns[bone + angle]] for angle in _ANGLES)
    return rotation.from_euler_yxz(-yaw, pitch, -roll)
