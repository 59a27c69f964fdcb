"""Bones guessed at import, corrected in the window, and the take made anew with them."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui.bone_table import BoneDialog
from studio.ui.curate.presenter import CuratePresenter
from studio.ui.curate.view import CurateView
from studio.ui.imports import Importer
from studio.ui.session import Session
from tests.formats.test_bone_tables import a_bvh

PAIRS = (("root", "Hips"), ("mune", ""), ("atama", "Head"), ("bōshi", ""))


def _accept(dialog: BoneDialog) -> QPushButton:
    button = dialog.findChild(QPushButton, "bone_accept")
    assert button is not None
    return button


def _problem(dialog: BoneDialog) -> str:
    found = dialog.findChild(QLabel, "bone_problem")
    assert found is not None
    return found.text()


def test_a_table_that_makes_no_sense_cannot_be_used_and_says_why(qtbot: QtBot) -> None:
    dialog = BoneDialog("dance.bvh", PAIRS)
    qtbot.addWidget(dialog)
    assert _problem(dialog) == "2 of 4 joints are bones."
    dialog.choose("bōshi", "Head")
    assert _problem(dialog) == "Head is assigned to both atama and bōshi. Choose one."
    assert not _accept(dialog).isEnabled()
    dialog.choose("atama", "")
    assert _accept(dialog).isEnabled()
    dialog.choose("root", "")
    assert _problem(dialog) == "Choose which joint is the hips: every other bone depends on it."
    reset = dialog.findChild(QPushButton, "bone_reset")
    assert reset is not None
    qtbot.mouseClick(reset, Qt.MouseButton.LeftButton)
    assert dialog.chosen == dict(PAIRS)


@pytest.mark.slow
def test_a_skeleton_nobody_knows_is_asked_about_and_then_imported(qtbot: QtBot, tmp_path: Path) -> None:
    path = a_bvh(tmp_path / "踊り.bvh", ("kosi", "mune", "atama"))
    session, window = Session(), QWidget()
    qtbot.addWidget(window)
    window.show()
    session.project = Project.create(tmp_path / "P")
    curate = CuratePresenter(CurateView(window), session)
    importer = Importer(session, window, lambda: curate)
    session.import_requested.connect(importer.start)
    importer.start((path,))
    qtbot.waitUntil(lambda: importer.bones.dialog is not None and not importer.running, timeout=60_000)
    dialog = importer.bones.dialog
    assert dialog is not None
    for joint, bone in (("kosi", "Hips"), ("mune", "Spine"), ("atama", "Head")):
        dialog.choose(joint, bone)
    qtbot.mouseClick(_accept(dialog), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: not importer.running and len(session.project.takes) == 1, timeout=60_000)
    assert set(session.project.takes[0].info.bone_names) == {"Hips", "Spine", "Head"}
    importer.close()
    curate.close()
    session.project.close()
