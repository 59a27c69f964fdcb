"""A performer: a figure with a small face in its corner, or a large face where there are no bones."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QStackedLayout, QVBoxLayout, QWidget

from studio.motion.avatar import Avatar
from studio.render.background import ROOM, Background
from studio.render.world_pose import WorldPose
from studio.ui import theme
from studio.ui.widgets.figure.figure import StickFigure
from studio.ui.widgets.figure.picture import background_image, draw_checkers
from studio.ui.widgets.figure.sketch import DrawnFace, draw_ground

FACE_SIDE = 132
FACE_MARGIN = 10
FACE_SHARE = 1 / 3
"""Of the picture's shorter side that the small face takes; as many pixels at most."""
LARGE_FACE = 380
CAPTION_HEIGHT, LINE_PX = 26, 2
TERMS_HEIGHT = 48
"""What stands along a picture's lower edge while an avatar is worn: its name and what its file allows."""


class _Caption(QWidget):
    """The word over a performer, in a line of its own: over the picture it lay on the head.

    Attributes:
        words: all of it; what has no room is cut where it is drawn.
    """

    def __init__(self, words: str) -> None:
        super().__init__()
        self.words = words
        self.token = "figure"
        self.setFixedHeight(CAPTION_HEIGHT)
        # Never shown here: without a parent yet it would be a window of its own for a moment.
        if not words:
            self.hide()

    def set_token(self, token: str) -> None:
        """Lie over a line of another colour: captured and predicted are told apart without words."""
        self.token = token
        self.update()

    def set_words(self, words: str) -> None:
        """Say something else; "" keeps the line, empty."""
        if words != self.words:
            self.words = words
            self.setToolTip(words)
            self.setAccessibleName(words)
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), theme.colour("sky"))
        if self.words:
            line = self.rect().adjusted(0, CAPTION_HEIGHT - LINE_PX, 0, 0)
            painter.fillRect(line, theme.colour(self.token))
        painter.setFont(theme.ui_font(semibold=True))
        painter.setPen(theme.colour("muted"))
        room = self.rect().adjusted(14, 2, -8, -LINE_PX)
        short = painter.fontMetrics().elidedText(self.words, Qt.TextElideMode.ElideMiddle, room.width())
        painter.drawText(room, int(Qt.AlignmentFlag.AlignVCenter), short)


class _FaceRoom(QWidget):
    """A large face, for motion without bones."""

    def __init__(self, token: str) -> None:
        super().__init__()
        self.face = DrawnFace(self)
        self.face.set_token(token)
        self.setMinimumSize(160, 160)
        self.background, self.checkered = ROOM, True

    def resizeEvent(self, event: QResizeEvent) -> None:
        side = int(min(min(self.width(), self.height()) * 0.8, LARGE_FACE))
        self.face.setGeometry((self.width() - side) // 2, (self.height() - side) // 2, side, side)
        super().resizeEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter, rect = QPainter(self), QRectF(self.rect())
        if self.background.is_clear and self.checkered:
            draw_checkers(painter, rect, theme.colour("surface"), theme.colour("raised"))
        elif self.background.is_room:
            draw_ground(painter, rect)
        elif not self.background.is_clear:
            size = (self.width(), self.height())
            painter.drawImage(rect, background_image(self.background, size, theme.colours()))


class Pane(QWidget):
    """One performer: a figure with a small face, or a large face where there are no bones.

    Args:
        name, caption: of the object, and the word over it.
        empty_text, empty_icon: for a room without anybody.
        token: the colour of the face.
        face_share: how large the small face is, see FACE_SHARE.
    """

    def __init__(
        self,
        name: str,
        caption: str,
        empty_text: str,
        empty_icon: str,
        token: str,
        face_share: float = FACE_SHARE,
    ) -> None:
        super().__init__()
        self.setObjectName(name)
        self._face_share = face_share
        self.figure = StickFigure(empty_text=empty_text, empty_icon=empty_icon)
        self.figure.setObjectName(f"{name}_figure")
        self.figure.view_buttons_shown = False
        self.face = DrawnFace(self.figure)
        self.face.set_token(token)
        self.face.resize(FACE_SIDE, FACE_SIDE)
        self.room = _FaceRoom(token)
        self.caption = _Caption(caption)
        self._wanted_caption = caption
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(self.caption)
        self._stack = QStackedLayout()
        column.addLayout(self._stack, 1)
        self._stack.addWidget(self.figure)
        self._stack.addWidget(self.room)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def set_token(self, token: str) -> None:
        """The colour of figure, face and caption: a token of the theme."""
        self.figure.set_token(token)
        self.caption.set_token(token)
        self.face.set_token(token)
        self.room.face.set_token(token)

    def set_background(self, background: Background) -> None:
        """What is behind the performer."""
        self.figure.set_background(background)
        self.room.background = background
        self.room.update()

    def set_see_through(self) -> None:
        """In a transparent window: nothing stands for nothing, and the mouse is the window's."""
        self.figure.checkered = self.room.checkered = False
        self.figure.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent, False)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def set_caption(self, caption: str) -> None:
        """A word over it, shown while there is something to see."""
        self._wanted_caption = caption
        empty = self._stack.currentIndex() == 0 and self.figure.empty
        self.caption.set_words("" if empty else caption)

    def show_nothing(self, sentence: str, icon: str = "") -> None:
        """An empty room with a sentence."""
        self._stack.setCurrentIndex(0)
        self.face.show_values(None)
        self.figure.clear(sentence, icon)
        self.figure.setAccessibleDescription(sentence)
        self.caption.set_words("")

    def show_stance(self, stance: WorldPose) -> None:
        """Show a performer, as the avatar where one is worn; bones or shapes may be missing."""
        worn = self.figure.avatar
        self.figure.set_close(worn is not None and worn.has_face and not len(stance.joints))
        if worn is not None and not len(stance.joints):
            stance = replace(WorldPose.rest_pose(worn.skeleton), shapes=stance.shapes, t=stance.t)
        self.caption.set_words(self._wanted_caption)
        if len(stance.joints):
            self._stack.setCurrentIndex(0)
            self.figure.setAccessibleDescription("")
            self.figure.show_stance(stance)
            own = worn is not None and worn.has_face
            self.face.show_values(stance.shapes if stance.shapes and not own else None)
            self._place_face()
        else:
            self._stack.setCurrentIndex(1)
            self.room.face.show_values(stance.shapes)

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Wear an avatar, which shows its own face where its file has one; None for the stick figure."""
        self.figure.set_avatar(avatar)
        self._place_face()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_face()

    def _place_face(self) -> None:
        most = int(self._face_share * min(self.figure.height(), self.width()))
        side = max(min(FACE_SIDE, most), 64)
        lift = TERMS_HEIGHT if self.figure.avatar is not None else FACE_MARGIN
        self.face.setGeometry(FACE_MARGIN, self.figure.height() - side - lift, side, side)
