"""The figure, the avatar and the shape meters: pictures a second, alone and beside a sound that plays."""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from studio import virtual_devices

PICTURES = 150
PLAYED_SECONDS = 6.0


def run() -> dict[str, Any]:
    """Pictures a second at 800 x 600: 54 bones as figure, sketch and avatar; meters of 52 shapes.

    Beside the pictures by the clock stand those that the processor time of one core would make, since a
    busy machine tells nothing by the clock; `load` is how busy it was.
    """
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # avatars are made by the tests' maker
    with ExitStack() as stack:
        if not virtual_devices.has_screen():
            os.environ["DISPLAY"] = stack.enter_context(virtual_devices.virtual_screen())
        os.environ |= stack.enter_context(virtual_devices.virtual_sound())
        from studio.capture.microphone import input_devices

        input_devices(refresh=True)
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        return {"load_1_min": os.getloadavg()[0]} | _measure(folder)


def _measure(folder: Path) -> dict[str, Any]:
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QApplication

    from studio.motion.channels import ARKIT_SHAPES
    from studio.motion.skeleton import Skeleton
    from studio.render.world_pose import WorldPose
    from studio.ui import theme
    from studio.ui.widgets.figure.figure import StickFigure
    from studio.ui.widgets.meters import ShapeMeters

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
        figure.show_stance(WorldPose(skeleton, world + 0.05 * np.sin(step / 10)))
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
    result |= {"opengl_per_core_s": _per_core_second(draw)} | _beside_a_sound(figure, folder, "figure")
    result |= _avatars(figure, folder)
    figure.dispose()
    return result


def _avatars(figure: Any, folder: Path) -> dict[str, Any]:
    """The same with a skinned avatar whose face moves."""
    from studio import formats
    from studio.render.world_pose import WorldPose
    from tests.formats.avatars import Maker
    from tests.formats.examples import a_motion

    motion, result = a_motion(120), dict[str, Any]()
    for finer, name in ((0, "avatar"), (1, "avatar_fine")):
        avatar = formats.read_avatar(Maker(0, finer=finer).write(folder / f"{name}.vrm"))
        figure.set_avatar(avatar)

        def draw(step: int) -> None:
            figure.show_stance(WorldPose.of(motion, step % 120 / 60))
            figure._draw_picture()
            figure.repaint()

        draw(0)
        result |= {
            f"{name}_triangles": sum(len(surface.triangles) for surface in avatar.surfaces),
            f"{name}_800x600_per_s": _per_second(draw),
            f"{name}_per_core_s": _per_core_second(draw),
        } | _beside_a_sound(figure, folder, name)
    figure.set_avatar(None)
    return result


def _beside_a_sound(figure: Any, folder: Path, name: str) -> dict[str, Any]:
    """Pictures a second while a sound is played and leads, as Review shows them, and how late they are."""
    from PySide6.QtCore import Qt, QTimer
    from PySide6.QtTest import QTest

    from studio.playback.player import Player
    from studio.render.world_pose import WorldPose
    from tests.formats.examples import a_motion, a_sound

    motion = a_motion(int(PLAYED_SECONDS * 60))
    player = Player(a_sound(folder / "tone.wav", PLAYED_SECONDS + 2.0, 48000))
    timer = QTimer(timerType=Qt.TimerType.PreciseTimer)
    timer.timeout.connect(lambda: figure.show_stance(WorldPose.of(motion, player.position)))
    timer.start(16)
    player.play()
    QTest.qWait(500)
    before, start, cpu = figure.renders, time.perf_counter(), time.process_time()
    QTest.qWait(int((PLAYED_SECONDS - 1.0) * 1000))
    seconds = time.perf_counter() - start
    made, cpu = figure.renders - before, time.process_time() - cpu
    timer.stop()
    player.close()
    return {f"{name}_with_sound_per_s": made / seconds, f"{name}_with_sound_cores": cpu / seconds}


def _per_core_second(work: Any) -> float:
    """Pictures that a second of one core's time makes."""
    start = time.process_time()
    for step in range(PICTURES):
        work(step)
    return PICTURES / (time.process_time() - start)


def _per_second(work: Any) -> float:
    times = []
    for step in range(PICTURES):
        start = time.perf_counter()
        work(step)
        times.append(time.perf_counter() - start)
    return 1 / statistics.median(times)
