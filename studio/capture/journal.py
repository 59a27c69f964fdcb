"""What a take in the making leaves on the disk: blocks with checksums, good up to the last whole one."""

from __future__ import annotations

import json
import os
import struct
import sys
import zlib
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from studio.capture.rows import Names, Row, Run

FILE = "journal.bin"
_MAGIC = b"SAIAJRN1"
_BLOCK = struct.Struct("<4sII")
_HEAD, _NAMES, _ROWS, _CLOCK, _FACTS = b"HEAD", b"NAME", b"ROWS", b"CLCK", b"FACT"


class Journal:
    """Writes one take's journal; all methods may raise OSError.

    Args:
        folder: the take's folder, which exists.
        head: what is known at the start.
    """

    def __init__(self, folder: Path, head: dict[str, Any]) -> None:
        self._file = (folder / FILE).open("xb")
        hold(self._file)
        self._names: Names | None = None
        self._rows: list[Row] = []
        self._clock: list[tuple[float, float]] = []
        self._syncer = ThreadPoolExecutor(1, thread_name_prefix="journal sync")
        self._syncing: Future[None] | None = None
        self._file.write(_MAGIC)
        self._json(_HEAD, head)
        self._file.flush()

    def add_row(self, row: Row) -> None:
        """A frame; on the disk after the next `flush`."""
        if row.names is not self._names:
            self._write_rows()
            self._names = row.names
            self._json(_NAMES, {"shapes": row.names.shapes, "bones": row.names.bones})
        self._rows.append(row)

    def add_clock(self, audio_time: float, captured: float) -> None:
        """One moment on both clocks: seconds of sound, and of `clock.now()`."""
        self._clock.append((audio_time, captured))

    def flush(self, facts: dict[str, Any]) -> None:
        """Hand everything to the system, so that a kill of this process loses nothing of it."""
        self._write_rows()
        if self._clock:
            self._block(_CLOCK, np.array(self._clock, dtype="<f8").tobytes())
            self._clock.clear()
        self._json(_FACTS, facts)
        self._file.flush()

    def sync(self, *others: int) -> None:
        """Ask for the platter in another thread, against a power cut; a slow disk holds nobody up.

        Args:
            others: further file descriptors.
        """
        if self._syncing is None or self._syncing.done():
            self._syncing = self._syncer.submit(_sync, self._file.fileno(), *others)

    def close(self) -> None:
        """End the file; the lock on it goes too."""
        self._syncer.shutdown(wait=True)
        with suppress(OSError):  # bytes that did not fit are lost; the ones before are not
            self._file.close()

    def _write_rows(self) -> None:
        if not self._rows:
            return
        stamps = np.array([(r.arrival, r.sender_time) for r in self._rows], dtype="<f8")
        values = np.stack([r.values for r in self._rows]).astype("<f4", copy=False)
        self._rows.clear()
        self._block(_ROWS, struct.pack("<I", len(stamps)) + stamps.tobytes() + values.tobytes())

    def _json(self, kind: bytes, content: dict[str, Any]) -> None:
        self._block(kind, json.dumps(content, ensure_ascii=False).encode("utf-8", "replace"))

    def _block(self, kind: bytes, payload: bytes) -> None:
        self._file.write(_BLOCK.pack(kind, len(payload), zlib.crc32(payload)) + payload)


def _sync(*descriptors: int) -> None:
    for descriptor in descriptors:
        with suppress(OSError):
            os.fsync(descriptor)


@dataclass
class Told:
    """What a journal tells.

    Args:
        head: what was known at the start. facts: the latest counters and names.
        runs: the motion. clock: pairs of audio time and capture time, (N, 2).
        torn: it ends in the middle of a block.
    """

    head: dict[str, Any] = field(default_factory=dict)
    facts: dict[str, Any] = field(default_factory=dict)
    runs: list[Run] = field(default_factory=list)
    clock: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    torn: bool = False


def read(folder: Path) -> Told:
    """Read a journal as far as it is whole; never raises for what is in it."""
    data = memoryview((folder / FILE).read_bytes())
    told, names = Told(torn=bytes(data[:8]) != _MAGIC), Names((), ())
    clocks, at = [told.clock], len(_MAGIC)
    while at < len(data) and not told.torn:
        kind, payload = _next_block(data, at)
        if payload is None:
            told.torn = True
            break
        at += _BLOCK.size + len(payload)
        if kind == _HEAD:
            told.head = json.loads(bytes(payload))
        elif kind == _FACTS:
            told.facts = json.loads(bytes(payload))
        elif kind == _NAMES:
            content = json.loads(bytes(payload))
            names = Names(tuple(content["shapes"]), tuple(content["bones"]))
        elif kind == _CLOCK:
            clocks.append(np.frombuffer(payload, dtype="<f8").reshape(-1, 2))
        elif kind == _ROWS:
            told.runs.append(_rows(payload, names))
    told.clock = np.concatenate(clocks)
    return told


def _next_block(data: memoryview, at: int) -> tuple[bytes, memoryview | None]:
    if at + _BLOCK.size > len(data):
        return b"", None
    kind, length, check = _BLOCK.unpack_from(data, at)
    payload = data[at + _BLOCK.size : at + _BLOCK.size + length]
    whole = len(payload) == length and zlib.crc32(payload) == check
    return kind, payload if whole else None


def _rows(payload: memoryview, names: Names) -> Run:
    (count,) = struct.unpack_from("<I", payload)
    stamps = np.frombuffer(payload, "<f8", 2 * count, 4).reshape(count, 2)
    values = np.frombuffer(payload, "<f4", count * names.width, 4 + 16 * count)
    return names, stamps[:, 0], values.reshape(count, names.width)


def hold(file: IO[bytes]) -> bool:
    """Lock a journal for this process; the system lets go when it dies. False where another has it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            file.seek(0x7FFF_FFFF)  # a byte far behind the content, since Windows locks forbid reading
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            file.seek(0, os.SEEK_END)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def abandoned(folder: Path) -> bool:
    """Whether a folder holds a journal that nobody writes any more."""
    path = folder / FILE
    if not path.is_file():
        return False
    with path.open("rb+") as file:
        return hold(file)
