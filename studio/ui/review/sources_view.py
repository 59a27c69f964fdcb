"""The list of what can be reviewed: dropped sounds and takes."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QObject, QPoint, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QAction, QKeyEvent
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QMenu, QPushButton, QWidget

from studio.actions import LIST
from studio.ui import theme
from studio.ui.review.clip import ReviewItem
from studio.ui.shortcuts import pressed
from studio.ui.widgets.card import Card, label
from studio.ui.widgets.timeline.time_view import minutes


class ReviewListCard(Card):
    """The list with its button.

    Signals:
        chosen: key of the source clicked.
        add_requested: choose sound files.
        batch_requested: make motion of many at once.
        removed: key of a dropped sound that is to go.
    """

    chosen = Signal(str)
    add_requested = Signal()
    batch_requested = Signal()
    removed = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(self.tr("Sources"), parent)
        self.list = QListWidget()
        self.list.setObjectName("sources")
        self.list.setAccessibleName(self.tr("Sources"))
        self.list.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.list.currentItemChanged.connect(self._on_chosen)
        self._remove = QAction(self.tr("Remove from the list"), self.list)
        self._remove.setObjectName("remove_sound")
        theme.set_icon(self._remove, "mdi6.trash-can-outline", "muted")
        self._remove.triggered.connect(self._on_remove)
        self.list.installEventFilter(self)
        self.list.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.list.customContextMenuRequested.connect(self._on_menu)
        self.body.addWidget(self.list, 1)
        add = QPushButton(self.tr("Add a sound"))
        add.setObjectName("add_sound")
        theme.set_icon(add, "mdi6.plus", "muted")
        add.clicked.connect(self.add_requested)
        self.body.addWidget(add)
        batch = QPushButton(self.tr("Batch…"))
        batch.setObjectName("batch_button")
        batch.setToolTip(self.tr("Make motion of a whole folder of sounds, or export all takes"))
        theme.set_icon(batch, "mdi6.playlist-play", "muted")
        batch.clicked.connect(self.batch_requested)
        self.body.addWidget(batch)
        hint = label(self.tr("or drop WAV, MP3, FLAC, OGG, M4A or a video here"), "caption")
        hint.setWordWrap(True)
        hint.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.body.addWidget(hint)
        self.setMinimumWidth(170)
        self.setMaximumWidth(420)

    def show_sources(self, sources: Sequence[ReviewItem], chosen: str) -> None:
        """Fill the list."""
        icons = {kind: theme.icon(f"mdi6.{kind}", "muted") for kind in ("account-voice", "music-note")}
        # Filling it is no choice of a person: what is shown stays.
        with QSignalBlocker(self.list):
            self.list.clear()
            for source in sources:
                length = f"   {minutes(source.duration)}" if source.duration else ""
                item = QListWidgetItem(source.title + length)
                item.setData(Qt.ItemDataRole.UserRole, source.key)
                item.setIcon(icons["account-voice" if source.take else "music-note"])
                item.setToolTip(item.text())
                item.setSizeHint(QSize(0, 32))
                self.list.addItem(item)
                if source.key == chosen:
                    self.list.setCurrentItem(item)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Delete on the list removes a dropped sound."""
        if watched is self.list and isinstance(event, QKeyEvent) and pressed(event, LIST) == "remove_sound":
            if event.type() == QEvent.Type.KeyPress:
                self._on_remove()
            return True
        return super().eventFilter(watched, event)

    def _on_menu(self, place: QPoint) -> None:
        """Offer to remove a dropped sound; takes are removed in Curate."""
        item = self.list.itemAt(place)
        if item is not None and _is_sound(item):
            menu = QMenu(self)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            menu.addAction(self._remove)
            # Not exec: no event loop of its own on top of the window's.
            menu.popup(self.list.viewport().mapToGlobal(place))

    def _on_remove(self) -> None:
        item = self.list.currentItem()
        if item is not None and _is_sound(item):
            self.removed.emit(str(item.data(Qt.ItemDataRole.UserRole)))

    def _on_chosen(self, item: QListWidgetItem | None) -> None:
        if item is not None:
            self.chosen.emit(str(item.data(Qt.ItemDataRole.UserRole)))


def _is_sound(item: QListWidgetItem) -> bool:
    return str(item.data(Qt.ItemDataRole.UserRole)).startswith("sound:")
