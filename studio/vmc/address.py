"""Where a program listens for motion: one target of those that a person keeps."""

from __future__ import annotations

from dataclasses import dataclass

from studio.vmc import PERFORMER_PORT

BLANK = frozenset(" \t,")


@dataclass(frozen=True)
class Address:
    """Where one target listens, and what people call it."""

    title: str
    host: str
    port: int

    @property
    def text(self) -> str:
        """As the settings keep it: program=host:port."""
        # Several stand in one line with commas between them.
        return f"{self.title.replace(',', ' ')}={self.host}:{self.port}"

    @property
    def where(self) -> str:
        """As commands name it: HOST:PORT, IPv6 addresses in brackets."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @classmethod
    def parse(cls, text: str) -> Address | None:
        """What the settings kept, the program's name left out or not; None where it makes no sense."""
        title, _, where = text.rpartition("=")
        host, _, port = where.rpartition(":")
        # isdigit alone takes digits of other scripts.
        known = port.isascii() and port.isdigit() and 1 <= int(port) <= 65535
        return cls(title, host.strip("[]"), int(port)) if host and known and not set(host) & BLANK else None


USUAL = Address("VSeeFace", "127.0.0.1", PERFORMER_PORT)
"""Where motion is sent where nobody said: the studio itself listens on the other port of the protocol."""
