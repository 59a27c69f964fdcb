"""Curate: a take is played, trimmed and labelled, and each take gets its use."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from studio.dataset.dataset import Selection
from studio.errors import StudioError
from studio.ui.tour.driver import PATIENCE
from studio.ui.tour.guide import Guide
from studio.ui.tour.recording import SLATE
from studio.ui.widgets.timeline import Timeline

FIRST, SECOND, THIRD = (f"{SLATE}_{number:03d}" for number in (1, 2, 3))
WORDS = "good morning"


def see_the_takes(guide: Guide) -> None:
    """All takes are listed; the first is shown with its sound, and plays."""
    guide.show_room("curate")
    guide.driver.choose_row("take_table", FIRST)
    timeline = _timeline(guide)
    guide.driver.wait(lambda: timeline.view.duration > 5, PATIENCE, f"{FIRST} was on the timeline")
    guide.driver.click("play_button", seconds=30)
    guide.driver.wait(lambda: timeline.playhead > 1.0, PATIENCE, "the take was played")
    guide.driver.click("play_button")


def trim_a_take(guide: Guide) -> None:
    """I and O set the ends at the playhead; undo and redo work."""
    timeline, duration = _timeline(guide), _timeline(guide).view.duration
    _seek(guide, timeline, 0.15 * duration)
    QTest.keyClick(timeline, Qt.Key.Key_I)
    guide.driver.wait(lambda: _choice(guide).in_point > 0.05 * duration, PATIENCE, "the in point was set")
    _seek(guide, timeline, 0.85 * duration)
    QTest.keyClick(timeline, Qt.Key.Key_O)
    guide.driver.wait(lambda: _choice(guide).out_point is not None, PATIENCE, "the out point was set")
    trimmed = _choice(guide)
    guide.driver.click("undo_button")
    guide.driver.wait(lambda: _choice(guide).out_point is None, PATIENCE, "undo took the out point back")
    guide.driver.click("redo_button")
    guide.driver.wait(lambda: _choice(guide) == trimmed, PATIENCE, "redo set the out point again")


def label_a_take(guide: Guide) -> None:
    """A word of the vocabulary and a typed label are on the take."""
    timeline = _timeline(guide)
    _seek(guide, timeline, 0.4 * timeline.view.duration)
    guide.driver.click("word_1")
    guide.driver.wait(lambda: len(_choice(guide).labels) == 1, PATIENCE, "the word became a label")
    _seek(guide, timeline, 0.6 * timeline.view.duration)
    guide.driver.click("add_label_button")
    guide.driver.wait(lambda: guide.driver.is_ready("label_editor"), PATIENCE, "a label could be typed")
    guide.driver.type_into("label_editor", WORDS)
    guide.driver.wait(
        lambda: WORDS in {label.text for label in _choice(guide).labels}, PATIENCE, "it was kept"
    )


def split_the_takes(guide: Guide) -> None:
    """One take is for training, one for validation, one for the test."""
    for take, split in ((SECOND, "val"), (THIRD, "test"), (FIRST, "train")):
        guide.driver.choose_row("take_table", take)
        if _choice(guide, take).split != split:
            guide.driver.click(f"split_{split}")
        is_so = partial(_is_for, guide, take, split)
        guide.driver.wait(is_so, PATIENCE, f"{take} was for {split}")
    guide.driver.choose_row("take_table", FIRST)
    guide.driver.rest(1.5)  # grades come in one by one
    guide.driver.picture("curate")


def _timeline(guide: Guide) -> Timeline:
    return guide.window.room("curate")[0].findChildren(Timeline)[0]


def _choice(guide: Guide, selection: str = FIRST) -> Selection:
    try:
        return guide.project.dataset[selection]
    except KeyError:
        raise StudioError(f"{selection} is not among the takes to choose from.", "") from None


def _is_for(guide: Guide, take: str, split: str) -> bool:
    return _choice(guide, take).split == split


def _seek(guide: Guide, timeline: Timeline, t: float) -> None:
    """Click the timeline at a moment, in its ruler."""
    spot = QPoint(round(timeline.x_of(t)), 6)
    QTest.mouseClick(timeline, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, spot)
    guide.driver.wait(lambda: abs(timeline.playhead - t) < 0.2, PATIENCE, f"the playhead was at {t:.1f} s")
    timeline.setFocus()
