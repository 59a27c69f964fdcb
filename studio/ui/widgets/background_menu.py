"""The menu of backgrounds: the room, transparent, green, any colour, or an image."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QActionGroup, QColor
from PySide6.QtWidgets import QColorDialog, QFileDialog, QMenu, QToolButton, QWidget

from studio.render.background import CLEAR, GREEN, ROOM, Background
from studio.ui import theme

IMAGES = "*.png *.jpg *.jpeg *.webp *.bmp"


class BackgroundMenu(QMenu):
    """What can be behind a performer.

    Args:
        parent: what it belongs to.
        prefix: begins the names of its entries, where a window has several.

    Signals:
        chosen: a background's text, as `Background` has it.
    """

    chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None, prefix: str = "") -> None:
        super().__init__(parent)
        self.setTitle(self.tr("Background"))
        self._text = ROOM.text
        group = QActionGroup(self)
        self._actions: dict[str, QAction] = {}
        for name, title in (
            (ROOM.text, self.tr("Room")),
            (CLEAR.text, self.tr("Transparent")),
            (GREEN, self.tr("Green screen")),
            ("colour", self.tr("Colour…")),
            ("image", self.tr("Image…")),
        ):
            action = QAction(title, group)
            action.setObjectName(f"{prefix}background_{'green' if name == GREEN else name}")
            action.setCheckable(True)
            action.triggered.connect(lambda _=False, name=name: self._on_chosen(name))
            self.addAction(action)
            self._actions[name] = action
        self.show_background(ROOM)

    @property
    def shown_name(self) -> str:
        """What the background that is shown is called."""
        if self._text in self._actions:
            return self._actions[self._text].text()
        return self._text if self._text.startswith("#") else Path(self._text).name

    def show_background(self, background: Background) -> None:
        """Tick one."""
        self._text = background.text
        other = "colour" if background.is_colour else "image"
        self._actions[self._text if self._text in self._actions else other].setChecked(True)

    def _on_chosen(self, name: str) -> None:
        before = Background(self._text)
        # Until it is chosen, the one before is shown.
        self.show_background(before)
        if name == "colour":
            colour = QColorDialog.getColor(
                QColor(self._text if before.is_colour else GREEN), self.parentWidget(), self.tr("Background")
            )
            name = colour.name() if colour.isValid() else ""
        elif name == "image":
            kinds = self.tr("Images ({0})").format(IMAGES)
            name, _ = QFileDialog.getOpenFileName(self.parentWidget(), self.tr("Background"), "", kinds)
        if name:
            self.chosen.emit(name)


class BackgroundButton(QToolButton):
    """A button that names the background and opens the menu.

    Signals:
        chosen: a background's text.
    """

    chosen = Signal(str)

    def __init__(self, prefix: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName(f"{prefix}background")
        self.setAccessibleName(self.tr("Background"))
        self.setToolTip(self.tr("What is behind the performer"))
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        theme.set_icon(self, "mdi6.image-outline", "muted")
        self.background = ROOM
        self.entries = BackgroundMenu(self, prefix)
        self.entries.chosen.connect(self.chosen)
        self.setMenu(self.entries)
        self.show_background(ROOM)

    def show_background(self, background: Background) -> None:
        """Name one and tick it."""
        self.background = background
        self.entries.show_background(background)
        title = self.entries.shown_name
        self.setText(self.fontMetrics().elidedText(title, Qt.TextElideMode.ElideMiddle, 160))
