"""What children say is read into types; a line in another form is a stated failure."""

from __future__ import annotations

import ast
import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from studio.cli import main
from studio.errors import Text, counted, say
from studio.ipc import events
from studio.ipc.events import (
    CheckDone,
    ChildEvent,
    CleanDone,
    EpochEvent,
    FilesDone,
    LiveStateEvent,
    MessageError,
    NoteEvent,
    QueueFailure,
    RecordStateEvent,
    TakeEvent,
    VoiceEvent,
    decode,
    encode,
    event_types,
)
from studio.project import Project

CLI = Path(__file__).resolve().parents[2] / "studio" / "cli"


@pytest.mark.parametrize(
    ("verb", "line", "expected"),
    [
        ("voice", '{"event": "voice", "to": null, "colour": "blue"}', VoiceEvent(None)),
        ("live", '{"event": "voice", "to": ""}', VoiceEvent("")),
        ("clean", '{"event": "done", "way": "noise"}', CleanDone(way="noise")),
        (
            "export",
            '{"event": "done", "files": ["a.bvh"], "failed": [{"name": "b", "what": "c", "remedy": "d"}]}',
            FilesDone(("a.bvh",), (QueueFailure("b", "c", "d"),)),
        ),
        ("train", "a library chats", None),
        ("train", "[1, 2]", None),
        ("train", '{"epoch": 1}', None),
    ],
)
def test_a_line_is_read_into_its_type(verb: str, line: str, expected: ChildEvent | None) -> None:
    assert decode(line, verb) == expected


def test_sentences_come_back_as_they_were_made_whatever_stands_in_them() -> None:
    """A name may read like a sentence, like the one it stands in, or like a field of one."""
    name = say("{name}", name="x")
    within = say("{what} {more}", what=say("{name} is {name}", name="{what}"), more=say("Stop."))
    for sentence in (name, within, say("{name} is bad.", name=within), counted(1, "frame")):
        back = decode(encode(NoteEvent(text=sentence)), "train")
        assert isinstance(back, NoteEvent)
        assert made_of(back.text) == made_of(sentence)


def made_of(text: str) -> object:
    if not isinstance(text, Text):
        return text
    return str(text), text.template, {key: made_of(one) for key, one in text.fields.items()}, text.number


def test_what_is_not_known_is_the_fields_default() -> None:
    event = decode('{"event": "epoch", "epoch": 3, "val_loss": null, "val": {"rmse": null}}', "train")
    assert isinstance(event, EpochEvent)
    assert math.isnan(event.val_loss)
    assert event.val == {"rmse": None}


def test_commands_call_different_things_by_one_name() -> None:
    assert event_types()["live", "state"] is LiveStateEvent
    assert event_types()["record", "state"] is RecordStateEvent


@pytest.mark.parametrize(
    "line", ['{"event": "epoch", "epoch": "three"}', '{"event": "epoch"}', '{"event": "nothing of ours"}']
)
def test_another_form_is_a_stated_failure(line: str) -> None:
    with pytest.raises(MessageError) as caught:
        decode(line, "train")
    assert caught.value.what.startswith("saia train told of ")


@pytest.mark.parametrize("kind", sorted(set(event_types().values()), key=lambda kind: kind.__name__))
def test_every_event_survives_its_line(kind: type[ChildEvent]) -> None:
    examples = {
        "str": "x", "int": 3, "float": 0.5, "bool": True, "Row": (0.5, None), "Rows": ((0.5, 1.0),),
        "tuple[int, ...]": (1, 2), "tuple[str, ...]": ("a",), "tuple[tuple[str, str], ...]": (("a", "b"),),
    }  # fmt: skip
    verb = next(iter(kind.VERBS), "")
    written = {
        name: kind_of
        for base in kind.__mro__
        for name, kind_of in vars(base).get("__annotations__", {}).items()
    }
    made = kind(**{name: examples[kind_of] for name, kind_of in written.items() if kind_of in examples})
    assert decode(encode(made), verb) == made


def test_every_event_a_command_prints_is_read_as_that_type() -> None:
    """Two events of one name and command would hide one another from the window."""
    types, wrong = event_types(), []
    for path in CLI.glob("*.py"):
        verb = path.stem.removesuffix("_verb")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
                continue
            kind = getattr(events, node.func.id, None)
            if not isinstance(kind, type) or not issubclass(kind, ChildEvent) or verb.startswith("_"):
                continue
            read = types.get((verb, kind.NAME)) or types.get(("", kind.NAME))
            if read is None or not issubclass(read, kind):
                wrong.append(f"{path.name}:{node.lineno} {kind.__name__} is read as {read}")
    assert not wrong, "\n".join(wrong)


def test_what_a_command_prints_is_read(
    make_toy_project: Callable[..., Project], capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project()
    capsys.readouterr()
    assert main(["check", str(project.folder), "--json"]) == 0
    lines = capsys.readouterr().out.splitlines()
    told = [decode(line, "check") for line in lines]
    assert [type(event).NAME for event in told if event] == [json.loads(line)["event"] for line in lines]
    assert isinstance(told[0], TakeEvent)
    assert told[0].grade
    last = told[-1]
    assert isinstance(last, CheckDone)
    assert set(last.takes) == {take.id for take in project.takes}
