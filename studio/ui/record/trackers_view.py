"""How are you tracked? A card for each tracker, with its steps in pictures, its light and its address."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QButtonGroup,
    QDialog,
    QHBoxLayout,
    QPushButton,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.record.inputs_view import PhoneRow
from studio.ui.record.tracker_pictures import PhoneCode, StepPicture
from studio.ui.record.webcam_view import WebcamPane
from studio.ui.widgets.card import Card, Picture, label

WEBCAM = "webcam"
"""Id of the tile that shows the webcam's page instead of steps."""


@dataclass(frozen=True)
class TrackerCard:
    """What the page says of one tracker.

    Args:
        id, title: the tracker's.
        steps: (picture, sentence) of each.
        address, port: what is typed into it.
        phone: whether a code for a phone is shown.
        asked: whether the phone's address is typed here instead.
        note: a further sentence, "" for none.
    """

    id: str
    title: str
    steps: tuple[tuple[str, str], ...]
    address: str
    port: int
    phone: bool
    note: str = ""
    asked: bool = False


class TrackersDialog(QDialog):
    """The page with the cards; all known ports are listened on while it is open.

    Signals:
        chosen: the id of the card to show.
        use_requested: listen to what is heard from now on.
        practice_requested: begin without a tracker.
        phone_chosen: the address of a phone to be asked for its face; "" for none.
        opened, closed: the page is shown, and no longer.
    """

    chosen = Signal(str)
    use_requested = Signal()
    practice_requested = Signal()
    phone_chosen = Signal(str)
    opened = Signal()
    closed = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("trackers")
        self.setWindowTitle(self.tr("How are you tracked?"))
        self.setModal(True)
        self._tiles: dict[str, QToolButton] = {}
        self._group = QButtonGroup(self)
        self._list = QVBoxLayout()
        self._list.setSpacing(theme.TIGHT)
        self._card = Card()
        self.webcam = WebcamPane()
        self.webcam.finished.connect(self.accept)
        self._pages = QStackedWidget()
        self._title = label("", "title", "tracker_title")
        self._steps = [(StepPicture(), label("", "", f"tracker_step_{i + 1}")) for i in range(3)]
        self.code = PhoneCode()
        self.address = label("", "title", "tracker_address")
        self.address.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._phone_words = label(
            self.tr("Scan it with the phone's camera, copy the address, and paste it into the app."), "muted"
        )
        self._phone_words.setWordWrap(True)
        self.phone = PhoneRow()
        self.phone.chosen.connect(self.phone_chosen)
        self.phone.button.setAutoDefault(False)
        self._note = label("", "caption", "tracker_note")
        self._note.setWordWrap(True)
        self._light = Picture("mdi6.circle-outline", 18)
        self.heard = label("", "", "tracker_heard")
        self.heard.setWordWrap(True)
        self.use = QPushButton(self.tr("Use this tracker"))
        self.use.setObjectName("use_tracker")
        theme.as_role(self.use, "primary")
        self.use.clicked.connect(self.use_requested)
        self._lay_out()
        self.finished.connect(lambda _result: self.closed.emit())

    def open_page(self) -> None:
        """Show the page over the window."""
        self.open()
        self.opened.emit()

    def show_tiles(self, tiles: Sequence[tuple[str, str]]) -> None:
        """List the trackers as (id, title); once."""
        for place, (tracker, title) in enumerate(tiles):
            tile = QToolButton()
            tile.setObjectName(f"tracker_{tracker}")
            tile.setText(title)
            tile.setCheckable(True)
            tile.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
            tile.setMinimumSize(200, 34)
            tile.setSizePolicy(self._card.sizePolicy().horizontalPolicy(), tile.sizePolicy().verticalPolicy())
            tile.clicked.connect(lambda _checked=False, one=tracker: self.chosen.emit(one))
            theme.set_icon(tile, "mdi6.circle-outline", "disabled")
            self._group.addButton(tile)
            self._tiles[tracker] = tile
            self._list.insertWidget(place, tile)

    def show_card(self, card: TrackerCard) -> None:
        """Show a tracker's steps."""
        self._tiles[card.id].setChecked(True)
        self._pages.setCurrentWidget(self._card)
        self._title.setText(card.title)
        for number, ((picture, words), (kind, text)) in enumerate(
            zip(self._steps, card.steps, strict=True), 1
        ):
            picture.show_step(kind, card.address, card.port)
            words.setText(f"{number}.  {text}")
        self.code.show_text(card.address if card.phone else "")
        for part in (self.code, self._phone_words):
            part.setVisible(card.phone and not card.asked and bool(card.address))
        self.address.setVisible(not card.asked)
        self.phone.setVisible(card.asked)
        self.address.setText(self.tr("{0}  port {1}").format(card.address, card.port))
        self._note.setText(card.note)
        self._note.setVisible(bool(card.note))

    def show_webcam(self) -> None:
        """Show the webcam's page in place of a tracker's steps."""
        self._tiles[WEBCAM].setChecked(True)
        self._pages.setCurrentWidget(self.webcam)

    def show_heard(self, trackers: frozenset[str], sentence: str, heard: bool) -> None:
        """Light the tiles of trackers that are heard, and say what comes in for the one shown.

        Args:
            trackers: ids of those heard.
            sentence: what is heard, or waited for.
            heard: whether the one shown is.
        """
        for tracker, tile in self._tiles.items():
            on = tracker in trackers
            icon = ("mdi6.check-circle", "good") if on else ("mdi6.circle-outline", "disabled")
            if tile.property("heard") != on:
                tile.setProperty("heard", on)
                tile.setAccessibleDescription(self.tr("I hear it") if on else "")
                theme.set_icon(tile, *icon)
        self._light.set_icon(*(("mdi6.check-circle", "good") if heard else ("mdi6.ear-hearing", "muted")))
        self.heard.setText(sentence)
        theme.as_role(self.heard, "good" if heard else "muted")
        self.use.setEnabled(heard)

    def _lay_out(self) -> None:
        practice = QPushButton(self.tr("No tracker? Practice performer"))
        practice.setObjectName("tracker_practice")
        theme.as_role(practice, "quiet")
        # Enter presses what a dialog holds first, otherwise.
        practice.setAutoDefault(False)
        practice.setToolTip(self.tr("Speaks and moves like a tracked person, without any hardware."))
        practice.clicked.connect(self.practice_requested)
        self._list.addStretch(1)
        self._list.addWidget(practice)
        body = self._card.body
        body.addWidget(self._title)
        steps = QHBoxLayout()
        steps.setSpacing(theme.BETWEEN)
        for picture, words in self._steps:
            words.setWordWrap(True)
            words.setAlignment(Qt.AlignmentFlag.AlignTop)
            words.setMinimumHeight(72)
            column = QVBoxLayout()
            column.addWidget(picture)
            column.addWidget(words, 1)
            steps.addLayout(column, 1)
        body.addLayout(steps)
        where = QHBoxLayout()
        where.setSpacing(theme.BETWEEN)
        where.addWidget(self.code, 0, Qt.AlignmentFlag.AlignTop)
        texts = QVBoxLayout()
        for part in (self.phone, self.address, self._phone_words, self._note):
            texts.addWidget(part)
        texts.addStretch(1)
        where.addLayout(texts, 1)
        body.addLayout(where)
        body.addStretch(1)
        light = QHBoxLayout()
        light.setSpacing(theme.INSIDE)
        light.addWidget(self._light)
        light.addWidget(self.heard, 1)
        close = QPushButton(self.tr("Close"))
        close.setAutoDefault(False)
        close.clicked.connect(self.reject)
        light.addWidget(close)
        light.addWidget(self.use)
        body.addLayout(light)
        row = QHBoxLayout(self)
        row.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        row.setSpacing(theme.BETWEEN)
        row.addLayout(self._list)
        for page in (self._card, self.webcam):
            self._pages.addWidget(page)
        row.addWidget(self._pages, 1)
        self.resize(900, 540)
