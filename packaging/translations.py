"""Writes what there is to translate: `.venv/bin/python packaging/translations.py saia_de.ts`.

A Qt .ts file for Qt Linguist, of every text that a person can see: the window's own by their contexts, and
the core's as templates in the context Core. What the file holds already is kept, so that a new release asks
only for what is new. `pyside6-lrelease saia_de.ts -qm resources/languages/saia_de.qm` makes of it what the
window reads where that is the system's language.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STUDIO, RESOURCES = ROOT / "studio", ROOT / "resources"
CORE = "Core"
MARKS = {"actions": "Actions", "capture.trackers": "Trackers"}
"""Context of what a core file marks by its own `_tr`, which is shown by a file of the window."""
SPOKEN = ("performer.sentences", "performer.script")
"""What the practice performer says aloud is no text of the window."""
SENTENCE = re.compile(r"[A-Z“`][^\n]* [^\n]*[.!?…]")


@dataclass(frozen=True)
class Source:
    """A text to translate.

    Args:
        context: where a translator finds it.
        text: the English; of a plural the form for many.
        plural: it goes by a number.
        place: a file and a line in it.
    """

    context: str
    text: str
    plural: bool
    place: str


def sources() -> list[Source]:
    """Every text there is to translate, once each, by context and place."""
    found: dict[tuple[str, str], Source] = {}
    for source in (*_of_code(), *_of_resources(), *_of_settings()):
        before = found.get((source.context, source.text))
        if before is None or (source.plural and not before.plural):
            found[source.context, source.text] = source
    return sorted(found.values(), key=lambda one: (one.context, one.place.split(":")[0]))


def trees() -> dict[Path, ast.Module]:
    """Every file of the studio, read."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(STUDIO.rglob("*.py"))}


def kinds_of_errors(files: Iterable[ast.Module]) -> set[str]:
    """StudioError and what is derived from it, by name."""
    nodes = [node for tree in files for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    bases = {
        node.name: {getattr(one, "id", getattr(one, "attr", "")) for one in node.bases} for node in nodes
    }
    kinds = {"StudioError"}
    while more := {name for name, own in bases.items() if own & kinds} - kinds:
        kinds |= more
    return kinds


def _of_code() -> Iterator[Source]:
    files = trees()
    kinds = kinds_of_errors(files.values())
    for path, tree in files.items():
        yield from _File(path, tree, kinds).sources()


def _of_resources() -> Iterator[Source]:
    """Names of what comes with the studio: recipes, their forms, and presets of the Tune panel."""
    for path in sorted((RESOURCES / "recipes").glob("*.toml")):
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        for one in (content, *content.get("forms", {}).values()):
            for key in ("title", "summary", "preset"):
                if text := one.get(key):
                    yield Source(CORE, text, False, f"{path.relative_to(ROOT).as_posix()}:1")
    for path in sorted((RESOURCES / "tunings").glob("*.json")):
        title = json.loads(path.read_text(encoding="utf-8"))["title"]
        yield Source(CORE, title, False, f"{path.relative_to(ROOT).as_posix()}:1")


def _of_settings() -> Iterator[Source]:
    from studio.settings import Settings

    for about in Settings.info().values():
        for text in (about.title, about.help, about.unit, about.zero, about.tip, *about.choices.values()):
            if text and about.title:
                yield Source("Settings", text, False, "studio/settings.py:1")


class _File(ast.NodeVisitor):
    """What one file says."""

    def __init__(self, path: Path, tree: ast.Module, kinds: set[str]) -> None:
        self._place = path.relative_to(ROOT).as_posix()
        self._name = ".".join(path.relative_to(STUDIO).with_suffix("").parts)
        self._tree, self._kinds = tree, kinds
        self._classes: list[str] = []
        self._found: list[Source] = []
        self._own_words = 0
        self._context = MARKS.get(self._name, "") or _context_of(tree)

    def sources(self) -> list[Source]:
        self.visit(self._tree)
        return self._found

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self._classes.append(node.name)
        self.generic_visit(node)
        self._classes.pop()

    def visit_Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):  # a docstring
            self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        named = isinstance(node.targets[0], ast.Name) and node.targets[0].id == "TITLE"
        if named and self._name.startswith("formats."):
            self._add(CORE, node.value)
        self.generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        for value in node.values:
            if isinstance(value, ast.FormattedValue):
                self.visit(value.value)

    def visit_Constant(self, node: ast.Constant) -> None:
        """A sentence of the core is its own template, wherever it stands; a command's words are its own."""
        shown = not self._name.startswith(("ui.", "cli.", *SPOKEN)) or self._own_words
        if shown and isinstance(node.value, str) and SENTENCE.fullmatch(node.value):
            self._add(CORE, node)

    def visit_Call(self, node: ast.Call) -> None:
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        words = self._words_of(name, node)
        if words is not None:
            self._add(*words)
        inside = name in self._kinds
        self._own_words += inside
        # Words that are found by their call are not sentences of the core beside it.
        marked = isinstance(node.func, ast.Name) and name in ("_tr", "_translated", "QT_TRANSLATE_NOOP")
        for child in () if marked else ast.iter_child_nodes(node):
            self.visit(child)
        self._own_words -= inside

    def _words_of(self, name: str, node: ast.Call) -> tuple[str, ast.AST, bool] | None:
        """Context, text and whether it goes by a number, of a call that says something."""
        if not node.args:
            return None
        if name == "say":
            return CORE, node.args[0], any(field.arg == "n" for field in node.keywords)
        if name == "Text" and len(node.args) > 1:
            return CORE, node.args[1], len(node.args) > 3
        if name == "counted" and len(node.args) == 2:
            thing = getattr(node.args[1], "value", None)
            return (CORE, ast.Constant(f"{{n}} {thing}s", lineno=node.lineno), True) if thing else None
        if name == "tr" and self._classes:
            return self._classes[-1], node.args[0], False
        if name in ("translate", "QT_TRANSLATE_NOOP") and len(node.args) > 1:
            return str(getattr(node.args[0], "value", "")), node.args[1], False
        return (self._context, node.args[0], False) if name in ("_tr", "_translated") else None

    def _add(self, context: str, node: ast.AST, plural: bool = False) -> None:
        text = getattr(node, "value", None)
        # "{what} {remedy}" has no words of its own.
        if context and isinstance(text, str) and re.search(r"[^\W\d_]", re.sub(r"\{\w*\}", "", text)):
            self._found.append(Source(context, text, plural, f"{self._place}:{node.lineno}"))


def _context_of(tree: ast.Module) -> str:
    """The context in which a file's own `_tr` looks its texts up, "" where it has none."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name in ("_tr", "_translated"):
            for call in ast.walk(node):
                if isinstance(call, ast.Call) and getattr(call.func, "attr", "") == "translate":
                    return str(getattr(call.args[0], "value", ""))
    return ""


def write(file: Path, known: list[Source]) -> int:
    """Write a .ts file, with the translations it has already; how many of the texts have one."""
    language = file.stem.partition("_")[2] or "en"
    kept = _kept(file)
    root = ElementTree.Element("TS", version="2.1", language=language, sourcelanguage="en")
    contexts: dict[str, ElementTree.Element] = {}
    for one in known:
        if one.context not in contexts:
            contexts[one.context] = ElementTree.SubElement(root, "context")
            ElementTree.SubElement(contexts[one.context], "name").text = one.context
        plural = {"numerus": "yes"} if one.plural else {}
        message = ElementTree.SubElement(contexts[one.context], "message", plural)
        path, _, line = one.place.rpartition(":")
        ElementTree.SubElement(message, "location", filename=path, line=line)
        ElementTree.SubElement(message, "source").text = one.text
        before = kept.get((one.context, one.text))
        if before is not None:
            message.append(before)
            continue
        empty = ElementTree.SubElement(message, "translation", type="unfinished")
        if one.plural:
            ElementTree.SubElement(empty, "numerusform")
    ElementTree.indent(root, "    ")
    text = ElementTree.tostring(root, encoding="unicode")
    file.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE TS>\n{text}\n', encoding="utf-8")
    return len(kept.keys() & {(one.context, one.text) for one in known})


def _kept(file: Path) -> dict[tuple[str, str], ElementTree.Element]:
    """Finished translations of a .ts file by context and English."""
    if not file.is_file():
        return {}
    found = {}
    for context in ElementTree.parse(file).getroot().iter("context"):
        for message in context.iter("message"):
            said = message.find("translation")
            if said is not None and ("".join(said.itertext()).strip()):
                found[context.findtext("name", ""), message.findtext("source", "")] = said
    return found


def main(argv: list[str] | None = None) -> int:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("file", type=Path, help="saia_LANGUAGE.ts, such as saia_de.ts")
    file = parser.parse_args(argv).file
    known = sources()
    done = write(file, known)
    print(f"{file}: {len(known)} texts, {done} of them translated.")
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    sys.exit(main())
