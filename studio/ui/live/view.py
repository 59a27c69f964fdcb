"""The Live tab: who performs, the avatar as it is sent, where it is sent to, and how late it is."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QScrollArea,
    QSplitter,
    QStackedLayout,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.live.controls import Controls
from studio.ui.live.latency_card import LatencyCard
from studio.ui.live.source_card import SourceCard
from studio.ui.review.send_panel import SendPanel
from studio.ui.widgets.card import Card, EmptyState, Picture, label
from studio.ui.widgets.drawn_face import DrawnFace
from studio.ui.widgets.figure import StickFigure
from studio.ui.widgets.shape_meters import ShapeMeters

FACE = QSize(140, 140)


class LiveView(QWidget):
    """The tab's layout.

    Signals:
        train_requested: there is no run yet.
    """

    train_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.empty = EmptyState(
            "mdi6.account-voice",
            self.tr("Live lets your avatar speak with you, now. It needs a run trained on your takes."),
            self.tr("Train a run"),
            "live_go_train",
        )
        self.empty.clicked.connect(self.train_requested)
        room = QWidget()
        self._stack = QStackedLayout(self)
        self._stack.addWidget(self.empty)
        self._stack.addWidget(room)
        outer = QHBoxLayout(room)
        outer.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        columns = QSplitter(Qt.Orientation.Horizontal)
        columns.setObjectName("live_columns")
        columns.setHandleWidth(12)
        columns.setChildrenCollapsible(False)
        for part in (self._left(), self._middle(), self._right()):
            columns.addWidget(part)
        columns.setStretchFactor(1, 1)
        columns.setSizes([310, 640, 300])
        outer.addWidget(columns)
        self.figure.installEventFilter(self)
        for box in self.findChildren(QComboBox):
            self.controls.heed_keys_of(box)

    def show_empty(self, empty: bool) -> None:
        """Show the empty state, or the room."""
        self._stack.setCurrentIndex(0 if empty else 1)

    def show_status(self, words: str, health: str = "") -> None:
        """The sentence under the avatar; health is "good", "warn", "bad" or ""."""
        icons = {"good": "mdi6.check-circle", "warn": "mdi6.alert", "bad": "mdi6.alert-circle"}
        self._light.set_icon(icons.get(health, "mdi6.circle-outline"), health or "disabled")
        if words != self.status.text():
            self.status.setText(words)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is self.figure and isinstance(event, QResizeEvent):
            self.face.move(theme.INSIDE, event.size().height() - FACE.height() - theme.INSIDE)
        return False

    def _left(self) -> QWidget:
        self.source, self.latency = SourceCard(), LatencyCard()
        inner = QWidget()
        inner.setObjectName("scrolled")
        column = QVBoxLayout(inner)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE + theme.TIGHT)
        column.addWidget(self.source)
        column.addWidget(self.latency)
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(inner)
        scroll.setMinimumWidth(300)
        return scroll

    def _middle(self) -> QWidget:
        self.figure = StickFigure(None, self.tr("Press Go live, and speak: your avatar moves here."))
        self.figure.setObjectName("live_figure")
        self.face = DrawnFace(self.figure)
        self.face.resize(FACE)
        self.face.hide()
        self.controls = Controls()
        self._light = Picture("mdi6.circle-outline", 14)
        self.status = label("", "muted", "live_status")
        self.status.setWordWrap(True)
        line = QHBoxLayout()
        line.setSpacing(theme.INSIDE)
        line.addWidget(self._light)
        line.addWidget(self.status, 1)
        card = Card()
        card.body.addWidget(self.figure, 1)
        card.body.addLayout(line)
        card.body.addWidget(self.controls)
        return card

    def _right(self) -> QWidget:
        self.send = SendPanel()
        send = Card(self.tr("Send"))
        send.body.addWidget(self.send)
        self.meters = ShapeMeters()
        self.meters.list.sentence = self.tr("The face appears here while you are live.")
        meters = Card()
        meters.body.addWidget(self.meters)
        column = QSplitter(Qt.Orientation.Vertical)
        column.setObjectName("live_right")
        column.setHandleWidth(12)
        column.setChildrenCollapsible(False)
        column.addWidget(send)
        column.addWidget(meters)
        column.setSizes([360, 340])
        column.setMinimumWidth(280)
        column.setMaximumWidth(460)
        return column
