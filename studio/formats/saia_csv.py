"""SAIA's own layout: Audio/NAME.wav, Blendshapes/NAME.csv and Bones/NAME.csv.

Source: SAIA's capture client (bone-major, right headers) and its notebook, whose files carry bone-major
values under attribute-major headers.
"""

from __future__ import annotations

import re
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, counted, say
from studio.files import atomic
from studio.formats import Imported, _writing
from studio.formats._table import Table, check_suffix, header, read_table, write_table
from studio.formats._writing import not_read_back, reading_back
from studio.motion import Motion
from studio.motion.channels import VRM0_SHAPES, canonical_bone
from studio.motion.sanitize import credible, forward_filled
from studio.motion.skeleton import Skeleton
from studio.sound.sound_file import sound_info

TITLE = "SAIA CSV"
SUFFIX = ".csv"
NOTE = (
    "Blend shapes and bones in two CSV files beside the sound; the avatar's place in the room is not in them."
)

SHAPES_FOLDER, BONES_FOLDER, AUDIO_FOLDER = "Blendshapes", "Bones", "Audio"
# The lossless ones first: where two of a name lie side by side, the better one is taken.
SOUND_SUFFIXES = (".wav", ".flac", ".ogg", ".mp3", ".m4a")
_PARTS = ("PosX", "PosY", "PosZ", "RotX", "RotY", "RotZ", "RotW")
# SAIA writes HeadPosX; Head_Pos_X and head.pos.x come from people's own scripts.
_PART = re.compile(r"(.+?)[_ .]?(Pos|Rot)[_ .]?([XYZW])", re.IGNORECASE)

Array = NDArray[np.float64]


def recognises(path: Path) -> bool:
    """Whether a CSV file is one of this layout: its first column is Time."""
    names = header(path)
    return bool(names) and names[0].lower() == "time"


def read(path: Path, audio: Path | None = None) -> Imported:
    """Read one take.

    Args:
        path: its CSV in Blendshapes or Bones (the other is found by name), or a lone CSV anywhere.
        audio: its sound; found in Audio or beside by name where None.

    Raises:
        StudioError: a file is empty, damaged, or lacks its time column.
    """
    shapes_path, bones_path = _files(path)
    notes: list[str] = []
    shapes = _read_shapes(shapes_path, notes) if shapes_path else None
    bones = _read_bones(bones_path, notes) if bones_path else None
    parts = [part for part in (shapes, bones) if part is not None]
    motion = _together(shapes, bones, notes) if shapes and bones else parts[0]
    motion = _from_zero(motion, path, notes)
    audio = audio or find_audio(path)
    if audio is None:
        notes.append(say("No sound was found for {name}.", name=path.stem))
    else:
        _compare_lengths(motion, audio, notes)
    return Imported(path.stem, motion, audio, tuple(notes))


def targets(path: Path) -> tuple[Path, ...]:
    """The three files that `write` may make of one path."""
    names = ((SHAPES_FOLDER, path.name), (BONES_FOLDER, path.name), (AUDIO_FOLDER, f"{path.stem}.wav"))
    return tuple(path.parent / folder / name for folder, name in names)


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write one take as Blendshapes/NAME.csv, Bones/NAME.csv and Audio/NAME.wav beside `path`.

    Args:
        path: NAME.csv in the folder that shall hold the three.
        motion: what to write; columns in the client's order.
        audio: its sound, None without.

    Returns:
        The files written, read back and compared.
    """
    check_suffix(path, SUFFIX)
    if not len(motion) or not (motion.shape_names or motion.bone_names):
        raise RequestError(
            say("There is no motion to write to {name}.", name=path.name), "Choose a take with motion."
        )
    shapes_path, bones_path, sound_path = targets(path)
    files: list[Path] = []
    shapes = bones = None
    # No file takes its name before all of them are written and read back.
    with ExitStack() as whole:

        def beside(file: Path) -> Path:
            files.append(file)
            return whole.enter_context(atomic.written(file))

        if motion.shape_names:
            _write_shapes(shapes := beside(shapes_path), motion)
        if motion.bone_names:
            _write_bones(bones := beside(bones_path), motion)
        if audio is not None:
            _writing.put(sound := beside(sound_path), audio)
        with reading_back(path.name):
            if not _fits(motion, shapes, bones) or (audio is not None and not _writing.fits(sound, audio)):
                raise not_read_back(path.name)
    return tuple(files)


def find_audio(path: Path) -> Path | None:
    """The sound of the same base name in the layout's Audio folder, or beside the file."""
    places = [path.parent]
    if path.parent.name.lower() in (SHAPES_FOLDER.lower(), BONES_FOLDER.lower()):
        places.insert(0, _sibling(path, AUDIO_FOLDER))
    for place in places:
        for suffix in SOUND_SUFFIXES:
            # Windows writes either; on Linux they are two names.
            for name in (path.stem + suffix, path.stem + suffix.upper()):
                if (place / name).is_file():
                    return place / name
    return None


def _files(path: Path) -> tuple[Path | None, Path | None]:
    place = path.parent.name.lower()
    if place == BONES_FOLDER.lower():
        other = _sibling(path, SHAPES_FOLDER) / path.name
        return (other if other.is_file() else None), path
    if place == SHAPES_FOLDER.lower():
        other = _sibling(path, BONES_FOLDER) / path.name
        return path, (other if other.is_file() else None)
    is_bones = any(_PART.fullmatch(name) for name in header(path)[1:3])
    return (None, path) if is_bones else (path, None)


def _sibling(path: Path, name: str) -> Path:
    """The layout's other folder, whatever the case of its name."""
    try:
        found = (p for p in path.parent.parent.iterdir() if p.name.lower() == name.lower())
        return next(found, path.parent.parent / name)
    except OSError:
        return path.parent.parent / name


def _times_and_values(table: Table, path: Path, notes: list[str]) -> tuple[Array, list[str], Array]:
    """The rising times in seconds, and the other columns on those rows."""
    notes += table.notes
    lower = [name.lower() for name in table.names]
    if "time" not in lower:
        raise StudioError(
            say("{name} has no Time column.", name=path.name),
            "Export it again with the time in the first column.",
        )
    at = lower.index("time")
    names = [name for i, name in enumerate(table.names) if i != at]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise StudioError(
            say("{name} has two columns called {twice}.", name=path.name, twice=twice),
            "Rename or remove one of them.",
        )
    values, empty = forward_filled(table.values[:, 1:] if at == 0 else np.delete(table.values, at, axis=1))
    if empty:
        notes.append(
            say(
                "{name} has {cells}; the value above was taken.",
                name=path.name,
                cells=counted(empty, "empty cell"),
            )
        )
    times = table.values[:, at]
    rows = credible(times)
    dropped = len(times) - len(rows)
    # More than half wrong is no damage but a column that holds something else.
    if dropped * 2 > len(times):
        raise StudioError(
            say("The times in {name} do not rise.", name=path.name),
            "Export it again with the time in seconds.",
        )
    if dropped:
        notes.append(
            say("{name}: {rows} with a wrong time left out.", name=path.name, rows=counted(dropped, "row"))
        )
        times, values = times[rows], values[rows]
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    # Nobody records a frame every two seconds, but a step of 16 or 33 ms is usual.
    if step > 2.0:
        times = times / 1000.0
        notes.append(say("The times in {name} look like milliseconds and were read as such.", name=path.name))
    return times, names, values


def _read_shapes(path: Path, notes: list[str]) -> Motion:
    times, names, values = _times_and_values(read_table(path), path, notes)
    if not names:
        raise StudioError(
            say("{name} has no blend shapes.", name=path.name), "Choose a file with columns beside Time."
        )
    top = float(values.max(initial=0.0))
    # Weights go to 1, and a little over with some trackers; percent go to 100.
    if 2.0 < top <= 100.5:
        values = values / 100.0
        notes.append(
            say(
                "The values in {name} reach {top}; they were taken as percent.",
                name=path.name,
                top=f"{top:.0f}",
            )
        )
    return Motion.build(times, tuple(names), values)


def _read_bones(path: Path, notes: list[str]) -> Motion:
    times, names, values = _times_and_values(read_table(path), path, notes)
    parts = [_PART.fullmatch(name) for name in names]
    known = [i for i, part in enumerate(parts) if part]
    if len(known) < len(names):
        other = next(name for name, part in zip(names, parts, strict=True) if not part)
        lost = counted(len(names) - len(known), "column")
        notes.append(
            say("{name}: {lost} left out, such as {other}: no bones.", name=path.name, lost=lost, other=other)
        )
    found = [(part[1], part[2].title() + part[3].upper()) for part in parts if part]
    values = values if len(known) == len(names) else values[:, known]
    bones = tuple(dict.fromkeys(bone for bone, _ in found))
    if not bones:
        raise StudioError(
            say("{name} has no bones.", name=path.name), "Choose a file with columns such as HeadRotX."
        )
    # The mark of the notebook's files: two bones' PosX side by side.
    if len(found) > 1 and found[0][1] == found[1][1] == "PosX":
        return _notebook_bones(path, times, bones, values, notes)
    if found == [(bone, part) for bone in bones for part in _PARTS]:
        cube = values.reshape(len(times), len(bones), 7)
        return _bones(times, bones, cube[..., :3], cube[..., 3:])
    columns = {key: i for i, key in enumerate(found)}
    return _client_bones(path, times, bones, columns, values, notes)


def _notebook_bones(
    path: Path, times: Array, bones: tuple[str, ...], values: Array, notes: list[str]
) -> Motion:
    """Bone-major values whatever the headers say."""
    if values.shape[1] != 7 * len(bones):
        what = say(
            "{name} names {bones} bones but has {columns} columns instead of {count}.",
            name=path.name,
            bones=len(bones),
            columns=values.shape[1],
            count=7 * len(bones),
        )
        raise StudioError(what, "Export it again from SAIA.")
    notes.append(
        say(
            "{name} has the notebook's headers, which do not fit its values; it was read bone by bone.",
            name=path.name,
        )
    )
    cube = values.reshape(len(times), len(bones), 7)
    return _bones(times, bones, cube[..., :3], cube[..., 3:])


def _client_bones(
    path: Path,
    times: Array,
    bones: tuple[str, ...],
    columns: dict[tuple[str, str], int],
    values: Array,
    notes: list[str],
) -> Motion:
    turned = tuple(bone for bone in bones if all((bone, part) in columns for part in _PARTS[3:]))
    if not turned:
        raise StudioError(
            say("No bone in {name} has all of RotX, RotY, RotZ and RotW.", name=path.name),
            "Export it again with rotations.",
        )
    if len(turned) < len(bones):
        halves = ", ".join(bone for bone in bones if bone not in turned)
        notes.append(
            say(
                "{name}: bones without a whole rotation were left out: {bones}.",
                name=path.name,
                bones=halves,
            )
        )
    rest = Skeleton.humanoid(tuple(canonical_bone(bone) for bone in turned)).rest_positions
    positions = np.tile(rest, (len(times), 1, 1))
    placed = [j for j, bone in enumerate(turned) if all((bone, part) in columns for part in _PARTS[:3])]
    for j in placed:
        positions[:, j] = values[:, [columns[turned[j], part] for part in _PARTS[:3]]]
    if len(placed) < len(turned):
        lost = counted(len(turned) - len(placed), "bone")
        notes.append(
            say(
                "{name}: {lost} without a position put where the built-in skeleton has it.",
                name=path.name,
                lost=lost,
            )
        )
    order = [columns[bone, part] for bone in turned for part in _PARTS[3:]]
    return _bones(times, turned, positions, values[:, order].reshape(len(times), -1, 4))


def _bones(times: Array, bones: tuple[str, ...], positions: Array, rotations: Array) -> Motion:
    names = tuple(canonical_bone(bone) for bone in bones)
    return Motion.build(times, (), None, names, positions, rotations)


def _together(shapes: Motion, bones: Motion, notes: list[str]) -> Motion:
    """Shapes and bones on the shapes' times; only where both have frames."""
    same = len(shapes) == len(bones) and np.allclose(shapes.times, bones.times, atol=1e-4, rtol=0)
    if not same:
        start = max(shapes.times[0], bones.times[0])
        end = min(shapes.times[-1], bones.times[-1])
        if end <= start:
            raise StudioError(
                "The times of blend shapes and bones do not overlap.", "Choose files of the same recording."
            )
        notes.append(
            say(
                "Blend shapes have {count} rows and bones {bones}; bones were read at the "
                "times of the shapes, {seconds} s in all.",
                count=len(shapes),
                bones=len(bones),
                seconds=f"{end - start:.2f}",
            )
        )
        # nextafter, since `between` leaves its end out and the last row belongs to both.
        shapes = shapes.between(start, np.nextafter(end, np.inf))
        bones = bones.at(shapes.times)
    return replace(bones, times=shapes.times, shape_names=shapes.shape_names, shapes=shapes.shapes)


def _from_zero(motion: Motion, path: Path, notes: list[str]) -> Motion:
    first = float(motion.times[0]) if len(motion) else 0.0
    # A take may begin late, and its sound with it; an hour is a clock that was never set to zero.
    if -0.5 <= first <= 60.0:
        return motion
    notes.append(
        say(
            "The times of {name} begin at {first} s; they were moved to begin at 0.",
            name=path.stem,
            first=f"{first:.2f}",
        )
    )
    return motion.shifted(-first)


def _compare_lengths(motion: Motion, audio: Path, notes: list[str]) -> None:
    sound, end = sound_info(audio).duration, float(motion.times[-1])
    if abs(sound - end) > 0.5:
        notes.append(
            say(
                "The sound of {name} lasts {sound} s and its motion {seconds} s.",
                name=audio.stem,
                sound=f"{sound:.2f}",
                seconds=f"{end:.2f}",
            )
        )


def _shape_order(names: tuple[str, ...]) -> list[int]:
    """The client's order where all are its names, else as they come."""
    if set(names) <= set(VRM0_SHAPES):
        return sorted(range(len(names)), key=lambda i: names[i])
    return list(range(len(names)))


def _write_shapes(path: Path, motion: Motion) -> None:
    order = _shape_order(motion.shape_names)
    names = ("Time", *(motion.shape_names[i] for i in order))
    write_table(path, names, [motion.times, *(motion.shapes[:, i] for i in order)])


def _write_bones(path: Path, motion: Motion) -> None:
    order = sorted(range(len(motion.bone_names)), key=lambda j: motion.bone_names[j])
    names = ["Time"]
    columns: list[NDArray[np.floating]] = [motion.times]
    for j in order:
        names += [motion.bone_names[j] + part for part in _PARTS]
        columns += [motion.positions[:, j, k] for k in range(3)]
        columns += [motion.rotations[:, j, k] for k in range(4)]
    write_table(path, names, columns)


def _fits(expected: Motion, shapes: Path | None, bones: Path | None) -> bool:
    """Whether the tables hold what was to be written."""
    return (shapes is None or _fits_shapes(expected, _read_shapes(shapes, []))) and (
        bones is None or _fits_bones(expected, _read_bones(bones, []))
    )


def _fits_shapes(expected: Motion, got: Motion) -> bool:
    order = [got.shape_names.index(name) for name in expected.shape_names]
    return _in_time(expected, got) and np.allclose(got.shapes[:, order], expected.shapes, atol=1e-5)


def _fits_bones(expected: Motion, got: Motion) -> bool:
    order = [got.bone_names.index(name) for name in expected.bone_names]
    return (
        _in_time(expected, got)
        and np.allclose(got.positions[:, order], expected.positions, atol=1e-5)
        and bool((np.abs((got.rotations[:, order] * expected.rotations).sum(-1)) > 1 - 1e-5).all())
    )


def _in_time(expected: Motion, got: Motion) -> bool:
    return len(got) == len(expected) and np.allclose(got.times, expected.times, atol=1e-6)
