"""The avatar window: the avatar alone, without a frame, transparent or on a colour, for OBS to capture."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint, QRect, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QCloseEvent,
    QContextMenuEvent,
    QEnterEvent,
    QGuiApplication,
    QKeyEvent,
    QKeySequence,
    QMouseEvent,
    QMoveEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QHBoxLayout, QMenu, QToolButton, QVBoxLayout, QWidget

from studio.render.background import Background
from studio.render.world_pose import WorldPose
from studio.ui import theme
from studio.ui.widgets.background_menu import BackgroundMenu
from studio.ui.widgets.figure.pane import Pane
from studio.ui.widgets.figure.view_buttons import add_framings

EDGE_PX, MARGIN_PX = 12, 24
"""Within which the mouse makes the window larger or smaller, and how far a new one stands from the corner."""
SIZE, LEAST = QSize(420, 560), QSize(160, 160)


class AvatarWindow(QWidget):
    """A window of its own: dragged anywhere, resized at its edges, zoomed with the wheel.

    Signals:
        placed: it stands somewhere else or has another size; carries a QRect.
        on_top_chosen: whether it is to stay in front of all others.
        closed: it was closed.
    """

    placed = Signal(QRect)
    on_top_chosen = Signal(bool)
    closed = Signal()

    def __init__(self, on_top: bool = True) -> None:
        super().__init__(None, Qt.WindowType.Window | Qt.WindowType.FramelessWindowHint)
        self.setObjectName("avatar_window")
        # What OBS lists it as.
        self.setWindowTitle(self.tr("Saia Studio avatar"))
        self.setWindowFlag(Qt.WindowType.WindowStaysOnTopHint, on_top)
        self.setAttribute(Qt.WidgetAttribute.WA_TranslucentBackground)
        # The program ends with its own window, whatever else is open.
        self.setAttribute(Qt.WidgetAttribute.WA_QuitOnClose, False)
        self.setMinimumSize(LEAST)
        self.setMouseTracking(True)
        self.pane = Pane("avatar_window_pane", "", "", "mdi6.human", "figure")
        self.pane.set_see_through()
        self.figure = self.pane.figure
        # A game that loads holds up a picture for seconds: no stick figure in front of viewers for that.
        self.figure.keeps_avatar = True
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.pane)
        self._build_menu(on_top)
        self._build_tools()
        self._edges = Qt.Edge(0)
        self._grabbed: tuple[QPoint, QRect] | None = None
        self._place = QTimer(self)
        self._place.setSingleShot(True)
        self._place.setInterval(400)
        self._place.timeout.connect(lambda: self.placed.emit(self.geometry()))

    def show_stance(self, stance: WorldPose) -> None:
        """Show the performer at this moment; bones or shapes may be missing."""
        self.pane.show_stance(stance)

    def set_background(self, background: Background) -> None:
        """What is behind the avatar."""
        self.pane.set_background(background)

    def set_on_top(self, on_top: bool) -> None:
        """Stay in front of all other windows, or not."""
        self._on_top.setChecked(on_top)
        if on_top != bool(self.windowFlags() & Qt.WindowType.WindowStaysOnTopHint):
            shown, place = self.isVisible(), self.geometry()
            # Another flag makes another window of the system, which comes up hidden.
            self.setWindowFlag(Qt.WindowType.WindowStaysOnTopHint, on_top)
            self.setGeometry(place)
            self.setVisible(shown)

    def stand(self, place: QRect | None) -> None:
        """Stand where it stood, or in the screen's lower right corner where no screen is there any more."""
        screens = [screen.availableGeometry() for screen in QGuiApplication.screens()]
        if place is not None and any(screen.intersects(place) for screen in screens):
            self.setGeometry(QRect(place.topLeft(), place.size().expandedTo(LEAST)))
        elif screens:
            corner = screens[0].bottomRight() - QPoint(SIZE.width() + MARGIN_PX, SIZE.height() + MARGIN_PX)
            self.setGeometry(QRect(corner, SIZE))

    # -- Qt ----------------------------------------------------------------------------------------

    def closeEvent(self, event: QCloseEvent) -> None:
        self._place.stop()
        self.placed.emit(self.geometry())
        super().closeEvent(event)
        self.closed.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.matches(QKeySequence.StandardKey.Cancel):
            self.close()
        else:
            super().keyPressEvent(event)

    def moveEvent(self, event: QMoveEvent) -> None:
        super().moveEvent(event)
        self._place.start()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        wide = self._tools.sizeHint().width()
        self._tools.setGeometry(self.width() - wide - 6, 6, wide, self._tools.sizeHint().height())
        self._place.start()

    def enterEvent(self, event: QEnterEvent) -> None:
        super().enterEvent(event)
        self._show_edge(True)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._show_edge(self._menu.isVisible())

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        self._menu.popup(event.globalPos())

    def wheelEvent(self, event: QWheelEvent) -> None:
        self.figure.set_orbit(self.figure.orbit.zoomed(0.999 ** event.angleDelta().y()))
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            return
        self._edges = self._edges_at(event.position().toPoint())
        handle = self.windowHandle()
        # The system's own way first: it snaps, and Wayland knows no other.
        if handle is not None and (
            handle.startSystemResize(self._edges) if self._edges else handle.startSystemMove()
        ):
            return
        self._grabbed = (event.globalPosition().toPoint(), self.geometry())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._grabbed is None:
            self._show_cursor(self._edges_at(event.position().toPoint()))
            return
        (start, place), now = self._grabbed, event.globalPosition().toPoint()
        moved = now - start
        if not self._edges:
            self.move(place.topLeft() + moved)
            return
        new = QRect(place)
        if self._edges & Qt.Edge.LeftEdge:
            new.setLeft(min(place.left() + moved.x(), place.right() - LEAST.width()))
        if self._edges & Qt.Edge.RightEdge:
            new.setRight(max(place.right() + moved.x(), place.left() + LEAST.width()))
        if self._edges & Qt.Edge.TopEdge:
            new.setTop(min(place.top() + moved.y(), place.bottom() - LEAST.height()))
        if self._edges & Qt.Edge.BottomEdge:
            new.setBottom(max(place.bottom() + moved.y(), place.top() + LEAST.height()))
        self.setGeometry(new)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._grabbed = None

    # -- parts -------------------------------------------------------------------------------------

    def _build_menu(self, on_top: bool) -> None:
        self._menu = QMenu(self)
        add_framings(self._menu, "avatar_window_", lambda: self.figure.seen, self.figure.set_view)
        self._menu.addSeparator()
        self.backgrounds = BackgroundMenu(self._menu, "avatar_window_")
        self._menu.addMenu(self.backgrounds)
        self._on_top = self._menu.addAction(self.tr("Always on top"))
        self._on_top.setObjectName("avatar_window_on_top")
        self._on_top.setCheckable(True)
        self._on_top.setChecked(on_top)
        self._on_top.triggered.connect(self.on_top_chosen)
        self._menu.addSeparator()
        self._menu.addAction(self.tr("Close")).triggered.connect(self.close)
        self._menu.aboutToHide.connect(lambda: self._show_edge(self.underMouse()))

    def _build_tools(self) -> None:
        """The buttons that are seen while the mouse is over the window."""
        self._tools = QWidget(self)
        row = QHBoxLayout(self._tools)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.TIGHT)
        for name, icon, text, do in (
            ("options", "mdi6.dots-horizontal", self.tr("View, background and more"), self._open_menu),
            ("close", "mdi6.close", self.tr("Close"), self.close),
        ):
            button = QToolButton()
            button.setObjectName(f"avatar_window_{name}")
            button.setAccessibleName(text)
            button.setToolTip(text)
            theme.set_icon(button, icon, "text")
            theme.as_role(button, "chip")
            button.clicked.connect(do)
            row.addWidget(button)
        self._edge = _Edge(self)
        self._edge.hide()
        self._tools.hide()

    def _open_menu(self) -> None:
        self._menu.popup(self._tools.mapToGlobal(QPoint(0, self._tools.height())))

    def _show_edge(self, shown: bool) -> None:
        self._edge.resize(self.size())
        self._edge.setVisible(shown)
        self._tools.setVisible(shown)
        self._tools.raise_()

    def _edges_at(self, point: QPoint) -> Qt.Edge:
        found = Qt.Edge(0)
        for near, edge in (
            (point.x() < EDGE_PX, Qt.Edge.LeftEdge),
            (point.x() >= self.width() - EDGE_PX, Qt.Edge.RightEdge),
            (point.y() < EDGE_PX, Qt.Edge.TopEdge),
            (point.y() >= self.height() - EDGE_PX, Qt.Edge.BottomEdge),
        ):
            found = found | edge if near else found
        return found

    def _show_cursor(self, edges: Qt.Edge) -> None:
        across = bool(edges & (Qt.Edge.LeftEdge | Qt.Edge.RightEdge))
        down = bool(edges & (Qt.Edge.TopEdge | Qt.Edge.BottomEdge))
        falling = edges in (Qt.Edge.LeftEdge | Qt.Edge.TopEdge, Qt.Edge.RightEdge | Qt.Edge.BottomEdge)
        shapes = {
            (True, True): Qt.CursorShape.SizeFDiagCursor if falling else Qt.CursorShape.SizeBDiagCursor,
            (True, False): Qt.CursorShape.SizeHorCursor,
            (False, True): Qt.CursorShape.SizeVerCursor,
            (False, False): Qt.CursorShape.OpenHandCursor,
        }
        self.setCursor(shapes[across, down])


class _Edge(QWidget):
    """What shows how large a transparent window is while the mouse is over it."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        # Hardly seen, but something: where a window is nothing at all, clicks go to what is behind it.
        painter.setBrush(theme.colour("ground", 24))
        painter.setPen(QPen(theme.colour("accent"), 1.5, Qt.PenStyle.DashLine))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), theme.RADIUS, theme.RADIUS)
        painter.end()


def place_of(text: str) -> QRect | None:
    """Where it stands, as settings have it, "left,top,width,height"; None where that is none."""
    try:
        left, top, width, height = (int(part) for part in text.split(","))
    except ValueError:
        return None
    return QRect(left, top, width, height) if width > 0 and height > 0 else None


def text_of(place: QRect) -> str:
    """A place as settings have it."""
    return f"{place.x()},{place.y()},{place.width()},{place.height()}"
