"""One recording in progress, on the disk from its first moment, and how it becomes a take."""

from __future__ import annotations

import contextlib
import json
import math
import time
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import IO, Any

import numpy as np

from studio import clock
from studio.capture import journal, journal_contents, journal_format
from studio.capture.microphone import SoundBlock
from studio.errors import StudioError
from studio.files.atomic import NewerVersionError, cannot_write, set_aside
from studio.motion.channels import shape_set
from studio.sound import wav_writer
from studio.take.folder import INFO_FILE, load_take, save_take
from studio.take.motion_file import SUFFIX, read_motion
from studio.take.take import Take, TakeInfo
from studio.vmc.rows import RowBlock, motion_of

SOUND, JOURNAL = "audio.wav", journal_format.FILE
_GAP_S = 0.06
_OVERFLOW_GAP_S = 0.004
_LONGEST_FILL_S = 600.0
_PATIENCE_S = 30.0
_LONGEST_PAUSE_S = 86_400.0
"""Nobody waits longer for the first frame of a take than they record at most."""


class Roll:
    """Writes a take as it comes. Not for several threads at once.

    Args:
        folder: the take's folder to be; it must not exist.
        slate, number: what the take is called.
        start: when it begins, seconds of `clock.now()`.
        sound: sample rate and channels, None without a microphone.
        head: further facts known now.

    Raises:
        StudioError: the folder exists or cannot be written.
    """

    def __init__(
        self, folder: Path, slate: str, number: int, start: float, sound: tuple[int, int] | None, **head: Any
    ) -> None:
        self.folder = folder
        self.start, self.sound = start, sound
        self.head: dict[str, Any] = {"slate": slate, "number": number, **head}
        self.frames = 0
        self.notes: list[str] = []
        self.last_arrival = start
        self._wav: wav_writer.WavWriter | None = None
        self._last_end: float | None = None
        self.first_captured: float | None = None
        created = datetime.now().astimezone().isoformat(timespec="seconds")
        # All of it goes into the journal at once: after a kill, a take is made from nothing else.
        known = {"slate": slate, "number": number, "created": created, "start": start, "sound": sound, **head}
        try:
            folder.mkdir(parents=True)
            self._journal = journal.Journal(folder, known)
            if sound is not None:
                self._wav = wav_writer.WavWriter(folder / SOUND, *sound)
        except FileExistsError as error:
            raise StudioError(
                f"There is a take {folder.name} already.", "Choose another slate or number."
            ) from error
        except OSError as error:
            raise cannot_write(folder, error) from error

    @property
    def audio_seconds(self) -> float:
        """Sound kept so far."""
        return self._wav.frames / self._wav.sample_rate if self._wav else 0.0

    @property
    def seconds(self) -> float:
        """How long it is so far."""
        return max(self.audio_seconds, self.last_arrival - self.start)

    @property
    def audio_end(self) -> float:
        """When the last sample kept was captured, seconds of `clock.now()`."""
        return self._last_end if self._last_end is not None else self.start

    def add_block(self, block: SoundBlock) -> None:
        """Sound; blocks that ended before the take began are passed over, lost sound becomes silence.

        Raises:
            OSError: it could not be written.
        """
        wav = self._wav
        duration = len(block.samples) / wav.sample_rate if wav else 0.0
        if wav is None or not duration or block.captured + duration <= self.start:
            return
        if self.first_captured is None:
            self.first_captured = block.captured
        self._fill_gap(wav, block)
        self._journal.add_clock(self.audio_seconds, block.captured)
        wav.append(block.samples)
        self._last_end = block.captured + duration

    def add_rows(self, block: RowBlock) -> None:
        """Frames; those from before the take began are passed over."""
        block = block.between(self.start)
        if len(block):
            self._journal.add_rows(block)
            self.frames += len(block)
            self.last_arrival = float(block.arrivals[-1])

    def flush(self, facts: dict[str, Any]) -> None:
        """Safe from a kill up to here.

        Raises:
            OSError: it could not be written.
        """
        if self._wav:
            self._wav.flush()
        self._journal.flush({**facts, "notes": self.notes})

    def sync(self) -> None:
        """Safe from a power cut up to here, soon."""
        self._journal.sync(*([self._wav.fileno()] if self._wav else []))

    def close(self) -> None:
        """End the files; what a full disk refuses is left out."""
        if self._wav:
            try:
                self._wav.close()
            except OSError:
                self._wav.abandon()
        self._journal.close()

    def _fill_gap(self, wav: wav_writer.WavWriter, block: SoundBlock) -> None:
        """Silence in place of sound that was lost, so that all after it stays in time."""
        if self._last_end is None:
            return
        # Stamps tremble by milliseconds: only more than that, or a loss the device reports, is a gap.
        gap = block.captured - self._last_end
        if gap < (_OVERFLOW_GAP_S if block.overflow else _GAP_S):
            return
        at = self.audio_seconds
        missing = round(min(gap, _LONGEST_FILL_S) * wav.sample_rate)
        while missing > 0:
            # A second at a time: ten minutes of silence for eight channels would be a gigabyte of zeros.
            chunk = min(missing, wav.sample_rate)
            wav.append(np.zeros((chunk, wav.channels), dtype=np.float32))
            missing -= chunk
        # A device that stutters all evening must not fill the take with sentences.
        if len(self.notes) < 50:
            self.notes.append(f"Sound was lost for {gap * 1e3:.0f} ms at {at:.1f} s and is silent there.")


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
        with (folder / journal_format.FILE).open("rb+") as held:
            _wait_for(held, folder)
            contents = journal_contents.read(folder)
            take = standing(folder, contents) or save(folder, contents, notes)
        # The journal goes last, once the take is safe: after a kill before that, recovery removes it.
        if take is not None:
            put_away(folder, contents)
            return take
        if holds_anything(folder, contents):
            raise set_unreadable_aside(folder)
    except FileNotFoundError as error:
        if is_take(folder):  # a program that opened the project just now took it for left behind
            return load_take(folder)
        raise cannot_write(folder, error) from error
    except OSError as error:
        raise cannot_write(folder, error) from error
    remove(folder)
    raise StudioError(
        f"Nothing came in while {folder.name} was recorded.", "Check the microphone and the sender."
    )


def _wait_for(held: IO[bytes], folder: Path) -> None:
    """Lock a closed journal; a program that recovers it at this moment is waited for."""
    until = time.monotonic() + _PATIENCE_S
    while journal.is_busy(held):
        if time.monotonic() > until:
            raise StudioError(f"{folder.name} is still being recorded.", "Stop the recording first.")
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
    samples = wav_writer.mend(sound, *_sound_form(contents.head)) if sound.is_file() else 0
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
        if _has_sound(folder):
            set_aside(sound)
            missing.append("Its sound was damaged on the disk and could not be read; the file is kept.")
        else:
            sound.unlink()
    left = folder / f"motion{SUFFIX}"  # by who was killed before take.json was written
    if motion is not None and left.is_file() and not _is_motion(left):
        set_aside(left)
    info = _info(contents, fit, folder)
    extra = {**info.extra, "damage": damage} if damage else info.extra
    notes_of = tuple(dict.fromkeys((*info.notes, *missing, *notes)))
    info = replace(info, notes=notes_of, extra=extra)
    return save_take(folder, info, motion, sound if samples else None)


def holds_anything(folder: Path, contents: journal_contents.JournalContents) -> bool:
    """Whether there is, or may have been, sound or motion in a roll: then it is never removed."""
    return _has_sound(folder) or bool(contents.row_blocks) or bool(contents.damaged)


def remove(folder: Path) -> None:
    """Remove a roll's own files, and its folder; one with anything of other people's stays."""
    with contextlib.suppress(OSError):
        (folder / journal_format.FILE).unlink(missing_ok=True)
        (folder / SOUND).unlink(missing_ok=True)
        folder.rmdir()


def put_away(folder: Path, contents: journal_contents.JournalContents) -> None:
    """Remove the journal of a take that is safe; one that was damaged is kept under another name."""
    path = folder / journal_format.FILE
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
    set_aside(folder / journal_format.FILE)
    what = f"{folder.name} was damaged on the disk, and nothing of it could be read."
    return StudioError(what, f"What is left of it is kept in {folder}.")


def _damage_note(contents: journal_contents.JournalContents, fit: clock.ClockFit) -> str:
    """One sentence on where a recording was damaged, and how much that cost; "" where it was not."""
    if not contents.damaged:
        return ""
    first = contents.damaged[0]
    moment = max(0.0, fit.to_audio(first.since))  # NaN stays NaN
    where = f"near {moment:.1f} s" if math.isfinite(first.since) else "at its beginning"
    if len(contents.damaged) > 1:
        where = f"in {len(contents.damaged)} places, the first {where}"
    lost = []
    if contents.rows_missing or contents.seconds_missing > 0.05:
        lost.append(f"{max(contents.seconds_missing, 0.1):.1f} s of motion")
    if contents.damaged[-1].is_end:
        lost.append("its end")
    exact = all(one.rows is not None for one in contents.damaged)
    none = "nothing was lost" if exact else "no more than a moment was lost"
    cost = f"{' and '.join(lost)} could not be read" if lost else none
    return f"The recording was damaged on the disk {where}; {cost}."


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
    names = tuple(dict.fromkeys(name for block in contents.row_blocks for name in block.names.shapes))
    extra = {
        key: str(facts[key]) for key in ("avatar", "avatar_hash", "tracking", "sender") if facts.get(key)
    }
    extra |= {key: str(head[key]) for key in ("port", "host", "pre_roll") if head.get(key) is not None}
    if facts.get("sources"):
        extra["sources"] = json.dumps(facts["sources"], ensure_ascii=False)
    extra |= {"shape_set": shape_set(names), "packets_lost": str(facts.get("packets_lost", 0))}
    extra |= {key: str(facts[key]) for key in ("late", "packets_refused", "frames_thinned") if facts.get(key)}
    moved = 0.0
    if len(contents.clock):
        extra["clock_residual_ms"] = f"{fit.residual_ms:.3f}"
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
    changed = datetime.fromtimestamp((folder / journal_format.FILE).stat().st_mtime)
    return changed.astimezone().isoformat(timespec="seconds")
