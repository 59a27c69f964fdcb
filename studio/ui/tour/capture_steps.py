"""Steps of the tour in Record and Curate: takes are made, played, trimmed, labelled and divided."""

from __future__ import annotations

from functools import partial

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QWidget

from studio.dataset.dataset import Selection
from studio.errors import StudioError
from studio.sound.sound_file import read_sound
from studio.take.motion_file import load_motion
from studio.take.take import Take
from studio.ui.tour.driver import PATIENCE
from studio.ui.tour.guide import Guide
from studio.ui.widgets.timeline.timeline import Timeline

SLATE = "Hello"
TAKES = 3
TAKE_SECONDS = 9.0
QUIETEST_DBFS = -60.0
"""A take whose mean level is lower holds no voice."""
LEAST_RATE = 20.0
MOST_LOST = 0.3
"""Share of frames that even a very busy machine keeps; a quiet one loses none."""


def start_the_performer(guide: Guide) -> None:
    """The practice performer's motion arrives over UDP and its voice through the sound device."""
    guide.show_room("record")
    guide.driver.click("practice_button", seconds=30)
    guide.driver.wait(lambda: _figure_in(guide, "motion") >= LEAST_RATE, PATIENCE, "motion arrived")
    guide.driver.wait(lambda: _figure_in(guide, "sound") >= QUIETEST_DBFS, PATIENCE, "a voice was heard")


def record_takes(guide: Guide) -> None:
    """Three takes are rolled, saved and whole."""
    guide.driver.choose("countdown", "No countdown")
    guide.driver.type_into("slate", SLATE)
    for number in range(1, TAKES + 1):
        _roll(guide, picture="record" if number == 1 else "")
        take = guide.project.takes[-1]
        if take.id != f"{SLATE}_{number:03d}":
            raise StudioError(f"The take is called {take.id}.", "")
        _inspect(take)


def stop_the_performer(guide: Guide) -> None:
    """The performer stops, and the window says that motion no longer arrives."""
    guide.driver.click("practice_button")
    guide.driver.wait(lambda: _figure_in(guide, "motion") == 0, PATIENCE, "the motion ended")


def _roll(guide: Guide, picture: str) -> None:
    driver, before = guide.driver, len(guide.project.takes)
    driver.click("record_button")
    driver.wait(lambda: guide.window.session.rolling, PATIENCE, "the recording ran")
    elapsed = driver.find("elapsed", QLabel)
    driver.wait(lambda: _clock(elapsed.text()) >= TAKE_SECONDS / 2, PATIENCE, "the recording went on")
    if picture:
        driver.picture(picture)
    driver.wait(lambda: _clock(elapsed.text()) >= TAKE_SECONDS, PATIENCE, "the recording went on")
    driver.click("record_button")
    driver.wait(lambda: len(guide.project.takes) > before, PATIENCE, "the take was saved")
    driver.wait(lambda: driver.is_ready("record_button"), PATIENCE, "the next take could be recorded")


def _inspect(take: Take) -> None:
    """Open what lies on disk: motion that moves, a voice that can be heard, both as long as the take."""
    motion = load_motion(take)
    assert motion is not None, f"{take.id} has motion"
    assert take.audio_path is not None, f"{take.id} has sound"
    sound = read_sound(take.audio_path)
    level = 20 * np.log10(np.sqrt(np.mean(sound.mono() ** 2)) + 1e-9)
    facts = {
        f"only {motion.duration:.1f} s of motion": motion.duration < 0.9 * TAKE_SECONDS,
        f"only {sound.duration:.1f} s of sound": sound.duration < 0.9 * TAKE_SECONDS,
        f"{len(motion.bone_names)} bones": len(motion.bone_names) != 54,
        f"{len(motion.shape_names)} shapes": len(motion.shape_names) < 18,
        f"{motion.fps:.0f} frames a second": motion.fps < LEAST_RATE,
        "a figure that stands still": float(np.abs(np.diff(motion.rotations, axis=0)).max(initial=0)) < 1e-3,
        "a face that stands still": float(np.ptp(motion.shapes, axis=0).max(initial=0)) < 0.05,
        f"a sound of {level:.0f} dBFS": level < QUIETEST_DBFS,
        f"{take.info.frames_lost} lost frames": take.info.frames_lost > MOST_LOST * take.info.frames,
    }
    wrong = [fact for fact, is_so in facts.items() if is_so]
    if wrong:
        raise StudioError(f"{take.id} has {', '.join(wrong)}.", "")


def _figure_in(guide: Guide, key: str) -> float:
    """The number in a fact of the status strip ("VMC 60.0/s", "Mic -18 dBFS"); 0 or -inf without one."""
    fact = guide.driver.find(f"status_{key}", QWidget)
    text = " ".join(label.text() for label in fact.findChildren(QLabel))
    for word in text.replace("/s", " ").split():
        try:
            return float(word)
        except ValueError:
            continue
    return 0.0 if key == "motion" else -np.inf


def _clock(text: str) -> float:
    minutes, _, seconds = text.rpartition(":")
    return 60 * float(minutes or 0) + float(seconds)


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
