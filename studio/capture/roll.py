"""One recording in progress, on the disk from its first moment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from studio.capture import journal
from studio.capture.microphone import SoundBlock
from studio.errors import StudioError, say
from studio.files.atomic import cannot_write
from studio.sound import wav_writer
from studio.vmc.rows import RowBlock

SOUND, JOURNAL = "audio.wav", journal.FILE
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
        self.start, self.sound = start, sound
        self.head: dict[str, Any] = {"slate": slate, "number": number, **head}
        self.frames = 0
        self.notes: list[str] = []
        # So that `seconds` is 0 before anything came.
        self.last_arrival = start
        self._wav: wav_writer.WavWriter | None = None
        self._last_end: float | None = None
        self.first_captured: float | None = None
        created = datetime.now().astimezone().isoformat(timespec="seconds")
        # All of it goes into the journal at once: after a kill, a take is made from nothing else.
        known = {"slate": slate, "number": number, "created": created, "start": start, "sound": sound, **head}
        try:
            # Not exist_ok: two recorders that chose the same number must not write into one folder.
            folder.mkdir(parents=True)
            self._journal = journal.Journal(folder, known)
            if sound is not None:
                self._wav = wav_writer.WavWriter(folder / SOUND, *sound)
        except FileExistsError as error:
            raise StudioError(
                say("There is a take {folder} already.", folder=folder.name),
                "Choose another slate or number.",
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
        # A block that reaches into the take is kept whole; the clock pairs tell where its first sample
        # belongs.
        if wav is None or not duration or block.captured + duration <= self.start:
            return
        if self.first_captured is None:
            self.first_captured = block.captured
        self._fill_gap(wav, block)
        # Where this block lies in the file, and when it was captured: the pairs that the take's clock is
        # fitted to.
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

    def add_pictures(self, pictures: Sequence[Sequence[float]], last: float = math.inf) -> None:
        """What a camera said of its pictures; those taken before the take began or after its last moment are
        passed over."""
        self._journal.add_pictures([one for one in pictures if self.start <= one[0] <= last])

    def flush(self, facts: dict[str, Any]) -> None:
        """Safe from a kill up to here.

        Raises:
            OSError: it could not be written.
        """
        if self._wav:
            # Sound before the journal: the journal never tells of more sound than there is.
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
            self.notes.append(
                say(
                    "Sound was lost for {gap} ms at {at} s and is silent there.",
                    gap=f"{gap * 1e3:.0f}",
                    at=f"{at:.1f}",
                )
            )
