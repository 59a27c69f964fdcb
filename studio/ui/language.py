"""What the core says, in the person's language."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication

from studio.errors import Text

CONTEXT = "Core"
"""Where translators find the core's sentences; the window's own have contexts of their own."""


def translated(text: str) -> str:
    """A text of the core as it is shown: in English where nobody has translated it.

    Args:
        text: a Text, or a text that is its own template.
    """
    if not isinstance(text, Text):
        return QCoreApplication.translate(CONTEXT, text) if text else ""
    number = -1 if text.number is None else text.number
    found = QCoreApplication.translate(CONTEXT, text.template, None, number)
    if not text.fields or (number == 1 and found == text.template):  # the template is that for many
        return str(text) if found == text.template else found
    fields = {
        name: translated(field) if isinstance(field, Text) else field for name, field in text.fields.items()
    }
    try:
        return found.format(**fields)
    except (KeyError, IndexError, ValueError):  # a translator wrote braces that nothing stands for
        return str(text)
