"""What the core says, in the person's language."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QCoreApplication, QLocale, QTranslator

from studio.errors import Text
from studio.paths import resource

CONTEXT = "Core"
"""Where translators find the core's sentences; the window's own have contexts of their own."""


def install(app: QCoreApplication, folder: Path | None = None, locale: QLocale | None = None) -> bool:
    """Speak the system's language where somebody has translated the studio; whether anybody has.

    Args:
        app: the application.
        folder: of saia_LANGUAGE.qm files; those that come with the studio where None.
        locale: the language; the system's where None.
    """
    translator = QTranslator(app)
    place = str(folder or resource("languages"))
    return translator.load(locale or QLocale(), "saia", "_", place) and app.installTranslator(translator)


def sentences(*texts: str) -> str:
    """Texts of the core as they are shown, one after the other."""
    return " ".join(native(text) for text in texts if text)


def native(text: str) -> str:
    """A text of the core as it is shown: in English where nobody has translated it.

    Args:
        text: a Text, or one that is its own template.
    """
    if not isinstance(text, Text):
        return _found(text) if text else ""
    number = -1 if text.number is None else text.number
    found = _found(text.template, number)
    if not text.fields:
        return found
    fields = {name: native(one) if isinstance(one, Text) else one for name, one in text.fields.items()}
    if found == text.template and fields == text.fields:
        return str(text)  # English, whose form for one is not in the template
    try:
        said = found.format(**fields)
    except (LookupError, ValueError, AttributeError):  # a translator wrote braces that nothing stands for
        return str(text)
    # Where English begins with a field and a capital, so does the other language.
    return f"{said[:1].upper()}{said[1:]}" if text[:1].isupper() and found.startswith("{") else said


def _found(text: str, number: int = -1) -> str:
    """A text in the person's language, itself where nobody has translated it."""
    try:
        text.encode()
    except UnicodeEncodeError:  # a file's name that is no text, on Linux: Qt cannot look it up
        return text
    return QCoreApplication.translate(CONTEXT, text, None, number)
