"""The avatar window as the screen shows it: transparent, on green, moved, resized, closed and remembered."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QToolButton, QWidget
from pytestqt.qtbot import QtBot

from studio.ipc.commands import switch
from studio.project import Project
from studio.ui import theme
from studio.ui.live.avatar_window import AvatarWindow
from studio.ui.messages import Toast
from tests.formats.avatars import Maker
from tests.inference.live.runs import add_run
from tests.ui.live.children import FakeChild, Room, pose, ready

BONES = ("Hips", "Spine", "Head")
GREEN = (0x00, 0xB1, 0x40)


@pytest.fixture
def live(qapp, room: Callable[..., Room], toy_project: Project, child: FakeChild) -> Room:
    theme.apply(qapp)
    add_run(toy_project)
    return room(toy_project, child, window_place="60,50,300,400", window_camera="0.00,4.00,1.000")


def opened(live: Room, qtbot: QtBot) -> AvatarWindow:
    """The window, with its first picture from OpenGL."""
    view, presenter, _ = live
    view.stream.avatar_window.click()
    window = presenter.window.window
    assert window is not None
    qtbot.waitExposed(window)
    qtbot.waitUntil(lambda: window.figure.warm and window.figure.renders > 0)
    return window


def points(image: QImage) -> np.ndarray:
    """RGBA (H, W, 4)."""
    image = image.convertToFormat(QImage.Format.Format_RGBA8888)
    return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4).astype(int)


def corners(pixels: np.ndarray) -> np.ndarray:
    return pixels[[4, 4, -5, -5], [4, -5, 4, -5]]


def grabbed(window: QWidget) -> np.ndarray:
    """What the window paints, with alpha."""
    return points(window.grab().toImage())


def test_it_is_transparent_but_for_the_avatar_which_performs(
    live: Room, child: FakeChild, qtbot: QtBot, tmp_path: Path
) -> None:
    view, _, _ = live
    window = opened(live, qtbot)
    assert window.geometry() == QRect(60, 50, 300, 400)
    flags = window.windowFlags()
    assert flags & Qt.WindowType.FramelessWindowHint
    assert flags & Qt.WindowType.WindowStaysOnTopHint
    stick = grabbed(window)
    view.stage.avatar.wanted.emit(Maker(0).write(tmp_path / "私.vrm"))
    qtbot.waitUntil(lambda: window.figure.avatar is not None and not window.figure.drawing_soon)
    avatar = grabbed(window)
    for pixels in (stick, avatar):
        assert corners(pixels)[:, 3].max() == 0
        assert 0.02 < (pixels[..., 3] == 255).mean() < 0.6
    clothes = (avatar[..., 2] > avatar[..., 0] + 60) & (avatar[..., 0] < 110) & (avatar[..., 3] == 255)
    assert clothes.sum() > 500
    view.source.start.click()
    child.told.emit(ready(("A",), BONES))
    before = window.figure.renders
    child.told.emit(pose(1, len(BONES)))
    stance = window.figure.stance
    assert stance is not None
    assert stance.shapes == {"A": 0.5}
    qtbot.waitUntil(lambda: window.figure.renders > before)
    child.end()
    assert window.figure.stance is not None
    assert not window.figure.stance.shapes


def test_on_green_the_screen_itself_shows_green_and_the_figure(live: Room, qtbot: QtBot) -> None:
    _, _, session = live
    window = opened(live, qtbot)
    window.backgrounds.chosen.emit("green")
    assert session.settings.window_background == "#00B140"
    qtbot.waitUntil(lambda: not window.figure.drawing_soon)
    window.repaint()

    def seen() -> np.ndarray:
        screen = window.screen()
        return points(screen.grabWindow(window.winId()).toImage())

    qtbot.waitUntil(lambda: bool((np.abs(corners(seen())[:, :3] - GREEN).max(axis=1) < 8).all()))
    other = np.abs(seen()[..., :3] - GREEN).max(axis=-1) > 60
    assert 0.02 < other.mean() < 0.6


def test_it_is_dragged_and_resized_and_stands_there_again(live: Room, qtbot: QtBot) -> None:
    view, presenter, session = live
    window = opened(live, qtbot)
    for start, end in ((QPoint(150, 200), QPoint(190, 230)), (QPoint(297, 397), QPoint(357, 377))):
        qtbot.mousePress(window, Qt.MouseButton.LeftButton, pos=start)
        qtbot.mouseMove(window, end)
        qtbot.mouseRelease(window, Qt.MouseButton.LeftButton, pos=end)
    assert window.geometry() == QRect(100, 80, 360, 380)
    button = window.findChild(QToolButton, "avatar_window_close")
    assert button is not None
    button.click()
    assert presenter.window.window is None
    assert not view.stream.avatar_window.isChecked()
    assert session.settings.window_place == "100,80,360,380"
    assert opened(live, qtbot).geometry() == QRect(100, 80, 360, 380)


def test_a_busy_computer_makes_it_coarse_and_says_so_elsewhere(
    live: Room, qtbot: QtBot, tmp_path: Path
) -> None:
    view, _, _ = live
    window = opened(live, qtbot)
    view.stage.avatar.wanted.emit(Maker(0).write(tmp_path / "a.vrm"))
    qtbot.waitUntil(lambda: window.figure.avatar is not None)
    for _ in range(12):
        window.figure.note_cost(2.1)  # as while a game loads
    assert window.figure.avatar is not None
    assert window.figure.avatar.surfaces
    said = [toast.text.text() for toast in view.findChildren(Toast)]
    assert said == [
        "This computer was too busy to draw the avatar window: it is coarser until that is over.",
    ]
    assert not window.findChildren(Toast), "viewers see that window"


def test_escape_closes_it_and_the_button_in_live_as_well(live: Room, qtbot: QtBot) -> None:
    view, presenter, _ = live
    qtbot.keyClick(opened(live, qtbot), Qt.Key.Key_Escape)
    assert presenter.window.window is None
    opened(live, qtbot)
    view.stream.avatar_window.click()
    assert presenter.window.window is None


def test_its_camera_and_whether_it_is_in_front_are_kept(live: Room, qtbot: QtBot) -> None:
    _, presenter, session = live
    window = opened(live, qtbot)
    window.figure.set_view("bust")
    window.on_top_chosen.emit(False)
    assert not window.windowFlags() & Qt.WindowType.WindowStaysOnTopHint
    assert window.isVisible()
    window.close()
    assert session.settings.window_camera == "0.00,4.00,0.500"
    again = opened(live, qtbot)
    assert again.figure.orbit.framing == "bust"
    assert not again.windowFlags() & Qt.WindowType.WindowStaysOnTopHint
    presenter.close()
    assert presenter.window.window is None, "it goes with the program"


def test_it_goes_on_while_another_tab_is_shown(live: Room, child: FakeChild, qtbot: QtBot) -> None:
    view, presenter, _ = live
    window = opened(live, qtbot)
    view.source.start.click()
    child.told.emit(ready(("A",), BONES))
    presenter.deactivate()
    assert child.commands[-1] == switch("poses", True)
    child.told.emit(pose(1, len(BONES)))
    stance = window.figure.stance
    assert stance is not None
    assert stance.shapes == {"A": 0.5}
    window.close()
    assert child.commands[-1] == switch("poses", False)
    child.end()


def test_a_place_on_a_screen_that_is_gone_is_not_used(live: Room, qtbot: QtBot) -> None:
    window = opened(live, qtbot)
    window.stand(QRect(90_000, 90_000, 300, 400))
    assert window.screen().availableGeometry().contains(window.geometry())
