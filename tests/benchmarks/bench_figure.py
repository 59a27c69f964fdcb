"""The figure and the shape meters: pictures a second when they have the GUI thread to themselves."""

from __future__ import annotations

import statistics
import time
from contextlib import ExitStack
from typing import Any

import numpy as np

from studio import stage

PICTURES = 150


def run() -> dict[str, Any]:
    """Pictures a second at 800 x 600 of 54 bones, by OpenGL and as the sketch; meters of 52 shapes."""
    import os

    with ExitStack() as stack:
        if not stage.has_screen():
            os.environ["DISPLAY"] = stack.enter_context(stage.virtual_screen())
        return _measure()


def _measure() -> dict[str, Any]:
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QApplication

    from studio.motion.channels import ARKIT_SHAPES
    from studio.motion.skeleton import Skeleton
    from studio.ui import theme
    from studio.ui.widgets.figure import StickFigure
    from studio.ui.widgets.shape_meters import ShapeMeters

    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
    theme.apply(app)
    figure, meters = StickFigure(), ShapeMeters()
    for widget, size in ((figure, (800, 600)), (meters, (320, 900))):
        widget.resize(*size)
        widget.show()
        QTest.qWaitForWindowExposed(widget)
    skeleton = Skeleton.humanoid()
    world, _ = skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations)

    def draw(step: int) -> None:
        figure._skeleton, figure._world = skeleton, world + 0.05 * np.sin(step / 10)
        figure._draw_picture()
        figure.repaint()

    def meter(step: int) -> None:
        meters.show_values({name: 0.5 + 0.5 * np.sin(step / 9 + i) for i, name in enumerate(ARKIT_SHAPES)})
        meters.list.viewport().repaint()

    sketch = _per_second(draw)
    start = time.perf_counter()
    import pyvista  # noqa: F401

    loaded = time.perf_counter()
    figure.warm_up()
    warm = time.perf_counter()
    result = {
        "opengl_800x600_per_s": _per_second(draw),
        "sketch_800x600_per_s": sketch,
        "load_pyvista_s": loaded - start,
        "first_picture_s": warm - loaded,
        "meters_of_52_shapes_per_s": _per_second(meter),
    }
    figure.dispose()
    return result


def _per_second(work: Any) -> float:
    times = []
    for step in range(PICTURES):
        start = time.perf_counter()
        work(step)
        times.append(time.perf_counter() - start)
    return 1 / statistics.median(times)
