"""The Settings dialog draws the table of settings, keeps a change at once, and puts it back."""

from __future__ import annotations

from typing import Any

import pytest
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QComboBox,
    QDoubleSpinBox,
    QLabel,
    QLineEdit,
    QSpinBox,
    QToolButton,
    QWidget,
)
from pytestqt.qtbot import QtBot

from studio import settings
from studio.project import Project
from studio.settings import NO_MICROPHONE, Settings
from studio.ui import theme
from studio.ui.main_window import MainWindow
from studio.ui.messages import Toast
from studio.ui.session import Session
from studio.ui.settings_dialog import SettingsDialog


@pytest.fixture
def dialog(qtbot: QtBot, session: Session) -> SettingsDialog:
    found = SettingsDialog(session)
    qtbot.addWidget(found)
    found.show()
    return found


def test_every_setting_with_a_label_has_a_line_and_no_other(dialog: SettingsDialog) -> None:
    named = [one.objectName() for one in dialog.findChildren(QWidget)]
    for name, about in Settings.info().items():
        assert (f"setting_{name}" in named) == bool(about.title), name
        assert (f"reset_{name}" in named) == bool(about.title), name


def test_a_change_is_kept_at_once_and_can_be_put_back(dialog: SettingsDialog, session: Session) -> None:
    values = {"vmc_port": 39600, "pre_roll": 2.5, "slate": "さくら", "send_names": "arkit", "recipe": "saia"}
    for name, value in values.items():
        control = dialog.findChild(QWidget, f"setting_{name}")
        if isinstance(control, QSpinBox | QDoubleSpinBox):
            control.setValue(value)  # type: ignore[arg-type]
        elif isinstance(control, QComboBox):
            control.setCurrentIndex(control.findData(value))
            control.activated.emit(control.currentIndex())
        elif isinstance(control, QLineEdit):
            control.setText(str(value))
            control.editingFinished.emit()
        assert getattr(session.settings, name) == getattr(settings.load(), name) == value
        reset = dialog.findChild(QToolButton, f"reset_{name}")
        assert isinstance(reset, QToolButton)
        assert reset.isEnabled()
        reset.click()
        assert getattr(settings.load(), name) == getattr(Settings(), name)
        assert not reset.isEnabled()


def test_a_number_keeps_its_limits(dialog: SettingsDialog) -> None:
    port = dialog.findChild(QAbstractSpinBox, "setting_vmc_port")
    assert isinstance(port, QSpinBox)
    assert (port.minimum(), port.maximum()) == (1, 65535)


def test_a_bad_text_is_refused_in_a_sentence_and_the_value_stays(dialog: SettingsDialog) -> None:
    line = dialog.findChild(QLineEdit, "setting_send_targets")
    assert isinstance(line, QLineEdit)
    line.setText("nowhere")
    line.editingFinished.emit()
    toast = dialog.findChild(Toast)
    assert isinstance(toast, Toast)
    assert toast.text.text() == "Send to cannot have this value."
    assert line.text() == "VSeeFace=127.0.0.1:39540"


def test_what_is_changed_elsewhere_is_shown(dialog: SettingsDialog, session: Session) -> None:
    session.change_settings(countdown=7.0)
    countdown = dialog.findChild(QDoubleSpinBox, "setting_countdown")
    assert isinstance(countdown, QDoubleSpinBox)
    assert countdown.value() == 7.0


def test_a_recording_keeps_the_inputs_it_began_with(dialog: SettingsDialog, session: Session) -> None:
    session.set_rolling(True)
    assert not dialog.findChild(QWidget, "setting_vmc_port").isEnabled()  # type: ignore[union-attr]
    session.set_rolling(False)
    assert dialog.findChild(QWidget, "setting_vmc_port").isEnabled()  # type: ignore[union-attr]


def test_the_tabs_show_what_is_changed_in_the_dialog(
    qtbot: QtBot, session: Session, toy_project: Project
) -> None:
    toy_project.close()
    window = MainWindow(session)
    qtbot.addWidget(window)
    session.open_project(toy_project.folder)
    views: dict[str, Any] = {}
    for tab in ("record", "train", "review", "live"):
        window.show_room(tab)
        views[tab] = window.room(tab)[0]
    session.change_settings(
        vmc_port=39611, countdown=7.0, pre_roll=4.0, slate="Night", audio_device=NO_MICROPHONE,
        recipe="saia", export_fps=24.0, send_fps=90.0, send_targets=("VNyan=a:5",),
    )  # fmt: skip
    record = views["record"]
    assert record.inputs.port.currentData() == 39611
    assert record.inputs.device.currentData() == NO_MICROPHONE
    assert (record.slate_bar.countdown.currentData(), record.slate_bar.pre_roll.currentData()) == (7.0, 4.0)
    assert record.slate_bar.slate.text() == "Night"
    assert views["train"].recipe.recipe.currentData() == "saia"
    assert views["review"].export.fps.currentData() == 24.0
    for panel in (views["review"].send, views["live"].send):
        assert panel.fps.currentData() == 90.0
        assert [row.address.where for row in panel.rows] == ["a:5"]
    window.menus.light.trigger()
    assert session.settings.theme == theme.colours().name == "light"
    session.change_settings(theme="dark")
    assert theme.colours().name == "dark"
    assert not window.menus.light.isChecked()
    window.close()


def test_no_line_is_cut_however_low_the_window(dialog: SettingsDialog, qtbot: QtBot) -> None:
    for height in (dialog.height(), 400):
        dialog.resize(dialog.width(), height)
        qtbot.waitUntil(lambda height=height: dialog.height() == height)  # type: ignore[misc]
        for meaning in dialog.findChildren(QLabel):
            if meaning.wordWrap() and meaning.isVisible():
                assert meaning.height() >= meaning.heightForWidth(meaning.width()), meaning.text()


def test_zero_says_what_it_means(dialog: SettingsDialog, session: Session) -> None:
    for name, words in (("sample_rate", "the device's own"), ("export_fps", "as recorded")):
        spin = dialog.findChild(QAbstractSpinBox, f"setting_{name}")
        assert isinstance(spin, QAbstractSpinBox)
        assert spin.text() == words
        reset = dialog.findChild(QToolButton, f"reset_{name}")
        assert isinstance(reset, QToolButton)
        assert reset.toolTip() == f"Back to the default: {words}"


def test_a_default_is_named_as_a_person_would(dialog: SettingsDialog) -> None:
    named = {}
    for name in Settings.shown():
        reset = dialog.findChild(QToolButton, f"reset_{name}")
        assert isinstance(reset, QToolButton)
        named[name] = reset.toolTip().removeprefix("Back to the default: ")
    assert (named["remote"], named["notify"], named["theme"]) == ("Off", "On", "Dark")
    assert (named["recipe"], named["vmc_host"]) == ("Balanced", "This computer")
    assert (named["audio_device"], named["audio_output"]) == ("Default microphone", "Default output")


def test_devices_are_chosen_from_a_list_and_one_that_is_absent_stays(
    dialog: SettingsDialog, session: Session
) -> None:
    session.change_settings(audio_device="Studio mic", audio_output="Headphones")
    dialog.show_devices((("USB mic", "default"), ("Headphones", "Screen")))
    microphone = dialog.findChild(QComboBox, "setting_audio_device")
    speaker = dialog.findChild(QComboBox, "setting_audio_output")
    assert isinstance(microphone, QComboBox)
    assert isinstance(speaker, QComboBox)
    listed = [microphone.itemText(i) for i in range(microphone.count())]
    assert listed == ["Default microphone", "No microphone", "USB mic", "Studio mic (not found)"]
    assert microphone.currentText() == "Studio mic (not found)"
    assert speaker.currentText() == "Headphones"
    microphone.setCurrentIndex(2)
    microphone.activated.emit(2)
    speaker.setCurrentIndex(0)
    speaker.activated.emit(0)
    assert (settings.load().audio_device, settings.load().audio_output) == ("USB mic", "")


def test_an_address_of_ones_own_is_kept_in_the_list(dialog: SettingsDialog, session: Session) -> None:
    session.change_settings(vmc_host="192.168.1.20")
    box = dialog.findChild(QComboBox, "setting_vmc_host")
    assert isinstance(box, QComboBox)
    assert box.currentText() == "192.168.1.20"
    assert session.settings.vmc_host == "192.168.1.20"
