"""Takes on disk: a folder with the sound, the motion and take.json, written once.

take.json is written last: a folder without one is not a take yet, and nothing here touches it.
"""

from __future__ import annotations

import math
import os
import re
import shutil
from collections.abc import Callable
from dataclasses import asdict, fields, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from studio.errors import StudioError, say
from studio.files import atomic, leftovers
from studio.motion import Motion
from studio.sound.sound_file import sound_info
from studio.take import motion_file
from studio.take.take import FORMAT_VERSION, NO_MOTION, Take, TakeInfo

INFO_FILE = "take.json"
TRASH_FOLDER = ".trash"
"""Beside the takes folder: takes that were removed, until a person deletes them for good."""
SOUND_SUFFIXES = (".wav", ".flac", ".ogg", ".mp3")
_MOST_SECONDS, _MOST_COUNTED = 1e7, 1e15
"""What no take reaches."""


def save_take(
    folder: Path,
    info: TakeInfo,
    motion: Motion | None,
    audio: Path | None = None,
    *,
    move_audio: bool = False,
) -> Take:
    """Save a recording; what the files tell (rates, lengths, names) is filled into its info.

    Args:
        folder: the take's folder. Where it exists without take.json (a recorder's), it is completed in
            place; else it appears in one piece.
        info: what is known; times and names of files are set here.
        motion: None without motion.
        audio: a sound file to bring in as audio.<suffix>, or one already in the folder; None without sound.
        move_audio: move the sound file instead of copying it.

    Raises:
        StudioError: the folder holds a take already, or it cannot be written.
    """
    if (folder / INFO_FILE).exists():
        # A take is never written over, whoever asks: recordings cannot be made again.
        raise StudioError(
            say("There is a take {folder} already.", folder=folder.name), "Choose another slate or number."
        )
    in_place = folder.is_dir()
    work = folder if in_place else leftovers.beside(folder)
    try:
        work.mkdir(parents=True, exist_ok=True)
        info = _with_audio(work, info, audio, move_audio)
        info = _with_motion(work, info, motion)
        write_info(work, info)
        if not in_place:
            # Before the rename: after a power cut the name must not be there without its content.
            _flush_folder(work)
            work.rename(folder)
    except OSError as error:
        raise atomic.cannot_write(folder, error) from error
    finally:
        if not in_place and work.exists():
            shutil.rmtree(work, ignore_errors=True)
    return Take(folder.name, folder, info)


def load_take(folder: Path) -> Take:
    """The take in a folder.

    Raises:
        StudioError: there is none, or take.json is damaged or of a newer version.
    """
    path = folder / INFO_FILE
    try:
        content = atomic.read_json(path)
    except FileNotFoundError as error:
        raise StudioError(
            say("{folder} holds no take.", folder=folder.name), "Choose a folder with a take.json."
        ) from error
    except OSError as error:
        raise StudioError(
            say("{path} cannot be read.", path=path), "Check the folder's permissions."
        ) from error
    atomic.check_version(path, content, FORMAT_VERSION)
    try:
        return Take(folder.name, folder, _parse_info(content))
    except (TypeError, ValueError, OverflowError) as error:  # the last is int(infinity)
        raise atomic.damaged(path) from error


def list_takes(
    takes_folder: Path, on_problem: Callable[[Path, StudioError], Take | None] | None = None
) -> tuple[Take, ...]:
    """All takes of a folder by id; half-made and foreign folders are passed over.

    Args:
        takes_folder: it may be missing.
        on_problem: is told of each take that cannot be loaded and may give one in its place.
    """
    if not takes_folder.is_dir():
        return ()
    found = []
    for folder in sorted(takes_folder.iterdir()):
        # Without take.json it is a recording under way or cut short; recovery looks after those.
        if folder.name.startswith(".") or not (folder / INFO_FILE).is_file():
            continue
        try:
            found.append(load_take(folder))
        except StudioError as error:
            stand_in = on_problem(folder, error) if on_problem else None
            if stand_in:
                found.append(stand_in)
    return tuple(found)


def next_number(takes_folder: Path, slate: str) -> int:
    """The number of the next take of a slate: one more than any has, finished or not.

    Those in the trash count too, or a new take would stand in the way of one that undo brings back.
    """
    pattern = re.compile(rf"\.?{re.escape(atomic.safe_name(slate))}_(\d+)(\..*)?$")
    places = (takes_folder, takes_folder.parent / TRASH_FOLDER)
    names = (path.name for place in places if place.is_dir() for path in place.iterdir())
    return max((int(found[1]) for name in names if (found := pattern.match(name))), default=0) + 1


def repair_take(folder: Path) -> Take:
    """A take whose take.json is damaged, known again from its sound and motion; the old file is set aside."""
    atomic.set_aside(folder / INFO_FILE)
    stamp = datetime.fromtimestamp(folder.stat().st_mtime).isoformat(timespec="seconds")
    slate, _, number = folder.name.rpartition("_")
    notes: tuple[str, ...] = ("take.json was damaged; its contents were rebuilt from the sound and motion.",)
    info = TakeInfo(folder.name, 1, stamp, source="recovered", notes=notes)
    if slate and number.isdigit():
        info = replace(info, slate=slate, number=int(number))
    audio = next((p for s in SOUND_SUFFIXES if (p := folder / f"audio{s}").is_file()), None)
    motion = None
    path = folder / f"motion{motion_file.SUFFIX}"
    try:
        motion = motion_file.read_motion(path) if path.is_file() else None
    except StudioError as error:
        notes = (*notes, error.what)
    return save_take(folder, replace(info, notes=notes), motion, audio)


def write_info(folder: Path, info: TakeInfo) -> None:
    """Write take.json."""
    atomic.write_json(folder / INFO_FILE, asdict(info))


def _with_audio(folder: Path, info: TakeInfo, audio: Path | None, move: bool) -> TakeInfo:
    if audio is None:
        return info
    target = folder / f"audio{audio.suffix.lower()}"
    if audio.resolve() != target.resolve():
        if move:
            shutil.move(audio, target)
        else:
            shutil.copyfile(audio, target)
    facts = sound_info(target)
    return replace(
        info,
        audio_file=target.name,
        sample_rate=facts.sample_rate,
        audio_channels=facts.channels,
        audio_seconds=facts.duration,
        duration=max(info.duration, facts.duration),
    )


def _with_motion(folder: Path, info: TakeInfo, motion: Motion | None) -> TakeInfo:
    if motion is None:
        return info
    path = folder / f"motion{motion_file.SUFFIX}"
    if not path.exists():
        motion_file.write_motion(path, motion)
    end = float(motion.times[-1]) if len(motion) else 0.0
    return replace(
        info,
        left_out=(*info.left_out, *_dead_parts(info, motion.times)),
        motion_file=path.name,
        frames=len(motion),
        fps=round(motion.fps, 3),
        shape_names=motion.shape_names,
        bone_names=motion.bone_names,
        duration=max(info.duration, end),
    )


def with_dead_parts(take: Take) -> Take:
    """A take saved before its sound without motion was noted, with that noted; the same take where none is.

    Raises:
        StudioError: its motion cannot be read.
    """
    info, path = take.info, take.motion_path
    # Told by its counts, so that of takes without a dead part no file is read.
    short = info.frames < info.fps * (info.duration - motion_file.NO_MOTION_S)
    if path is None or info.left_out or not short:
        return take
    dead = _dead_parts(info, motion_file.read_times(path))
    return replace(take, info=replace(info, left_out=dead)) if dead else take


def _dead_parts(info: TakeInfo, times: motion_file.Array) -> tuple[tuple[float, float, str], ...]:
    """Sound that nothing moved to, which teaches nothing; what is known of already is not told twice."""
    if not info.audio_file or len(times) < 2:
        return ()
    return tuple(
        (start, end, NO_MOTION)
        for start, end in motion_file.without_motion(times, max(info.duration, float(times[-1])))
        if not any(a < end and start < b for a, b, _ in info.left_out)
    )


def _parse_info(content: dict[str, Any]) -> TakeInfo:
    """The facts of a take.json; TypeError or ValueError where one is of another type, or cannot be."""
    known = {field.name for field in fields(TakeInfo)}
    values: dict[str, Any] = {key: value for key, value in content.items() if key in known}
    for name in values.keys() & {"slate", "created", "source", "device"}:
        values[name] = _of_type(values[name], str)
    for name in values.keys() & {"shape_names", "bone_names", "notes"}:
        values[name] = tuple(_of_type(one, str) for one in _of_type(values[name], list))
    for name in values.keys() & {"duration", "audio_seconds"}:
        values[name] = _within(values[name], _MOST_SECONDS)
    for name in values.keys() & {"fps", "offset", "drift_ppm"}:  # nothing hangs on these
        number = float(_of_type(values[name], float))
        values[name] = number if math.isfinite(number) else 0.0
    whole = {"number", "sample_rate", "audio_channels", "frames", "frames_lost", "packets", "packets_bad"}
    for name in values.keys() & whole:
        values[name] = int(_within(values[name], _MOST_COUNTED))
    for name in ("audio_file", "motion_file"):
        if values.get(name) is not None:
            values[name] = _file_name(_of_type(values[name], str))
    values["left_out"] = tuple(map(_span, _of_type(values.get("left_out", []), list)))
    extra = _of_type(values.get("extra", {}), dict)
    values["extra"] = {str(key): str(value) for key, value in extra.items()}
    return TakeInfo(**values)


def _span(value: Any) -> tuple[float, float, str]:
    """A span of TakeInfo.left_out."""
    start, end, why = _of_type(value, list)
    return _within(start, _MOST_SECONDS), _within(end, _MOST_SECONDS), _of_type(why, str)


def _file_name(text: str) -> str:
    """Only a name: a take.json from elsewhere must not reach outside its folder."""
    name = Path(text.replace("\\", "/")).name
    if name == ".." or "\0" in name:
        raise ValueError(text)
    return name


def _of_type(value: Any, kind: type) -> Any:
    """A value of JSON; TypeError where it is of another type. True and false are no numbers."""
    fits = isinstance(value, (int, float) if kind is float else kind) and not isinstance(value, bool)
    if not fits:
        raise TypeError(value)
    return value


def _within(value: Any, most: float) -> float:
    """A number from 0 to `most`."""
    number = float(_of_type(value, float))
    if not 0 <= number <= most:
        raise ValueError(value)
    return number


def _flush_folder(folder: Path) -> None:
    """Ask the system to keep the folder's files through a power cut, where it can."""
    for path in folder.iterdir():
        with path.open("rb+") as file:
            os.fsync(file.fileno())
