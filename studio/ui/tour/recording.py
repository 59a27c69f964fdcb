"""Record: the practice performer is seen and heard, and takes are made of it."""

from __future__ import annotations

import numpy as np
from PySide6.QtWidgets import QLabel, QWidget

from studio.errors import StudioError
from studio.take.motion_file import read_motion
from studio.take.sound import read_sound
from studio.take.take import Take
from studio.ui.tour.driver import PATIENCE
from studio.ui.tour.guide import Guide

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
    assert take.motion_path is not None, f"{take.id} has motion"
    assert take.audio_path is not None, f"{take.id} has sound"
    motion, sound = read_motion(take.motion_path), read_sound(take.audio_path)
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
