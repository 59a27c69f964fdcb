"""What the window tells a child is read as it was meant."""

from __future__ import annotations

import pytest

from studio.ipc import commands
from studio.ipc.commands import STOP, Command, skip, switch


@pytest.mark.parametrize(
    ("command", "line"),
    [
        (STOP, "stop"),
        (skip(3), "skip 3"),
        (switch("mute", False), "mute off"),
        (Command("tune", '{"a": "ä b"}'), 'tune {"a": "ä b"}'),
    ],
)
def test_a_command_survives_its_line(command: Command, line: str) -> None:
    assert command.line == line
    assert commands.read(line + "\n") == command


def test_an_empty_line_says_nothing() -> None:
    assert commands.read(" \n") is None
