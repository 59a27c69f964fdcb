"""One UDP datagram taken apart into OSC messages. Pure, and safe against anything that arrives.

Source: OSC 1.0 specification. Time tags are ignored: VMC means "now".
"""

from __future__ import annotations

import struct

from pythonosc.osc_message import OscMessage
from pythonosc.osc_message import ParseError as OscParseError
from pythonosc.parsing.osc_types import ParseError as OscTypeError

MOST_BYTES = 48 * 1024
"""What a datagram may hold: a body of 54 bones takes 5 KB, and each blend shape 40 to 80 bytes."""
LEAST_BYTES = 8
"""No OSC message that means anything is shorter."""
MOST_MESSAGES = 1024
"""Messages in a datagram, whatever bundles they are in."""
BUNDLE_MARK = b"#bundle\x00"
_SIZE = struct.Struct(">i")
# Deeper than any sender nests bundles; without a limit a hostile one would end in a RecursionError.
_MAX_DEPTH = 8
_KNOWN_TAGS = frozenset("ihfdsbrmtTFN[]")
_WIDTHS = {"i": 4, "f": 4, "r": 4, "m": 4, "h": 8, "d": 8, "t": 8}


class MalformedError(ValueError):
    """A datagram, or part of one, that is not OSC."""


class AbsurdError(MalformedError):
    """Nothing that any motion program sends, not even one whose tracking is lost."""


def split(datagram: bytes) -> tuple[list[bytes], bool]:
    """The messages of a datagram, bundles opened to any sensible depth.

    Args:
        datagram: as it came.

    Returns:
        The messages in order, and whether everything was well formed. What comes before a fault is kept;
        nothing is of a datagram with more messages than any body and face have.
    """
    if not datagram.startswith(BUNDLE_MARK):
        return ([datagram], True) if datagram.startswith(b"/") else ([], False)
    found: list[bytes] = []
    good = _open(datagram, found, 0)
    # None of them, not the first thousand: whoever sends so many is no motion program.
    return ([], False) if len(found) > MOST_MESSAGES else (found, good)


def _open(bundle: bytes, found: list[bytes], depth: int) -> bool:
    if depth >= _MAX_DEPTH or len(bundle) < 16:
        return False
    index, end, good = 16, len(bundle), True
    while index < end:
        if index + 4 > end or len(found) > MOST_MESSAGES:
            return False
        (size,) = _SIZE.unpack_from(bundle, index)
        index += 4
        # A length that leads out of the datagram: nothing behind it can be found again.
        if size <= 0 or index + size > end:
            return False
        part = bundle[index : index + size]
        index += size
        if part.startswith(b"/"):
            found.append(part)
        elif part.startswith(BUNDLE_MARK):
            good = _open(part, found, depth + 1) and good
        else:
            good = False
    return good


def address(message: bytes) -> str:
    """The address of a message.

    Raises:
        MalformedError: it does not end, or is not text.
    """
    end = message.find(b"\x00")
    try:
        return message[: end if end >= 0 else len(message)].decode("utf-8")
    except UnicodeDecodeError as error:
        raise AbsurdError("the address is not text") from error


def arguments(message: bytes) -> list[object]:
    """The arguments of a message, by python-osc.

    Raises:
        MalformedError: they could not be read.
    """
    comma = message.find(b",")
    end = message.find(b"\x00", comma)
    tags = message[comma + 1 : end].decode("latin-1") if 0 <= comma < end else ""
    # python-osc logs each unknown tag, which a hostile sender could turn into a flood of lines, and reads
    # missing bytes as zeros, which would fold a bone into its parent.
    if not _KNOWN_TAGS.issuperset(tags):
        raise MalformedError("an argument has an unknown type")
    if len(message) % 4 or _needed(message, tags, (end // 4 + 1) * 4) > len(message):
        raise MalformedError("the message is cut off")
    try:
        return OscMessage(message).params
    except (OscParseError, OscTypeError, ValueError, IndexError, OverflowError, struct.error) as error:
        raise MalformedError("the arguments are damaged") from error


def _needed(message: bytes, tags: str, index: int) -> int:
    """Where the arguments end, the first of them being at an index; beyond the end where they are cut off."""
    for tag in tags:
        if tag == "s":
            ending = message.find(b"\x00", index)
            index = (ending // 4 + 1) * 4 if ending >= 0 else len(message) + 1
        elif tag == "b":
            size = _SIZE.unpack_from(message, index)[0] if index + 4 <= len(message) else 0
            index += 4 + (max(size, 0) + 3) // 4 * 4
        else:
            index += _WIDTHS.get(tag, 0)
    return index
