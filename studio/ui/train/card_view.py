"""The model card of a run, with the note on licence and consent that a person writes."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QPlainTextEdit,
    QPushButton,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.shortcuts import name_of
from studio.ui.widgets.card import heading, label


class CardDialog(QDialog):
    """Reads the card, writes the note.

    Signals:
        licence_written: the note, when it is saved.
        browser_requested: open the card in a browser, to print or to send it.
    """

    licence_written = Signal(str)
    browser_requested = Signal()

    def __init__(self, run: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("card_dialog")
        self._locked = ""
        self.setWindowTitle(self.tr("Model card of {0}").format(run))
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.resize(720, 700)
        self.card = QTextBrowser()
        self.card.setObjectName("card_text")
        self.card.setAccessibleName(name_of("card_of_run"))
        self.card.setOpenLinks(False)
        self.licence = QPlainTextEdit()
        self.licence.setObjectName("card_licence")
        self.licence.setAccessibleName(self.tr("Licence and consent"))
        self.licence.setPlaceholderText(
            self.tr("What may be done with this model, and who agreed to it. For example: "
                    "“Mia agreed to streaming and to videos; not for sale.”")
        )  # fmt: skip
        self.licence.setMaximumHeight(90)
        self.licence.setTabChangesFocus(True)
        self.licence.textChanged.connect(lambda: self.save.setEnabled(not self._locked))
        self._saved = label("", "good", "card_saved")
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        column.setSpacing(theme.INSIDE)
        column.addWidget(self.card, 1)
        column.addWidget(heading(self.tr("Licence and consent")))
        column.addWidget(self.licence)
        column.addLayout(self._buttons())

    def show_card(self, html: str, licence: str, saved: bool = False) -> None:
        """Show the card and the note as they are.

        Args:
            html: the card.
            licence: the note.
            saved: it was saved just now.
        """
        place = self.card.verticalScrollBar().value()
        self.card.setHtml(html)
        self.card.verticalScrollBar().setValue(place)
        if not saved:
            self.licence.setPlainText(licence)
        self.save.setEnabled(False)
        self._saved.setText(self.tr("The card says so now.") if saved else "")

    def show_locked(self, reason: str) -> None:
        """Why the note cannot be changed here; "" where it can."""
        self._locked = reason
        self.licence.setReadOnly(bool(reason))
        for part in (self.licence, self.save):
            part.setToolTip(reason)
        self._saved.setText(reason)
        theme.as_role(self._saved, "muted" if reason else "good")

    def _buttons(self) -> QHBoxLayout:
        self.save = QPushButton(self.tr("Save the note"))
        self.save.setObjectName("save_licence")
        theme.as_role(self.save, "primary")
        self.save.clicked.connect(lambda: self.licence_written.emit(self.licence.toPlainText()))
        browser = QPushButton(self.tr("Open in the browser"))
        browser.setObjectName("card_in_browser")
        theme.set_icon(browser, "mdi6.open-in-new", "muted")
        browser.clicked.connect(self.browser_requested)
        close = QPushButton(self.tr("Close"))
        close.clicked.connect(self.accept)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(browser)
        row.addWidget(self._saved)
        row.addStretch(1)
        row.addWidget(self.save)
        row.addWidget(close)
        return row
