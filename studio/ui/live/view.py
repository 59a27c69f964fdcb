"""The Live tab: who performs, the avatar as it is sent, where it is sent to, and how late it is."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QScrollArea, QVBoxLayout, QWidget

from studio.ui import theme
from studio.ui.live.latency_view import LatencyCard
from studio.ui.live.source_view import LiveSourceCard
from studio.ui.live.stage_view import Controls, LiveStage
from studio.ui.live.stream_view import StreamCard
from studio.ui.shortcuts import pressed
from studio.ui.widgets.card import Card, Picture, columns, label, rows
from studio.ui.widgets.meters import ShapeMeters
from studio.ui.widgets.send_panel import SendPanel, TargetRow


class LiveView(QWidget):
    """The tab's layout."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        outer = QHBoxLayout(self)
        outer.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        parts = (self._left(), 310, 0), (self._middle(), 640, 1), (self._right(), 300, 0)
        outer.addWidget(columns("live_columns", *parts))
        for box in self.findChildren(QComboBox):
            self.controls.claim_keys_of(box)
        self.send.row_added.connect(self._on_target)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go back: leave one thing that is held at each press."""
        if pressed(event, "live") == "let_go":
            self.controls.let_go()
        else:
            super().keyPressEvent(event)

    def show_status(self, words: str, health: str = "") -> None:
        """The sentence under the avatar; health is "good", "warn", "bad" or ""."""
        icons = {"good": "mdi6.check-circle", "warn": "mdi6.alert", "bad": "mdi6.alert-circle"}
        self._light.set_icon(icons.get(health, "mdi6.circle-outline"), health or "disabled")
        if words != self.status.text():
            self.status.setText(words)

    def _on_target(self, row: TargetRow) -> None:
        for box in (row.preset, row.port):
            self.controls.claim_keys_of(box)

    def _left(self) -> QWidget:
        self.source, self.latency, self.stream = LiveSourceCard(), LatencyCard(), StreamCard()
        inner = QWidget()
        inner.setObjectName("scrolled")
        column = QVBoxLayout(inner)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE + theme.TIGHT)
        column.addWidget(self.source)
        column.addWidget(self.latency)
        column.addWidget(self.stream)
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(inner)
        scroll.setMinimumWidth(300)
        return scroll

    def _middle(self) -> QWidget:
        self.stage = LiveStage()
        self.controls = Controls()
        self._light = Picture("mdi6.circle-outline", 14)
        self.status = label("", "muted", "live_status")
        self.status.setWordWrap(True)
        line = QHBoxLayout()
        line.setSpacing(theme.INSIDE)
        line.addWidget(self._light)
        line.addWidget(self.status, 1)
        card = Card()
        card.body.addWidget(self.stage, 1)
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
        column = rows("live_right", (send, 360, 0), (meters, 340, 0))
        column.setMinimumWidth(280)
        column.setMaximumWidth(460)
        return column
