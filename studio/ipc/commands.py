"""What a running command is told on its standard input, one line each: built by the window, read by it."""

from __future__ import annotations

from typing import NamedTuple

from studio.errors import RequestError, say

SWITCHES = ("mute", "freeze", "neutral", "gain", "gate", "early", "poses")
LIVE_WORDS = (
    *SWITCHES,
    "look-ahead",
    "voice-to",
    "mood",
    "tune",
    "send",
    "unsend",
    "wave",
    "clip",
    "keep",
    "stop",
)


class Command(NamedTuple):
    """A word and what follows it on the line."""

    word: str
    argument: str = ""

    @property
    def line(self) -> str:
        """How it is written, without the line's end."""
        return f"{self.word} {self.argument}".rstrip()

    def switched_to(self, now: bool) -> bool:
        """What a switch is to be: on, off, or the other way round where neither is said.

        Raises:
            RequestError: something else is said.
        """
        if self.argument in ("", "on", "off"):
            return not now if not self.argument else self.argument == "on"
        what = say("{word} cannot be {argument}.", word=self.word, argument=self.argument)
        raise RequestError(what, say("Write {word} on or {word} off.", word=self.word))


STOP = Command("stop")
"""End well and keep what there is; training, recording, performing and queues read it."""


def skip(index: int) -> Command:
    """Leave an entry of a queue away, counted from 0."""
    return Command("skip", str(index))


def switch(name: str, on: bool) -> Command:
    """Turn one of SWITCHES."""
    return Command(name, "on" if on else "off")


def read(line: str) -> Command | None:
    """What a line says; None for an empty one."""
    word, _, argument = line.strip().partition(" ")
    return Command(word, argument.strip()) if word else None


def read_live(line: str) -> Command | None:
    """What a line says to a performance; None for an empty one.

    Raises:
        RequestError: there is no such word.
    """
    command = read(line)
    if command is not None and command.word not in LIVE_WORDS:
        what = say("There is no {word} while it is live.", word=command.word)
        raise RequestError(what, say("Write one of: {words}.", words=", ".join(LIVE_WORDS)))
    return command
