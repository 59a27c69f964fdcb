"""Another language: what the core says is looked up as a template, and its fields are filled afterwards."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import PySide6
import pytest
from PySide6.QtCore import QLocale, QTranslator
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QApplication, QComboBox, QTabBar, QTableView, QWidget

from studio.errors import StudioError, capital, counted, port_taken, say, together
from studio.ui import language, messages, theme
from studio.ui.language import native, sentences
from studio.ui.main_window import MainWindow
from studio.ui.messages import Toast
from studio.ui.tasks import ChildTask

ROOT = Path(__file__).resolve().parents[2]


class Brackets(QTranslator):
    """A language in which every text stands in brackets; those in `known` read otherwise."""

    def __init__(self, known: dict[str, str] | None = None) -> None:
        super().__init__()
        self.known = known or {}

    def isEmpty(self) -> bool:  # noqa: N802
        return False

    def translate(self, context: str, text: str, disambiguation: str | None = None, n: int = -1) -> str:
        if context == "Core" and text in self.known:
            return self.known[text] if n != 1 else self.known.get(f"1 {text}", self.known[text])
        # "{what} {remedy}" has no words, so that no translator is asked about it.
        return f"[{text}]" if re.search(r"[^\W\d_]", re.sub(r"\{\w+\}", "", text)) else text


@pytest.fixture
def speak(qapp: QApplication) -> Iterator[type[Brackets]]:
    """Installs a language for a test."""
    spoken = []

    def install(known: dict[str, str] | None = None) -> Brackets:
        translator = Brackets(known)
        qapp.installTranslator(translator)
        spoken.append(translator)
        return translator

    yield install  # type: ignore[misc]
    for translator in spoken:
        qapp.removeTranslator(translator)


def test_without_a_translation_the_window_speaks_english(qapp) -> None:
    one = say("{n} takes were lost in {name}.", "{n} take was lost in {name}.", n=1, name="a")
    assert (native(one), native("The disk is full."), native("")) == (one, "The disk is full.", "")


@pytest.mark.parametrize("name", ["{0}", "{name}", "100 %n", "{", "take\udcff.wav"])
def test_a_name_of_a_file_is_shown_as_it_is(speak, window, name: str) -> None:
    """Braces are nothing to fill, and bytes that are no text are no reason to show nothing at all."""
    what = "{name} cannot be read as a video."
    assert native(say(what, name=name)) == f"{name} cannot be read as a video."
    assert native(name) == name
    speak({what: "{name} ist kein Video."})
    error = StudioError(say(what, name=name), f"Look at {name}.")
    messages.show_error(window, error)
    toast = window.findChild(Toast)
    assert toast is not None
    assert toast.text.text() == f"{name} ist kein Video.".replace("\udcff", "")


def test_an_error_of_the_core_is_said_in_another_language(speak, window) -> None:
    what = "Port {port} is used by another program, such as VSeeFace or a second studio."
    speak({what: "Ein anderes Programm benutzt Port {port}."})
    messages.show_error(window, port_taken(39539))
    toast = window.findChild(Toast)
    assert toast is not None
    assert toast.text.text() == "Ein anderes Programm benutzt Port 39539."
    assert toast.remedy.text() == "[Close it, or choose another port here.]"


def test_a_plural_has_the_other_language_s_forms(speak) -> None:
    speak({"{n} frames": "{n} Bilder", "1 {n} frames": "{n} Bild", "Lost {frames}.": "{frames} fehlen."})
    assert native(say("Lost {frames}.", frames=counted(1, "frame"))) == "1 Bild fehlen."
    assert native(say("Lost {frames}.", frames=counted(1472, "frame"))) == "1,472 Bilder fehlen."


def test_words_within_a_sentence_are_translated_and_names_are_not(speak) -> None:
    speak({"{what} in {name}": "in {name}: {what}", "nods": "nickt", "{part}.": "{part}."})
    said = say("{what} in {name}", what=say("nods"), name="nods")
    assert native(said) == "in nods: nickt"
    assert native(together(" ", say("nods"), said)) == "nickt in nods: nickt"
    assert native(capital(say("{part}.", part=say("nods")))) == "Nickt."


def test_braces_that_nothing_stands_for_are_english(speak) -> None:
    speak({"{name} is damaged.": "{nmae} ist beschädigt."})
    assert native(say("{name} is damaged.", name="a.wav")) == "a.wav is damaged."


def test_a_child_s_error_is_translated_by_the_window(speak, qtbot) -> None:
    speak({"There is no project at {folder}.": "In {folder} ist kein Projekt."})
    task = ChildTask()
    with qtbot.waitSignal(task.ended), qtbot.waitSignal(task.failed) as failed:
        task.start(["check", "/nowhere at all"])
    remedy = "[Choose a folder with a project.json, or create a project there.]"
    error = failed.args[0]
    assert sentences(error.what, error.in_window) == f"In /nowhere at all ist kein Projekt. {remedy}"


@pytest.mark.slow
def test_a_translated_file_is_spoken(qapp, tmp_path: Path, window) -> None:
    """The road of a translator: list the texts, translate, compile, and start the studio."""
    file, lrelease = tmp_path / "saia_de.ts", Path(PySide6.__file__).with_name("lrelease")
    if not lrelease.exists():
        pytest.skip("this PySide6 has no lrelease")
    listing = [sys.executable, str(ROOT / "packaging" / "translations.py"), str(file)]
    subprocess.run(listing, check=True, cwd=ROOT, capture_output=True)
    tree = ElementTree.parse(file)
    german = {"Cancel": ["Abbrechen"], "{n} frames": ["{n} Bild", "{n} Bilder"]}
    for message in tree.iter("message"):
        forms = german.get(message.findtext("source", ""))
        said = message.find("translation")
        if forms and said is not None:
            del said.attrib["type"]
            for form, empty in zip(forms, list(said) + [said] * (not len(said)), strict=False):
                empty.text = form
            for form in forms[1:] if message.get("numerus") else ():
                ElementTree.SubElement(said, "numerusform").text = form
    tree.write(file, encoding="utf-8", xml_declaration=True)
    made = tmp_path / "saia_de.qm"
    subprocess.run([str(lrelease), str(file), "-qm", str(made)], check=True, capture_output=True)
    locale = QLocale(QLocale.Language.German, QLocale.Country.Germany)
    assert not language.install(qapp, tmp_path / "none", locale)
    before = set(qapp.findChildren(QTranslator))
    assert language.install(qapp, tmp_path, locale)
    (translator,) = set(qapp.findChildren(QTranslator)) - before
    try:
        assert [native(counted(n, "frame")) for n in (1, 3)] == ["1 Bild", "3 Bilder"]
        assert native("The disk is full.") == "The disk is full."
    finally:
        qapp.removeTranslator(translator)


# -- every text of the window ----------------------------------------------------------------------


OTHERS = {"prompt_text", "webcam_shape"}
"""Widgets that show what is read aloud, and names of shapes."""
NAMES = re.compile(r"Toy - Saia Studio|\S*/\S*.*|Keep one for val\w*")
"""Addresses, paths, and what the test's own edit is called."""


@pytest.mark.slow
def test_every_text_of_the_window_is_translated(speak, session, qtbot, qapp) -> None:
    """Of each tab, as it opens: a text that is not said by `tr` or `native` stands outside of brackets."""
    speak()
    theme.apply(qapp)
    window = MainWindow(session)
    qtbot.addWidget(window)
    window.show()
    english = set()
    for number in range(window.tabs.count()):
        window.tabs.setCurrentIndex(number)
        qapp.processEvents()
        english |= {text for text in texts_of(window) if is_english(text)}
    window.close()
    assert not english, "\n".join(sorted(english))


def texts_of(root: QWidget) -> Iterator[str]:
    for one in (root, *root.findChildren(QWidget), *root.findChildren(QAction)):
        if one.objectName() in OTHERS:
            continue
        for name in ("text", "toolTip", "placeholderText", "title", "accessibleName", "windowTitle"):
            said = getattr(one, name, None)
            if callable(said):
                yield str(said())
        if isinstance(one, QComboBox):
            yield from (one.itemText(i) for i in range(one.count()))
        if isinstance(one, QTabBar):
            yield from (one.tabText(i) for i in range(one.count()))
        if isinstance(one, QTableView) and (model := one.model()) is not None:
            yield from (str(model.index(0, i).data() or "") for i in range(model.columnCount()))


def is_english(text: str) -> bool:
    """Whether three words are left where everything in brackets, and every name, is taken away."""
    before = ""
    while before != text:
        before, text = text, re.sub(r"\[[^\[\]]*\]", "", text)
    return len(re.findall(r"\b[A-Za-z]{2,}\b", NAMES.sub("", text))) >= 3
