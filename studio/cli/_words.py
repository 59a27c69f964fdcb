"""How commands count things and read addresses."""

from __future__ import annotations

from studio.errors import RequestError


def counted(number: int, thing: str) -> str:
    """ "1 take", "2 takes"."""
    return f"{number:,} {thing}{'' if number == 1 else 's'}"


def address(text: str) -> tuple[str, int]:
    """HOST:PORT as its two parts.

    Raises:
        RequestError: it is written otherwise, or there is no such port.
    """
    host, _, port = text.rpartition(":")
    if not host or not (port.isascii() and port.isdigit()) or not 1 <= int(port) <= 65535:
        raise RequestError(f"{text} is not an address.", "Write HOST:PORT, such as 127.0.0.1:39539.")
    return host.strip("[]"), int(port)
