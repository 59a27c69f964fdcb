"""Reader of a take's journal: resynchronises after damage, collects rows and lists what is missing."""

from __future__ import annotations

import errno
import json
import math
import struct
import zlib
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from studio.capture.journal import (
    CHECK,
    CLOCK,
    FACTS,
    FILE,
    HEAD,
    HEADER,
    HEADER_1,
    HEADER_BYTES,
    MAGIC,
    MAGIC_1,
    MARK,
    NAMES,
    PICTURES,
    ROWS,
    Block,
)
from studio.motion import filmed
from studio.vmc.rows import ChannelLayout, RowBlock

# No block was ever longer; a damaged length must not have the rest of a large file checksummed in vain.
_LONGEST = 1 << 28
# What one look at a place that is no block costs of the patience, in bytes, whatever its length says.
_LOOK = 4096
# Bytes summed up in vain before a file is given up, which only one made to hold us up ever reaches.
_PATIENCE = 1 << 30


@dataclass(frozen=True)
class Scan:
    """What was found in a journal.

    Args:
        version: 1 or 2. blocks: the whole ones as they lie. gaps: (start, end) of all other bytes.
    """

    version: int
    blocks: Sequence[Block]
    gaps: Sequence[tuple[int, int]]


def scan(data: bytes) -> Scan:
    """Find all whole blocks, going on behind damaged ones; takes time in proportion to the data."""
    # The version it says first; it may be the other one where that is damaged.
    for version in (1, 2) if data.startswith(MAGIC_1) else (2, 1):
        found = _Scanner(data, version).scan()
        if found.blocks:
            break
    return found


def holds_only_head(data: bytes) -> bool:
    """Whether a journal ends in its first block or before: nothing recorded was ever in it."""
    size = len(data) - len(MAGIC)
    if size <= 0:
        return True
    at = len(MAGIC)
    if data.startswith(MAGIC_1):
        if size < HEADER_1.size:
            return True
        kind, length, _ = HEADER_1.unpack_from(data, at)
        # Other tags behind it mean that its length is damaged, and that something was recorded.
        others = any(tag in data for tag in (NAMES, ROWS, CLOCK, FACTS))
        return kind == HEAD and size <= HEADER_1.size + length and not others
    if size < HEADER_BYTES:
        return True
    header = data[at : at + HEADER.size]
    if data[at + 4 : at + 8] != HEAD or zlib.crc32(header) != CHECK.unpack_from(data, at + HEADER.size)[0]:
        return False
    return size <= HEADER_BYTES + HEADER.unpack(header)[5]


class _Scanner:
    """One pass over a journal's bytes."""

    def __init__(self, data: bytes, version: int) -> None:
        self._data, self._view = data, memoryview(data)
        self._version = version
        # Every byte of an honest file is looked at a few times at most; beyond that somebody made it to take
        # forever.
        self._patience = _PATIENCE + 8 * len(data)
        tags = (MARK,) if version == 2 else (HEAD, NAMES, ROWS, CLOCK, FACTS)
        self._next = dict.fromkeys(tags, -1)

    def scan(self) -> Scan:
        blocks: list[Block] = []
        gaps: list[tuple[int, int]] = []
        # A damaged mark at the head costs nothing: blocks are found by their own marks.
        at = len(MAGIC) if self._data[: len(MAGIC)] in (MAGIC, MAGIC_1) else 0
        while at < len(self._data):
            block = self._block(at)
            if block is None:
                block = self._behind(at)
                gaps.append((at, block.at if block else len(self._data)))
            if block is None:
                break
            blocks.append(block)
            at = block.end
        return Scan(self._version, blocks, gaps)

    def _behind(self, at: int) -> Block | None:
        """The first whole block behind a place."""
        while self._patience > 0:
            at = self._candidate(at + 1)
            if at < 0:
                return None
            block = self._block(at)
            if block is not None:
                return block
        return None

    def _candidate(self, start: int) -> int:
        """Where the next block may begin, -1 for nowhere.

        Each mark is looked for once over the whole file, however many gaps there are: kept is where it was
        found last, and the end of the file where it was not.
        """
        for tag, found in self._next.items():
            if found < start:
                at = self._data.find(tag, start)
                self._next[tag] = at if at >= 0 else len(self._data)
        nearest = min(self._next.values())
        return nearest if nearest < len(self._data) else -1

    def _block(self, at: int) -> Block | None:
        block, summed = self._block_2(at) if self._version == 2 else self._block_1(at)
        if block is None:
            self._patience -= summed + _LOOK
        return block

    def _block_2(self, at: int) -> tuple[Block | None, int]:
        """The block at a place, or None; and how many bytes of payload were summed up."""
        if at + HEADER_BYTES > len(self._data):
            return None, 0
        mark, kind, number, rows, layout, length, check = HEADER.unpack_from(self._view, at)
        (header_check,) = CHECK.unpack_from(self._view, at + HEADER.size)
        if mark != MARK or zlib.crc32(self._view[at : at + HEADER.size]) != header_check:
            return None, 0
        payload = self._payload(at + HEADER_BYTES, length)
        if payload is None or zlib.crc32(payload) != check:
            return None, length if payload is not None else 0
        end = at + HEADER_BYTES + length
        return Block(kind, payload, at, end, number, rows, layout), length

    def _block_1(self, at: int) -> tuple[Block | None, int]:
        if at + HEADER_1.size > len(self._data):
            return None, 0
        kind, length, check = HEADER_1.unpack_from(self._view, at)
        # Zeros are the right checksum of nothing, so prove nothing.
        if kind not in self._next or not length:
            return None, 0
        payload = self._payload(at + HEADER_1.size, length)
        if payload is None or zlib.crc32(payload) != check:
            return None, length if payload is not None else 0
        return Block(kind, payload, at, at + HEADER_1.size + length), length

    def _payload(self, at: int, length: int) -> memoryview | None:
        inside = length <= min(_LONGEST, len(self._data) - at)
        return self._view[at : at + length] if inside else None


# No clock of ours is ever further from 0 than that, seconds.
_LATEST = 1e9
_SECTOR = 4096


@dataclass(frozen=True)
class Damage:
    """A part of a journal that could not be read.

    Args:
        start, end: bytes of the file; the same where the part is gone without a trace.
        blocks: how many are missing, at least.
        rows: how many are missing, None where nothing tells.
        since, until: arrival of the last row before and the first one after, NaN where there is none.
        is_end: nothing could be read behind it.
    """

    start: int
    end: int
    blocks: int = 1
    rows: int | None = None
    since: float = math.nan
    until: float = math.nan
    is_end: bool = False


@dataclass
class JournalContents:
    """What a journal tells.

    Args:
        head: what was known at the start. facts: the latest counters and names.
        row_blocks: the motion. clock: pairs of audio time and capture time, (N, 2).
        damaged: what could not be read, in order; nothing where it ends before anything could be recorded.
    """

    head: dict[str, Any] = field(default_factory=dict)
    facts: dict[str, Any] = field(default_factory=dict)
    row_blocks: list[RowBlock] = field(default_factory=list)
    clock: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    pictures: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, filmed.COLUMNS)))
    damaged: tuple[Damage, ...] = ()

    @property
    def interval(self) -> float:
        """Median seconds between rows; 1/60 where there are too few to say."""
        arrivals = [block.arrivals for block in self.row_blocks]
        steps = np.diff(np.concatenate(arrivals)) if arrivals else np.zeros(0)
        return float(np.median(steps)) if len(steps) else 1 / 60

    @property
    def rows_missing(self) -> int:
        """Rows that are known to be missing."""
        return sum(d.rows or 0 for d in self.damaged)

    @property
    def seconds_missing(self) -> float:
        """Motion that could not be read, but for what may have stood behind the last whole block."""
        interval = self.interval
        known = self.rows_missing * interval
        silent = (d.until - d.since - interval for d in self.damaged if d.rows is None)
        return known + sum(max(0.0, s) for s in silent if math.isfinite(s))


def read(folder: Path) -> JournalContents:
    """Read a take's journal as far as it is whole; never raises for what is in it.

    Raises:
        OSError: there is none, or it may not be read.
    """
    return contents(_bytes_of(folder / FILE))


def contents(data: bytes) -> JournalContents:
    """What a journal's bytes tell; never raises for what is in them."""
    found = scan(data)
    # By their numbers: a file system that was repaired may have put pieces in another order.
    blocks = sorted(found.blocks, key=lambda block: block.number)
    understood: dict[object, tuple[Block, Any]] = {}
    unreadable: dict[object, Block] = {}
    for block, names in _with_names(blocks, found, data):
        identity = _identity(block, found.version)
        # A disk that failed may have written the same block twice.
        if identity in understood:
            continue
        content = _understood(block, names)
        if content is None:
            unreadable[identity] = block
        else:
            understood[identity] = block, content
    collected = _collect(understood.values())
    # A journal that was only begun ends early by nature, and is not damaged.
    if not holds_only_head(data):
        lost = [block for identity, block in unreadable.items() if identity not in understood]
        missing = sorted(_missing(found, blocks, lost), key=lambda d: d.start)
        rows = [(block.at, run) for block, run in understood.values() if block.kind == ROWS]
        collected.damaged = tuple(_placed(missing, sorted(rows, key=lambda pair: pair[0])))
    return collected


def _collect(understood: Iterable[tuple[Block, Any]]) -> JournalContents:
    """What blocks tell together, in the order they were written; of facts the latest ones hold."""
    collected = JournalContents()
    clocks, pictures = [collected.clock], [collected.pictures]
    for block, content in understood:
        if block.kind == ROWS:
            collected.row_blocks.append(content)
        elif block.kind == CLOCK:
            clocks.append(content)
        elif block.kind == PICTURES:
            pictures.append(content)
        elif block.kind == HEAD:
            collected.head = content
        elif block.kind == FACTS:
            collected.facts = content
    collected.clock, collected.pictures = np.concatenate(clocks), np.concatenate(pictures)
    return collected


def _bytes_of(path: Path) -> bytes:
    """A file's bytes; zeros where the disk cannot give them."""
    try:
        return path.read_bytes()
    except OSError as error:
        if error.errno != errno.EIO:
            raise
    with path.open("rb", buffering=0) as file:
        return read_around(file, path.stat().st_size)


def read_around(file: IO[bytes], size: int) -> bytes:
    """Bytes of a file on a failing disk, page by page; a page that cannot be read is zeros."""
    pages = []
    for at in range(0, size, _SECTOR):
        length = min(_SECTOR, size - at)
        try:
            file.seek(at)
            page = file.read(length)
        except OSError:
            page = b""
        # Zeros keep all later offsets, and no block with zeros in it has the right checksum.
        pages.append(page.ljust(length, b"\0"))
    return b"".join(pages)


def _identity(block: Block, version: int) -> object:
    """What two copies of one block share, and no two blocks."""
    if version == 2:
        return block.number
    # Tables are repeated on purpose, so each place counts as one of its own.
    if block.kind == NAMES:
        return block.at
    # Rows and clock pairs begin with moments that no other block has.
    return block.kind, len(block.payload), zlib.crc32(block.payload), bytes(block.payload[:20])


def _with_names(
    blocks: Sequence[Block], found: Scan, data: bytes
) -> Iterator[tuple[Block, ChannelLayout | None]]:
    """Each block with the names its rows have, None where these are damaged."""
    if found.version == 2:
        tables = {zlib.crc32(b.payload): _names(b.payload) for b in blocks if b.kind == NAMES}
        yield from ((block, tables.get(block.layout)) for block in blocks)
        return
    names = None
    # In version 1 rows have the names that came last: those lost in a gap spoil all rows up to the next ones.
    lost = [(start, None) for start, end in found.gaps if _held_names(data[start:end])]
    for _, block in sorted([*lost, *((b.at, b) for b in blocks)], key=lambda pair: pair[0]):
        if block is None or block.kind == NAMES:
            names = _names(block.payload) if block else None
        if block is not None:
            yield block, names


def _held_names(gap: bytes) -> bool:
    return NAMES in gap or b'{"shapes"' in gap


def _understood(block: Block, names: ChannelLayout | None) -> Any:
    """A block's content; None where it makes no sense, which a right checksum does not rule out."""
    if block.kind in (HEAD, FACTS):
        return _object(block.payload)
    if block.kind == NAMES:
        return _names(block.payload)
    if block.kind == ROWS:
        return _rows(block.payload, names) if names else None
    if block.kind == CLOCK:
        return _clock(block.payload)
    if block.kind == PICTURES:
        return _pictures(block.payload)
    return block.payload


def _object(payload: memoryview) -> dict[str, Any] | None:
    try:
        content = json.loads(bytes(payload))
        # JSON can name half a character (a lone surrogate), which no file can hold when the take is written.
        json.dumps(content, ensure_ascii=False).encode()
    except (ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


def _names(payload: memoryview) -> ChannelLayout | None:
    content = _object(payload) or {}
    parts = (content.get("shapes"), content.get("bones"))
    shapes, bones = (tuple(part) if isinstance(part, list) else None for part in parts)
    if shapes is None or bones is None or not all(isinstance(name, str) for name in shapes + bones):
        return None
    # With a name twice, one of its columns would silently take the other's place.
    once = len(set(shapes)) == len(shapes) and len(set(bones)) == len(bones)
    return ChannelLayout(shapes, bones) if once else None


def _rows(payload: memoryview, names: ChannelLayout) -> RowBlock | None:
    if len(payload) < 4:
        return None
    (count,) = struct.unpack_from("<I", payload)
    if not count or len(payload) != 4 + count * (16 + 4 * names.width):
        return None
    stamps = np.frombuffer(payload, "<f8", 2 * count, 4).reshape(count, 2)
    values = np.frombuffer(payload, "<f4", count * names.width, 4 + 16 * count)
    if not _plausible(stamps[:, 0]):
        return None
    return RowBlock(names, stamps, values.reshape(count, names.width))


def _clock(payload: memoryview) -> NDArray[np.float64] | None:
    if len(payload) % 16:
        return None
    pairs = np.frombuffer(payload, dtype="<f8").reshape(-1, 2)
    return pairs if _plausible(pairs) else None


def _pictures(payload: memoryview) -> NDArray[np.float64] | None:
    if len(payload) % (8 * filmed.COLUMNS):
        return None
    rows = np.frombuffer(payload, dtype="<f8").reshape(-1, filmed.COLUMNS)
    # Of another face there may be none, which is NaN; all else are moments, flags and weights.
    flags_good = _plausible(rows[:, 0]) and bool(((rows[:, 1] >= 0) & (rows[:, 1] < 256)).all())
    return rows if flags_good and bool(np.isfinite(rows[:, 2:5]).all()) else None


def _plausible(times: NDArray[np.float64]) -> bool:
    # NaN compares as false, so times that are no numbers are implausible too.
    return bool((np.abs(times) < _LATEST).all())


def _missing(found: Scan, blocks: Sequence[Block], unreadable: Iterable[Block]) -> list[Damage]:
    """All that is missing, without when."""
    missing = [Damage(b.at, b.end, rows=_row_count(b)) for b in unreadable]
    end = found.gaps[-1][1] if found.gaps else 0
    last = max((b.end for b in found.blocks), default=0)
    holes = _holes(blocks) if found.version == 2 else []
    for start, stop in found.gaps:
        at_end = stop == end and start >= last
        if at_end:
            missing.append(Damage(start, stop, is_end=True))
        elif not any(hole.start <= start and stop <= hole.end for hole in holes):
            missing.append(Damage(start, stop, rows=0 if found.version == 2 else None))
    return missing + holes


def _holes(blocks: Sequence[Block]) -> list[Damage]:
    """Where numbers are missing: damage, or bytes that are gone without a trace."""
    holes = []
    number = rows = end = 0
    for block in blocks:
        if block.number > number:
            # Blocks that lie in another order than they were numbered leave no bytes between them.
            start, stop = (end, block.at) if end <= block.at else (block.at, block.at)
            holes.append(Damage(start, stop, block.number - number, max(0, block.rows - rows)))
        number, rows, end = block.number + 1, block.rows + _row_count(block), block.end
    return holes


def _row_count(block: Block) -> int:
    """How many rows a block says it has; it may lie."""
    if block.kind != ROWS or len(block.payload) < 4:
        return 0
    # Bounded by the payload, which a row of any layout fills with 16 bytes and more.
    return int(min(struct.unpack_from("<I", block.payload)[0], len(block.payload) // 16))


def _placed(missing: Iterable[Damage], rows: Sequence[tuple[int, RowBlock]]) -> Iterator[Damage]:
    """Damage with the arrival of its neighbours, of all rows as they lie."""
    places = [at for at, _ in rows]
    for one in missing:
        after = bisect_left(places, one.start)
        since = float(rows[after - 1][1].arrivals[-1]) if after else math.nan
        until = float(rows[after][1].arrivals[0]) if after < len(rows) else math.nan
        yield replace(one, since=since, until=until)
