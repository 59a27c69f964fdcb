"""Every event a command prints with --json, as a frozen type (no Qt, no torch, no numpy), and its line.

NAME is the line's `event`; VERBS are the commands that mean this by it, () for all that use the name.

common    Events that many commands print: notes, problems, progress, and the last line
live      Events of a live performance, the practice performer, the doctor, the settings and the tour
takes     Events of commands that record, import, change and export takes
training  Events of commands that train, measure and describe: train, style, evaluate, compare, suggest,
          card, encoder
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

import msgspec

from studio.errors import StudioError
from studio.ipc.events.common import *  # noqa: F403
from studio.ipc.events.common import ChildEvent
from studio.ipc.events.live import *  # noqa: F403
from studio.ipc.events.takes import *  # noqa: F403
from studio.ipc.events.training import *  # noqa: F403

REMEDY = "Please report it with the log."


class MessageError(StudioError):
    """A line says something that no event of its command says."""


def decode(line: str | bytes, verb: str) -> ChildEvent | None:
    """The event a command told in a line of its output.

    Unknown keys are passed over, so that an older window reads a newer command. A null is what is not
    known: the field's default stands for it.

    Args:
        line: one line of what `saia VERB --json` prints.
        verb: the command; several call different things by the same name.

    Returns:
        The event; None for a line that is none, such as what a library printed by itself.

    Raises:
        MessageError: there is no event of that name, or its keys do not hold what they should.
    """
    try:
        facts = msgspec.json.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None
    if not isinstance(facts, dict) or "event" not in facts:
        return None
    return from_plain(facts, verb)


def from_plain(facts: Mapping[str, Any], verb: str) -> ChildEvent:
    """The event in a JSON object; as `decode`.

    Raises:
        MessageError: as `decode`.
    """
    name = facts.get("event")
    kind = event_types().get((verb, str(name))) or event_types().get(("", str(name)))
    if kind is None:
        raise MessageError(f"saia {verb} told of {name}, which nobody knows.", REMEDY)
    known = {key: value for key, value in facts.items() if value is not None}
    try:
        return msgspec.convert(known, kind)
    except msgspec.ValidationError as error:
        raise MessageError(f"saia {verb} told of {name} in another form: {error}.", REMEDY) from error


def encode(event: ChildEvent) -> str:
    """The line of an event, without its end."""
    return json.dumps({"event": event.NAME, **msgspec.to_builtins(event)}, ensure_ascii=False)


@cache
def event_types() -> dict[tuple[str, str], type[ChildEvent]]:
    """Every event by (command, name); the command is "" where all mean the same by that name."""
    kinds = (one for one in globals().values() if isinstance(one, type) and issubclass(one, ChildEvent))
    return {
        (verb, kind.NAME): kind for kind in kinds if kind is not ChildEvent for verb in kind.VERBS or ("",)
    }
