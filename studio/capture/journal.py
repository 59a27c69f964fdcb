"""Writer of a take's crash-safe journal, and the blocks it is made of: each readable without the others."""

from __future__ import annotations

import errno
import json
import os
import struct
import sys
import time
import zlib
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from studio.vmc.rows import ChannelLayout, RowBlock

FILE = "journal.bin"
MAGIC = b"SAIAJRN2"
MAGIC_1 = b"SAIAJRN1"
HEAD, NAMES, ROWS, CLOCK, FACTS, PICTURES = b"HEAD", b"NAME", b"ROWS", b"CLCK", b"FACT", b"PICT"
# Read as a number in a row of floats it would be -2.7e38, and UTF-8 has no such bytes: only blocks have it.
MARK = b"\xfeSJ\xff"
HEADER = struct.Struct("<4s4sIIIII")
CHECK = struct.Struct("<I")
HEADER_BYTES = HEADER.size + CHECK.size
HEADER_1 = struct.Struct("<4sII")


@dataclass(frozen=True)
class Block:
    """One whole block.

    Args:
        kind: HEAD, NAMES, ROWS, CLOCK, FACTS, PICTURES, or one of a later version.
        payload: its content. at, end: where it lies, bytes.
        number, rows: blocks and rows written before it. layout: what its rows have. All 0 in version 1.
    """

    kind: bytes
    payload: memoryview
    at: int
    end: int
    number: int = 0
    rows: int = 0
    layout: int = 0


def pack(kind: bytes, payload: bytes, number: int, rows: int, layout: int) -> bytes:
    """A block as version 2 writes it."""
    header = HEADER.pack(MARK, kind, number, rows, layout, len(payload), zlib.crc32(payload))
    return header + CHECK.pack(zlib.crc32(header)) + payload


# Rows of more than that go into several blocks, since damage costs a whole one.
_BLOCK_BYTES = 128 * 1024
# Flushes after which head and names are written again, at the latest.
_REPEAT = 25
# How many tables of names are written again: those that came last.
_TABLES = 16
_LOCK_TRIES, _LOCK_S = 40, 0.005


class Journal:
    """Writes one take's journal; all methods may raise OSError.

    Args:
        folder: the take's folder, which exists.
        head: what is known at the start.
    """

    def __init__(self, folder: Path, head: dict[str, Any]) -> None:
        # Without Python's buffer: after a write that failed nothing may follow by itself, at the wrong place.
        self._file = (folder / FILE).open("xb", buffering=0)
        _hold_for_good(self._file)
        self._names: ChannelLayout | None = None
        self._rows: list[RowBlock] = []
        self._clock: list[tuple[float, float]] = []
        self._pictures: list[Sequence[float]] = []
        # fsync of a slow disk takes up to seconds; on a thread of its own nothing waits for it.
        self._syncer = ThreadPoolExecutor(1, thread_name_prefix="journal sync")
        self._syncing: Future[None] | None = None
        # Everything of one flush goes out in one write, so that a block is either whole or not there.
        self._pending = bytearray(MAGIC)
        self._number = self._row_count = 0
        self._written = (0, 0, 0)
        """Bytes, blocks and rows that are in the file."""
        self._flushes, self._repeat_at = 0, 1
        self._head = _plain(head)
        self._tables: dict[int, bytes] = {}
        self._layout = 0
        self._add(HEAD, self._head)
        self._write()

    def add_rows(self, block: RowBlock) -> None:
        """Frames; on the disk after the next `flush`."""
        # By identity: the packer gives one layout object for as long as the channels stay the same.
        if block.names is not self._names:
            self._pack_rows()
            self._names = block.names
            self._add_names(block.names)
        self._rows.append(block)

    def add_clock(self, audio_time: float, captured: float) -> None:
        """One moment on both clocks: seconds of sound, and of `clock.now()`."""
        self._clock.append((audio_time, captured))

    def add_pictures(self, pictures: Sequence[Sequence[float]]) -> None:
        """What a camera said of its pictures; rows of motion.filmed."""
        self._pictures += pictures

    def flush(self, facts: dict[str, Any]) -> None:
        """Hand everything to the system, so that a kill of this process loses nothing of it."""
        self._pack_rows()
        if self._clock:
            self._add(CLOCK, np.array(self._clock, dtype="<f8").tobytes())
            self._clock.clear()
        if self._pictures:
            self._add(PICTURES, np.array(self._pictures, dtype="<f8").tobytes())
            self._pictures.clear()
        self._add(FACTS, _plain(facts))
        self._flushes += 1
        if self._flushes >= self._repeat_at:
            self._repeat()
        self._write()

    def sync(self, *others: int) -> None:
        """Ask for the platter in another thread, against a power cut; a slow disk holds nobody up.

        Args:
            others: further file descriptors.
        """
        # One at a time: a disk that is slower than two seconds would pile them up.
        if self._syncing is None or self._syncing.done():
            self._syncing = self._syncer.submit(_sync, self._file.fileno(), *others)

    def close(self) -> None:
        """End the file; the lock on it goes too."""
        self._syncer.shutdown(wait=True)
        # Bytes that did not fit are lost, but not the ones before them.
        with suppress(OSError):
            self._file.close()

    def _add_names(self, names: ChannelLayout) -> None:
        """What follows has these names. The table's checksum is its name, the same wherever it stands."""
        payload = _plain({"shapes": names.shapes, "bones": names.bones})
        self._layout = zlib.crc32(payload)
        if self._tables.pop(self._layout, None) is None:
            # A new table is repeated soon: rows that were just written are worth nothing without it.
            self._repeat_at = min(self._repeat_at, self._flushes + 2)
        # Names that came last stand last, so that those of long ago are the first to be dropped.
        self._tables[self._layout] = payload
        if len(self._tables) > _TABLES:
            self._tables.pop(next(iter(self._tables)))
        self._add(NAMES, payload)

    def _repeat(self) -> None:
        """Write again what all rows lean on: without a head or names, whole rows would tell nothing.

        Soon after it was new, then more and more seldom: at most five seconds apart, where 0.2 s are flushed.
        """
        self._repeat_at = self._flushes + min(self._flushes, _REPEAT)
        self._add(HEAD, self._head)
        for payload in self._tables.values():
            self._add(NAMES, payload)

    def _pack_rows(self) -> None:
        """Turn the rows since the last flush into as few blocks as their size allows."""
        if not self._rows or self._names is None:
            return
        stamps = np.concatenate([block.stamps for block in self._rows]).astype("<f8", copy=False)
        values = np.concatenate([block.values for block in self._rows]).astype("<f4", copy=False)
        self._rows.clear()
        at_once = max(1, _BLOCK_BYTES // (4 * self._names.width))
        for start in range(0, len(stamps), at_once):
            part = slice(start, start + at_once)
            count = len(stamps[part])
            self._add(ROWS, struct.pack("<I", count) + stamps[part].tobytes() + values[part].tobytes())
            self._row_count += count

    def _add(self, kind: bytes, payload: bytes) -> None:
        self._pending += pack(kind, payload, self._number, self._row_count, self._layout)
        self._number += 1

    def _write(self) -> None:
        """Write what is pending, whole or not at all: the reader would take half of it for damage."""
        pending, self._pending = memoryview(self._pending), bytearray()
        try:
            while pending:
                pending = pending[self._file.write(pending) :]
        except OSError:
            size, self._number, self._row_count = self._written
            with suppress(OSError):
                # A torn block would be read as damage of the disk, and a person told so.
                self._file.truncate(size)
                self._file.seek(size)
            raise
        self._written = self._file.tell(), self._number, self._row_count


def _plain(content: dict[str, Any]) -> bytes:
    return json.dumps(content, ensure_ascii=False).encode("utf-8", "replace")


def _sync(*descriptors: int) -> None:
    for descriptor in descriptors:
        with suppress(OSError):
            os.fsync(descriptor)


def hold(file: IO[bytes]) -> bool:
    """Lock a file for this process; the system lets go when it dies. False where that cannot be."""
    try:
        _lock(file)
    except OSError:
        return False
    return True


def is_busy(file: IO[bytes]) -> bool:
    """Whether another process has a file; if not, it is locked, unless the disk knows no locks."""
    try:
        _lock(file)
    except OSError as error:
        # Any other error says that this disk knows no locks at all, and then the file counts as free.
        return error.errno in (errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK)
    return False


def _lock(file: IO[bytes]) -> None:
    if sys.platform == "win32":
        import msvcrt

        # A byte far behind the content: on Windows nobody can read what is locked.
        file.seek(0x7FFF_FFFF)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        finally:
            file.seek(0, os.SEEK_END)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _hold_for_good(file: IO[bytes]) -> None:
    """Lock a journal that was just made; one who looks for abandoned ones may have it for a moment."""
    # Tried for 0.2 s: whoever recovers journals locks each for a moment to see whether it is free.
    for _ in range(_LOCK_TRIES):
        if hold(file):
            return
        time.sleep(_LOCK_S)
