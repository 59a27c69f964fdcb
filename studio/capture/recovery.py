"""Takes made from journals: when a recording ends, and after a program that was killed while it recorded."""

from __future__ import annotations

import contextlib
import json
import logging
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import IO, Any

import numpy as np

from studio import clock
from studio.capture import journal, journal_contents
from studio.capture.roll import SOUND
from studio.errors import StudioError, say
from studio.files.atomic import NewerVersionError, cannot_write, set_aside
from studio.motion import filmed
from studio.motion.channels import shape_set
from studio.sound import wav_writer
from studio.take.folder import INFO_FILE, load_take, save_take
from studio.take.motion_file import SUFFIX, read_motion
from studio.take.take import Take, TakeInfo
from studio.vmc.rows import motion_of

_PATIENCE_S = 30.0
# Nobody waits longer for the first frame of a take than they record at most.
_LONGEST_PAUSE_S = 86_400.0


def complete(folder: Path, *notes: str) -> Take:
    """Turn a closed roll into a take.

    Args:
        folder: with a journal; where it holds a take already, only the journal goes.
        notes: sentences to keep with it.

    Raises:
        StudioError: nothing was recorded (the folder is removed), nothing can be read (it is kept), or the
            take cannot be written.
    """
    try:
        with (folder / journal.FILE).open("rb+") as held:
            _wait_for(held, folder)
            contents = journal_contents.read(folder)
            # A take that is whole already is kept: recovery may have been interrupted between writing it and
            # removing the journal.
            take = standing(folder, contents) or save(folder, contents, notes)
        # The journal goes last, once the take is safe: after a kill before that, recovery removes it.
        if take is not None:
            put_away(folder, contents)
            return take
        if holds_anything(folder, contents):
            raise set_unreadable_aside(folder)
    except FileNotFoundError as error:
        # Another program that opened the project at this moment recovered it first.
        if is_take(folder):
            return load_take(folder)
        raise cannot_write(folder, error) from error
    except OSError as error:
        raise cannot_write(folder, error) from error
    remove(folder)
    raise StudioError(
        say("Nothing came in while {folder} was recorded.", folder=folder.name),
        "Check the microphone and the sender.",
    )


def _wait_for(held: IO[bytes], folder: Path) -> None:
    """Lock a closed journal; a program that recovers it at this moment is waited for."""
    until = time.monotonic() + _PATIENCE_S
    while journal.is_busy(held):
        if time.monotonic() > until:
            raise StudioError(
                say("{folder} is still being recorded.", folder=folder.name), "Stop the recording first."
            )
        time.sleep(0.02)


def standing(folder: Path, contents: journal_contents.JournalContents) -> Take | None:
    """The take that a folder holds already; None where its journal has to make it, or to make it again.

    Only one with all that was recorded may cost the journal: a power cut can leave take.json and nothing of
    the motion, and so does a take.json that was damaged and made anew. The old one is set aside.

    Raises:
        OSError, StudioError: it cannot be read, and the journal does not tell all of it.
    """
    if not is_take(folder):
        return None
    try:
        take = load_take(folder)
        # Without rows in the journal there is nothing that a new take could hold more of.
        if not contents.row_blocks or _has_motion(take):
            return take
    except NewerVersionError:
        raise
    except StudioError:
        if contents.damaged or not contents.row_blocks:
            raise
    set_aside(folder / INFO_FILE)
    return None


def _has_motion(take: Take) -> bool:
    """Whether a take's motion is there and can be read."""
    return take.motion_path is not None and _is_motion(take.motion_path)


def _is_motion(path: Path) -> bool:
    """Whether a file holds motion; one of a later version raises."""
    try:
        return path.is_file() and len(read_motion(path)) > 0
    except NewerVersionError:
        raise
    except StudioError:
        return False


def save(folder: Path, contents: journal_contents.JournalContents, notes: tuple[str, ...]) -> Take | None:
    """The take of a roll, None where nothing in it can be read; its journal stays.

    Raises:
        OSError, StudioError: it cannot be written.
    """
    sound = folder / SOUND
    # The sizes in a WAV's head are written last; of a killed program they are still zero.
    samples = wav_writer.repair(sound, *_sound_form(contents.head)) if sound.is_file() else 0
    # Fitted anew over the whole take, which is more exact than the fit that was shown while it rolled.
    fit = _fit(contents, samples)
    arrivals = [block.arrivals for block in contents.row_blocks]
    motion = motion_of(contents.row_blocks, fit.to_audio(np.concatenate(arrivals))) if arrivals else None
    if motion is None and not samples:
        return None
    missing = [] if samples else ["There is no sound in this take."]
    missing += [] if motion is not None else ["There is no motion in this take."]
    damage = _damage_note(contents, fit)
    missing += [damage] if damage else []
    if not samples and sound.is_file():
        # Bytes that cannot be understood may still be somebody's only copy.
        if _has_sound(folder):
            set_aside(sound)
            missing.append("Its sound was damaged on the disk and could not be read; the file is kept.")
        else:
            sound.unlink()
    # Left by a program that was killed after the motion was written and before take.json was.
    left = folder / f"motion{SUFFIX}"
    if motion is not None and left.is_file() and not _is_motion(left):
        set_aside(left)
    info = _info(contents, fit, folder)
    extra = {**info.extra, "damage": damage} if damage else info.extra
    # Each sentence once: a take that ended early has its reason from the journal and from its stop.
    notes_of = tuple(dict.fromkeys((*info.notes, *missing, *notes)))
    info = replace(info, notes=notes_of, extra=extra)
    return save_take(folder, info, motion, sound if samples else None)


def holds_anything(folder: Path, contents: journal_contents.JournalContents) -> bool:
    """Whether there is, or may have been, sound or motion in a roll: then it is never removed."""
    return _has_sound(folder) or bool(contents.row_blocks) or bool(contents.damaged)


def remove(folder: Path) -> None:
    """Remove a roll's own files, and its folder; one with anything of other people's stays."""
    with contextlib.suppress(OSError):
        (folder / journal.FILE).unlink(missing_ok=True)
        (folder / SOUND).unlink(missing_ok=True)
        folder.rmdir()


def put_away(folder: Path, contents: journal_contents.JournalContents) -> None:
    """Remove the journal of a take that is safe; one that was damaged is kept under another name."""
    path = folder / journal.FILE
    with contextlib.suppress(
        OSError
    ):  # another program was faster, or has it open; the next one comes by again
        if contents.damaged:
            set_aside(path)
        else:
            path.unlink()


def set_unreadable_aside(folder: Path) -> StudioError:
    """Keep a recording of which nothing can be read, so that nobody tries again; gives what to say of it.

    Raises:
        OSError: it cannot be renamed.
    """
    set_aside(folder / journal.FILE)
    what = say("{folder} was damaged on the disk, and nothing of it could be read.", folder=folder.name)
    return StudioError(what, say("What is left of it is kept in {folder}.", folder=folder))


def _damage_note(contents: journal_contents.JournalContents, fit: clock.ClockFit) -> str:
    """One sentence on where a recording was damaged, and how much that cost; "" where it was not."""
    if not contents.damaged:
        return ""
    first = contents.damaged[0]
    # max gives NaN back where the second value is NaN, which is asked about below.
    moment = max(0.0, fit.to_audio(first.since))
    where = say("near {moment} s", moment=f"{moment:.1f}")
    if not math.isfinite(first.since):
        where = say("at its beginning")
    if len(contents.damaged) > 1:
        where = say("in {n} places, the first {where}", n=len(contents.damaged), where=where)
    seconds, ends = f"{max(contents.seconds_missing, 0.1):.1f}", contents.damaged[-1].is_end
    if contents.rows_missing or contents.seconds_missing > 0.05:
        cost = say("{seconds} s of motion could not be read", seconds=seconds)
        if ends:
            cost = say("{seconds} s of motion and its end could not be read", seconds=seconds)
    elif ends:
        cost = say("its end could not be read")
    elif all(one.rows is not None for one in contents.damaged):
        cost = say("nothing was lost")
    else:
        cost = say("no more than a moment was lost")
    return say("The recording was damaged on the disk {where}; {cost}.", where=where, cost=cost)


def is_take(folder: Path) -> bool:
    """Whether a folder holds a finished take."""
    return (folder / INFO_FILE).is_file()


def _has_sound(folder: Path) -> bool:
    sound = folder / SOUND
    return sound.is_file() and sound.stat().st_size > wav_writer.HEADER_BYTES


def _sound_form(head: dict[str, Any]) -> tuple[int, int]:
    """Sample rate and channels, (0, 0) where a journal does not tell; older ones did not."""
    form = head.get("sound")
    if not isinstance(form, list) or len(form) != 2:
        return 0, 0
    sample_rate, channels = (_whole(number) for number in form)
    # Only what a device can have: the numbers come from a file that may be damaged.
    return (sample_rate, channels) if sample_rate <= 1_000_000 and channels <= 64 else (0, 0)


def _fit(contents: journal_contents.JournalContents, samples: int) -> clock.ClockFit:
    """The take's clock: the sound's where there is some, else the computer's from the start on."""
    if samples and len(contents.clock):
        return clock.fit(contents.clock[:, 0], contents.clock[:, 1])
    first = float(contents.row_blocks[0].arrivals[0]) if contents.row_blocks else 0.0
    start = contents.head.get("start")
    # A head of nonsense must not move all of the motion out of the take.
    if not isinstance(start, int | float) or not first - _LONGEST_PAUSE_S <= start <= first:
        start = first
    return clock.ClockFit(offset=-float(start))


def _info(contents: journal_contents.JournalContents, fit: clock.ClockFit, folder: Path) -> TakeInfo:
    facts, head = contents.facts, contents.head
    slate, _, number = folder.name.rpartition("_")
    named = int(number) if slate and number.isdecimal() else 1
    # Of all blocks, since shapes may come only after a while.
    names = tuple(dict.fromkeys(name for block in contents.row_blocks for name in block.names.shapes))
    extra = {
        key: str(facts[key]) for key in ("avatar", "avatar_hash", "tracking", "sender") if facts.get(key)
    }
    extra |= {key: str(head[key]) for key in ("port", "host", "pre_roll") if head.get(key) is not None}
    if facts.get("sources"):
        extra["sources"] = json.dumps(facts["sources"], ensure_ascii=False)
    extra |= {"shape_set": shape_set(names), "packets_lost": str(facts.get("packets_lost", 0))}
    counters = "late", "packets_refused", "frames_thinned", "values_unknown"
    extra |= {key: str(facts[key]) for key in counters if facts.get(key)}
    pictures = contents.pictures[np.argsort(contents.pictures[:, 0], kind="stable")]
    moments, flags = fit.to_audio(pictures[:, 0]), pictures[:, 1].astype(int)
    alone = (flags & filmed.PictureFlag.MERGED) > 0
    # Of a face that another tracker gave, a camera's pictures say nothing; yet they count, or the moment
    # before a phone was heard would be said of all the take.
    extra |= filmed.shares(np.where(alone, flags, filmed.PictureFlag.FACE)) if alone.any() else {}
    if (beside := filmed.agreement(pictures)) is not None:
        extra[filmed.BESIDE] = json.dumps(vars(beside))
    moved = 0.0
    if len(contents.clock):
        extra["clock_residual_ms"] = f"{fit.residual_ms:.3f}"
        # How far the first block's own stamp is from what all of them say: the offset that the fit took out.
        moved = float(fit.to_audio(contents.clock[0, 1]) - contents.clock[0, 0])
    notes = facts.get("notes")
    return TakeInfo(
        slate=_text(head.get("slate")) or slate or folder.name,
        number=_whole(head.get("number")) or named,
        created=_text(head.get("created")) or _changed(folder),
        frames_lost=_whole(facts.get("frames_lost")),
        packets=_whole(facts.get("packets")),
        packets_bad=_whole(facts.get("packets_bad")),
        drift_ppm=round(fit.drift_ppm, 3),
        offset=round(moved, 6),
        source="recorded",
        device=_text(head.get("device")),
        notes=tuple(filter(None, map(_text, notes))) if isinstance(notes, list) else (),
        left_out=filmed.webcam_left_out(moments, flags),
        extra=extra,
    )


def _whole(value: object) -> int:
    """A count from a journal, which may hold anything; 0 for what is none."""
    known = isinstance(value, int | float) and 0 <= value < 2**53
    return int(value) if known else 0  # type: ignore[call-overload]


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""


def _changed(folder: Path) -> str:
    """When a journal was last written, in place of when it was begun."""
    changed = datetime.fromtimestamp((folder / journal.FILE).stat().st_mtime)
    return changed.astimezone().isoformat(timespec="seconds")


_RECOVERED = "The studio closed while recording; this take was recovered."
_LOCK_FILE = ".recovering"
_WAIT_S, _LOOK_S = 60.0, 0.05
# A recording as young as that may be about to begin, and not have its lock yet.
_YOUNG_S = 60.0
# After which no recording goes on that wrote nothing; the clock of a network drive may be off by some.
_SILENT_S = 3600.0
_log = logging.getLogger(__name__)


def left_behind(takes_folder: Path) -> tuple[Path, ...]:
    """Folders that are no takes yet: recordings that go on, or were cut short."""
    try:
        return tuple(sorted(path.parent for path in takes_folder.glob(f"*/{journal.FILE}")))
    except OSError:
        # A folder that cannot be listed is reported by whatever opens the project.
        return ()


def recover(
    takes_folder: Path, on_problem: Callable[[Path, StudioError], object] | None = None
) -> tuple[Take, ...]:
    """Make takes of what a program that was killed left; recordings that still go on are let be.

    Where another program recovers already, it is waited for, so that both see the same takes.

    Args:
        takes_folder: it may be missing.
        on_problem: is told of each folder that could not be recovered, and why; nothing in it is lost.

    Returns:
        The takes, each with a note that says so. Folders in which nothing was recorded are removed.
    """
    found: list[Take] = []
    if not left_behind(takes_folder):
        return ()
    # Looked for again under the lock: what another program recovered meanwhile is no longer there.
    with _alone(takes_folder):
        for folder in left_behind(takes_folder):
            try:
                take = _recovered(folder)
            except StudioError as error:
                if on_problem:
                    on_problem(folder, error)
                else:
                    _log.warning("%s was not recovered: %s", folder, error)
            else:
                found += [take] if take is not None else []
    return tuple(found)


@contextmanager
def _alone(takes_folder: Path) -> Iterator[None]:
    """Wait until no other program recovers here; where there are no locks, those of the journals must do."""
    path = takes_folder / _LOCK_FILE
    try:
        file = path.open("wb")
    except OSError:
        # In a folder that is read-only each recording then says for itself why it is not recovered.
        yield
        return
    with file:
        until = time.monotonic() + _WAIT_S
        while journal.is_busy(file) and time.monotonic() < until:
            time.sleep(_LOOK_S)
        yield
    # Windows removes no file that another program waits for.
    with suppress(OSError):
        path.unlink()


def _recovered(folder: Path) -> Take | None:
    """The take of one folder, None where there is nothing to recover or nothing may be touched.

    Raises:
        StudioError: it could not be recovered, for whatever reason.
    """
    path = folder / journal.FILE
    try:
        with path.open("rb+") as held:
            locked = journal.hold(held)
            changed = path.stat().st_mtime
            # A disk without locks tells by the time alone: what goes on is written to five times a second.
            if not locked and (journal.is_busy(held) or time.time() - changed < _SILENT_S):
                # It is still being recorded, or another program recovers it.
                return None
            contents = journal_contents.read(folder)
            take = standing(folder, contents)
            recovered = save(folder, contents, (_RECOVERED,)) if take is None else None
        if take or recovered:
            put_away(folder, contents)
        elif holds_anything(folder, contents):
            raise set_unreadable_aside(folder)
        # An empty one may belong to a recording that is just being begun.
        elif time.time() - changed > _YOUNG_S:
            remove(folder)
    except FileNotFoundError as error:
        if path.exists():
            raise cannot_write(folder, error) from error
        return None
    except OSError as error:
        raise cannot_write(folder, error) from error
    except StudioError:
        raise
    except Exception as error:
        # One odd recording must not keep anybody from the rest of the project.
        what = say("Something unexpected happened: {kind}: {error}.", kind=type(error).__name__, error=error)
        raise StudioError(what, say("It is kept in {folder}; please report this.", folder=folder)) from error
    return recovered
