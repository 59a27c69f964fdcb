"""One take in the making, on the disk from its first moment, and how it becomes a take."""

from __future__ import annotations

import contextlib
import json
import shutil
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from studio.capture import clock, journal, wav_file
from studio.capture.audio import Block
from studio.capture.rows import Row, motion_of
from studio.errors import StudioError
from studio.motion.channels import shape_set
from studio.take.folder import INFO_FILE, save_take
from studio.take.safe_file import cannot_write
from studio.take.take import Take, TakeInfo

SOUND = "audio.wav"
_GAP_S = 0.06
_OVERFLOW_GAP_S = 0.004
_LONGEST_FILL_S = 600.0


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
        self.start = start
        self.frames = 0
        self.notes: list[str] = []
        self.last_arrival = start
        self._wav: wav_file.WavWriter | None = None
        self._last_end: float | None = None
        self.first_captured: float | None = None
        created = datetime.now().astimezone().isoformat(timespec="seconds")
        known = {"slate": slate, "number": number, "created": created, "start": start, **head}
        try:
            folder.mkdir(parents=True)
            self._journal = journal.Journal(folder, known)
            if sound is not None:
                self._wav = wav_file.WavWriter(folder / SOUND, *sound)
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
    def audio_end(self) -> float:
        """When the last sample kept was captured, seconds of `clock.now()`."""
        return self._last_end if self._last_end is not None else self.start

    def add_block(self, block: Block) -> None:
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

    def add_row(self, row: Row) -> None:
        """A frame; those from before the take began are passed over."""
        if row.arrival >= self.start:
            self._journal.add_row(row)
            self.frames += 1
            self.last_arrival = row.arrival

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

    def _fill_gap(self, wav: wav_file.WavWriter, block: Block) -> None:
        """Silence in place of sound that was lost, so that all after it stays in time."""
        if self._last_end is None:
            return
        gap = block.captured - self._last_end
        if gap < (_OVERFLOW_GAP_S if block.overflow else _GAP_S):
            return
        at = self.audio_seconds
        missing = round(min(gap, _LONGEST_FILL_S) * wav.sample_rate)
        while missing > 0:
            chunk = min(missing, wav.sample_rate)
            wav.append(np.zeros((chunk, wav.channels), dtype=np.float32))
            missing -= chunk
        if len(self.notes) < 50:
            self.notes.append(f"Sound was lost for {gap * 1e3:.0f} ms at {at:.1f} s and is silent there.")


def complete(folder: Path, *notes: str) -> Take:
    """Turn a closed or abandoned roll into a take.

    Args:
        folder: with a journal; where it holds a take already, only the journal goes.
        notes: sentences to keep with it.

    Raises:
        StudioError: nothing was recorded (the folder is removed), or the take cannot be written.
    """
    try:
        with (folder / journal.FILE).open("rb+") as held:
            if not journal.hold(held):
                raise StudioError(f"{folder.name} is still being recorded.", "Stop the recording first.")
            take = _save(folder, notes)
    except OSError as error:
        raise cannot_write(folder, error) from error
    if take is None:
        shutil.rmtree(folder, ignore_errors=True)
        raise StudioError(
            f"Nothing came in while {folder.name} was recorded.", "Check the microphone and the sender."
        )
    forget(folder)
    return take


def _save(folder: Path, notes: tuple[str, ...]) -> Take | None:
    """The take of a roll, None where there is nothing in it."""
    told = journal.read(folder)
    sound = folder / SOUND
    samples = wav_file.mend(sound) if sound.is_file() else 0
    fit = _fit(told, samples)
    arrivals = [run[1] for run in told.runs]
    motion = motion_of(told.runs, fit.to_audio(np.concatenate(arrivals))) if arrivals else None
    if not samples:
        sound.unlink(missing_ok=True)
    if motion is None and not samples:
        return None
    info = _info(told, fit, folder)
    missing = [] if samples else ["There is no sound in this take."]
    missing += [] if motion is not None else ["There is no motion in this take."]
    info = replace(info, notes=(*info.notes, *missing, *notes))
    return save_take(folder, info, motion, sound if samples else None)


def holds_anything(folder: Path) -> bool:
    """Whether there is sound or motion in an abandoned roll."""
    sound = folder / SOUND
    has_sound = sound.is_file() and sound.stat().st_size > wav_file.HEADER_BYTES
    return has_sound or bool(journal.read(folder).runs)


def forget(folder: Path) -> None:
    """Remove a journal whose take is safe."""
    with contextlib.suppress(OSError):
        (folder / journal.FILE).unlink(missing_ok=True)


def is_take(folder: Path) -> bool:
    """Whether a folder holds a finished take."""
    return (folder / INFO_FILE).is_file()


def _fit(told: journal.Told, samples: int) -> clock.ClockFit:
    """The take's clock: the sound's where there is some, else the computer's from the start on."""
    if samples and len(told.clock):
        return clock.fit(told.clock[:, 0], told.clock[:, 1])
    first = told.runs[0][1][0] if told.runs else 0.0
    return clock.ClockFit(offset=-float(told.head.get("start", first)))


def _info(told: journal.Told, fit: clock.ClockFit, folder: Path) -> TakeInfo:
    facts, head = told.facts, told.head
    slate, _, number = folder.name.rpartition("_")
    names = tuple(dict.fromkeys(name for run in told.runs for name in run[0].shapes))
    extra = {
        key: str(facts[key]) for key in ("avatar", "avatar_hash", "tracking", "sender") if facts.get(key)
    }
    extra |= {key: str(head[key]) for key in ("port", "host", "pre_roll") if head.get(key) is not None}
    if facts.get("sources"):
        extra["sources"] = json.dumps(facts["sources"], ensure_ascii=False)
    extra |= {"shape_set": shape_set(names), "packets_lost": str(facts.get("packets_lost", 0))}
    extra |= {"late": str(facts["late"])} if facts.get("late") else {}
    moved = 0.0
    if len(told.clock):
        extra["clock_residual_ms"] = f"{fit.residual_ms:.3f}"
        moved = float(fit.to_audio(told.clock[0, 1]) - told.clock[0, 0])
    return TakeInfo(
        slate=head.get("slate", slate or folder.name),
        number=int(head.get("number", number if number.isdigit() else 1)),
        created=head.get("created", ""),
        frames_lost=int(facts.get("frames_lost", 0)),
        packets=int(facts.get("packets", 0)),
        packets_bad=int(facts.get("packets_bad", 0)),
        drift_ppm=round(fit.drift_ppm, 3),
        offset=round(moved, 6),
        source="recorded",
        device=head.get("device") or "",
        notes=tuple(facts.get("notes", ())),
        extra=extra,
    )
