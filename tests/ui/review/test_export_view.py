"""The export form by itself."""

from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel, QScrollArea
from pytestqt.qtbot import QtBot

from studio.export.options import FormatChoice, format_choices
from studio.render.background import CLEAR
from studio.ui import theme
from studio.ui.review.export_options_view import ExportOptions
from studio.ui.review.export_view import ExportPanel, ExportRequest


@pytest.fixture
def panel(qtbot, qapp) -> ExportPanel:
    theme.apply(qapp)
    made = ExportPanel()
    qtbot.addWidget(made)
    return made


def test_another_project_exports_into_its_own_folder(panel: ExportPanel, tmp_path: Path) -> None:
    for name in ("One", "Two"):
        panel.show_target("Hello_001", tmp_path / name / "exports", ready=True)
        assert panel.folder.text() == str(tmp_path / name / "exports")


def test_a_folder_that_was_chosen_stays(panel: ExportPanel, tmp_path: Path) -> None:
    panel.show_target("Hello_001", tmp_path / "One", ready=True)
    panel.folder.setText(str(tmp_path / "Mine"))
    panel.show_target("Hello_001", tmp_path / "Two", ready=True)
    assert panel.folder.text() == str(tmp_path / "Mine")


def test_what_came_of_one_export_is_not_said_of_the_next(panel: ExportPanel, tmp_path: Path) -> None:
    panel.show_formats(format_choices())
    panel.show_target("Hello_001", tmp_path, ready=True)
    panel.show_result("Exported and verified: Hello_001.vrma.", True)
    panel.show_target("Hello_001", tmp_path, ready=True)
    assert panel.result.text(), "it stays while nothing else is chosen"
    panel.format.setCurrentIndex(panel.format.currentIndex() + 1)
    assert not panel.result.text()
    panel.show_result("Exported and verified: Hello_001.csv.", True)
    panel.show_target("Hello_002", tmp_path, ready=True)
    assert not panel.result.text()


def _small(panel: ExportPanel) -> tuple[int, int]:
    """What a window of 1280 x 800 leaves it, more where this machine's font is larger than DejaVu Sans."""
    metrics = panel.fontMetrics()
    wide = metrics.horizontalAdvance("The quick brown fox jumps over the lazy dog") / 268
    return round(268 * max(wide, 1.0)), round(391 * max(metrics.height() / 19, 1.0))


@pytest.mark.parametrize("choice", format_choices(), ids=lambda choice: choice.name)
def test_every_format_fits_a_small_window_without_scrolling(
    qtbot: QtBot, panel: ExportPanel, tmp_path: Path, choice: FormatChoice
) -> None:
    panel.show_formats(format_choices())
    panel.show_target("Hello_001", tmp_path, ready=True)
    panel.show_what(predicted=True)
    panel.resize(*_small(panel))
    panel.show()
    panel.format.setCurrentIndex(panel.format.findData(choice.name))
    scroll = panel.findChild(QScrollArea, "export_scroll")
    assert scroll is not None
    bar = scroll.verticalScrollBar()
    qtbot.waitUntil(lambda: bar.maximum() == 0)
    qtbot.waitUntil(lambda: panel.note.height() >= panel.note.heightForWidth(panel.note.width()))


def test_a_closed_fold_says_what_is_not_as_it_comes(panel: ExportPanel) -> None:
    fold, options = panel.options.fold, panel.options
    assert (fold.head.text(), fold.reset.isHidden()) == ("Options", True)
    options.part.setCurrentIndex(1)
    panel.show_fps(30.0)
    options.tuned.setChecked(False)
    assert (fold.head.text(), fold.reset.isHidden()) == (
        "Options: face, 30 frames/s, without Tune settings",
        False,
    )
    fold.reset.click()
    assert (fold.head.text(), fold.reset.isHidden()) == ("Options", True)
    assert options.options == ExportOptions()


def test_a_face_alone_is_not_exported_as_bones(panel: ExportPanel, tmp_path: Path) -> None:
    panel.show_formats(format_choices())
    panel.show_target("Hello_001", tmp_path, ready=True, body=False)
    assert panel.format.currentData() == "saia_csv"
    assert panel.export.isEnabled()
    panel.format.setCurrentIndex(panel.format.findData("bvh"))
    assert panel.note.text() == "BVH holds a body alone, and this motion is a face. Choose another format."
    assert not panel.export.isEnabled()
    panel.show_target("Hello_002", tmp_path, ready=True, body=True)
    assert panel.export.isEnabled()
    assert panel.export.toolTip() == ""


def test_a_film_that_cannot_be_transparent_says_which_can(panel: ExportPanel, tmp_path: Path) -> None:
    panel.show_formats(format_choices())
    panel.show_target("Hello_001", tmp_path, ready=True)
    panel.options.show_background(CLEAR)
    for name, possible in (("mp4", False), ("webm", True), ("frames", True), ("png", True)):
        panel.format.setCurrentIndex(panel.format.findData(name))
        assert panel.export.isEnabled() == possible
    panel.format.setCurrentIndex(panel.format.findData("mp4"))
    assert panel.note.text() == "An .mp4 film cannot be transparent. Choose .webm, or another background."
    panel.options.background.chosen.emit("#102030")
    assert panel.export.isEnabled()
    assert panel.options.options.background.text == "#102030"


def test_an_image_that_cannot_be_read_is_said_when_it_is_chosen(
    panel: ExportPanel, qtbot: QtBot, tmp_path: Path
) -> None:
    panel.options.show_background(CLEAR)
    for name, what in (
        ("gone.png", "There is no background called"),
        ("wall.png", "The background wall.png cannot be read as an image."),
    ):
        panel.options.background.chosen.emit(str(tmp_path / name))
        qtbot.waitUntil(lambda what=what: any(what in one.text() for one in panel.findChildren(QLabel)))
        assert panel.options.options.background.is_clear, "the one before"
        (tmp_path / "wall.png").write_bytes(b"no picture")


def test_a_size_may_be_typed(panel: ExportPanel) -> None:
    panel.options.picture.setEditText("1600 × 900")
    assert panel.options.options.size == (1600, 900)


def test_a_size_that_is_half_typed_is_asked_for_and_never_guessed(panel: ExportPanel, tmp_path: Path) -> None:
    panel.show_formats(format_choices())
    panel.show_target("Hello_001", tmp_path, ready=True)
    asked: list[ExportRequest] = []
    panel.export_requested.connect(asked.append)
    panel.format.setCurrentIndex(panel.format.findData("png"))
    for text in ("", "16", "1920x", "1920 x 1"):
        panel.options.picture.setEditText(text)
        panel.export.click()
        assert panel.result.text() == "Finish the picture's size first, such as 1920 x 1080."
    assert not asked
    panel.options.picture.setEditText("1920 x 108")
    panel.export.click()
    assert [one.options.size for one in asked] == [(1920, 108)]
    # Where nothing is drawn, nobody sees the box.
    panel.options.picture.setEditText("1920x")
    panel.format.setCurrentIndex(panel.format.findData("bvh"))
    panel.export.click()
    assert len(asked) == 2
