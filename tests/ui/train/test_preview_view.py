"""The preview plays what the training child wrote, and follows it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QToolButton
from pytestqt.qtbot import QtBot

from studio.motion import Motion, rotation
from studio.training import preview
from studio.ui import theme
from studio.ui.train.preview_view import CAPTION, Loop, PreviewPane, SmallFigure
from studio.ui.train.progress_presenter import PreviewPresenter

MINUTE = 60_000


def motion(strength: float, bones: bool = True) -> Motion:
    times = np.arange(60) / 30
    names = ("Hips", "Spine", "Head") if bones else ()
    turns = np.tile(rotation.IDENTITY, (60, len(names), 1))
    if bones:
        turns[:, 1] = rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), strength * np.sin(times))
    return Motion.build(times, ("A",), strength * np.abs(np.sin(times))[:, None], names, None, turns)


def _write(run: Path, epoch: int, best: bool, at: int, bones: bool = True) -> None:
    """As the child does; the file's time is set, since two writes may share a tick of the disk's clock."""
    child = preview.PreviewWriter(run, 100)
    child.show("Chat_001", motion(1.0, bones), motion(epoch / 100, bones), epoch, best)
    os.utime(run / "preview" / "preview.json", ns=(at, at))


def test_the_newest_epoch_is_seen_while_it_trains_and_the_best_afterwards(
    qtbot: QtBot, tmp_path: Path
) -> None:
    pane = PreviewPane()
    qtbot.addWidget(pane)
    pane.resize(320, 240)
    following = PreviewPresenter(pane)
    following.follow(tmp_path, live=True)
    assert not pane.isVisible(), "there is nothing yet"
    _write(tmp_path, 5, best=True, at=10**9)
    following.follow(tmp_path, live=True)
    qtbot.waitUntil(lambda: pane.predicted.accessibleName() == "Epoch 5, kept", timeout=MINUTE)
    _write(tmp_path, 10, best=False, at=2 * 10**9)
    following.follow(tmp_path, live=True)
    qtbot.waitUntil(lambda: pane.predicted.accessibleName() == "Epoch 10", timeout=MINUTE)
    qtbot.waitUntil(lambda: pane.predicted.frame > 2, timeout=MINUTE)
    following.follow(tmp_path, live=False)
    qtbot.waitUntil(lambda: pane.predicted.accessibleName() == "Epoch 5, kept", timeout=MINUTE)
    newest = pane.findChild(QToolButton, "preview_latest")
    assert newest is not None
    qtbot.mouseClick(newest, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: pane.predicted.accessibleName() == "Epoch 10", timeout=MINUTE)
    following.follow(None, live=False)
    assert not pane.isVisible()


def test_a_face_without_a_body_fills_the_picture(qtbot: QtBot, tmp_path: Path) -> None:
    pane = PreviewPane()
    qtbot.addWidget(pane)
    pane.resize(320, 240)
    _write(tmp_path, 100, best=True, at=10**9, bones=False)
    PreviewPresenter(pane).follow(tmp_path, live=False)
    qtbot.waitUntil(lambda: pane.predicted.moving, timeout=MINUTE)
    assert pane.predicted.face.width() > 0.7 * min(pane.predicted.width(), pane.predicted.height() - 22)


def test_all_frames_are_worked_out_at_once() -> None:
    whole = motion(0.5)
    loop = Loop.of(whole)
    local, _ = whole.skeleton.forward(whole.positions[17], whole.rotations[17])
    np.testing.assert_allclose(loop.joints[17], local, atol=1e-6)
    assert loop.frame(2.0 + 17 / 30 + 0.001) == 17, "round and round"


def _top(qtbot: QtBot, token: str) -> int:
    """The first row in which a figure's own colour is seen."""
    figure = SmallFigure(f"small_{token}", token)
    qtbot.addWidget(figure)
    figure.resize(200, 240)
    figure.show_loop(Loop.of(motion(0.0)), "")
    figure.face.hide()
    image = figure.grab().toImage()
    wanted = theme.colour(token).getRgb()[:3]
    for y in range(image.height()):
        for x in range(image.width()):
            seen = image.pixelColor(x, y).getRgb()[:3]
            if max(abs(a - b) for a, b in zip(seen, wanted, strict=True)) < 40:
                return y
    return -1


def test_a_bright_head_on_a_bright_ground_has_an_edge_below_the_caption(
    qtbot: QtBot, qapp: QApplication
) -> None:
    theme.apply(qapp, "light")
    try:
        whole, edged = _top(qtbot, "ghost"), _top(qtbot, "figure")
    finally:
        theme.apply(qapp)
    assert whole >= CAPTION
    assert abs(whole - edged) <= 3, "the predicted head is seen as far up as the captured one"
