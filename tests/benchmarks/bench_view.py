"""The window's picture of a performer at 1280 x 720: processor time of one core for each picture.

A stick figure, our own avatar, those of ../shared/data/vrm (SAIA_DATA) and one of 49,248 triangles: a whole
body that moves, the face from close by, and one that stands still; every pose turns head and arms far, more
than people do. Beside it films of our own avatar: how many seconds of film a second draws, encoded and read
back.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from studio import virtual_devices

OWN = Path(__file__).resolve().parents[2] / "resources" / "avatar" / "Saia.vrm"
PICTURES, ROUNDS = 60, 3
SIZE = (1280, 720)
AVATARS = ("cryptovoxels", "EmissionMigration_v0.107.0")
FILM_SECONDS = 4.0


def run() -> dict[str, Any]:
    """Milliseconds of one core for each picture, quickest of ROUNDS; films at 30 frames a second."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # avatars are made by the tests' maker
    with ExitStack() as stack:
        if not virtual_devices.has_screen():
            os.environ["DISPLAY"] = stack.enter_context(virtual_devices.virtual_screen())
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        return {"load_1_min": os.getloadavg()[0]} | _views(folder) | _film(folder)


def _views(folder: Path) -> dict[str, Any]:
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QApplication

    from studio import formats
    from studio.render.camera import Orbit
    from studio.ui import theme
    from studio.ui.widgets.figure.figure import StickFigure

    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
    theme.apply(app)
    figure = StickFigure()
    figure.resize(*SIZE)
    figure.show()
    QTest.qWaitForWindowExposed(figure)
    import pyvista  # noqa: F401

    figure.warm_up()
    result: dict[str, Any] = {}
    for name, path in _avatars(folder):
        figure.set_avatar(formats.read_avatar(path) if path is not None else None)
        for view, orbit in (("body", Orbit.preset("front")), ("face", Orbit(0.0, 2.0, 0.25))):
            figure.set_orbit(orbit)
            result[f"{name}_{view}_ms"] = _milliseconds(figure, moving=True)
        result[f"{name}_still_ms"] = _milliseconds(figure, moving=False)
    figure.dispose()
    return result


def _avatars(folder: Path) -> Iterator[tuple[str, Path | None]]:
    from tests.formats.avatars import Maker

    data = Path(os.environ.get("SAIA_DATA", "../shared/data")) / "vrm"
    yield "stick", None
    yield "saia", OWN
    for name in AVATARS:
        if (data / f"{name}.vrm").is_file():
            yield name, data / f"{name}.vrm"
    yield "fine", Maker(0, finer=1).write(folder / "fine.vrm")


def _milliseconds(figure: Any, moving: bool) -> float:
    """Of processor time for each pose shown: drawn and painted, as the display's timer has it."""
    from PySide6.QtWidgets import QApplication

    from studio.render.world_pose import WorldPose
    from tests.formats.examples import a_motion

    motion, costs = a_motion(120), []
    for _ in range(ROUNDS):
        start = time.process_time()
        for step in range(PICTURES):
            figure.show_stance(WorldPose.of(motion, step / 60 if moving else 0.5))
            if figure._next.isActive():
                figure._draw_picture()
            figure._next.stop()
            QApplication.processEvents()
        costs.append(1000 * (time.process_time() - start) / PICTURES)
    return min(costs)


def _film(folder: Path) -> dict[str, Any]:
    from studio.formats import mp4, webm
    from studio.render.background import CLEAR, ROOM
    from studio.render.drawing import Drawing
    from tests.formats.examples import a_motion

    motion, found = a_motion(int(FILM_SECONDS * 60)), dict[str, Any]()
    for module, background in ((mp4, ROOM), (webm, CLEAR)):
        speeds = []
        for _ in range(ROUNDS):
            drawing = Drawing(*SIZE, fps=30.0, background=background, avatar=OWN)
            start = time.perf_counter()
            module.write(folder / f"film{module.SUFFIX}", motion, None, drawing)
            speeds.append(FILM_SECONDS / (time.perf_counter() - start))
        found[f"film{module.SUFFIX}_seconds_per_s"] = statistics.median(speeds)
    return found
