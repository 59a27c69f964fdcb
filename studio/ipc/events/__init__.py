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
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from typing import Any

import msgspec

from studio.errors import StudioError, Text, say
from studio.ipc.events.common import *  # noqa: F403
from studio.ipc.events.common import ChildEvent
from studio.ipc.events.live import *  # noqa: F403
from studio.ipc.events.takes import *  # noqa: F403
from studio.ipc.events.training import *  # noqa: F403

REMEDY = "Please report it with the log."
_TEMPLATES = "templates"
"""The key of [template, fields, number] by the English text."""
FOR_WINDOW = "SAIA_FOR_WINDOW"
"""The environment variable by which the window asks its children for templates; others read English."""


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
        raise MessageError(
            say("saia {verb} told of {name}, which nobody knows.", verb=verb, name=name), REMEDY
        )
    known = {key: value for key, value in facts.items() if value is not None}
    told = known.pop(_TEMPLATES, None)
    if isinstance(told, dict):
        known = _said_again(known, told)
    try:
        return msgspec.convert(known, kind)
    except msgspec.ValidationError as error:
        what = say("saia {verb} told of {name} in another form: {error}.", verb=verb, name=name, error=error)
        raise MessageError(what, REMEDY) from error


def _builtins(event: Any) -> Any:
    return msgspec.to_builtins(event, enc_hook=str)


def encode(event: ChildEvent, plain: Callable[[Any], Any] = _builtins, templates: bool = True) -> str:
    """The line of an event, without its end.

    Its texts are English.

    Args:
        event: what is told.
        plain: makes JSON values of it.
        templates: also tell how texts with fields were made, so that the window can say them in the person's
            language.
    """
    told: dict[str, Any] = {}
    if templates:
        _tell_sentences(event, told)
    more = {_TEMPLATES: told} if told else {}
    return json.dumps({"event": event.NAME, **plain(event), **more}, ensure_ascii=False)


def _tell_sentences(value: Any, told: dict[str, Any], within: bool = False) -> None:
    """Put the parts of the sentences in a value beside their English."""
    if isinstance(value, Text):
        # Without fields it is its own template; only among fields it must be told from names.
        if value.fields or within:
            told[str(value)] = [value.template, value.fields, value.number]
            for field in value.fields.values():
                _tell_sentences(field, told, within=True)
    elif isinstance(value, msgspec.Struct):
        _tell_sentences([getattr(value, name) for name in value.__struct_fields__], told)
    elif isinstance(value, Mapping):
        _tell_sentences(list(value.values()), told)
    elif isinstance(value, list | tuple):
        for one in value:
            if not isinstance(one, float):  # a pose is many numbers, many times a second
                _tell_sentences(one, told)


def _said_again(value: Any, told: Mapping[str, Any], around: tuple[str, ...] = ()) -> Any:
    """A JSON value with its sentences as they were when they were told; `around` are those it stands in."""
    if isinstance(value, str) and value in told and value not in around:
        with suppress(TypeError, ValueError):  # not as we write it: then it is a text as others are
            template, fields, number = told[value]
            return Text(value, template, _said_again(fields, told, (*around, value)), number)
    if isinstance(value, dict):
        return {key: _said_again(one, told, around) for key, one in value.items()}
    return [_said_again(one, told, around) for one in value] if isinstance(value, list) else value


@cache
def event_types() -> dict[tuple[str, str], type[ChildEvent]]:
    """Every event by (command, name); the command is "" where all mean the same by that name."""
    kinds = (one for one in globals().values() if isinstance(one, type) and issubclass(one, ChildEvent))
    return {
        (verb, kind.NAME): kind for kind in kinds if kind is not ChildEvent for verb in kind.VERBS or ("",)
    }
