"""The button in a picture's corner that chooses an avatar, and what its file allows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QAction, QActionGroup, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QMenu, QSizePolicy, QToolButton, QWidget

from studio.motion.avatar import Avatar
from studio.ui import theme
from studio.ui.language import sentences
from studio.ui.widgets.card import label
from studio.ui.widgets.figure.pane import FACE_SIDE

LONGEST_NAME = 24
LEAST_TERMS = 160
"""Pixels; cut shorter than that, what a file allows says nothing."""


class AvatarButton(QWidget):
    """A menu button: no avatar, those of the project, those used lately, and any other file.

    Args:
        parent: the picture it stands on.
        prefix: begins the names of its parts, where a window has several.
        brief: the button alone; its tip says what the file allows.

    Signals:
        wanted: a Path, or None for the stick figure.
        browse_requested: choose a file.
        faces_requested: see the avatar's faces and what moves them.
        menu_opening: the menu is about to be seen; fill it by `show_choices`.
    """

    wanted = Signal(object)
    browse_requested = Signal()
    faces_requested = Signal()
    menu_opening = Signal()

    def __init__(self, parent: QWidget | None = None, prefix: str = "", brief: bool = False) -> None:
        super().__init__(parent)
        self.button = QToolButton()
        self.button.setObjectName(f"{prefix}avatar_button")
        self.button.setText(self.tr("Avatar"))
        self.button.setToolTip(self.tr("Choose who is seen: your avatar (.vrm), Saia or the stick figure"))
        self.button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        theme.set_icon(self.button, "mdi6.account-box-outline", "muted")
        theme.as_role(self.button, "chip")
        self.menu = QMenu(self.button)
        self.menu.setToolTipsVisible(True)
        self.button.setMenu(self.menu)
        self.menu.aboutToShow.connect(self.menu_opening)
        self.terms: QLabel = label("", "caption", f"{prefix}avatar_terms")
        self.terms.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.terms.setTextFormat(Qt.TextFormat.PlainText)
        self.terms.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self._text, self._faced, self._brief, self._free = "", False, brief, False
        if brief:
            self.terms.hide()
        row = self._row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        row.addWidget(self.terms, 1)
        row.addWidget(self.button)

    def show_choices(self, own: Sequence[Path], recent: Sequence[Path], chosen: Path | None) -> None:
        """Fill the menu.

        Args:
            own: avatars of the project.
            recent: avatars elsewhere that were used lately.
            chosen: which of the project's is worn, None for the stick figure.
        """
        self.menu.clear()
        group = QActionGroup(self.menu)
        self._choice(group, self.tr("None (stick figure)"), None, chosen is None)
        for path in own:
            self._choice(group, path.stem, path, path == chosen)
        if recent:
            self.menu.addSection(self.tr("Recent"))
        for path in recent:
            action = self.menu.addAction(path.stem)
            action.setToolTip(str(path))
            action.triggered.connect(lambda _=False, p=path: self.wanted.emit(p))
        self.menu.addSeparator()
        browse = self.menu.addAction(self.tr("Open a VRM avatar…"))
        browse.setObjectName("avatar_browse")
        browse.triggered.connect(lambda _=False: self.browse_requested.emit())
        faces = self.menu.addAction(self.tr("Face shapes…"))
        faces.setObjectName("avatar_faces")
        faces.setEnabled(self._faced)
        faces.setToolTip(
            self.tr("See each face your avatar can make, and choose what moves it")
            if self._faced
            else self.tr("An avatar with a face has some; choose one first")
        )
        faces.triggered.connect(lambda _=False: self.faces_requested.emit())

    def show_avatar(self, avatar: Avatar | None) -> None:
        """Name what is worn and what its file allows."""
        self._faced = avatar is not None and avatar.has_face
        # Where nobody has to heed anything, the words would only lie over the performer.
        self._free = avatar is not None and avatar.licence.free and not avatar.notes
        name = avatar.name if avatar else ""
        name = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
        self.button.setText(self.tr("Avatar: {0}").format(name) if avatar else self.tr("Avatar"))
        self._row.invalidate()
        self._row.activate()  # it stands in no layout that would ask it to
        self._show_text(sentences(avatar.licence.line, *avatar.notes) if avatar else "")
        if (around := self.parentWidget()) is not None:
            self.place(around.size())

    def show_busy(self, name: str) -> None:
        """An avatar is being opened."""
        self._free = False
        self._show_text(self.tr("Opening {0}…").format(name))

    def place(self, room: QSize) -> None:
        """Stand in the lower right corner of a picture, beside its small face."""
        left = min(FACE_SIDE, room.height() // 3, room.width() // 3) + theme.BETWEEN
        if self._brief:
            left = max(left, room.width() - self.button.sizeHint().width() - theme.INSIDE)
        height = self.sizeHint().height()
        bottom = room.height() - height - theme.INSIDE
        self.setGeometry(left, bottom, room.width() - left - theme.INSIDE, height)

    @property
    def said(self) -> str:
        """What stands beside the button, all of it."""
        return self._text

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_text(self._text)

    def paintEvent(self, event: QPaintEvent) -> None:
        """A soft ground behind the words, which stand over the picture."""
        super().paintEvent(event)
        if self._brief or not self.terms.text():
            return
        wide = self.terms.fontMetrics().horizontalAdvance(self.terms.text()) + 2 * theme.INSIDE
        rect = QRectF(self.terms.geometry())
        rect.setLeft(rect.right() - wide + theme.INSIDE)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("surface", 200))
        painter.drawRoundedRect(rect.adjusted(0, 3, theme.TIGHT, -3), theme.RADIUS, theme.RADIUS)
        painter.end()

    def _show_text(self, text: str) -> None:
        """Text next to the button, cut where there is no room; the tip has them all."""
        self._text = text
        room = max(self.width() - self.button.sizeHint().width() - 2 * theme.BETWEEN, 0)
        short = self.terms.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, room)
        self.terms.setText(short if room >= LEAST_TERMS and not self._free else "")
        self.setToolTip(text)

    def _choice(self, group: QActionGroup, text: str, path: Path | None, checked: bool) -> None:
        action = QAction(text.replace("&", "&&"), group)
        action.setCheckable(True)
        action.setChecked(checked)
        action.triggered.connect(lambda _=False: self.wanted.emit(path))
        self.menu.addAction(action)
