"""The data card from the window: a real child process writes it."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui import theme
from studio.ui.curate.library_presenter import DataCardPresenter
from studio.ui.curate.library_view import Library
from studio.ui.curate.model import CurateModel
from studio.ui.session import Session


@pytest.mark.slow
def test_the_card_is_written_beside_the_window(qtbot: QtBot, toy_project: Project, tmp_path: Path) -> None:
    session, library = Session(), Library()
    qtbot.addWidget(library)
    session.project = toy_project
    told: list[str] = []
    session.status_changed.connect(lambda key, text, health: told.append(text))
    making = DataCardPresenter(library, CurateModel(session), session)
    making.make(tmp_path / "カード")
    qtbot.waitUntil(lambda: not making.running and told[-1:] == [""], timeout=60_000)
    assert "3 takes" in (tmp_path / "カード.html").read_text(encoding="utf-8")
    assert told[0] == "Counting for the data card…"


def test_no_button_of_the_librarys_head_is_cut(qtbot: QtBot, qapp: QApplication) -> None:
    theme.apply(qapp)
    library = Library()
    qtbot.addWidget(library)
    library.setMinimumWidth(300)  # as in a window that is no wider
    library.show()
    library.summary.setText("12 takes, 02:30")
    buttons = (library.fix_button, library.split_button, library.import_button)
    for wide in (800, 486):
        library.resize(wide, 300)
        for count in (0, 12):
            library.show_count(count)
            qtbot.waitUntil(lambda: all(one.width() >= one.sizeHint().width() for one in buttons))
