"""Camera and background as they were the last time."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from studio import settings as preferences
from studio.render.camera import Orbit
from studio.settings import Settings
from studio.ui import tasks
from studio.ui.session import Session
from studio.ui.view_settings import ViewSettings, orbit_of
from studio.ui.widgets.background_menu import BackgroundButton
from studio.ui.widgets.figure.pane import Pane

Seen = tuple[Pane, BackgroundButton, ViewSettings]


def seen(qtbot: QtBot, session: Session) -> Seen:
    pane, button = Pane("p", "", "", "mdi6.human", "figure"), BackgroundButton()
    qtbot.addWidget(pane, before_close_func=lambda _: pane.figure.dispose())
    qtbot.addWidget(button)
    return pane, button, ViewSettings(pane, (pane,), button, session, "review_camera")


def test_camera_and_background_are_as_they_were(qtbot: QtBot, tmp_path: Path) -> None:
    session = Session(Settings())
    pane, button, presenter = seen(qtbot, session)
    pane.figure.set_orbit(Orbit(30.0, 10.0, 0.5))
    button.chosen.emit("green")
    assert pane.figure.background.text == "#00B140"
    assert button.text() == "Green screen"
    presenter.close()
    later, button, _ = seen(qtbot, Session(preferences.load()))
    assert later.figure.orbit == Orbit(30.0, 10.0, 0.5)
    assert later.figure.background.text == button.background.text == "#00B140"


def test_a_camera_that_rests_is_kept_without_asking(qtbot: QtBot) -> None:
    session = Session(Settings().changed(review_camera=""))
    pane, _, _ = seen(qtbot, session)
    pane.figure.set_view("face")
    qtbot.waitUntil(lambda: session.settings.review_camera == "-32.00,9.00,0.250")


def test_an_image_that_cannot_be_read_is_said_and_changes_nothing(qtbot: QtBot, tmp_path: Path) -> None:
    (tmp_path / "wall.png").write_bytes(b"no picture")
    session = Session(Settings())
    pane, button, _ = seen(qtbot, session)
    pane.show()
    button.chosen.emit(str(tmp_path / "wall.png"))
    said = "The background wall.png cannot be read as an image."
    qtbot.waitUntil(lambda: any(said in one.text() for one in pane.findChildren(QLabel)))
    assert session.settings.stage_background == button.background.text == "room"


def test_an_image_is_read_where_nobody_waits_for_pictures(qtbot: QtBot, tmp_path: Path) -> None:
    wall = str(tmp_path / "wall.png")
    Image.new("RGB", (64, 48), "red").save(wall)
    session = Session(Settings())
    pane, button, _ = seen(qtbot, session)
    button.chosen.emit(wall)
    assert button.text() == "wall.png", "it is named at once"
    assert pane.figure.background.is_room, "and painted when it is there"
    qtbot.waitUntil(lambda: pane.figure.background.text == wall)
    assert session.settings.stage_background == wall
    later, _, _ = seen(qtbot, session)
    assert later.figure.background.is_room
    qtbot.waitUntil(lambda: later.figure.background.text == wall)


def test_what_is_chosen_while_an_image_is_read_holds(qtbot: QtBot, tmp_path: Path) -> None:
    wall = str(tmp_path / "wall.png")
    Image.new("RGB", (64, 48), "red").save(wall)
    session = Session(Settings())
    pane, button, _ = seen(qtbot, session)
    button.chosen.emit(wall)
    button.chosen.emit("green")
    assert tasks.wait()
    qtbot.wait(1)
    assert session.settings.stage_background == pane.figure.background.text == "#00B140"


def test_an_image_that_is_gone_is_the_rooms_wall(qtbot: QtBot, tmp_path: Path) -> None:
    session = Session(Settings().changed(stage_background=str(tmp_path / "gone.png")))
    pane, button, _ = seen(qtbot, session)
    assert button.text() == "gone.png"
    pane.show_nothing("Nobody")
    assert not pane.grab().isNull()


@pytest.mark.parametrize("text", ["", "1,2", "a,b,c", "0,0,99", "nan,0,1", "0,0,nan"])
def test_what_is_no_camera_is_the_usual_one(text: str) -> None:
    assert orbit_of(text) is None
