"""Five stars to click, or to set with the arrow keys and the digits 0 to 5."""

from __future__ import annotations

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFont, QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.ui import theme

STAR_PX = 20
MOST = 5


class StarEdit(QWidget):
    """How good a take is, as 0 to 5 stars.

    Signals:
        stars_changed: the number chosen by hand.
    """

    stars_changed = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setToolTip(self.tr("Click to rate; click the first star again for none"))
        self.stars = 0
        self.show_stars(0)

    def show_stars(self, stars: int) -> None:
        """Show a number of stars."""
        self.stars = stars
        self.setAccessibleName(self.tr("Stars: {0} of 5").format(stars))
        self.update()

    def sizeHint(self) -> QSize:
        """Five stars in a row."""
        return QSize(STAR_PX * MOST + 4, STAR_PX + 8)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the star under the mouse."""
        stars = min(max(int((event.position().x() - 2) // STAR_PX) + 1, 1), MOST)
        self._choose(0 if stars == self.stars == 1 else stars)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Digits set, Up and Down step."""
        step = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}.get(Qt.Key(event.key()))
        if step is not None:
            self._choose(min(max(self.stars + step, 0), MOST))
        elif event.text() in tuple("012345"):
            self._choose(int(event.text()))
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the stars, and a ring where the keyboard is."""
        painter = QPainter(self)
        font = QFont(theme.ui_font())
        font.setPixelSize(STAR_PX)
        painter.setFont(font)
        for i in range(MOST):
            painter.setPen(theme.colour("warn" if i < self.stars else "line"))
            place = QRectF(2 + i * STAR_PX, 0, STAR_PX, self.height())
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, "★")
        if self.hasFocus():
            painter.setPen(theme.colour("accent"))
            painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        painter.end()

    def _choose(self, stars: int) -> None:
        if stars != self.stars:
            self.show_stars(stars)
            self.stars_changed.emit(stars)
