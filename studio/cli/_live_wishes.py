"""What a person or the window says to a performance while it runs: one wish a line on stdin."""

from __future__ import annotations

import os
import stat
import sys
import threading
from collections import deque
from typing import NamedTuple

from studio.errors import RequestError

SWITCHES = ("mute", "freeze", "neutral", "gain", "gate", "poses")
WORDS = (*SWITCHES, "look-ahead", "voice-to", "tune", "send", "unsend", "wave", "clip", "stop")


class Wish(NamedTuple):
    """A word and what follows it on the line."""

    word: str
    rest: str

    def turned(self, now: bool) -> bool:
        """What a switch is to be: on, off, or the other way round where neither is said.

        Raises:
            RequestError: something else is said.
        """
        if self.rest in ("", "on", "off"):
            return not now if not self.rest else self.rest == "on"
        raise RequestError(f"{self.word} cannot be {self.rest}.", f"Write {self.word} on or {self.word} off.")


def read_wish(line: str) -> Wish | None:
    """The wish on a line; None for an empty one.

    Raises:
        RequestError: there is no such word.
    """
    word, _, rest = line.strip().partition(" ")
    if not word:
        return None
    if word not in WORDS:
        raise RequestError(f"There is no {word} while it is live.", f"Write one of: {', '.join(WORDS)}.")
    return Wish(word, rest.strip())


class Wishes:
    """Lines of stdin as they come."""

    def __init__(self) -> None:
        self._lines: deque[str] = deque()
        self._came = threading.Event()
        self._closed = False
        if sys.stdin is not None:
            threading.Thread(target=self._read, name="stdin", daemon=True).start()

    @property
    def parent_gone(self) -> bool:
        """Whether the pipe was closed and all that came through it is taken: nobody is there any more."""
        return self._closed and not self._lines

    def wait(self, seconds: float) -> None:
        """Return as soon as a line comes, or after so many seconds."""
        self._came.wait(seconds)
        self._came.clear()

    def take(self) -> list[str]:
        """The lines since the last call."""
        lines = []
        while self._lines:
            lines.append(self._lines.popleft())
        return lines

    def _read(self) -> None:
        try:
            for line in sys.stdin:
                self._lines.append(line)
                self._came.set()
        except (OSError, ValueError):
            return  # stdin is closed; Ctrl+C remains
        self._closed = _is_pipe()


def _is_pipe() -> bool:
    """Whether somebody held the other end; an empty file or /dev/null ends at once and means nothing."""
    try:
        mode = os.fstat(sys.stdin.fileno()).st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)
