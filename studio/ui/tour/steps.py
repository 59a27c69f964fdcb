"""The steps of the tour, in the order of the work, each verified by its effect."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QProgressBar, QPushButton, QTabWidget, QWidget

from studio import formats
from studio.dataset.dataset import Selection
from studio.errors import StudioError
from studio.formats import Imported
from studio.ipc.events import EpochEvent
from studio.sound.sound_file import read_sound
from studio.take.motion_file import load_motion
from studio.take.take import Take
from studio.ui.tour.driver import PATIENCE, Guide, Listener
from studio.ui.widgets.timeline.timeline import Timeline

SLATE = "Hello"
TAKES = 3
FIRST, SECOND, THIRD = (f"{SLATE}_{number:03d}" for number in (1, 2, 3))
WORDS = "good morning"
TAKE_SECONDS = 8.0
EPOCHS = 4
TRAINING_PATIENCE = 600.0
"""Seconds the toy-length training may take on a slow and busy machine."""
LEAST_FRAMES_SENT = 45
LEAST_FRAMES = 30
QUIETEST_DBFS = -60.0
"""A take whose mean level is lower holds no voice."""
LEAST_RATE = 20.0
MOST_LOST = 0.3
"""Share of frames that even a very busy machine keeps; a quiet one loses none."""


def open_the_window(guide: Guide) -> None:
    """The welcome page is there and can be used."""
    guide.open_window([])
    guide.driver.wait(lambda: guide.driver.is_ready("new_project"), PATIENCE, "the welcome page was shown")
    guide.driver.picture("welcome")


def check_the_machine(guide: Guide) -> None:
    """The window asks `saia doctor`, in a child process, and shows what it found."""
    guide.driver.click("check_again")
    page = guide.window.welcome
    guide.driver.wait(lambda: guide.driver.is_ready("check_details"), 120, "the check of this machine ended")
    guide.driver.click("check_details")
    guide.driver.wait(
        lambda: any("39539" in label.text() for label in page.findChildren(QLabel)),
        120,
        "the check of this machine was shown",
    )
    guide.driver.picture("machine")


def make_a_project(guide: Guide) -> None:
    """A project folder is made through the dialog and opened."""
    guide.driver.answer_file_dialog(guide.project_folder, lambda: guide.driver.click("new_project"))
    guide.driver.wait(lambda: guide.window.session.project is not None, PATIENCE, "the new project was open")
    assert guide.project.folder == guide.project_folder


def start_the_performer(guide: Guide) -> None:
    """The practice performer's motion arrives over UDP and its voice beside it."""
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


def see_the_takes(guide: Guide) -> None:
    """All takes are listed; the first is shown with its sound, and plays."""
    guide.show_room("curate")
    guide.driver.choose_row("take_table", FIRST)
    timeline = _curate_timeline(guide)
    guide.driver.wait(lambda: timeline.view.duration > 5, PATIENCE, f"{FIRST} was on the timeline")
    guide.driver.click("play_button", seconds=30)
    guide.driver.wait(lambda: timeline.playhead > 1.0, PATIENCE, "the take was played")
    guide.driver.click("play_button")


def trim_a_take(guide: Guide) -> None:
    """I and O set the ends at the playhead; undo and redo work."""
    timeline, duration = _curate_timeline(guide), _curate_timeline(guide).view.duration
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
    timeline = _curate_timeline(guide)
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
    # Grades come in one by one.
    guide.driver.rest(1.5)
    guide.driver.picture("curate")


def _curate_timeline(guide: Guide) -> Timeline:
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


def start_training(guide: Guide) -> None:
    """The quick preset, cut to a few epochs, starts as a child process and reports its first epoch."""
    guide.show_room("train")
    guide.driver.click("preset_quick_look")
    guide.driver.click("advanced")
    guide.driver.type_into("epochs", str(EPOCHS))
    guide.driver.click("start_training")
    guide.driver.wait(lambda: _epochs(guide) >= 1, TRAINING_PATIENCE, "the first epoch was trained")


def work_meanwhile(guide: Guide) -> None:
    """Other tabs work while it trains; back in Train the curves are there."""
    guide.show_room("curate")
    guide.driver.rest(0.5)
    guide.show_room("train")
    guide.driver.wait(lambda: _epochs(guide) >= 3, TRAINING_PATIENCE, "the training went on")
    guide.driver.picture("train")


def finish_training(guide: Guide) -> None:
    """The run ends by itself with weights and a report, and the window lists it."""

    def done() -> bool:
        runs = guide.project.runs
        return bool(runs) and runs[-1].has_weights and runs[-1].facts.status == "done"

    guide.driver.wait(done, TRAINING_PATIENCE, "the run had its weights and its report")
    bar = guide.driver.find("train_bar", QProgressBar)
    guide.driver.wait(
        lambda: not bar.isVisible() or bar.value() == bar.maximum(), PATIENCE, "the window said so"
    )
    guide.driver.wait(
        lambda: guide.driver.is_ready("start_training"), PATIENCE, "another training could start"
    )
    run = guide.project.runs[-1]
    guide.run_id = run.id
    losses = [EpochEvent.from_dict(facts).train_loss for facts in run.epochs()]
    if len(losses) != EPOCHS:
        raise StudioError(f"{run.id} trained {len(losses)} epochs instead of {EPOCHS}.", "")
    if not losses[-1] < losses[0]:
        raise StudioError(
            f"{run.id} learnt nothing: its loss went from {losses[0]:.4f} to {losses[-1]:.4f}.", ""
        )


def _epochs(guide: Guide) -> int:
    runs = guide.project.runs
    return len(runs[-1].epochs()) if runs else 0


SEND, EXPORT = 1, 2
"""Places of the tool tabs."""


def review_the_prediction(guide: Guide) -> None:
    """The run makes motion of a take it never saw; figure and sound play together."""
    driver = guide.driver
    guide.show_room("review")
    driver.choose_row("sources", THIRD)
    driver.choose("review_run", guide.run_id)
    metrics = driver.find("review_metrics", QLabel)
    driver.wait(lambda: bool(metrics.text()), 180, "the prediction was measured against the take")
    timeline = _review_timeline(guide)
    driver.click("play_button")
    start = timeline.playhead
    driver.wait(lambda: timeline.playhead > start + 1.0, PATIENCE, "the sound played and the figure followed")
    driver.picture("review")
    driver.wait(lambda: timeline.playhead != start, PATIENCE, "it played on")


def send_it(guide: Guide) -> None:
    """A program that listens for VMC receives the motion while it plays."""
    driver, listener = guide.driver, Listener()
    try:
        _show_tool(guide, SEND)
        driver.type_into("target_port_0", str(listener.port))
        driver.click("send_button")
        driver.picture("review_send")
        _play_from_start(guide)

        def received() -> bool:
            listener.read()
            return listener.frames >= LEAST_FRAMES_SENT and bool(listener.moving)

        driver.wait(
            received, PATIENCE, f"{LEAST_FRAMES_SENT} frames with a moving face arrived at the other program"
        )
        driver.click("send_button")
    finally:
        listener.close()


def export_it(guide: Guide) -> None:
    """BVH and SAIA's CSV are written, read back, and hold the same motion."""
    _show_tool(guide, EXPORT)
    bvh = _export(guide, "bvh", "predicted")
    _read(bvh[0], "bvh", bones=54)
    csv = _export(guide, "saia_csv", "predicted_saia")
    tables = [path for path in csv if path.suffix == ".csv"]
    if len(tables) < 2:
        raise StudioError(f"The CSV export wrote only {', '.join(path.name for path in csv)}.", "")
    _read(tables[0], "saia_csv", bones=54)
    guide.driver.picture("review_export")
    guide.exported += [*bvh, *csv]


def _export(guide: Guide, format_name: str, name: str) -> list[Path]:
    """Press Export and give the files that appeared."""
    driver, folder = guide.driver, guide.folder / "exports"
    driver.choose("export_format", format_name)
    driver.type_into("export_name", name)
    driver.type_into("export_folder", str(folder))
    for path, _ in _files(folder):
        if path.stem == name:
            # An earlier tour's: the window would ask before it wrote over it.
            path.unlink()
    before = _files(folder)
    driver.click("export_button")
    driver.wait(lambda: driver.is_ready("show_export_folder"), 120, f"the {format_name} export was done")
    made = sorted(path for path, _ in _files(folder) - before)
    if not made:
        raise StudioError(f"The {format_name} export wrote no file.", "")
    return made


def _read(path: Path, format_name: str, bones: int) -> None:
    found: Imported = formats.load(format_name).read(path)
    motion = found.motion
    if motion is None or len(motion) < 100 or len(motion.bone_names) < bones:
        raise StudioError(f"{path.name} does not hold the motion that was exported.", "")


def _files(folder: Path) -> set[tuple[Path, int]]:
    """Files with their times of writing."""
    found = folder.rglob("*") if folder.is_dir() else ()
    return {(path, path.stat().st_mtime_ns) for path in found if path.is_file()}


def _show_tool(guide: Guide, place: int) -> None:
    tabs = guide.driver.find("review_tabs", QTabWidget)
    spot = tabs.tabBar().tabRect(place).center()
    QTest.mouseClick(tabs.tabBar(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, spot)
    guide.driver.wait(lambda: tabs.currentIndex() == place, PATIENCE, "the tool was shown")


def _play_from_start(guide: Guide) -> None:
    """Go to the beginning and play, whatever the player is doing."""
    timeline = _review_timeline(guide)
    view = guide.window.room("review")[0]
    view.setFocus()
    QTest.keyClick(view, Qt.Key.Key_Home)
    guide.driver.rest(0.3)
    before = timeline.playhead
    guide.driver.rest(0.5)
    if timeline.playhead == before:
        guide.driver.click("play_button")


def _review_timeline(guide: Guide) -> Timeline:
    return guide.window.room("review")[0].findChildren(Timeline)[0]


def go_live(guide: Guide) -> None:
    """A program that listens for VMC receives the live avatar; the panic key stops it."""
    driver, listener = guide.driver, Listener()
    try:
        guide.show_room("live")
        driver.choose("review_run_live", guide.run_id)
        driver.type_into("live_target_port_0", str(listener.port))
        driver.click("live_start")
        start = driver.find("live_start", QPushButton)
        latency = driver.find("live_latency", QLabel)

        def received() -> bool:
            listener.read()
            return listener.frames >= LEAST_FRAMES and latency.text().endswith("ms")

        driver.wait(received, 2 * PATIENCE, f"{LEAST_FRAMES} live frames arrived at the other program")
        driver.picture("live")
        driver.click("live_neutral")
        status = driver.find("live_status", QLabel)
        driver.wait(lambda: "Neutral" in status.text(), PATIENCE, "the panic key was heeded")
        running = start.text()
        driver.click("live_start")
        driver.wait(lambda: start.text() != running and start.isEnabled(), PATIENCE, "it was no longer live")
    finally:
        listener.close()


def open_it_again(guide: Guide) -> None:
    """A second window on the same folder shows the same takes, choices and runs."""
    before = guide.project
    dataset, takes, runs = before.dataset, [take.id for take in before.takes], [run.id for run in before.runs]
    guide.close_window()
    guide.open_window([str(guide.project_folder)])
    after = guide.project
    same = {
        "takes": [take.id for take in after.takes] == takes,
        "choices": after.dataset == dataset,
        "runs": [run.id for run in after.runs] == runs,
    }
    changed = [what for what, is_same in same.items() if not is_same]
    if changed:
        raise StudioError(f"After opening it again, its {' and '.join(changed)} had changed.", "")


STEPS: tuple[tuple[str, Callable[[Guide], None]], ...] = (
    ("the window opens", open_the_window),
    ("this machine is checked", check_the_machine),
    ("a new project is made", make_a_project),
    ("the practice performer is seen and heard", start_the_performer),
    ("three takes are recorded", record_takes),
    ("the practice performer stops", stop_the_performer),
    ("the takes are seen and played", see_the_takes),
    ("a take is trimmed", trim_a_take),
    ("a take is labelled", label_a_take),
    ("the takes are split", split_the_takes),
    ("training starts in the background", start_training),
    ("other tabs work meanwhile", work_meanwhile),
    ("training ends with a run", finish_training),
    ("the prediction is reviewed", review_the_prediction),
    ("the prediction is sent to an avatar", send_it),
    ("the prediction is exported", export_it),
    ("the avatar moves live", go_live),
    ("the project is as it was when opened again", open_it_again),
)
