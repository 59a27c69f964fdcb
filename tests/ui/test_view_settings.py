"""Camera and background as they were the last time."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from studio import settings as preferences
from studio.render.camera import Orbit
from studio.settings import Settings
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
    assert session.settings.stage_background == "room"
    said = [one.text() for one in pane.findChildren(QLabel)]
    assert any("The background wall.png cannot be read as an image." in text for text in said)


def test_an_image_that_is_gone_is_the_rooms_wall(qtbot: QtBot, tmp_path: Path) -> None:
    session = Session(Settings().changed(stage_background=str(tmp_path / "gone.png")))
    pane, button, _ = seen(qtbot, session)
    assert button.text() == "gone.png"
    pane.show_nothing("Nobody")
    assert not pane.grab().isNull()


@pytest.mark.parametrize("text", ["", "1,2", "a,b,c", "0,0,99", "nan,0,1", "0,0,nan"])
def test_what_is_no_camera_is_the_usual_one(text: str) -> None:
    assert orbit_of(text) is None
