"""More views of the figures, and a camera that goes around them by itself."""

from __future__ import annotations

from PySide6.QtCore import QTimer
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

from studio.render.camera import Orbit
from studio.ui import theme
from studio.ui.review.stage import Stage

TURN_MS = 33
TURN_DEGREES_S = 24.0
"""A round takes a quarter of a minute."""


class CameraButton(QToolButton):
    """A menu of views, and the turntable.

    Args:
        stage: what is looked at; its figures share one camera.
    """

    def __init__(self, stage: Stage, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._stage = stage
        self.setObjectName("camera_button")
        self.setAccessibleName(self.tr("Views"))
        self.setToolTip(self.tr("Where the figure is seen from"))
        theme.set_icon(self, "mdi6.video-outline", "muted")
        theme.as_role(self, "quiet")
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(self)
        self.setMenu(menu)
        for name, words, orbit in (
            ("front", self.tr("Front"), Orbit.preset("front")),
            ("three_quarter", self.tr("Three-quarter"), Orbit.preset("three_quarter")),
            ("side", self.tr("Side"), Orbit.preset("side")),
            ("back", self.tr("Back"), Orbit(180.0, 4.0)),
            ("upper", self.tr("Upper body"), Orbit(0.0, 4.0, 0.55)),
            ("face", self.tr("Face"), Orbit(0.0, 2.0, 0.25)),
        ):
            action = menu.addAction(words)
            action.setObjectName(f"view_{name}")
            action.triggered.connect(lambda _=False, seen=orbit: self._look(seen))
        menu.addSeparator()
        self.turntable: QAction = menu.addAction(self.tr("Turntable"))
        self.turntable.setObjectName("turntable")
        self.turntable.setCheckable(True)
        self._timer = QTimer(self)
        self._timer.setInterval(TURN_MS)
        self._timer.timeout.connect(self._turn)
        self.turntable.toggled.connect(self._on_turntable)

    def _on_turntable(self, on: bool) -> None:
        if on:
            self._timer.start()
        else:
            self._timer.stop()

    def _turn(self) -> None:
        """A step around; rests while the tab is not seen."""
        figure = self._stage.predicted.figure
        if self._stage.isVisible():
            figure.set_orbit(figure.orbit.turned(TURN_DEGREES_S * TURN_MS / 1000.0, 0.0))

    def _look(self, orbit: Orbit) -> None:
        self.turntable.setChecked(False)
        self._stage.predicted.figure.set_orbit(orbit)
