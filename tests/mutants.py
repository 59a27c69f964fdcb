"""Damaged files by the thousand: what disks, programs and people with bad intent make of a good one.

The same seed gives the same mutants. Half of them are damage as it happens (bits, cuts, zeros, spans copied
over one another); the other half put numbers where numbers are, since a length or a count that lies does
more harm than noise.
"""

from __future__ import annotations

import random
import re
import struct
from collections.abc import Callable, Iterator

_WHOLE = (
    0,
    1,
    2,
    3,
    7,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0xFFFF,
    1 << 19,
    1 << 24,
    (1 << 31) - 1,
    1 << 31,
    (1 << 32) - 1,
)
_REAL = (0.0, -0.0, -1.0, 1e-30, 1e30, 3e38, -3e38, float("nan"), float("inf"), float("-inf"), 86400.0, 1e9)
_WORDS = (
    b"true", b"false", b"null", b"[]", b"{}", b'""', b'"x"', b"NaN", b"Infinity", b"-1", b"0", b"1e-300",
    b"1e308", b"1e999", b"-1e999", b"999999999999", b"0.0000001", b"9" * 400, b"9" * 5000, b"[" * 2000,
    b'{"a":' * 2000, b"x", b'"../../x"', b'"/etc"', b'"C:\\\\x"', b"\xff\xfe", b"\0", b"\n", b",", b";",
    b"\t",
)  # fmt: skip
_TOKEN = re.compile(rb'-?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?|"[^"\n]{0,80}"|true|false|null|\b[A-Za-z]{2,20}\b')
_LOOKED_AT = 1 << 16
"""Bytes of a text that tokens are looked for in."""

Change = Callable[[random.Random, bytearray], str]


def mutants(data: bytes, seed: int, count: int) -> Iterator[tuple[str, bytes]]:
    """Damaged copies of a file.

    Args:
        data: of a good one, not empty.
        seed: the same gives the same.
        count: how many.

    Yields:
        What was done to it, and its bytes.
    """
    changes = _TEXT if _is_text(data) else _BINARY
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        copy = bytearray(data)
        done = [rng.choice(changes)(rng, copy) for _ in range(rng.choice((1, 1, 1, 1, 1, 2, 4)))]
        yield "; ".join(done), bytes(copy)


def _is_text(data: bytes) -> bool:
    start = data[:4096]
    return (
        b"\0" not in start and sum(byte < 9 for byte in start) == 0 and data[:3] not in (b"ID3", b"\xff\xfb")
    )


def _place(rng: random.Random, data: bytearray) -> int:
    """Somewhere; every second time in the first 256 bytes, where heads and counts are."""
    size = max(len(data), 1)
    return rng.randrange(min(256, size) if rng.random() < 0.5 else size)


def _length(rng: random.Random, data: bytearray) -> int:
    return min(rng.choice((1, 2, 4, 16, 64, 256, 1024, 4096, 65536)), max(len(data), 1))


def _flip(rng: random.Random, data: bytearray) -> str:
    at, bit = _place(rng, data), rng.randrange(8)
    if data:
        data[at] ^= 1 << bit
    return f"bit {bit} of byte {at} flipped"


def _cut(rng: random.Random, data: bytearray) -> str:
    at = rng.choice((_place(rng, data), max(len(data) - 1 - rng.randrange(16), 0)))
    del data[at:]
    return f"cut off at {at}"


def _zero(rng: random.Random, data: bytearray) -> str:
    at, length = _place(rng, data), _length(rng, data)
    data[at : at + length] = bytes(len(data[at : at + length]))
    return f"{length} zeros at {at}"


def _noise(rng: random.Random, data: bytearray) -> str:
    at, length = _place(rng, data), _length(rng, data)
    data[at : at + length] = rng.randbytes(len(data[at : at + length]))
    return f"{length} bytes of noise at {at}"


def _repeat(rng: random.Random, data: bytearray) -> str:
    at, length = _place(rng, data), _length(rng, data)
    data[at:at] = data[at : at + length]
    return f"{length} bytes twice at {at}"


def _lose(rng: random.Random, data: bytearray) -> str:
    at, length = _place(rng, data), _length(rng, data)
    del data[at : at + length]
    return f"{length} bytes lost at {at}"


def _copy_over(rng: random.Random, data: bytearray) -> str:
    source, at, length = _place(rng, data), _place(rng, data), _length(rng, data)
    part = data[source : source + length]
    data[at : at + len(part)] = part
    return f"{len(part)} bytes of {source} over {at}"


def _append(rng: random.Random, data: bytearray) -> str:
    length = _length(rng, data)
    data += rng.randbytes(length) if rng.random() < 0.5 else bytes(data[:length])
    return f"{length} bytes more at the end"


def _number(rng: random.Random, data: bytearray) -> str:
    kind = rng.choice(("B", "<H", ">H", "<I", ">I", "<I", ">I", "<Q", ">Q", "<f", "<d"))
    size = struct.calcsize(kind)
    at = _place(rng, data) // 4 * 4 + rng.choice((0, 0, 0, 1, 2, 3))
    if at + size > len(data):
        return _append(rng, data)
    if kind[-1] in "fd":
        value: float = rng.choice(_REAL)
        struct.pack_into(kind, data, at, value)
    else:
        old = struct.unpack_from(kind, data, at)[0]
        value = rng.choice((*_WHOLE, old + 1, old - 1, old * 2, old // 2)) & ((1 << 8 * size) - 1)
        struct.pack_into(kind, data, at, value)
    return f"{kind} {value} at {at}"


def _token(rng: random.Random, data: bytearray) -> str:
    begin = rng.randrange(max(len(data) - _LOOKED_AT, 1)) if rng.random() < 0.5 else 0
    found = list(_TOKEN.finditer(data, begin, begin + _LOOKED_AT))
    if not found:
        return _append(rng, data)
    old = found[rng.randrange(min(60, len(found)) if rng.random() < 0.5 else len(found))]
    new = rng.choice((*_WORDS, rng.choice(found)[0]))
    data[old.start() : old.end()] = new
    return f"{bytes(old[0][:20])!r} at {old.start()} became {new[:20]!r}"


def _same_room(rng: random.Random, data: bytearray) -> str:
    """A word or number by one that takes no more room: what follows stays in place."""
    old = _TOKEN.search(data, _place(rng, data), _LOOKED_AT)
    if old is None:
        return _number(rng, data)
    length = old.end() - old.start()
    new = rng.choice([word for word in _WORDS if len(word) <= length and not word.isspace()])
    data[old.start() : old.end()] = new.ljust(length)
    return f"{bytes(old[0][:20])!r} at {old.start()} became {new[:20]!r}"


def _line(rng: random.Random, data: bytearray) -> str:
    lines = data.split(b"\n")
    at, to = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.choice(("lost", "twice", "moved"))
    line = lines[at] if how == "twice" else lines.pop(at)
    if how != "lost":
        lines.insert(to, line)
    data[:] = b"\n".join(lines)
    return f"line {at} {how}"


_BINARY: tuple[Change, ...] = (
    _flip, _flip, _cut, _zero, _noise, _repeat, _lose, _copy_over, _append,
    *(_number,) * 6, *(_same_room,) * 4,
)  # fmt: skip
_TEXT: tuple[Change, ...] = (
    _flip, _flip, _cut, _zero, _noise, _repeat, _lose, _copy_over, _append, _line, _line, *(_token,) * 11
)  # fmt: skip
