"""The performer's own avatar in Live: one choice for all rooms, worn while it speaks and while it waits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from studio import formats
from studio.project import Project, avatars
from studio.ui.messages import Toast
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.widgets.face_dialog import FaceDialog
from tests.formats.avatars import Maker
from tests.inference.live.runs import add_run
from tests.ui.live.children import FakeChild, Room, pose, ready

BONES = ("Hips", "Spine", "Head")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return Maker(0).write(tmp_path / "elsewhere" / "私.vrm")


@pytest.fixture
def live(room: Callable[..., Room], toy_project: Project, child: FakeChild) -> Room:
    add_run(toy_project)
    return room(toy_project, child)


def test_an_avatar_is_worn_with_its_bones_and_its_face(
    live: Room, child: FakeChild, file: Path, qtbot: QtBot
) -> None:
    view, _, _ = live
    view.stage.avatar.wanted.emit(file)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    assert not view.stage.figure.empty  # it waits, and is seen
    view.source.start.click()
    child.told.emit(ready(("A",), BONES))
    child.told.emit(pose(1, len(BONES)))
    stance = view.stage.figure.stance
    assert stance is not None
    assert stance.turns is not None
    assert stance.shapes == {"A": 0.5}
    assert stance.skeleton.bone_names == BONES
    child.end()
    assert not view.stage.figure.empty


def test_a_face_alone_is_worn_by_an_avatar_at_ease(
    live: Room, child: FakeChild, file: Path, qtbot: QtBot
) -> None:
    view, _, _ = live
    view.source.start.click()
    child.told.emit(ready(("A",), ()))
    child.told.emit(pose(1, 0))
    assert view.stage.pane.room.isVisible()  # a large face
    view.stage.avatar.wanted.emit(file)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    child.told.emit(pose(1, 0))
    assert view.stage.figure.isVisible()


def test_one_choice_holds_in_review_and_live(live: Room, file: Path, qtbot: QtBot) -> None:
    view, _, session = live
    review = ReviewView()
    presenter = ReviewPresenter(review, session)
    qtbot.addWidget(review, before_close_func=lambda _: presenter.close())
    view.stage.avatar.wanted.emit(file)
    qtbot.waitUntil(lambda: review.stage.worn is not None)
    assert view.stage.figure.avatar is review.stage.worn
    assert review.stage.avatar.button.text() == view.stage.avatar.button.text() == "Avatar: 小さな Test"
    assert session.project is not None
    assert avatars.chosen(session.project.folder) == session.avatars.path
    review.stage.avatar.wanted.emit(None)
    assert view.stage.figure.avatar is None
    assert view.stage.figure.empty
    assert view.stage.avatar.button.text() == "Avatar"


def test_what_cannot_be_opened_is_said_once_and_the_last_one_stays(
    live: Room, file: Path, tmp_path: Path, qtbot: QtBot
) -> None:
    view, _, _ = live
    view.stage.avatar.wanted.emit(file)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    broken = tmp_path / "broken.vrm"
    broken.write_bytes(file.read_bytes()[:5000])
    view.stage.avatar.wanted.emit(broken)
    qtbot.waitUntil(lambda: any("broken.vrm" in toast.text.text() for toast in view.findChildren(Toast)))
    assert view.stage.figure.avatar is not None
    assert view.stage.avatar.said.startswith("By Saia Studio.")


def test_drawing_too_slowly_is_said_and_the_stick_figure_goes_on(
    live: Room, child: FakeChild, file: Path, qtbot: QtBot
) -> None:
    view, _, _ = live
    view.stage.avatar.wanted.emit(file)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    figure = view.stage.figure
    for _ in range(12):
        figure.note_cost(10.0)
    assert figure.avatar is not None
    assert not figure.avatar.surfaces
    said = " ".join(toast.text.text() for toast in view.findChildren(Toast))
    assert said == (
        "This computer is too slow to draw this avatar. A stick figure with its proportions is shown instead."
    )
    view.source.start.click()
    child.told.emit(ready(("A",), BONES))
    child.told.emit(pose(1, len(BONES)))
    assert view.stage.pane.face.face is not None  # without its own face, the drawn one shows


def test_what_moves_its_faces_is_kept_in_the_project(live: Room, file: Path, qtbot: QtBot) -> None:
    view, _, session = live
    button = view.stage.avatar
    button.menu_opening.emit()
    faces = next(action for action in button.menu.actions() if action.objectName() == "avatar_faces")
    assert not faces.isEnabled()
    button.wanted.emit(file)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    button.menu_opening.emit()
    faces = next(action for action in button.menu.actions() if action.objectName() == "avatar_faces")
    faces.trigger()
    dialog = view.window().findChild(FaceDialog)
    assert dialog is not None
    dialog.drivers_changed.emit({"joy": "MouthSmileLeft"})
    worn = view.stage.figure.avatar
    assert worn is not None
    assert [one.name for one in worn.face.moved_by("MouthSmileLeft")] == ["joy"]
    path = session.avatars.path
    assert path is not None
    qtbot.waitUntil(lambda: formats.read_drivers(path) == {"joy": "MouthSmileLeft"})
    assert formats.read_avatar(path).drivers == {"joy": "MouthSmileLeft"}
    # Chosen again from where it came from, the project's own choice holds; its faces may be others now.
    with qtbot.waitSignal(dialog.finished):
        button.wanted.emit(file)
    assert dict(session.avatars.avatar.drivers if session.avatars.avatar else {}) == {"joy": "MouthSmileLeft"}


def test_the_studios_own_avatar_is_changed_in_the_project_alone(live: Room, qtbot: QtBot) -> None:
    view, _, session = live
    view.stage.avatar.wanted.emit(avatars.OWN)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    assert session.project is not None
    assert session.avatars.path == avatars.OWN
    view.stage.avatar.faces_requested.emit()
    dialog = view.window().findChild(FaceDialog)
    assert dialog is not None
    for drivers in ({"happy": "MouthSmileLeft"}, {"happy": "MouthSmileRight"}):
        dialog.drivers_changed.emit(drivers)
        assert dialog.isVisible()
    assert session.avatars.path == avatars.OWN, "copying it takes as long as the disk does"
    qtbot.waitUntil(lambda: session.avatars.path != avatars.OWN)
    copy = avatars.chosen(session.project.folder)
    assert copy == session.avatars.path
    assert copy is not None
    qtbot.waitUntil(lambda: formats.read_drivers(copy) == {"happy": "MouthSmileRight"})
    assert formats.read_drivers(avatars.OWN) == {}
    assert session.avatars.choices()[0] == (copy,)
    dialog.close()


def test_a_choice_that_is_taken_back_at_once_is_not_kept(live: Room, qtbot: QtBot) -> None:
    view, _, session = live
    view.stage.avatar.wanted.emit(avatars.OWN)
    qtbot.waitUntil(lambda: view.stage.figure.avatar is not None)
    assert session.project is not None
    session.avatars.drive({"happy": "MouthSmileLeft"})
    session.avatars.drive({})
    qtbot.waitUntil(lambda: session.avatars.path != avatars.OWN)
    copy = avatars.chosen(session.project.folder)
    assert copy is not None
    qtbot.waitUntil(lambda: formats.read_drivers(copy) == {})
    assert formats.read_avatar(copy).drivers == {}
