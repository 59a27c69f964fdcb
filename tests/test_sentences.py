"""What the core says: templates with named fields, told between processes, and none but templates."""

from __future__ import annotations

import ast
import copy
import importlib.util
import pickle
import string
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from studio.errors import StudioError, Text, capital, counted, port_taken, say, some, together
from studio.files.atomic import plain
from studio.ipc.events import ErrorEvent, NoteEvent, TakeEvent, decode, encode

ROOT = Path(__file__).resolve().parent.parent
_spec = importlib.util.spec_from_file_location("translations", ROOT / "packaging" / "translations.py")
assert _spec is not None
assert _spec.loader is not None
translations = importlib.util.module_from_spec(_spec)
sys.modules["translations"] = translations  # its dataclass looks itself up there
_spec.loader.exec_module(translations)
TREES = translations.trees()
KINDS = translations.kinds_of_errors(TREES.values())


def test_a_sentence_is_its_english_and_knows_how_it_was_made() -> None:
    error = port_taken(39539)
    assert error.what == "Port 39539 is used by another program, such as VSeeFace or a second studio."
    assert isinstance(error.what, Text)
    assert error.what.template.startswith("Port {port} is used")
    assert error.what.fields == {"port": "39539"}
    assert str(error) == f"{error.what} {error.remedy}"


def test_a_constant_is_its_own_template() -> None:
    error = StudioError("The disk is full.", "Free {some} space.")
    assert (error.remedy, say(error.remedy)) == ("Free {some} space.", error.in_window)
    assert error.what.template == "The disk is full."


def test_a_field_with_braces_stays_as_it_is() -> None:
    assert say("{name} is damaged.", name="{name}{0}") == "{name}{0} is damaged."


def test_counted_things_know_their_number() -> None:
    assert (counted(1, "frame"), counted(1472, "frame")) == ("1 frame", "1,472 frames")
    assert (counted(1472, "frame").template, counted(1472, "frame").number) == ("{n} frames", 1472)
    lost = say("{n} were lost.", "{n} was lost.", n=1)
    assert (lost, lost.template, lost.number) == ("1 was lost.", "{n} were lost.", 1)


def test_parts_are_put_together() -> None:
    assert some(["A", "B", "C"], 2) == "A, B and 1 more"
    assert some(["A", "B"], 2) == "A, B"
    first, second = say("nods"), say("{who} blinks", who="Mia")
    both = together(", ", first, "", second)
    assert (both, together(", ", "", first)) == ("nods, Mia blinks", "nods")
    assert capital(say("{all}.", all=both)) == "Nods, Mia blinks."


@pytest.mark.parametrize("again", [lambda one: pickle.loads(pickle.dumps(one)), copy.deepcopy])
def test_a_sentence_survives_pickling_and_copying(again) -> None:
    made = say("{what} In {place}.", what=counted(2, "frame"), place="a")
    back = again(made)
    assert (back, back.template, back.fields["what"].number) == (made, made.template, 2)


@pytest.mark.parametrize("through", [{}, {"plain": plain}], ids=["structs", "a command's output"])
def test_a_child_s_sentences_reach_the_window_whole(through) -> None:
    what = say("{what} {frames} in {place}.", what=say("Bad."), frames=counted(1, "frame"), place="Bad")
    event = decode(encode(ErrorEvent(what, "Restore it."), **through), "train")
    assert isinstance(event, ErrorEvent)
    assert (event.what, event.remedy) == ("Bad. 1 frame in Bad.", "Restore it.")
    assert isinstance(event.what, Text)
    assert isinstance(event.what.fields["what"], Text)
    assert not isinstance(event.what.fields["place"], Text)
    assert event.what.fields["frames"].template == "{n} frames"
    take = decode(encode(TakeEvent("a", notes=(what, "Kept.")), **through), "import")
    assert isinstance(take, TakeEvent)
    assert take.notes == (what, "Kept.")
    assert take.notes[0].template == what.template


def test_other_programs_read_english_alone() -> None:
    line = encode(NoteEvent(say("{name} is kept.", name="a")), plain, templates=False)
    assert line == '{"event": "note", "text": "a is kept.", "note": "", "take": ""}'


@pytest.mark.parametrize("parts", ["null", '"x"', "[1, 2]", '["{a}", {"a": "A"}, null]'])
def test_templates_of_another_form_are_texts(parts: str) -> None:
    event = decode(f'{{"event": "note", "text": "A", "templates": {{"A": {parts}}}}}', "train")
    assert event == NoteEvent("A")


# -- the source ------------------------------------------------------------------------------------


def test_errors_are_said_as_templates() -> None:
    """An f-string, a %, a format or a + is English for ever; so is the tour's own report, at a terminal."""
    files = {path: tree for path, tree in TREES.items() if path.parent.name != "tour"}
    wrong = [f"{path}:{line}" for path, tree in files.items() for line in built(tree)]
    assert not wrong, "\n".join(wrong)


ENGLISH = ("cli/", "ui/", "dataset/data_card.py", "evaluation/model_card.py", "remote/server.py")
"""What a terminal reads, what the window says by `tr`, cards that are files, and answers to programs."""


def test_no_sentence_of_the_core_is_an_f_string() -> None:
    wrong = []
    for path, tree in TREES.items():
        if path.relative_to(ROOT / "studio").as_posix().startswith(ENGLISH):
            continue
        for node in ast.walk(tree):
            texts = node.values if isinstance(node, ast.JoinedStr) else ()
            said = "".join(
                getattr(part, "value", "") if isinstance(part, ast.Constant) else "X" for part in texts
            )
            if translations.SENTENCE.fullmatch(said) and said[-1] != "…":
                wrong.append(f"{path}:{node.lineno} {said}")
    assert not wrong, "\n".join(wrong)


def test_a_built_sentence_is_found() -> None:
    source = (
        "def f(x):\n"
        "    a = f'{x} is bad.'\n"
        "    raise StudioError(a, 'No. ' + x)\n"
        "    raise RequestError('%s' % x, '{}'.format(x), in_window=say('{x}', x=x))\n"
    )
    assert list(built(ast.parse(source))) == [3, 3, 4, 4]


def test_templates_name_their_fields() -> None:
    wrong = []
    for path, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "say":
                wrong += [f"{path}:{node.lineno} {why}" for why in faults(node)]
    assert not wrong, "\n".join(wrong)


def built(tree: ast.Module) -> Iterator[int]:
    """Lines of sentences that are put together in the source and handed to an error."""
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        made = {
            target.id
            for node in ast.walk(function)
            if isinstance(node, ast.Assign) and is_built(node.value)
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        for node in ast.walk(function):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in KINDS:
                named = [word.value for word in node.keywords if word.arg in ("what", "remedy", "in_window")]
                for given in (*node.args[:2], *named):
                    if is_built(given) or getattr(given, "id", "") in made:
                        yield given.lineno


def is_built(node: ast.AST) -> bool:
    by_format = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
    if by_format and node.func.attr == "format":
        inner = node.func.value  # of a text that was translated already, in the window
        return not (isinstance(inner, ast.Call) and getattr(inner.func, "attr", "") == "tr") and isinstance(
            inner, ast.Constant
        )
    return isinstance(node, ast.JoinedStr | ast.BinOp)


def faults(call: ast.Call) -> Iterator[str]:
    """What is wrong with a call of `say`."""
    names = {word.arg for word in call.keywords}
    for text in call.args:
        if not (isinstance(text, ast.Constant) and isinstance(text.value, str)):
            # Words of a table that are marked, or are sentences, where the table stands.
            if names:
                yield "has a template that translators cannot find"
            continue
        parts = list(string.Formatter().parse(text.value)) if names else []
        asked = {name for _, name, _, _ in parts if name is not None}
        if asked - names or (text is call.args[0] and names - asked):
            yield f"fills {sorted(map(str, names))} into {text.value!r}"
        if any(spec or conversion for _, _, spec, conversion in parts):
            yield "formats within the template"
