"""The Tune panel alone: what it gives, what it enables, undo, and presets in a real project."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QToolButton
from pytestqt.qtbot import QtBot

from studio.motion.channels import ARKIT_SHAPES, BONES, VRM0_SHAPES
from studio.playback.layers import ShapeTuning, Tuning, presets
from studio.playback.layers.tuning import FACE_ONLY
from studio.project import Project
from studio.settings import Settings
from studio.ui.messages import Toast
from studio.ui.review.preset_presenter import TuningPresetPresenter
from studio.ui.review.tune_view import TunePanel
from studio.ui.session import Session


@pytest.fixture
def panel(qtbot: QtBot) -> TunePanel:
    panel = TunePanel()
    qtbot.addWidget(panel)
    panel.resize(300, 700)
    panel.show_motion(VRM0_SHAPES, BONES)
    panel.show()
    return panel


def test_a_new_panel_changes_nothing(panel: TunePanel) -> None:
    assert panel.tuning == Tuning()
    assert not panel.reset.isEnabled()
    assert not panel.undo_button.isEnabled()


def test_every_slider_number_and_box_gives_what_it_says(panel: TunePanel) -> None:
    panel.rows["mouth"].slider.setValue(10)
    panel.rows["blinks"].box.setValue(17.0)
    panel.rows["seed"].box.setValue(4)
    panel.shapes.top_vowels.click()
    panel.shapes.shape.setCurrentText("Joy")
    panel.shapes.gain.box.setValue(2.0)
    panel.moves.choice.setCurrentIndex(1)
    panel.moves.choice.activated.emit(1)
    panel.moves.rest.setCurrentIndex(1)
    panel.moves.rest.activated.emit(1)
    panel.ground.plant_feet.click()
    assert panel.tuning == Tuning(
        mouth=0.5, blinks=17.0, seed=4, top_vowels=True, shapes=(ShapeTuning("Joy", 2.0),),
        moves=FACE_ONLY, left_out=True, plant_feet=True,
    )  # fmt: skip


def test_what_is_set_is_what_every_control_shows(panel: TunePanel) -> None:
    tuning = Tuning(
        head=1.5, smoothing=0.1, offset_ms=-40.0, breath=0.8, moves=frozenset({"mouth", "hands"}),
        shapes=(ShapeTuning("A", 0.5, 0.1),), lock_root=True,
    )  # fmt: skip
    panel.set_tuning(tuning)
    assert panel.tuning == tuning
    assert panel.rows["head"].slider.value() == 30
    assert panel.rows["offset_ms"].value == -40.0
    assert panel.moves.moves == {"mouth", "hands"}
    assert panel.moves.choice.currentText() == "Your choice"
    assert panel.shapes.gain.value == 0.5, "A is the first of the shapes"
    assert panel.ground.lock_root.isChecked()


def test_undo_takes_back_one_edit_after_another_and_redo_brings_them_again(
    panel: TunePanel, qtbot: QtBot
) -> None:
    for place in (25, 30, 36):  # one drag
        panel.rows["mouth"].slider.setValue(place)
    panel.rows["head"].box.setValue(0.5)
    panel.set_tuning(Tuning(blinks=9.0))
    qtbot.mouseClick(panel.undo_button, Qt.MouseButton.LeftButton)
    assert panel.tuning == Tuning(mouth=1.8, head=0.5)
    panel.undo_scope.undo()
    assert panel.tuning == Tuning(mouth=1.8)
    panel.undo_scope.undo()
    assert panel.tuning == Tuning()
    assert not panel.undo_button.isEnabled()
    for _ in range(3):
        panel.undo_scope.redo()
    assert panel.tuning == Tuning(blinks=9.0)


def test_a_fold_is_reset_alone_and_says_when_it_has_something_to_reset(
    panel: TunePanel, qtbot: QtBot
) -> None:
    panel.set_tuning(Tuning(mouth=0.5, blinks=10.0, lock_root=True))
    reset = panel.findChild(QToolButton, "tune_reset_life")
    assert isinstance(reset, QToolButton)
    assert not reset.isHidden()
    qtbot.mouseClick(reset, Qt.MouseButton.LeftButton)
    assert panel.tuning == Tuning(mouth=0.5, lock_root=True)
    assert reset.isHidden()
    panel.ground.reset.click()
    assert panel.tuning == Tuning(mouth=0.5)
    panel.reset.click()
    assert panel.tuning == Tuning()


def test_a_double_click_on_a_slider_resets_it(panel: TunePanel, qtbot: QtBot) -> None:
    panel.rows["expressiveness"].box.setValue(1.6)
    qtbot.mouseDClick(panel.rows["expressiveness"].slider, Qt.MouseButton.LeftButton)
    assert panel.tuning == Tuning()


@pytest.mark.parametrize(
    ("shapes", "bones", "off"),
    [
        ((), BONES, {"mouth", "brows", "face", "blinks"}),
        (("A",), (), {"brows", "eyes", "face", "head", "torso", "arms", "hands", "legs", "blinks", "darts",
                      "breath", "sway", "seed"}),
        (ARKIT_SHAPES, BONES, set()),
        ((), (), None),
    ],
)  # fmt: skip
def test_what_the_motion_has_no_channels_for_is_off(
    panel: TunePanel, shapes: tuple[str, ...], bones: tuple[str, ...], off: set[str] | None
) -> None:
    panel.show_motion(shapes, bones)
    found = {name for name, row in panel.rows.items() if not row.slider.isEnabled()}
    assert found == (set(panel.rows) if off is None else off)
    assert panel.ground.plant_feet.isEnabled() == bool(bones)
    assert panel.shapes.shape.isEnabled() == bool(shapes)


# -- presets -----------------------------------------------------------------------------------------


@pytest.fixture
def tunings(panel: TunePanel, qtbot: QtBot, tmp_path: Path) -> TuningPresetPresenter:
    session = Session(Settings())
    session.project = Project.create(tmp_path / "プロジェクト")
    tunings = TuningPresetPresenter(panel, session)
    qtbot.waitUntil(lambda: panel.presets.list.count() == 5)
    return tunings


def _titles(panel: TunePanel) -> list[str]:
    texts = [panel.presets.list.itemText(i) for i in range(panel.presets.list.count())]
    return [text for text in texts if text]


def _action(panel: TunePanel, name: str) -> QAction:
    found = panel.presets.findChild(QAction, name)
    assert found is not None
    return found


def _told(panel: TunePanel) -> str:
    toast = panel.window().findChild(Toast)
    return toast.text.text() if toast is not None else ""


def _choose(panel: TunePanel, title: str) -> None:
    index = panel.presets.list.findText(title)
    panel.presets.list.setCurrentIndex(index)
    panel.presets.list.activated.emit(index)


def test_a_preset_is_chosen_and_named_until_something_is_changed(
    panel: TunePanel, tunings: TuningPresetPresenter
) -> None:
    assert panel.presets.list.currentText() == "As predicted"
    _choose(panel, "Streaming")
    assert panel.tuning == presets.find("Streaming").tuning
    panel.rows["head"].box.setValue(0.3)
    assert panel.presets.list.currentIndex() == -1
    panel.undo_scope.undo()
    assert panel.presets.list.currentText() == "Streaming"


def test_a_tuning_is_saved_under_a_name_deleted_and_brought_back(
    panel: TunePanel, tunings: TuningPresetPresenter, qtbot: QtBot
) -> None:
    panel.rows["head"].box.setValue(0.3)
    _action(panel, "tune_preset_save").trigger()
    assert not panel.presets.naming.isHidden()
    panel.presets.name.setText("配信")
    qtbot.keyClick(panel.presets.name, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: panel.presets.list.currentText() == "配信")
    _action(panel, "tune_preset_delete").trigger()
    qtbot.waitUntil(lambda: "配信" not in _titles(panel))
    assert panel.tuning == Tuning(head=0.3), "what is tuned stays tuned"
    qtbot.waitUntil(lambda: _told(panel) == "Preset 配信 deleted.")
    toast = panel.window().findChild(Toast)
    assert toast is not None
    toast.action.click()
    qtbot.waitUntil(lambda: "配信" in _titles(panel))


def test_a_shipped_preset_can_be_neither_deleted_nor_replaced(
    panel: TunePanel, tunings: TuningPresetPresenter, qtbot: QtBot
) -> None:
    _choose(panel, "Calm")
    assert not _action(panel, "tune_preset_delete").isEnabled()
    tunings.save("Calm")
    qtbot.waitUntil(lambda: _told(panel) == "Calm is a preset of the studio.")


def test_presets_travel_by_file_and_a_broken_one_changes_nothing(
    panel: TunePanel, tunings: TuningPresetPresenter, qtbot: QtBot, tmp_path: Path
) -> None:
    panel.set_tuning(Tuning(blinks=11.0))
    tunings.send_out(tmp_path / "夜の配信")
    qtbot.waitUntil(lambda: (tmp_path / "夜の配信.json").is_file())
    panel.set_tuning(Tuning())
    tunings.bring_in(tmp_path / "夜の配信.json")
    qtbot.waitUntil(lambda: panel.tuning == Tuning(blinks=11.0))
    qtbot.waitUntil(lambda: "夜の配信" in _titles(panel))
    (tmp_path / "broken.json").write_text("{")
    tunings.bring_in(tmp_path / "broken.json")
    qtbot.waitUntil(lambda: _told(panel) == "broken.json is no preset: it is damaged.")
    assert panel.tuning == Tuning(blinks=11.0)
