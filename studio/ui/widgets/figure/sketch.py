"""The figure drawn with plain lines: until OpenGL is warm, and where there is none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QLinearGradient, QPainter, QPen

from studio.motion.skeleton import Skeleton
from studio.render import body
from studio.render.camera import Orbit, project, to_picture
from studio.ui import theme


def draw_ground(painter: QPainter, rect: QRectF) -> None:
    """The gradient behind the figure."""
    gradient = QLinearGradient(rect.topLeft(), rect.bottomLeft())
    gradient.setColorAt(0.0, theme.colour("sky"))
    gradient.setColorAt(1.0, theme.colour("floor"))
    painter.fillRect(rect, gradient)


def draw_figure(
    painter: QPainter,
    rect: QRectF,
    orbit: Orbit,
    skeleton: Skeleton,
    world: NDArray[np.floating],
    token: str = "figure",
) -> None:
    """One figure as round-ended lines and a head.

    Args:
        painter: its coordinates are those of rect.
        rect: the picture.
        orbit: the camera.
        skeleton: J bones.
        world: Unity-space joints (J, 3).
        token: the theme's colour.
    """
    plan = body.Plan.of(skeleton)
    joints = to_picture(world)
    scale = plan.scale(joints)
    seen = project(joints, orbit, int(rect.width()), int(rect.height()), scale)
    per_metre = rect.height() / (2 * np.tan(np.radians(14.0)))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    for start, end, radii in zip(plan.starts, plan.ends, plan.radii, strict=True):
        width = max(float(radii.mean()) * 2 * scale * per_metre / float(seen[end, 2]), 1.0)
        pen = QPen(theme.colour(token), width)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        painter.setPen(pen)
        painter.drawLine(QPointF(*seen[start, :2]), QPointF(*seen[end, :2]))
    if plan.head >= 0:
        centre, radius = body.head_ball(plan, joints, scale)
        x, y, depth = project(centre[None], orbit, int(rect.width()), int(rect.height()), scale)[0]
        size = radius * per_metre / depth
        painter.setPen(QPen(theme.colour(token), 1.5))  # a bright head on a bright ground needs an edge
        painter.setBrush(theme.colour("joint" if token == "figure" else token))
        painter.drawEllipse(QPointF(x, y), size, size)
