"""How the studio says things: sentences that can be translated, counted things, and what went wrong."""

from __future__ import annotations

import copyreg
from collections.abc import Sequence
from typing import Any


class Text(str):
    """A text in English that knows how it was made, so that it can be said in another language.

    Args:
        text: the English.
        template: what is translated, with its fields in braces; of a plural the form for many.
        fields: what stands in the braces. Words of ours are Texts again, all else is the same in
            every language.
        number: what a plural goes by, None without one.
    """

    def __new__(
        cls, text: str, template: str, fields: dict[str, str] | None = None, number: int | None = None
    ) -> Text:
        self = super().__new__(cls, text)
        self.template, self.fields, self.number = template, fields or {}, number
        return self

    template: str
    fields: dict[str, str]
    number: int | None

    def __getnewargs__(self) -> tuple[Any, ...]:  # pickling and copying make it anew
        return str(self), self.template, self.fields, self.number


def say(template: str, one: str = "", /, **fields: Any) -> Text:
    """A sentence that can be translated; without fields it is only marked as one.

    Args:
        template: a literal, so that packaging/translations.py finds it: "Port {port} is not possible."
        one: the English for a single one, where the template is that for many.
        fields: what stands in the braces, written as it is to be read; `n` is the number a plural goes by.
    """
    if isinstance(template, Text):  # marked before, where it is told from
        return template
    filled = {name: f if isinstance(f, Text) else str(f) for name, f in fields.items()}
    number = int(filled["n"].replace(",", "")) if "n" in filled else None
    english = one if one and number == 1 else template
    return Text(english.format(**filled) if filled else english, template, filled, number)


def together(between: str, *parts: str) -> str:
    """Those sentences or clauses that say something, one after the other."""
    said = {f"part{number}": part for number, part in enumerate(parts) if part}
    template = between.join(f"{{{name}}}" for name in said)
    return Text(between.join(said.values()), template, said) if len(said) > 1 else "".join(said.values())


def capital(sentence: Text) -> Text:
    """A sentence that begins with a field, with a capital letter; so it does in every language."""
    english = f"{sentence[:1].upper()}{sentence[1:]}"
    return Text(english, sentence.template, sentence.fields, sentence.number)


def counted(number: int, thing: str) -> Text:
    """A number and what it counts: "1 frame", "1,472 frames"."""
    count = f"{number:,}"
    english = f"{count} {thing}{'' if number == 1 else 's'}"
    return Text(english, f"{{n}} {thing}s", {"n": count}, int(number))


def some(names: Sequence[str], most: int) -> str:
    """The first of some names, and how many more there are: "A, B and 3 more"."""
    first = ", ".join(names[:most])
    return say("{names} and {n} more", names=first, n=len(names) - most) if len(names) > most else first


class StudioError(Exception):
    """Something a person can act on.

    A sentence with something filled in is made by `say`; one without is its own template.

    Args:
        what: one sentence naming the thing that happened.
        remedy: one sentence saying what to do about it, at a terminal too.
        code: what programs decide by; the kind's own where it is not given. Sentences change and are
            translated, codes stay.
        in_window: the remedy where it is another one in the window, where options have no dashes.
    """

    code = "failed"

    def __init__(self, what: str, remedy: str, *, code: str = "", in_window: str = "") -> None:
        super().__init__(f"{what} {remedy}")
        self.what = say(what)
        self.remedy = say(remedy)
        self.in_window = say(in_window or remedy)
        if code:
            self.code = code

    def __reduce__(self) -> tuple[Any, ...]:
        # As an exception is pickled it is made anew from its one text, and lost on the way between processes.
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


class RequestError(StudioError):
    """The request itself was wrong (an unknown take, a bad option): exit code 2 on the command line."""

    code = "request"


class FileThereError(RequestError):
    """A file would be written over, which is not done unasked.

    Args:
        what, remedy: the two sentences.
        file: the name of the file.
        in_window: the remedy in the window.
    """

    code = "exists"

    def __init__(self, what: str, remedy: str, file: str, *, in_window: str = "") -> None:
        super().__init__(what, remedy, in_window=in_window)
        self.file = file


class InputError(StudioError):
    """A port or a microphone cannot be opened."""

    code = "input"


def port_taken(port: int) -> InputError:
    """Another program receives on a UDP port."""
    return InputError(
        say("Port {port} is used by another program, such as VSeeFace or a second studio.", port=port),
        "Close it, or choose another port in Record (or with --port).",
        in_window="Close it, or choose another port here.",
    )


def no_sound(what: str) -> InputError:
    """There is no sound input to be had; `what` says why."""
    return InputError(
        what,
        "Check that a microphone is plugged in and allowed. "
        "Without one, record takes --device none and live takes --file.",
        in_window="Check that a microphone is plugged in and allowed, then refresh the list of devices.",
    )


class Cancelled(StudioError):  # noqa: N818 (a request that was met, not an error)
    """Work ended because the person who asked for it cancelled it; nothing of it was written."""

    code = "cancelled"

    def __init__(self, what: str = "It was cancelled.") -> None:
        super().__init__(what, "Nothing was written.")
