"""Review with a run that was really trained: generate, compare, play, tune, send, export."""

from __future__ import annotations

import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QLabel, QMessageBox
from pytestqt.qtbot import QtBot

from studio.cli import main
from studio.dataset import edits
from studio.formats import bvh
from studio.metrics.scores import is_still
from studio.take.motion_file import read_motion
from studio.training.styles import RunChoice, RunSelection
from studio.ui.messages import Toast
from studio.ui.review.model import A
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.session import Session

MINUTE = 60_000


def _loaded(qtbot: QtBot, presenter: ReviewPresenter) -> None:
    qtbot.waitUntil(lambda: presenter.model.tuned is not None, timeout=MINUTE)


def _text(view: ReviewView, name: str) -> str:
    found = view.findChild(QLabel, name)
    assert found is not None
    return found.text()


def test_a_take_nobody_trained_on_comes_up_first(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, _ = tab
    item = view.sources.currentItem()
    assert item.data(Qt.ItemDataRole.UserRole) == "take:toy_003"
    assert view.stage.captured.isVisible()
    assert not view.stage.predicted.isVisible()


def test_an_empty_stage_says_what_is_being_read(opened: tuple[ReviewView, ReviewPresenter]) -> None:
    view, _ = opened
    assert view.stage.predicted.isVisible()
    assert view.stage.predicted.figure.accessibleDescription() == "Loading toy_003…"
    assert not view.stage.captured.isVisible(), "it would say that there is no captured motion"


def test_what_the_bars_show_does_not_move_the_columns(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, _ = tab
    view.resize(1040, 588)
    qtbot.waitUntil(lambda: sum(view.columns.sizes()) < 1040, timeout=MINUTE)
    before = view.columns.sizes()
    run = RunChoice("balanced_001", ("average", "Hello_001"), "average", draws=True)
    view.bar.show_runs([run], [RunSelection(run.id), RunSelection(run.id)])
    view.bar.show_ghost_choice(True, True)
    view.bar.show_two(True)
    view.show_metrics("error 0.123  r 0.84  motion 0.92  bones 12.3°", "")
    view.tabs.setCurrentWidget(view.export)
    view.columns.refresh()
    assert view.columns.sizes() == before


def test_the_word_over_a_figure_is_not_on_the_picture(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    pane = tab[0].stage.captured
    qtbot.waitUntil(lambda: pane.caption.words == "Captured", timeout=MINUTE)
    assert pane.caption.geometry().bottom() < pane.figure.geometry().top()
    pane.show_nothing("Nothing.")
    assert pane.caption.words == ""


def test_playing_moves_the_playhead_and_the_figure(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, presenter = tab
    qtbot.mouseClick(view.play, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: view.timeline.playhead > 0.3, timeout=MINUTE)
    if presenter.model.player is not None and presenter.model.player.playing:
        qtbot.keyClick(view, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: view.play.accessibleName() == "Play", timeout=MINUTE)
    view.seek_requested.emit(1.0)  # a busy machine may have let it play to the end
    qtbot.waitUntil(lambda: view.timeline.playhead == 1.0, timeout=MINUTE)
    qtbot.keyClick(view, Qt.Key.Key_Right)
    qtbot.waitUntil(lambda: view.timeline.playhead > 1.0, timeout=MINUTE)
    assert view.timeline.playhead == pytest.approx(1.0 + 1 / 30, abs=0.02)


def test_tuning_changes_what_is_shown_and_a_reset_brings_it_back(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, presenter = tab
    assert presenter.model.tuned is not None
    before = presenter.model.tuned.shapes[:, 0].max()
    view.tune.rows["mouth"].box.setValue(0.5)
    qtbot.waitUntil(
        lambda: presenter.model.tuned.shapes[:, 0].max() == pytest.approx(before / 2, rel=0.01),
        timeout=MINUTE,
    )
    view.tune.reset.click()
    qtbot.waitUntil(lambda: presenter.model.tuned.shapes[:, 0].max() == pytest.approx(before), timeout=MINUTE)


def test_head_and_body_are_tuned_apart(qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]) -> None:
    view, presenter = tab

    def nod() -> float:
        tuned = presenter.model.tuned
        assert tuned is not None
        return float(np.ptp(tuned.rotations[:, tuned.bone_names.index("Head"), 0]))

    before, first = nod(), presenter.model.tuned
    assert before > 0.1
    view.tune.rows["torso"].box.setValue(0.0)
    view.tune.rows["arms"].box.setValue(0.0)
    qtbot.waitUntil(lambda: presenter.model.tuned is not first, timeout=MINUTE)
    assert nod() == pytest.approx(before, abs=1e-3), "the head is none of the body's"
    view.tune.rows["head"].box.setValue(0.0)
    qtbot.waitUntil(lambda: nod() == pytest.approx(0.0, abs=1e-3), timeout=MINUTE)


def test_sending_reaches_a_listener_and_the_light_says_so(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, presenter = tab
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(60.0)
        row = view.send.rows[0]
        row.port.setValue(listener.getsockname()[1])
        qtbot.mouseClick(row.send, Qt.MouseButton.LeftButton)
        qtbot.waitUntil(lambda: _text(view, "target_state").startswith("sending"), timeout=MINUTE)
        assert b"/VMC/Ext/" in listener.recv(65536)
        assert row.send.text() == "Stop sending"
        qtbot.mouseClick(row.send, Qt.MouseButton.LeftButton)
        qtbot.waitUntil(lambda: not presenter.send.sending, timeout=MINUTE)
        assert row.send.text() == "Send"


def test_an_export_is_a_real_file_that_reads_back(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session
) -> None:
    view, _ = tab
    assert [view.export.format.itemData(row) for row in (0, 1, 2)] == ["vrma", "bvh", "saia_csv"]
    view.export.format.setCurrentIndex(view.export.format.findData("bvh"))
    view.export.export.click()
    qtbot.waitUntil(lambda: _text(view, "export_result") != "", timeout=MINUTE)
    assert _text(view, "export_result") == "Exported and verified: toy_003.bvh."
    assert session.project is not None
    motion = bvh.read(session.project.exports_folder / "toy_003.bvh").motion
    assert motion is not None
    assert motion.duration == pytest.approx(6.0, abs=0.1)
    head = motion.bone_names.index("Head")
    assert np.ptp(motion.rotations[:, head, 0]) > 0.1


@pytest.mark.parametrize("replace", [False, True])
def test_an_export_asks_before_it_writes_over_a_file(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session, replace: bool
) -> None:
    view, presenter = tab
    assert session.project is not None
    there = session.project.exports_folder / "Blendshapes" / "toy_003.csv"
    there.parent.mkdir(parents=True)
    there.write_text("mine", encoding="utf-8")
    view.export.format.setCurrentIndex(view.export.format.findData("saia_csv"))
    asked = []

    def answer() -> None:
        box = view.findChild(QMessageBox, "question")
        if box is None or not box.isVisible():
            return
        look.stop()
        asked.extend((box.text(), box.informativeText()))
        wanted = "Replace" if replace else "Cancel"
        next(button for button in box.buttons() if button.text() == wanted).click()

    look = QTimer()
    look.timeout.connect(answer)
    look.start(50)
    view.export.show_result("Exported and verified: toy_003.bvh.", True)
    view.export.export.click()
    assert asked == [
        "toy_003.csv already exists. Replace it?", f"This file will be replaced: {there}"
    ]  # fmt: skip
    if replace:
        qtbot.waitUntil(lambda: _text(view, "export_result") != "", timeout=MINUTE)
        assert there.read_text(encoding="utf-8").startswith("Time,")
        assert _text(view, "export_result") == (
            "Exported and verified: Blendshapes/toy_003.csv, Bones/toy_003.csv, Audio/toy_003.wav."
        )
    else:
        assert not presenter.export.busy
        assert _text(view, "export_result") == "", "the one before was exported, not this one"
        assert there.read_text(encoding="utf-8") == "mine"


def test_a_take_without_sound_says_why_a_run_predicts_nothing(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session
) -> None:
    view, presenter = tab
    assert session.project is not None
    why = view.findChild(QLabel, "why_no_prediction")
    assert why is not None
    assert why.isHidden()
    heard = session.project.take("toy_001")
    assert heard.motion_path is not None
    info = replace(heard.info, number=4, audio_file=None, audio_channels=0, audio_seconds=0.0)
    session.project.add_take("toy_004", info, read_motion(heard.motion_path), None)
    session.refresh_takes()
    qtbot.waitUntil(lambda: any(title.startswith("toy_004") for title in _titles(view)))
    row = next(n for n, title in enumerate(_titles(view)) if title.startswith("toy_004"))
    view.sources.setCurrentRow(row)
    _loaded(qtbot, presenter)
    assert why.isHidden(), "no run was chosen"
    view.bar.chosen.emit(A, RunSelection("quick_001"))
    qtbot.waitUntil(lambda: not why.isHidden())
    assert why.text() == "This take has no sound, so nothing can be predicted from it."
    assert _text(view, "export_what") == "Exports the captured motion."


def test_a_long_sentence_beside_the_transport_leaves_the_send_panel_whole(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter]
) -> None:
    view, _ = tab
    view.tabs.setCurrentWidget(view.send)
    view.show_metrics("error 0.123  r 0.84  motion 0.92  bones 12.3°", "")
    view.show_notice("No sound device can play.", "Plug in headphones.")
    view.columns.setSizes([210, 2000, 0])  # as narrow as it gets
    qtbot.waitUntil(lambda: view.columns.sizes()[2] <= 300)
    notice = view.findChild(QLabel, "sound_notice")
    assert notice is not None
    assert notice.minimumSizeHint().width() < notice.fontMetrics().horizontalAdvance(notice.text())
    assert notice.toolTip() == "No sound device can play. Plug in headphones."
    assert notice.height() < 2 * notice.fontMetrics().height(), "in one line"
    for box in (view.send.rows[0].port, view.send.names, view.send.fps):
        assert box.mapTo(view.send, box.rect().topRight()).x() < view.send.width()


def _told(view: ReviewView) -> str:
    toast = view.findChild(Toast)
    return f"{toast.text.text()} {toast.remedy.text()}" if toast is not None else ""


def test_a_sound_that_is_none_is_told_of_and_does_not_get_into_the_list(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], tmp_path: Path
) -> None:
    view, presenter = tab
    broken, good = tmp_path / "壊れた.wav", tmp_path / "good.wav"
    broken.write_bytes(b"this is no sound at all")
    soundfile.write(good, np.random.default_rng(1).normal(0, 0.1, 16_000).astype(np.float32), 16_000)
    presenter.sources.add([broken, good])
    qtbot.waitUntil(lambda: "壊れた.wav" in _told(view), timeout=MINUTE)
    qtbot.waitUntil(lambda: _titles(view)[0].startswith("good"), timeout=MINUTE)
    assert len(_titles(view)) == 4, "the good one came in, the broken one did not"


def test_a_kept_sound_that_broke_goes_to_the_trash(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session
) -> None:
    view, presenter = tab
    project = session.project
    assert project is not None
    (project.folder / "sounds").mkdir()
    (project.folder / "sounds" / "壊れた.wav").write_bytes(b"no sound any more")
    session.project_opened.emit()
    qtbot.waitUntil(lambda: "壊れた" in _titles(view), timeout=MINUTE)
    _loaded(qtbot, presenter)
    view.sources.setCurrentRow(_titles(view).index("壊れた"))
    qtbot.waitUntil(lambda: "壊れた" not in _titles(view), timeout=MINUTE)
    assert (project.folder / ".trash" / "sounds" / "壊れた.wav").is_file()
    assert "壊れた.wav is in the project's trash." in _told(view)
    _loaded(qtbot, presenter)


def _titles(view: ReviewView) -> list[str]:
    return [view.sources.item(row).text() for row in range(view.sources.count())]


def test_a_dropped_sound_stays_with_the_project_until_it_is_removed(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session, tmp_path: Path
) -> None:
    view, presenter = tab
    project = session.project
    assert project is not None
    sound = tmp_path / "другой звук.flac"
    soundfile.write(sound, np.random.default_rng(1).normal(0, 0.1, 48_000).astype(np.float32), 16_000)
    presenter.sources.add([sound])
    qtbot.waitUntil(lambda: _titles(view)[0] == "другой звук   0:03", timeout=MINUTE)
    sound.unlink()
    session.project_opened.emit()  # as when the project is opened again
    qtbot.waitUntil(lambda: _titles(view)[0].startswith("другой звук"), timeout=MINUTE)
    view.sources.setCurrentRow(0)
    view.sources.setFocus()
    qtbot.keyClick(view.sources, Qt.Key.Key_Delete)
    qtbot.waitUntil(lambda: len(_titles(view)) == 3, timeout=MINUTE)
    assert list((project.folder / ".trash" / "sounds").iterdir())
    view.sources.setCurrentRow(0)
    qtbot.keyClick(view.sources, Qt.Key.Key_Delete)
    assert len(project.takes) == len(_titles(view)) == 3, "takes are removed in Curate"


def test_a_take_that_went_is_no_longer_on_the_stage(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session
) -> None:
    view, presenter = tab
    session.remove_take("toy_003")
    assert not any(title.startswith("toy_003") for title in _titles(view))
    qtbot.waitUntil(lambda: presenter.model.player is not None, timeout=MINUTE)
    assert presenter.model.item is not None
    assert presenter.model.item.key != "take:toy_003"


def test_a_part_plays_to_its_end_and_then_from_its_beginning_again(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session
) -> None:
    view, presenter = tab
    project = session.project
    assert project is not None
    take = project.take("toy_003")
    cut = edits.split_at(project.dataset, "toy_003", [0.4, 0.8], take.info.duration)
    project.edit("Cut", cut)
    presenter.deactivate()
    presenter.activate()  # the whole take is no longer there: its first part comes up
    view.sources.setCurrentRow([title.split()[0] for title in _titles(view)].index("toy_003.2"))
    qtbot.waitUntil(lambda: presenter.model.used == (0.4, 0.8), timeout=MINUTE)
    player = presenter.model.player
    assert player is not None
    assert player.position == pytest.approx(0.4)
    for _ in range(2):
        view.play.click()
        qtbot.waitUntil(lambda: not player.playing and player.position == pytest.approx(0.8), timeout=MINUTE)


def test_what_was_moved_in_curate_is_seen_moved(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session
) -> None:
    _, presenter = tab
    project, before = session.project, presenter.model.captured.motion
    assert project is not None
    assert before is not None
    project.edit("Align", edits.set_offset(project.dataset, ["toy_003"], 0.2))
    presenter.deactivate()
    presenter.activate()
    qtbot.waitUntil(lambda: presenter.model.captured.motion not in (None, before), timeout=MINUTE)
    moved = presenter.model.captured.motion
    assert moved is not None
    assert moved.times[0] == pytest.approx(before.times[0] + 0.2)


@pytest.mark.slow
def test_a_run_is_shown_beside_the_capture_and_kept(
    qtbot: QtBot, tab: tuple[ReviewView, ReviewPresenter], session: Session, tmp_path: Path
) -> None:
    view, presenter = tab
    project = session.project
    assert project is not None
    words = ["train", str(project.folder), "--recipe", "quick", "--set", "epochs=1", "--set", "steps=2"]
    assert main(words) == 0
    session.runs_changed.emit()
    presenter.deactivate()
    presenter.activate()
    assert view.bar.first.run.currentData() == "quick_001", "the newest run comes up where none was chosen"
    qtbot.waitUntil(lambda: presenter.model.predicted is not None, timeout=2 * MINUTE)
    qtbot.waitUntil(lambda: bool(_text(view, "review_metrics")), timeout=MINUTE)
    comparison = presenter.model.comparison
    assert comparison is not None
    assert comparison.closings is not None
    closed = "lips closed {} of {} times, {} wrongly".format(*comparison.closings)
    assert (closed in _text(view, "review_metrics")) is not is_still(comparison.motion_ratio)
    assert view.stage.captured.isVisible()
    assert view.stage.predicted.isVisible()
    kept = list((project.folder / ".cache" / "generated" / "quick_001").glob("*.arrow"))
    assert len(kept) == 1
    view.bar.ghost.click()
    assert not view.stage.captured.isVisible()
    sound = tmp_path / "другой звук.flac"
    soundfile.write(sound, np.random.default_rng(1).normal(0, 0.1, 50 * 16_000).astype(np.float32), 16_000)
    presenter.sources.add([sound])
    qtbot.waitUntil(
        lambda: presenter.model.captured.motion is None and presenter.model.complete, timeout=MINUTE
    )
    assert presenter.model.tuned.duration == pytest.approx(50.0, abs=0.2)
    assert _text(view, "review_metrics") == ""
    qtbot.waitUntil(lambda: not presenter.model.generating)
    made = max((project.folder / ".cache" / "generated" / "quick_001").glob("*.arrow"), key=_changed)
    np.testing.assert_array_equal(read_motion(made).shapes, presenter.model.predicted.shapes)


def _changed(path: Path) -> float:
    return path.stat().st_mtime
