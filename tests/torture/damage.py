"""Damage done to bytes by the dice: flipped, cut, zeroed, doubled, filled with junk."""

from __future__ import annotations

import random
import re
from dataclasses import dataclass

PAGE = 4096


@dataclass(frozen=True)
class Damage:
    """What was done.

    Args:
        data: what came of it.
        kind: what it is called.
        start, end: the bytes of the original that are not as they were; equal where some were put in.
    """

    data: bytes
    kind: str
    start: int
    end: int


def damaged(data: bytes, dice: random.Random) -> Damage:
    """One damage such as disks, power cuts and people do."""
    at = dice.randrange(len(data))
    length = min(dice.choice((1, 2, 4, 16, 100, 512, PAGE, 3 * PAGE)), len(data) - at)
    match dice.choice(("bit", "bits", "byte", "zeros", "page", "cut", "junk", "hole", "double", "insert")):
        case "bit":
            return _written(data, at, bytes([data[at] ^ 1 << dice.randrange(8)]), "bit")
        case "bits":
            return _written(data, at, bytes(b ^ dice.randrange(256) for b in data[at : at + length]), "bits")
        case "byte":
            return _written(
                data, at, bytes([dice.choice((0, 0xFF, 0x7F, 0x80, dice.randrange(256)))]), "byte"
            )
        case "zeros":
            return _written(data, at, bytes(length), "zeros")
        case "page":
            at = at // PAGE * PAGE
            return _written(data, at, bytes(min(PAGE, len(data) - at)), "page")
        case "cut":
            return Damage(data[:at], "cut", at, len(data))
        case "junk":
            return _written(data, at, dice.randbytes(length), "junk")
        case "hole":
            return Damage(data[:at] + data[at + length :], "hole", at, at + length)
        case "double":
            return Damage(data[: at + length] + data[at:], "double", at + length, at + length)
        case _:
            return Damage(data[:at] + dice.randbytes(length) + data[at:], "insert", at, at)


def _written(data: bytes, at: int, new: bytes, kind: str) -> Damage:
    return Damage(data[:at] + new + data[at + len(new) :], kind, at, at + len(new))


_NUMBERS = (
    b"0",
    b"-1",
    b"1e999",
    b"nan",
    b"99999999999999999999",
    b"2147483648",
    b"1e-300",
    b"null",
    b'"x"',
    b"[]",
)


def mutant(data: bytes, dice: random.Random) -> tuple[str, bytes]:
    """A file like this one that its reader may not expect: (kind, content)."""
    turn = dice.randrange(10)
    if turn == 0:
        return "empty", b""
    if turn in (1, 2, 3) and (swapped := _number_swapped(data, dice)) is not None:
        return "number", swapped
    if turn == 4:
        lines = data.splitlines(keepends=True)
        dice.shuffle(lines)
        return "lines", b"".join(lines)
    done = damaged(data, dice)
    for _ in range(dice.choice((0, 0, 1, 5))):
        done = damaged(done.data or b"\0", dice)
    return done.kind, done.data


def _number_swapped(data: bytes, dice: random.Random) -> bytes | None:
    """A number written in the text is another one; a word of a binary file is an extreme one."""
    found = [match.span() for match in re.finditer(rb"-?\d+(\.\d+)?", data[: 1 << 20])]
    if not found or (turn := dice.random()) < 0.2:
        at = dice.randrange(max(len(data) - 4, 1))
        word = dice.choice(
            (b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0\0\0\0", b"\x7f\xff\xff\xff")
        )
        return data[:at] + word + data[at + 4 :]
    start, end = found[int((turn - 0.2) / 0.8 * len(found))]
    return data[:start] + dice.choice(_NUMBERS) + data[end:]
