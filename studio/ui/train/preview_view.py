"""What a model has learnt, to be seen: a few seconds of a validation take, captured and predicted."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSignalBlocker, QSize, QTimer, Signal
from PySide6.QtGui import QHideEvent, QPainter, QPaintEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from studio.motion import Motion, rotation
from studio.render.camera import Orbit
from studio.training.preview import BEST, LATEST
from studio.ui import theme
from studio.ui.widgets.card import heading
from studio.ui.widgets.figure.sketch import DrawnFace, draw_figure, draw_ground

FRAME_MS = 40
"""25 pictures a second: enough for a small figure, and light beside a training."""
CORNER = 0.42
"""Share of the picture a face takes where there is a body too."""
CAPTION = 22
"""Pixels above the figure, for its caption."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A motion ready to be drawn: joints in the world (T, J, 3), shapes (T, S)."""

    motion: Motion
    joints: NDArray[np.float64]

    @classmethod
    def of(cls, motion: Motion) -> Loop:
        """Forward kinematics of all frames at once."""
        if not motion.bone_names or not len(motion):
            return cls(motion, np.zeros((len(motion), 0, 3)))
        local, _ = motion.skeleton.forward(motion.positions, motion.rotations)
        turned = rotation.rotate(motion.root_rotation[:, None], local)
        return cls(motion, np.asarray(turned + motion.root_position[:, None], dtype=np.float64))

    def frame(self, t: float) -> int:
        """The frame at a moment, round and round."""
        motion = self.motion
        return int(t * motion.fps) % len(motion) if motion.fps > 0 else 0


class SmallFigure(QWidget):
    """One motion: a body with a small face, or a face alone."""

    def __init__(self, name: str, token: str) -> None:
        super().__init__()
        self.setObjectName(name)
        self._token, self._caption = token, ""
        self._loop: Loop | None = None
        self._frame = 0
        self.face = DrawnFace(self)
        self.face.set_token(token)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    @property
    def moving(self) -> bool:
        """Whether there is anything to play."""
        return self._loop is not None and len(self._loop.motion) > 1

    @property
    def frame(self) -> int:
        """The frame that is seen."""
        return self._frame

    def sizeHint(self) -> QSize:
        return QSize(150, 190)

    def show_loop(self, loop: Loop | None, caption: str) -> None:
        """Play another motion."""
        self._loop, self._caption, self._frame = loop, caption, 0
        self.setAccessibleName(caption)
        self._place_face()
        self.show_at(0.0)

    def show_at(self, t: float) -> None:
        """Show a moment of it."""
        loop = self._loop
        shapes = None
        if loop is not None and len(loop.motion):
            self._frame = loop.frame(t)
            names = loop.motion.shape_names
            values = loop.motion.shapes[self._frame].tolist()
            shapes = dict(zip(names, values, strict=True)) if names else None
        self.face.show_values(shapes)
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_face()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        rect = QRectF(self.rect())
        draw_ground(painter, rect)
        loop = self._loop
        if loop is not None and loop.joints.shape[1] and len(loop.joints):
            below = QRectF(0, 0, rect.width(), rect.height() - CAPTION)
            painter.translate(0, CAPTION)
            draw_figure(painter, below, _CAMERA, loop.motion.skeleton, loop.joints[self._frame], self._token)
            painter.translate(0, -CAPTION)
        painter.setFont(theme.ui_font(theme.CAPTION_PX, semibold=True))
        painter.setPen(theme.colour("muted"))
        painter.drawText(8, 17, self._caption)

    def _place_face(self) -> None:
        body = self._loop is not None and self._loop.joints.shape[1] > 0
        side = int(min(self.width(), self.height() - 22) * (CORNER if body else 0.85))
        if body:
            self.face.setGeometry(4, self.height() - side - 4, side, side)
        else:
            self.face.setGeometry(
                (self.width() - side) // 2, 20 + (self.height() - 20 - side) // 2, side, side
            )


_CAMERA = Orbit()


class PreviewPane(QWidget):
    """Captured and predicted side by side; the newest or the best epoch.

    Signals:
        chosen: "latest" or "best" is to be seen.
    """

    chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("train_preview")
        self.captured = SmallFigure("preview_captured", "ghost")
        self.predicted = SmallFigure("preview_predicted", "figure")
        self._chips: dict[str, QToolButton] = {}
        self._began = time.monotonic()
        self._timer = QTimer(self)
        self._timer.setInterval(FRAME_MS)
        self._timer.timeout.connect(self._tick)
        figures = QHBoxLayout()
        figures.setSpacing(2)
        figures.addWidget(self.captured)
        figures.addWidget(self.predicted)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.TIGHT)
        column.addLayout(self._head())
        column.addLayout(figures, 1)
        self.setMinimumWidth(300)
        self.setMaximumWidth(560)
        self.hide()

    def show_preview(
        self, captured: Motion | None, predicted: Motion | None, caption: str, which: str, choice: bool
    ) -> None:
        """Play another pair, from the start.

        Args:
            captured, predicted: the motions; None hides everything.
            caption: what the predicted one is.
            which: "latest" or "best", the chip that is down.
            choice: whether the two differ.
        """
        for name, chip in self._chips.items():
            chip.setVisible(choice)
            with QSignalBlocker(chip):
                chip.setChecked(name == which)
        if captured is None or predicted is None:
            self.hide()
            return
        self.captured.show_loop(Loop.of(captured), self.tr("Captured"))
        self.predicted.show_loop(Loop.of(predicted), caption)
        self.show()
        self._run()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._run()

    def hideEvent(self, event: QHideEvent) -> None:
        self._timer.stop()
        super().hideEvent(event)

    def _run(self) -> None:
        if self.isVisible() and self.predicted.moving:
            self._timer.start()

    def _tick(self) -> None:
        t = time.monotonic() - self._began
        for figure in (self.captured, self.predicted):
            figure.show_at(t)

    def _head(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(theme.TIGHT)
        title = heading(self.tr("Preview"))
        title.setToolTip(self.tr("A few seconds of a validation take, as the model predicts them"))
        row.addWidget(title)
        row.addStretch(1)
        group = QButtonGroup(self)
        for name, text in ((LATEST, self.tr("Newest")), (BEST, self.tr("Best"))):
            chip = QToolButton()
            chip.setObjectName(f"preview_{name}")
            chip.setText(text)
            chip.setCheckable(True)
            theme.as_role(chip, "chip")
            chip.clicked.connect(lambda _=False, which=name: self.chosen.emit(which))
            group.addButton(chip)
            row.addWidget(chip)
            self._chips[name] = chip
        return row
