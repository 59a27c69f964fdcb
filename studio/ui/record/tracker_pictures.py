"""Pictures of the tracker cards, painted in the theme's colours: the steps, and the code for a phone."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from studio.ui import theme

_SIZE = QSize(190, 112)
_QUIET_ZONE = 3
"""Light modules around a code, without which cameras do not find it."""


class StepPicture(QWidget):
    """What one step looks like: the program's window or the phone, and where the hand goes."""

    def __init__(self) -> None:
        super().__init__()
        self._kind, self._address, self._port = "switch", "", 0
        self.setFixedHeight(_SIZE.height())
        self.setMinimumWidth(110)

    def sizeHint(self) -> QSize:
        return _SIZE

    def show_step(self, kind: str, address: str, port: int) -> None:
        """Show a step of a tracker; `kind` as in studio.capture.trackers."""
        self._kind, self._address, self._port = kind, address, port
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("ground"))
        painter.drawRoundedRect(QRectF(self.rect()), 6, 6)
        # Drawn on a sheet of 160 x 100 and scaled, so that small windows cut nothing off.
        scale = min(self.width() / 170, self.height() / 106)
        painter.translate(self.width() / 2, self.height() / 2)
        painter.scale(scale, scale)
        painter.translate(-80, -50)
        draw = {
            "switch": self._switch, "address": self._fields, "move": self._move,
            "phone": self._phone_app, "phone_address": self._phone_fields, "phone_face": self._phone_face,
            "phone_shows": self._phone_shows, "program": self._program,
        }  # fmt: skip
        draw[self._kind](painter)

    def _switch(self, painter: QPainter) -> None:
        _window(painter, QRectF(14, 8, 132, 84))
        _bar(painter, 26, 34, 60)
        _bar(painter, 26, 66, 44)
        _words(painter, QRectF(26, 44, 60, 16), "VMC", "text", 12, semibold=True)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("accent"))
        painter.drawRoundedRect(QRectF(98, 43, 34, 18), 9, 9)
        painter.setBrush(theme.colour("on_accent"))
        painter.drawEllipse(QPointF(123, 52), 6.5, 6.5)
        _ring(painter, QPointF(115, 52), 24)

    def _fields(self, painter: QPainter) -> None:
        _window(painter, QRectF(14, 8, 132, 84))
        _field(painter, QRectF(26, 34, 108, 21), self._address or "127.0.0.1")
        _field(painter, QRectF(26, 62, 108, 21), str(self._port))

    def _move(self, painter: QPainter) -> None:
        _face(painter, QPointF(40, 48), 25)
        _arrow(painter, 74, 98, 50)
        _window(painter, QRectF(104, 22, 50, 56))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("good"))
        painter.drawEllipse(QPointF(129, 56), 11, 11)
        _tick(painter, QPointF(129, 56))

    def _phone_app(self, painter: QPainter) -> None:
        _phone(painter, QRectF(54, 4, 52, 92))
        _face(painter, QPointF(80, 48), 16)
        painter.setPen(_pen("accent", 2.5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for side in (7, 14, 21):
            painter.drawArc(QRectF(132 - side, 30 - side, 2 * side, 2 * side), 45 * 16, 90 * 16)

    def _phone_fields(self, painter: QPainter) -> None:
        _phone(painter, QRectF(10, 4, 140, 92))
        _field(painter, QRectF(24, 24, 112, 22), self._address or "…")
        _field(painter, QRectF(24, 54, 112, 22), str(self._port))

    def _phone_shows(self, painter: QPainter) -> None:
        _phone(painter, QRectF(10, 4, 140, 92))
        _bar(painter, 24, 26, 64)
        _field(painter, QRectF(24, 40, 112, 22), self._address)

    def _program(self, painter: QPainter) -> None:
        _window(painter, QRectF(14, 8, 132, 84))
        _face(painter, QPointF(80, 57), 24)

    def _phone_face(self, painter: QPainter) -> None:
        _face(painter, QPointF(36, 50), 25)
        _phone(painter, QRectF(84, 16, 34, 66))
        _face(painter, QPointF(101, 47), 10)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("good"))
        painter.drawEllipse(QPointF(138, 50), 11, 11)
        _tick(painter, QPointF(138, 50))


class PhoneCode(QWidget):
    """A QR code that a phone's camera reads: this computer's address, to be pasted into the app."""

    def __init__(self) -> None:
        super().__init__()
        self._text = ""
        self._modules: tuple[bytes, ...] = ()
        self.setFixedSize(112, 112)

    @property
    def text(self) -> str:
        """What a phone reads."""
        return self._text

    def show_text(self, text: str) -> None:
        """Show a text as a code; "" shows none."""
        if text == self._text:
            return
        self._text, self._modules = text, _modules(text) if text else ()
        self.setAccessibleName(text)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        if not self._modules:
            return
        painter = QPainter(self)
        # Black on white in both themes: not every camera reads an inverted code.
        painter.fillRect(self.rect(), QColor("white"))
        count = len(self._modules) + 2 * _QUIET_ZONE
        side = self.width() // count
        left = (self.width() - side * count) // 2 + side * _QUIET_ZONE
        for y, row in enumerate(self._modules):
            for x, dark in enumerate(row):
                if dark:
                    painter.fillRect(left + x * side, left + y * side, side, side, QColor("black"))


def _modules(text: str) -> tuple[bytes, ...]:
    """Rows of a QR code, 1 for a dark module."""
    # Not at the top: only those who open a phone's card need it.
    import segno

    return tuple(bytes(row) for row in segno.make_qr(text, error="m").matrix)


def _pen(token: str, width: float, style: Qt.PenStyle = Qt.PenStyle.SolidLine) -> QPen:
    return QPen(theme.colour(token), width, style, Qt.PenCapStyle.RoundCap)


def _window(painter: QPainter, box: QRectF) -> None:
    painter.setPen(_pen("muted", 1.5))
    painter.setBrush(theme.colour("raised"))
    painter.drawRoundedRect(box, 5, 5)
    painter.drawLine(QPointF(box.left(), box.top() + 14), QPointF(box.right(), box.top() + 14))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(theme.colour("muted"))
    for i in range(3):
        painter.drawEllipse(QPointF(box.left() + 8 + 7 * i, box.top() + 7), 1.8, 1.8)


def _phone(painter: QPainter, box: QRectF) -> None:
    painter.setPen(_pen("muted", 2))
    painter.setBrush(theme.colour("raised"))
    painter.drawRoundedRect(box, 8, 8)
    painter.drawLine(
        box.center() + QPointF(-6, box.height() / 2 - 5), box.center() + QPointF(6, box.height() / 2 - 5)
    )


def _face(painter: QPainter, middle: QPointF, radius: float) -> None:
    painter.setPen(_pen("text", max(radius / 11, 1.2)))
    painter.setBrush(theme.colour("accent_soft"))
    painter.drawEllipse(middle, radius * 0.86, radius)
    for side in (-1, 1):
        eye = middle + QPointF(side * radius * 0.33, -radius * 0.2)
        painter.drawLine(eye - QPointF(0, radius * 0.08), eye + QPointF(0, radius * 0.08))
    mouth = QRectF(-radius * 0.4, 0, radius * 0.8, radius * 0.55).translated(middle)
    painter.drawArc(mouth, 200 * 16, 140 * 16)


def _arrow(painter: QPainter, start: float, end: float, y: float) -> None:
    painter.setPen(_pen("accent", 3))
    painter.drawLine(QPointF(start, y), QPointF(end, y))
    for side in (-6, 6):
        painter.drawLine(QPointF(end, y), QPointF(end - 7, y + side))


def _tick(painter: QPainter, middle: QPointF) -> None:
    painter.setPen(_pen("ground", 2.5))
    painter.drawLine(middle + QPointF(-5, 0), middle + QPointF(-1.5, 4))
    painter.drawLine(middle + QPointF(-1.5, 4), middle + QPointF(5, -4))


def _ring(painter: QPainter, middle: QPointF, radius: float) -> None:
    painter.setPen(_pen("accent", 1.5, Qt.PenStyle.DashLine))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawEllipse(middle, radius, radius * 0.75)


def _bar(painter: QPainter, x: float, y: float, width: float) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(theme.colour("line"))
    painter.drawRoundedRect(QRectF(x, y, width, 5), 2.5, 2.5)


def _field(painter: QPainter, place: QRectF, words: str) -> None:
    """A field that is filled in."""
    painter.setPen(_pen("accent", 1.5))
    painter.setBrush(theme.colour("ground"))
    painter.drawRoundedRect(place, 4, 4)
    _words(painter, place.adjusted(6, 0, -4, 0), words, "text", 12, semibold=True)


def _words(
    painter: QPainter, box: QRectF, text: str, token: str, pixels: int, semibold: bool = False
) -> None:
    painter.setPen(theme.colour(token))
    painter.setFont(theme.ui_font(pixels, semibold=semibold))
    painter.drawText(box, int(Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft), text)
