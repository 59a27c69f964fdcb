"""Words and choices that have no room."""

from __future__ import annotations

from PySide6.QtCore import QEvent
from PySide6.QtGui import QHelpEvent
from PySide6.QtWidgets import QApplication, QToolTip
from pytestqt.qtbot import QtBot

from studio.ui import theme
from studio.ui.widgets.card import CutComboBox, CutLabel


def test_a_choice_without_room_is_told_whole_in_its_tip(qtbot: QtBot, qapp: QApplication) -> None:
    theme.apply(qapp)
    box = CutComboBox()
    qtbot.addWidget(box)
    box.addItem("average (usual)")
    box.setToolTip("Whose way of moving")
    box.show()
    box.resize(300, box.height())
    assert not box.cut
    box.resize(90, box.height())
    assert box.cut
    middle = box.rect().center()
    QApplication.sendEvent(box, QHelpEvent(QEvent.Type.ToolTip, middle, box.mapToGlobal(middle)))
    qtbot.waitUntil(lambda: QToolTip.text() == "average (usual)\nWhose way of moving")
    QToolTip.hideText()


def test_a_short_word_stands_in_for_a_sentence_and_always_has_room(qtbot: QtBot) -> None:
    label = CutLabel()
    qtbot.addWidget(label)
    label.setText("No sound device can play.")
    label.short = "No sound"
    assert label.minimumSizeHint().width() >= label.fontMetrics().horizontalAdvance("No sound")
    label.setText("")
    assert label.minimumSizeHint().width() == 0
