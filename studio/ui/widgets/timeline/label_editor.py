"""The field in which a label's text is typed, right where the label lies."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import QCompleter, QLineEdit, QWidget

from studio.ui import theme


class LabelEditor(QLineEdit):
    """One text, typed and kept, or dropped.

    Signals:
        closed: whether to keep the text; sent once, by Enter, Escape or by leaving the field.
    """

    closed = Signal(bool)

    def __init__(self, text: str, vocabulary: Sequence[str], parent: QWidget) -> None:
        super().__init__(text, parent)
        self._open = True
        self.setObjectName("label_editor")
        self.setAccessibleName(self.tr("Label text"))
        edge = theme.colours().accent
        self.setStyleSheet(
            f"QLineEdit {{ padding: 0 4px; min-height: 16px; border: 1px solid {edge}; border-radius: 4px; }}"
        )
        completer = QCompleter(sorted(set(vocabulary)), self)
        completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.setCompleter(completer)
        self.returnPressed.connect(lambda: self.finish(True))

    def finish(self, keep: bool) -> None:
        """Close the field."""
        if self._open:
            self._open = False
            self.closed.emit(keep)

    def event(self, event: QEvent) -> bool:
        """Take Escape before any shortcut of the window does."""
        if isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Escape:
            if event.type() == QEvent.Type.ShortcutOverride:
                event.accept()
                return True
            if event.type() == QEvent.Type.KeyPress:
                self.finish(False)
                return True
        return super().event(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Leaving keeps the text; the list of words to choose from is not leaving."""
        super().focusOutEvent(event)
        if event.reason() != Qt.FocusReason.PopupFocusReason:
            self.finish(True)
