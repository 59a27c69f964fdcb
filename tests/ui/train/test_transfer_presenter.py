"""The model card and its note, and a run that comes from a file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui.messages import Toast
from studio.ui.session import Session
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.view import TrainView

MINUTE = 60_000


@pytest.fixture
def session(session: Session, toy_project: Project) -> Session:
    folder = toy_project.new_run_folder("quick")
    (folder / "best.safetensors").write_bytes(b"weights")
    report = {"status": "done", "title": "Quick look", "train": ["toy_001"], "performers": ["友"]}
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    return session


def _press(qtbot: QtBot, parent: object, name: str) -> None:
    found = parent.findChild(QPushButton, name)  # type: ignore[attr-defined]
    assert found is not None
    assert found.isEnabled()
    qtbot.mouseClick(found, Qt.MouseButton.LeftButton)


def test_the_card_is_read_and_its_note_is_kept(
    qtbot: QtBot, tab: tuple[TrainView, TrainPresenter], toy_project: Project
) -> None:
    view, presenter = tab
    _press(qtbot, view, "card_of_run")
    dialog = presenter.transfer.dialog
    assert dialog is not None
    text = dialog.card.toPlainText()
    assert "Quick look" in text
    assert "友" in text
    assert "Nobody has said yet" in text
    assert not dialog.save.isEnabled(), "nothing was written yet"
    dialog.licence.setPlainText("友 agreed.")
    _press(qtbot, dialog, "save_licence")
    assert "友 agreed." in dialog.card.toPlainText()
    assert not dialog.save.isEnabled()
    assert (toy_project.run("quick_001").folder / "licence.txt").read_text(encoding="utf-8") == "友 agreed."
    dialog.close()
    assert presenter.transfer.dialog is None


@pytest.mark.slow
def test_a_file_that_is_no_run_is_a_sentence_in_the_window(
    qtbot: QtBot,
    tab: tuple[TrainView, TrainPresenter],
    session: Session,
    toy_project: Project,
    tmp_path: Path,
) -> None:
    view, _ = tab
    broken = tmp_path / "壊れた.saiarun"
    broken.write_bytes(b"no run")
    session.run_dropped.emit(broken)

    def told() -> str:
        toast = view.findChild(Toast)
        return toast.text.text() if toast is not None else ""

    qtbot.waitUntil(lambda: told() == "壊れた.saiarun is damaged or no run of Saia Studio.", timeout=MINUTE)
    assert [run.id for run in toy_project.runs] == ["quick_001"]


def test_a_run_can_come_into_a_project_without_takes(qtbot: QtBot) -> None:
    view = TrainView()
    qtbot.addWidget(view)
    view.show_empty(True)
    view.show()
    with qtbot.waitSignal(view.import_requested):
        _press(qtbot, view, "train_import_run")
