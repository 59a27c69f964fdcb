"""Packing and unpacking from the window, by real children."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel, QWidget
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui.imports import PackTask, free_folder
from studio.ui.session import Session


def test_a_folder_that_is_there_gets_a_number(tmp_path: Path) -> None:
    assert free_folder(tmp_path, "P").name == "P"
    (tmp_path / "P").mkdir()
    (tmp_path / "P 2").mkdir()
    assert free_folder(tmp_path, "P").name == "P 3"


@pytest.mark.slow
def test_a_project_is_packed_and_opened_elsewhere(qtbot: QtBot, toy_project: Project, tmp_path: Path) -> None:
    session, window = Session(), QWidget()
    qtbot.addWidget(window)
    window.show()
    session.project = toy_project
    opened: list[Path] = []
    packing = PackTask(session, window, opened.append)
    packing.pack(tmp_path / "包み")
    qtbot.waitUntil(lambda: not packing.running, timeout=60_000)
    packed = tmp_path / "包み.zip"
    with zipfile.ZipFile(packed, "a") as file:
        file.writestr("studio/__init__.py", "raise SystemExit")
    packing.unpack(packed, tmp_path / "else where")
    qtbot.waitUntil(lambda: opened == [tmp_path / "else where"], timeout=60_000)
    other = Project.open(tmp_path / "else where", read_only=True)
    assert [take.id for take in other.takes] == [take.id for take in toy_project.takes]
    assert other.dataset == toy_project.dataset
    assert not (other.folder / "studio").exists()
    said = window.findChild(QLabel, "toast_text")
    assert said is not None
    assert said.text() == "1 file in the zip does not belong to a project and was skipped."
    packing.close()


@pytest.mark.slow
def test_a_zip_that_leads_out_of_its_folder_is_refused_with_a_sentence(qtbot: QtBot, tmp_path: Path) -> None:
    packed = tmp_path / "bad.zip"
    with zipfile.ZipFile(packed, "w") as file:
        file.writestr("project.json", "{}")
        file.writestr("../evil.txt", "x")
    session, window = Session(), QWidget()
    qtbot.addWidget(window)
    window.show()
    opened: list[Path] = []
    packing = PackTask(session, window, opened.append)
    packing.unpack(packed, tmp_path / "P")

    def said() -> str:
        found = window.findChild(QLabel, "toast_text")
        return found.text() if found is not None else ""

    qtbot.waitUntil(
        lambda: said() == "bad.zip contains a path that leads outside the project.", timeout=60_000
    )
    assert opened == []
    assert not (tmp_path / "P").exists()
    assert not (tmp_path.parent / "evil.txt").exists()
    packing.close()
