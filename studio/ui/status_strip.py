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
URGENT = ("locked", "rolling", "job", "train", "live")
"""Facts whose words stay while there is room for few; so do those of bad health."""
WHOLE, BRIEF, SYMBOLS = range(3)
"""How much a strip says: all words, those that matter most, or none."""
SPACING_PX, GAP_PX = 18, 6
HEALTH_ICONS = {"warn": "mdi6.alert", "bad": "mdi6.alert-circle"}


class Fact(QWidget):
    """One fact: a symbol and a few words; health shows in the symbol's shape as well as its colour.

    Where its words are folded away, they are its tip.

    Signals:
        clicked: it was clicked; carries its key.
    """

    clicked = Signal(str)

    def __init__(self, key: str) -> None:
        super().__init__()
        self.key = key
        self.setObjectName(f"status_{key}")
        self._shown = ("", "")
        self._folding = WHOLE
        self._tip = ""
        self._picture = QLabel()
        self.words = QLabel()
        self.words.setFont(theme.figures_font())
        # A device's name may look like markup.
        self.words.setTextFormat(Qt.TextFormat.PlainText)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(GAP_PX)
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
        self.fold(self._folding)
        if restyle:
            self._style()

    def fold(self, folding: int) -> None:
        """Say as much as WHOLE, BRIEF or SYMBOLS allows."""
        self._folding = folding
        folded = not self._speaks(folding)
        self.words.setHidden(folded)
        if folded or self.toolTip() == self._tip:
            self._tip = self._shown[0] if folded else ""
            self.setToolTip(self._tip)

    def width_at(self, folding: int) -> int:
        """Pixels it takes up at WHOLE, BRIEF or SYMBOLS; 0 where it says nothing."""
        if not self._shown[0]:
            return 0
        words = GAP_PX + self.words.sizeHint().width() if self._speaks(folding) else 0
        return theme.icon_size().width() + words

    def _speaks(self, folding: int) -> bool:
        urgent = self.key in URGENT or self._shown[1] in HEALTH_ICONS
        return folding == WHOLE or (folding == BRIEF and urgent)

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
    """All facts in a row, folded to symbols where there is less room.

    Signals:
        clicked: a fact was clicked; carries its key.
        changed: it says something else, and may need another width.
    """

    clicked = Signal(str)
    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("status_strip")
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(0, 0, 0, 0)
        self._row.setSpacing(SPACING_PX)
        self._folding = WHOLE
        self.facts: dict[str, Fact] = {}
        for key in ICONS:
            self._add(key)

    def show_fact(self, key: str, text: str, health: str = "") -> None:
        """Show a fact, or take it away where the text is empty."""
        if key not in self.facts:
            self._add(key)
        before = self.facts[key].width_at(WHOLE)
        self.facts[key].show_fact(text, health)
        if self.facts[key].width_at(WHOLE) != before:
            self.changed.emit()

    def fold(self, folding: int) -> None:
        """Say as much as WHOLE, BRIEF or SYMBOLS allows."""
        if folding != self._folding:
            self._folding = folding
            for fact in self.facts.values():
                fact.fold(folding)

    def width_at(self, folding: int) -> int:
        """Pixels it takes up at WHOLE, BRIEF or SYMBOLS."""
        widths = [width for fact in self.facts.values() if (width := fact.width_at(folding))]
        return sum(widths) + SPACING_PX * max(0, len(widths) - 1)

    def _add(self, key: str) -> None:
        fact = Fact(key)
        fact.hide()
        fact.fold(self._folding)
        fact.clicked.connect(self.clicked)
        self.facts[key] = fact
        self._row.addWidget(fact)

    def clear(self) -> None:
        """Take all facts away."""
        for key in self.facts:
            self.show_fact(key, "")
