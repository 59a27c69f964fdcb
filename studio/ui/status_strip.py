"""The facts at the right of the tab bar: motion, sound, room on the disk, work going on."""

from __future__ import annotations

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QWidget

from studio.ui import theme

ICONS = {
    "locked": "mdi6.eye-outline",
    "rolling": "mdi6.record-circle",
    "job": "mdi6.progress-clock",
    "train": "mdi6.school-outline",
    "motion": "mdi6.human-handsup",
    "sound": "mdi6.microphone",
    "sending": "mdi6.access-point",
    "disk": "mdi6.harddisk",
}
"""The known facts in the order shown; others follow behind."""
HEALTH_ICONS = {"warn": "mdi6.alert", "bad": "mdi6.alert-circle"}


class Fact(QWidget):
    """One fact: a symbol and a few words; health shows in the symbol's shape as well as its colour.

    Signals:
        clicked: it was clicked; carries its key.
    """

    clicked = Signal(str)

    def __init__(self, key: str) -> None:
        super().__init__()
        self.key = key
        self.setObjectName(f"status_{key}")
        self._shown = ("", "")
        self._picture = QLabel()
        self.words = QLabel()
        self.words.setFont(theme.figures_font())
        # A device's name may look like markup.
        self.words.setTextFormat(Qt.TextFormat.PlainText)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(6)
        row.addWidget(self._picture)
        row.addWidget(self.words)

    def show_fact(self, text: str, health: str) -> None:
        """Show it, or nothing where the text is empty."""
        if (text, health) == self._shown:
            return
        restyle = health != self._shown[1] or not self._shown[0]
        self._shown = (text, health)
        self.words.setText(text)
        self.setAccessibleName(text)
        self.setVisible(bool(text))
        if restyle:
            self._style()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self._style()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.clicked.emit(self.key)

    def _style(self) -> None:
        health = self._shown[1]
        token = "record" if self.key == "rolling" else health or "muted"
        name = HEALTH_ICONS.get(health, ICONS.get(self.key, "mdi6.information-outline"))
        self._picture.setPixmap(theme.icon(name, token).pixmap(theme.icon_size()))
        theme.as_role(self.words, health if health in HEALTH_ICONS else "muted")


class StatusStrip(QWidget):
    """All facts in a row; long words are cut before the tabs are.

    Signals:
        clicked: a fact was clicked; carries its key.
    """

    clicked = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("status_strip")
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(0, 0, 0, 0)
        self._row.setSpacing(18)
        self.facts: dict[str, Fact] = {}
        for key in ICONS:
            self._add(key)

    def show_fact(self, key: str, text: str, health: str = "") -> None:
        """Show a fact, or take it away where the text is empty."""
        if key not in self.facts:
            self._add(key)
        self.facts[key].show_fact(text, health)

    def _add(self, key: str) -> None:
        fact = Fact(key)
        fact.hide()
        fact.clicked.connect(self.clicked)
        self.facts[key] = fact
        self._row.addWidget(fact)

    def clear(self) -> None:
        """Take all facts away."""
        for fact in self.facts.values():
            fact.show_fact("", "")
