"""The row of the inputs card that asks a phone for its face."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QPushButton, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.widgets.card import label


class PhoneRow(QWidget):
    """The phone's address and a button.

    Signals:
        chosen: the address typed, when the button or Enter is pressed; "" to ask no more.
    """

    chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self._asked = ""
        self.address = QLineEdit()
        self.address.setObjectName("phone_address")
        self.address.setMaxLength(40)
        self.address.setPlaceholderText(self.tr("Phone's address"))
        self.address.setAccessibleName(self.tr("Address of the phone with iFacialMocap"))
        self.address.setToolTip(self.tr("iFacialMocap shows it at the top, for example 192.168.1.7."))
        self.address.returnPressed.connect(self._on_pressed)
        self.address.textChanged.connect(self._say)
        self.button = QPushButton()
        self.button.setObjectName("phone_connect")
        self.button.clicked.connect(self._on_pressed)
        self.words = label("", "caption", "phone_words")
        self.words.setWordWrap(True)
        self.words.hide()
        line = QHBoxLayout()
        line.setSpacing(theme.INSIDE)
        line.addWidget(self.address, 1)
        line.addWidget(self.button)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.TIGHT)
        column.addLayout(line)
        column.addWidget(self.words)
        self._say()

    def show_phone(self, address: str, words: str) -> None:
        """Show which phone is asked, "" for none, and how that stands."""
        if address != self._asked:
            self._asked = address
            self._say()
        if words != self.words.text():
            self.words.setText(words)
        self.words.setVisible(bool(words))

    def _on_pressed(self) -> None:
        typed = self.address.text().strip()
        self.chosen.emit("" if typed == self._asked else typed)

    def _say(self) -> None:
        asked = bool(self._asked) and self.address.text().strip() == self._asked
        self.button.setText(self.tr("Disconnect") if asked else self.tr("Connect to phone"))
