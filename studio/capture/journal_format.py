"""The blocks a journal is made of: marks, headers and checksums that its writer and its reader share."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

FILE = "journal.bin"
MAGIC = b"SAIAJRN2"
MAGIC_1 = b"SAIAJRN1"
HEAD, NAMES, ROWS, CLOCK, FACTS = b"HEAD", b"NAME", b"ROWS", b"CLCK", b"FACT"
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
        kind: HEAD, NAMES, ROWS, CLOCK, FACTS, or one of a later version.
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
