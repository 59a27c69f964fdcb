"""A batch through its dialog: real children, failures that stop nothing, and the question before a loss."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import QTimer
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMessageBox, QPushButton
from pytestqt.qtbot import QtBot

from studio.cli import main
from studio.formats import bvh
from studio.ipc.events import QueueEvent
from studio.project import Project
from studio.take.motion_file import read_motion
from studio.training.styles import RunSelection, run_choice
from studio.ui.review.batch_presenter import BatchPresenter, batch_arguments
from studio.ui.review.batch_view import BatchDialog, BatchRequest
from studio.ui.review.model import ReviewModel
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from tests.fakes import FakeChildTask

ROOT = Path(__file__).resolve().parents[3]
Tab = tuple[ReviewView, ReviewPresenter]


def _opened(view: ReviewView, presenter: ReviewPresenter) -> BatchDialog:
    button = view.findChild(QPushButton, "batch_button")
    assert button is not None
    button.click()
    dialog = presenter.batch.dialog
    assert dialog is not None
    assert dialog.isVisible()
    return dialog


def _format(dialog: BatchDialog, *names: str) -> None:
    for name in names:
        action = dialog.more.findChild(QAction, f"more_{name}")
        assert action is not None
        action.trigger()


def _done(qtbot: QtBot, presenter: ReviewPresenter, dialog: BatchDialog) -> list[tuple[str, ...]]:
    qtbot.waitUntil(lambda: not presenter.batch.busy)
    items = [dialog.list.topLevelItem(row) for row in range(dialog.list.topLevelItemCount())]
    return [(item.text(0), item.text(1), item.text(2)) for item in items if item is not None]


def test_all_takes_are_exported_and_nothing_is_written_over_unasked(
    qtbot: QtBot, tab: Tab, tmp_path: Path
) -> None:
    view, presenter = tab
    dialog, out = _opened(view, presenter), tmp_path / "出力: all"
    dialog.material.setCurrentIndex(1)
    dialog.run.setCurrentIndex(0)
    dialog.folder.setText(str(out))
    _format(dialog, "bvh", "arrow")
    assert len(dialog.formats.text().split(", ")) == 2
    dialog.start.click()
    rows = _done(qtbot, presenter, dialog)
    names = [f"toy_{number:03d}{suffix}" for number in (1, 2, 3) for suffix in (".arrow", ".bvh")]
    assert sorted(name for name, _, _ in rows) == names
    assert {state for _, state, _ in rows} == {"done"}
    assert dialog.message.text() == "6 files written and read back."
    assert len(bvh.read(out / "toy_002.bvh").motion or ()) == 180
    mine = (out / "toy_001.bvh").read_bytes()
    asked: list[str] = []

    def refuse() -> None:
        box = dialog.findChild(QMessageBox, "question")
        if box is not None and box.isVisible():
            look.stop()
            asked.append(box.text())
            next(button for button in box.buttons() if button.text() == "Cancel").click()

    look = QTimer()
    look.timeout.connect(refuse)
    look.start(50)
    dialog.start.click()
    qtbot.waitUntil(lambda: bool(asked))
    assert asked[0] in [f"{name} already exists. Replace its contents?" for name in names]
    assert not presenter.batch.busy
    assert (out / "toy_001.bvh").read_bytes() == mine


def test_what_is_missing_is_said(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, presenter = tab
    dialog = _opened(view, presenter)
    dialog.start.click()
    assert dialog.message.text() == "Choose the sounds first."
    dialog.set_sounds([tmp_path])
    assert dialog.run.currentText() == "Base voice"
    dialog.run.setCurrentIndex(0)
    dialog.start.click()
    assert dialog.message.text() == "Choose a run: sounds need one to become motion."
    assert not presenter.batch.busy


def test_a_dropped_folder_waits_in_the_form(tab: Tab, session: Session, tmp_path: Path) -> None:
    view, presenter = tab
    session.batch_dropped.emit(tmp_path / "声 sounds")
    dialog = presenter.batch.dialog
    assert dialog is not None
    assert dialog.isVisible()
    assert dialog.material.currentData() == "sounds"
    assert dialog.chosen.text() == str(tmp_path / "声 sounds")
    assert not presenter.batch.busy, "nothing begins before a person says so"
    assert _opened(view, presenter) is not dialog, "the form is a new one the next time"


def _runs(project: Project) -> None:
    """Two runs that are only looked at: one draws its motion and has styles, the newer does neither."""
    for name, report in (
        ("drawn_001", {"styles": ["友: 静か", "toy_001"], "style": "toy_001", "draws": True}),
        ("quick_001", {}),
    ):
        folder = project.runs_folder / name
        folder.mkdir(parents=True)
        (folder / "best.safetensors").write_bytes(b"weights")
        facts = {"version": 1, "status": "done", **report}
        (folder / "report.json").write_text(json.dumps(facts), encoding="utf-8")


def test_a_batch_moves_as_the_bar_shows(tab: Tab, session: Session, tmp_path: Path) -> None:
    view, presenter = tab
    project = session.project
    assert project is not None
    _runs(project)
    shown = RunSelection("drawn_001", "友: 静か", 2, 0.5)
    view.bar.show_runs([run_choice(project.run(name)) for name in ("drawn_001", "quick_001")],
                       [shown, RunSelection()])  # fmt: skip
    dialog = _opened(view, presenter)
    assert dialog.chooser.styles.currentText() == "友: 静か"
    assert dialog.run_options.text() == "Liveliness: calm. Variation 3."
    requests: list[BatchRequest] = []
    dialog.start_requested.disconnect()
    dialog.start_requested.connect(requests.append)
    dialog.set_sounds([tmp_path / "a.wav"])
    dialog.start.click()
    assert requests[-1].selection == shown
    manner = ["--style=友: 静か", "--liveliness=0.5", "--seed=2"]
    assert batch_arguments(requests[-1], project.folder, [])[4:7] == manner
    dialog.material.setCurrentIndex(1)
    dialog.start.click()
    words = batch_arguments(requests[-1], project.folder, ["toy_001", "toy_002"])
    assert words[2:7] == ["drawn_001:toy_001", "drawn_001:toy_002", *manner]
    dialog.run.setCurrentIndex(dialog.run.findData("quick_001"))
    dialog.start.click()
    assert requests[-1].selection == RunSelection("quick_001")
    assert dialog.run_options.isHidden()
    dialog.run.setCurrentIndex(0)
    dialog.start.click()
    assert "--seed=2" not in batch_arguments(requests[-1], project.folder, ["toy_001"])


def test_without_a_run_in_the_bar_the_newest_is_proposed(tab: Tab, session: Session) -> None:
    view, presenter = tab
    project = session.project
    assert project is not None
    _runs(project)
    assert _opened(view, presenter).chooser.wanted == RunSelection("quick_001")


def test_a_batch_of_the_project_before_is_none_of_the_new_form(
    qtbot: QtBot, session: Session, tmp_path: Path
) -> None:
    view, model, child = ReviewView(), ReviewModel(session), FakeChildTask(tmp_path)
    qtbot.addWidget(view)
    model.active = True
    model.open()
    batch = BatchPresenter(view, model, session, child)
    before = tmp_path / "before"
    half_written = _left_half_written(before)
    for folder in (before, tmp_path / "after"):
        batch.show()
        dialog = batch.dialog
        assert dialog is not None
        dialog.material.setCurrentIndex(1)
        dialog.run.setCurrentIndex(0)
        dialog.folder.setText(str(folder))
        dialog.tuned.setChecked(False)
        _format(dialog, "bvh")
        dialog.start.click()
        if folder == before:
            model.open()  # another project
    assert dialog is not None
    assert dialog.message.text() == "The previous batch is still stopping. Try again in a moment."
    child.say(QueueEvent(("a.bvh",)))
    assert dialog.list.topLevelItemCount() == 0
    assert half_written.exists()
    child.end(None)
    assert dialog.message.text() == "The previous batch has stopped."
    assert not half_written.exists(), "its half-written files lie in its own folder"
    assert not batch.busy
    dialog.start.click()
    assert child.started[-1][child.started[-1].index("-o") + 1] == str(tmp_path / "after")
    model.close()


def _left_half_written(folder: Path) -> Path:
    """A file that a killed process began."""
    folder.mkdir()
    code = "import pathlib, sys\n"
    code += "from studio.files.leftovers import beside\nprint(beside(pathlib.Path(sys.argv[1])))"
    command = [sys.executable, "-c", code, str(folder / "a.bvh")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    path = Path(done.stdout.strip())
    path.write_text("half")
    return path


def test_a_long_failure_can_be_read_whole(tab: Tab) -> None:
    view, presenter = tab
    dialog = _opened(view, presenter)
    why = "No sound could be read from broken.mp3. Choose a WAV, FLAC, OGG, MP3 or M4A file."
    dialog.show_entries(["a.vrma", "broken.vrma", "worse.vrma"])
    assert dialog.details.isHidden()
    dialog.show_entry(0, "done")
    dialog.show_entry(1, "failed", why)
    dialog.show_entry(2, "failed", "The disk is full. Free some space.")
    assert dialog.details.isVisible()
    assert dialog.details.wordWrap()
    assert dialog.details.text() == f"broken.vrma: {why}"
    assert not dialog.list.selectedItems(), "it is looked at, not chosen to be cancelled"
    dialog.list.setCurrentItem(dialog.list.topLevelItem(2))
    assert dialog.details.text() == "worse.vrma: The disk is full. Free some space."
    dialog.list.setCurrentItem(dialog.list.topLevelItem(0))
    assert dialog.details.isHidden()
    dialog.show_entries(["again.vrma"])
    assert dialog.details.isHidden()


@pytest.mark.slow
def test_a_folder_of_sounds_with_a_broken_one_and_one_that_is_not_wanted(
    qtbot: QtBot, tab: Tab, session: Session, tmp_path: Path
) -> None:
    view, presenter = tab
    project = session.project
    assert project is not None
    assert (
        main(["train", str(project.folder), "--recipe", "quick", "--set", "epochs=1", "--set", "steps=2"])
        == 0
    )
    folder, out = tmp_path / "声 sounds", tmp_path / "out"
    folder.mkdir()
    for name in ("a: 今日.wav", "b.flac", "z last.wav"):
        soundfile.write(folder / name, np.random.default_rng(1).normal(0, 0.1, 16_000), 16_000)
    (folder / "broken.mp3").write_bytes(b"ID3 no sound" * 30)
    dialog = _opened(view, presenter)
    dialog.set_sounds([folder])
    dialog.folder.setText(str(out))
    _format(dialog, "arrow")
    dialog.start.click()
    qtbot.waitUntil(lambda: dialog.list.topLevelItemCount() == 4)
    last = dialog.list.topLevelItem(3)
    assert last is not None
    last.setSelected(True)
    dialog.skip.click()  # while torch is loaded for the first one
    rows = _done(qtbot, presenter, dialog)
    states = {name: (state, words) for name, state, words in rows}
    assert states["a_ 今日_quick_001.arrow"][0] == "done"
    assert states["z last_quick_001.arrow"][0] == "cancelled"
    assert states["broken_quick_001.arrow"] == (
        "failed",
        "No sound could be read from broken.mp3. Choose a WAV, FLAC, OGG, MP3 or M4A file.",
    )
    assert dialog.message.text() == (
        "2 files written and read back. 1 failed; the list says why. 1 cancelled."
    )
    assert sorted(path.name for path in out.iterdir()) == [
        "a_ 今日_quick_001.arrow", "b_quick_001.arrow"
    ]  # fmt: skip
    assert len(read_motion(out / "b_quick_001.arrow")) == 30


def test_cancel_all_ends_it_and_what_was_finished_stays(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, presenter = tab
    dialog, out = _opened(view, presenter), tmp_path / "out"
    dialog.material.setCurrentIndex(1)
    dialog.run.setCurrentIndex(0)
    dialog.folder.setText(str(out))
    _format(dialog, "mp4")
    dialog.start.click()
    qtbot.waitUntil(lambda: out.is_dir() and any(out.iterdir()))
    dialog.cancel.click()
    _done(qtbot, presenter, dialog)
    assert dialog.message.text() == "Cancelled. What was finished stays."
    assert not [path for path in out.iterdir() if path.name.startswith(".")], "nothing half-written"
