"""Your own avatar in Review: opened, worn by both panes, kept with the project, and taken off again."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QMenu
from pytestqt.qtbot import QtBot

from studio.formats import _glb
from studio.project import Project, avatars
from studio.settings import Settings
from studio.ui.imports import sort_drop
from studio.ui.messages import Toast
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from tests.formats.avatars import Maker

Tab = tuple[ReviewView, ReviewPresenter]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return Maker(0).write(tmp_path / "elsewhere" / "私の アバター.vrm")


def wear(qtbot: QtBot, view: ReviewView, file: Path) -> None:
    view.stage.avatar.wanted.emit(file)
    qtbot.waitUntil(lambda: view.stage.worn is not None)


def choices(menu: QMenu) -> list[str]:
    menu.aboutToShow.emit()
    return [action.text() for action in menu.actions() if action.text()]


def test_an_avatar_is_worn_named_and_kept_in_the_project(
    qtbot: QtBot, tab: Tab, session: Session, file: Path
) -> None:
    view, _ = tab
    wear(qtbot, view, file)
    assert session.project is not None
    copy = session.project.folder / "avatars" / file.name
    assert copy.read_bytes() == file.read_bytes()
    assert avatars.chosen(session.project.folder) == copy
    assert view.stage.avatar.button.text() == "Avatar: 小さな Test"
    assert view.stage.avatar.said.startswith("By Saia Studio. Everyone may use it.")
    for pane in (view.stage.captured, view.stage.predicted):
        assert pane.figure.avatar is view.stage.worn
    assert session.settings.recent_avatars == (str(file),)


def test_a_project_wears_its_avatar_wherever_it_goes(
    qtbot: QtBot, tab: Tab, session: Session, file: Path, tmp_path: Path
) -> None:
    wear(qtbot, tab[0], file)
    assert session.project is not None
    moved = tmp_path / "another place"
    shutil.copytree(session.project.folder, moved)
    found = avatars.chosen(moved)
    assert found is not None
    assert found.parent == moved / "avatars"
    other = Session(Settings())
    other.open_project(moved)
    view = ReviewView()
    presenter = ReviewPresenter(view, other)
    qtbot.addWidget(view)
    qtbot.waitUntil(lambda: view.stage.worn is not None)
    presenter.close()
    other.close_project()


def test_it_is_taken_off_and_offered_again(qtbot: QtBot, tab: Tab, session: Session, file: Path) -> None:
    view, _ = tab
    wear(qtbot, view, file)
    menu = view.stage.avatar.menu
    assert choices(menu) == ["None (stick figure)", "Saia", file.stem, "Open a VRM avatar…", "Face shapes…"]
    menu.actions()[0].trigger()
    assert view.stage.worn is None
    assert view.stage.avatar.button.text() == "Avatar"
    assert session.project is not None
    assert avatars.chosen(session.project.folder) is None
    choices(menu)
    menu.actions()[2].trigger()
    qtbot.waitUntil(lambda: view.stage.worn is not None)
    assert len(avatars.kept(session.project.folder)) == 1


def test_a_broken_avatar_is_one_sentence_and_the_last_one_stays(
    qtbot: QtBot, tab: Tab, session: Session, file: Path, tmp_path: Path
) -> None:
    view, _ = tab
    wear(qtbot, view, file)
    broken = tmp_path / "broken.vrm"
    broken.write_bytes(file.read_bytes()[:5000])
    view.stage.avatar.wanted.emit(broken)
    qtbot.waitUntil(
        lambda: any("broken.vrm is cut short" in toast.text.text() for toast in view.findChildren(Toast))
    )
    assert view.stage.worn is not None
    assert session.project is not None
    assert [path.name for path in avatars.kept(session.project.folder)] == [file.name]
    assert view.stage.avatar.said.startswith("By Saia Studio.")


def test_two_avatars_of_one_name_are_both_kept(tmp_path: Path, toy_project: Project) -> None:
    first = avatars.adopt(toy_project.folder, Maker(0).write(tmp_path / "a" / "me.vrm"))
    again = avatars.adopt(toy_project.folder, Maker(0).write(tmp_path / "a" / "me.vrm"))
    other = avatars.adopt(toy_project.folder, Maker(1).write(tmp_path / "b" / "me.vrm"))
    assert (first.name, again.name, other.name) == ("me.vrm", "me.vrm", "me 2.vrm")


def test_a_new_project_wears_the_studios_own_avatar_and_never_copies_it(tmp_path: Path) -> None:
    assert avatars.chosen(tmp_path) == avatars.OWN
    avatars.choose(tmp_path, None)
    assert avatars.chosen(tmp_path) is None
    avatars.choose(tmp_path, avatars.adopt(tmp_path, avatars.OWN))
    assert avatars.chosen(tmp_path) == avatars.OWN
    assert avatars.kept(tmp_path) == ()


@pytest.mark.parametrize("written", ['{"avatar": "../../secret.vrm"}', '{"avatar": 5}', '{"avatar": null}'])
def test_a_choice_that_leads_nowhere_is_the_stick_figure(tmp_path: Path, written: str) -> None:
    (tmp_path / "avatars").mkdir()
    (tmp_path / "avatars" / "chosen.json").write_text(written)
    assert avatars.chosen(tmp_path) is None


def test_a_dropped_vrm_is_an_avatar_in_every_room(tmp_path: Path) -> None:
    for room in ("record", "review", ""):
        assert sort_drop((tmp_path / "me.VRM",), room).avatar == tmp_path / "me.VRM"


def test_the_avatar_is_what_is_drawn(qtbot: QtBot, tab: Tab, file: Path) -> None:
    view, _ = tab
    figure = view.stage.captured.figure
    qtbot.waitUntil(lambda: figure.warm and figure.renders > 0)

    def blue() -> int:
        image = figure.grab().toImage().convertToFormat(QImage.Format.Format_RGBA8888)
        pixels = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4).astype(int)
        cloth = (pixels[:, :, 2] > pixels[:, :, 0] + 60) & (pixels[:, :, 0] < 110)
        return int(cloth.sum())

    stick = blue()
    wear(qtbot, view, file)
    qtbot.waitUntil(lambda: blue() > 200 + 2 * stick)
    view.stage.avatar.wanted.emit(None)
    qtbot.waitUntil(lambda: blue() <= 200 + 2 * stick)


@pytest.mark.slow
def test_an_exported_body_is_the_one_review_wears(
    qtbot: QtBot, tab: Tab, session: Session, file: Path
) -> None:
    view, _ = tab
    wear(qtbot, view, file)
    assert session.project is not None
    view.export.format.setCurrentIndex(view.export.format.findData("glb"))
    view.export.export.click()
    qtbot.waitUntil(lambda: len(view.export.result.text()) > 0)
    (target,) = session.project.exports_folder.glob("*.glb")
    assert view.export.result.text() == f"Exported and verified: {target.name}."
    meshes = {mesh["name"] for mesh in _glb.read(target).document["meshes"]}
    assert meshes == {"からだ", "Face 顔"}
