"""Steps of the tour in Train, Review and Live: a run is trained, reviewed, sent, exported, performed."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QProgressBar, QPushButton, QTabWidget

from studio import formats
from studio.errors import StudioError
from studio.formats import Imported
from studio.ipc.events import EpochEvent
from studio.ui.tour.capture_steps import THIRD
from studio.ui.tour.driver import PATIENCE, Listener
from studio.ui.tour.guide import Guide
from studio.ui.widgets.timeline.timeline import Timeline

EPOCHS = 6
TRAINING_PATIENCE = 600.0
"""Seconds the toy-length training may take on a slow and busy machine."""


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


LEAST_FRAMES_SENT = 45
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
    timeline = _timeline(guide)
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
        if path.stem == name:  # an earlier tour's: the window would ask before it wrote over it
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
    timeline = _timeline(guide)
    view = guide.window.room("review")[0]
    view.setFocus()
    QTest.keyClick(view, Qt.Key.Key_Home)
    guide.driver.rest(0.3)
    before = timeline.playhead
    guide.driver.rest(0.5)
    if timeline.playhead == before:
        guide.driver.click("play_button")


def _timeline(guide: Guide) -> Timeline:
    return guide.window.room("review")[0].findChildren(Timeline)[0]


LEAST_FRAMES = 30


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
