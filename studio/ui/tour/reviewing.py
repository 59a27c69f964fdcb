"""Review: the prediction plays in time with the sound, is sent to an avatar and exported."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QTabWidget

from studio import formats
from studio.errors import StudioError
from studio.formats import Imported
from studio.ui.tour.curating import THIRD
from studio.ui.tour.driver import PATIENCE
from studio.ui.tour.guide import Guide
from studio.ui.tour.listener import Listener
from studio.ui.widgets.timeline import Timeline

LEAST_FRAMES = 45
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
            return listener.frames >= LEAST_FRAMES and bool(listener.moving)

        driver.wait(
            received, PATIENCE, f"{LEAST_FRAMES} frames with a moving face arrived at the other program"
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
