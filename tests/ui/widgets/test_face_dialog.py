"""The page of an avatar's faces: what moves each, a try, and a person's correction."""

from __future__ import annotations

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from studio import formats
from studio.motion import Skeleton
from studio.motion.expression import NOTHING
from studio.render.world_pose import WorldPose
from studio.ui.widgets.face_dialog import FaceDialog, spelt
from tests.formats.avatars import SHAPES, Maker


@pytest.fixture
def dialog(qtbot: QtBot, tmp_path: Path) -> FaceDialog:
    made = FaceDialog(formats.read_avatar(Maker(0).write(tmp_path / "x.vrm")))
    qtbot.addWidget(made)
    made.show()
    return made


def rows(dialog: FaceDialog) -> dict[str, str]:
    items = [dialog.list.topLevelItem(i) for i in range(dialog.list.topLevelItemCount())]
    return {item.text(0): item.text(1) for item in items if item is not None}


def choose(dialog: FaceDialog, face: str) -> None:
    dialog.list.setCurrentIndex(dialog.list.model().index(list(rows(dialog)).index(face), 0))


def drive(dialog: FaceDialog, shape: str) -> None:
    edit = dialog.driver.lineEdit()
    assert edit is not None
    edit.setText(shape)
    edit.editingFinished.emit()


def test_each_face_says_what_moves_it(dialog: FaceDialog) -> None:
    assert list(rows(dialog)) == list(SHAPES)
    assert rows(dialog)["joy"] == "Joy / happy"
    assert rows(dialog)["blink_l"] == "Blink_L / blinkLeft"
    assert rows(dialog)["angry"] == "Angry"


def test_a_chosen_face_is_seen_and_moved_by_hand(dialog: FaceDialog) -> None:
    choose(dialog, "e")
    for percent in (100, 30):
        dialog.attempt.setValue(percent)
        stance, avatar = dialog.figure.stance, dialog.figure.avatar
        assert stance is not None
        assert avatar is not None
        weights = avatar.morph_weights(stance.shapes)[1]
        assert {SHAPES[i]: w for i, w in enumerate(weights) if w} == {"e": pytest.approx(percent / 100)}


def test_another_shape_may_move_a_face(dialog: FaceDialog, qtbot: QtBot) -> None:
    choose(dialog, "joy")
    with qtbot.waitSignal(dialog.drivers_changed) as told:
        drive(dialog, "mouthsmileleft")
    assert told.args == [{"joy": "MouthSmileLeft"}]
    assert rows(dialog)["joy"] == "MouthSmileLeft (yours)"
    # What it moves is seen still.
    dialog.attempt.setValue(50)
    avatar, stance = dialog.figure.avatar, dialog.figure.stance
    assert avatar is not None
    assert stance is not None
    assert avatar.morph_weights(stance.shapes)[1].max() == pytest.approx(0.5)


def test_a_rigs_own_shape_may_be_typed_and_taken_back(dialog: FaceDialog, qtbot: QtBot) -> None:
    choose(dialog, "fun")
    with qtbot.waitSignal(dialog.drivers_changed) as told:
        drive(dialog, "My own smirk")
    assert told.args == [{"fun": "My own smirk"}]
    choose(dialog, "a")
    choose(dialog, "fun")
    assert dialog.driver.currentText() == "My own smirk"
    with qtbot.waitSignal(dialog.drivers_changed) as told:
        drive(dialog, "")
    assert told.args == [{}]
    assert rows(dialog)["fun"] == "Fun / relaxed"


def test_nothing_may_move_a_face_and_all_go_back(dialog: FaceDialog, qtbot: QtBot) -> None:
    assert not dialog.reset.isEnabled()
    choose(dialog, "angry")
    with qtbot.waitSignal(dialog.drivers_changed) as told:
        drive(dialog, "Nothing")
    assert told.args == [{"angry": NOTHING}]
    assert rows(dialog)["angry"] == "Nothing (yours)"
    with qtbot.waitSignal(dialog.drivers_changed) as told:
        dialog.reset.click()
    assert told.args == [{}]
    assert rows(dialog)["angry"] == "Angry"
    assert dialog.driver.currentIndex() == 0


def test_choosing_a_face_changes_nothing(dialog: FaceDialog, qtbot: QtBot) -> None:
    with qtbot.assertNotEmitted(dialog.drivers_changed):
        for face in rows(dialog):
            choose(dialog, face)
            drive(dialog, dialog.driver.currentText())


def test_its_picture_goes_with_it(qtbot: QtBot, tmp_path: Path) -> None:
    dialog = FaceDialog(formats.read_avatar(Maker(0).write(tmp_path / "x.vrm")))
    dialog.show()
    dialog.figure.show_stance(WorldPose.rest_pose(Skeleton.humanoid()))
    assert dialog.figure.drawing_soon
    dialog.close()
    assert not dialog.figure.drawing_soon


def test_shapes_are_called_what_people_call_them() -> None:
    assert [spelt(name) for name in ("jawopen", "aa", "", "Smirk")] == [
        "JawOpen",
        "A / aa",
        "Nothing",
        "Smirk",
    ]
