"""The window: opens on a welcome page or a project, shows rooms, keeps what it is told."""

import gc
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, QMimeData, QObject, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QApplication, QLabel, QPushButton, QWidget

from studio.errors import StudioError
from studio.project import Project
from studio.ui import app as application
from studio.ui import messages, tabs, tasks, theme
from studio.ui.main_window import MainWindow
from studio.ui.messages import Toast
from studio.ui.shortcuts import ShortcutsDialog
from tests.abandoned import leave_behind
from tests.formats.avatars import Maker

HEAVY = ("torch", "librosa", "pyvista", "vtkmodules", "scipy.signal", "lightning_fabric", "pyarrow")


@pytest.fixture
def open_window(qtbot, qapp):
    """Opens a window on some words and closes it after the test."""
    windows = []

    def make(*words: str) -> MainWindow:
        _, window = application.build(list(words))
        qtbot.addWidget(window)
        window.show()
        windows.append(window)
        return window

    yield make
    for window in windows:
        window.session.set_rolling(False)  # a test that failed on the way must not leave a question open
        window.close()
    tasks.wait()


@pytest.fixture
def project_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "私の Project"
    Project.create(folder, "My project").close()
    return folder


def test_nothing_heavy_is_loaded_to_open_the_window(project_folder: Path) -> None:
    code = (
        "import sys, json\n"
        "from studio.ui import app\n"
        f"_, window = app.build([{str(project_folder)!r}])\n"
        "window.show()\n"
        f"loaded = [name for name in {HEAVY!r} if name in sys.modules]\n"
        "window.close()\n"
        "print(json.dumps(loaded))\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert json.loads(run.stdout) == []


def test_the_welcome_page_waits_for_nothing_that_opens_projects() -> None:
    """What reads takes and avatars is most of all that is imported: it comes when a project is opened."""
    late = ("numpy", "studio.project", "studio.dataset", "studio.formats")
    code = (
        "import sys\nfrom studio.ui import app\n_, window = app.build([])\nwindow.show()\n"
        f"print(*(name for name in {late!r} if name in sys.modules))\nwindow.close()\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert run.stdout == "\n"


def test_without_a_project_the_welcome_page_is_shown(open_window) -> None:
    window = open_window()
    assert window.stack.currentWidget() is window.welcome
    assert not window.tabs.isVisible()
    for name in ("new_project", "open_project", "open_sample"):
        assert window.findChild(QPushButton, name).isEnabled()


def test_a_project_opens_in_record(open_window, project_folder: Path) -> None:
    window = open_window(str(project_folder))
    assert window.shown_room == "record"
    assert window.windowTitle() == "My project - Saia Studio"
    assert window.tabs.isVisible()


def test_what_was_cut_short_is_recovered_whatever_tab_is_shown(
    open_window, project_folder: Path, tmp_path: Path, qtbot
) -> None:
    other = tmp_path / "Other"
    Project.create(other).close()
    journal = leave_behind(other / "takes" / "Left_001") / "journal.bin"
    data = bytearray(journal.read_bytes())
    data[len(data) // 2] ^= 1
    journal.write_bytes(data)
    stuck = leave_behind(other / "takes" / "Stuck_001", 0.2)
    (stuck / "take.json").mkdir()
    window = open_window(str(project_folder))
    window.show_room("curate")
    window.session.open_project(other)
    assert window.shown_room == "curate"
    qtbot.waitUntil(
        lambda: [take.id for take in window.session.project.takes] == ["Left_001"], timeout=30_000
    )
    toast = window.findChild(Toast)
    qtbot.waitUntil(lambda: toast.isVisible(), timeout=30_000)
    assert toast.text.text() == "Stuck_001 was not recovered. There is a take Stuck_001 already."
    assert toast.remedy.text() == "Choose another slate or number."


def test_what_is_no_project_says_so_and_stays_welcoming(open_window, tmp_path: Path) -> None:
    window = open_window(str(tmp_path))
    assert window.stack.currentWidget() is window.welcome
    toast = window.findChild(Toast)
    assert toast.text.text() == f"There is no project at {tmp_path}."
    assert toast.remedy.text() == "Choose a folder with a project.json, or create a project there."


def test_keys_lead_through_the_rooms(open_window, project_folder: Path, qtbot) -> None:
    window = open_window(str(project_folder))
    qtbot.waitExposed(window)
    for index, name in enumerate(tabs.NAMES):
        window.show_room(name)
        assert window.shown_room == name
        assert window.tabs.currentIndex() == index
        assert window.stack.currentWidget() is window.room(name)[0]


def test_tabs_lead_to_their_rooms(open_window, project_folder: Path) -> None:
    window = open_window(str(project_folder))
    window.tabs.setCurrentIndex(2)
    assert window.shown_room == "train"


def test_a_recent_project_can_be_opened_and_forgotten(open_window, project_folder: Path, qtbot) -> None:
    first = open_window(str(project_folder))
    first.close_project()
    assert first.stack.currentWidget() is first.welcome
    button = first.welcome.findChild(QPushButton, "open_recent")
    assert button.text() == project_folder.name
    button.click()
    assert first.shown_room == "record"
    first.close_project()
    first.welcome.forget_requested.emit(project_folder)
    assert first.session.settings.recent_projects == ()


def test_creating_a_project_opens_it(open_window, tmp_path: Path) -> None:
    window = open_window()
    window.start.create_project(tmp_path / "New")
    assert window.session.project.folder == tmp_path / "New"
    assert (tmp_path / "New" / "project.json").is_file()


def test_the_tabs_come_up_whole_after_the_welcome_page(open_window, tmp_path: Path, qtbot) -> None:
    window = open_window()
    qtbot.waitExposed(window)
    window.start.create_project(tmp_path / "New")
    qtbot.waitUntil(lambda: window.tabs.size().width() >= window.tabs.sizeHint().width())
    assert window.tabs.height() >= window.tabs.sizeHint().height()
    assert window.tabs.rect().contains(window.tabs.tabRect(window.tabs.count() - 1))


@pytest.mark.usefixtures("real_freezing")
def test_a_recording_is_not_held_up_by_tidying_memory(open_window, project_folder: Path) -> None:
    window = open_window(str(project_folder))
    frozen = gc.get_freeze_count()
    window.session.set_rolling(True)
    assert gc.get_freeze_count() > max(frozen, 10_000)
    window.session.set_rolling(False)


def test_an_error_does_not_follow_to_another_tab_or_into_a_recording(
    open_window, project_folder: Path
) -> None:
    window = open_window(str(project_folder))
    for go_on in (lambda: window.show_room("curate"), lambda: window.session.set_rolling(True)):
        messages.show_error(window, StudioError("The port is in use.", "Choose another port."))
        toast = window.findChild(Toast)
        assert toast.isVisible()
        go_on()
        assert not toast.isVisible()
    window.session.set_rolling(False)


def test_a_folder_with_something_else_is_refused_in_words(open_window, tmp_path: Path) -> None:
    (tmp_path / "letters.txt").write_text("mine")
    window = open_window()
    window.start.create_project(tmp_path)
    assert window.session.project is None
    assert window.findChild(Toast).text.text() == f"The folder {tmp_path.name} is not empty."


def test_a_dropped_project_is_opened(open_window, project_folder: Path) -> None:
    window = open_window()
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(project_folder))])
    event = QDropEvent(
        QPointF(50, 50),
        Qt.DropAction.CopyAction,
        data,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    window.dropEvent(event)
    assert window.session.project.folder == project_folder


def test_dropping_files_without_a_project_says_what_to_do(open_window, tmp_path: Path) -> None:
    window = open_window()
    window.take_paths((tmp_path / "a.bvh",))
    toast = window.findChild(Toast)
    assert toast.text.text() == "No project is open."
    assert toast.remedy.text() == "Open or create a project first."


def test_a_dropped_run_needs_a_project_too(open_window, tmp_path: Path) -> None:
    window = open_window()
    window.take_paths((tmp_path / "best_001.saiarun",))
    toast = window.findChild(Toast)
    assert toast.text.text() == "No project is open for best_001.saiarun."
    assert toast.remedy.text() == "Open or create a project first."


@pytest.mark.slow
def test_dropped_sound_is_imported_by_a_child(
    open_window, project_folder: Path, tmp_path: Path, qtbot
) -> None:
    import numpy as np
    import soundfile

    sound = tmp_path / "声.wav"
    soundfile.write(sound, np.sin(np.arange(16000) / 20) * 0.3, 16000)
    window = open_window(str(project_folder))
    window.take_paths((sound,))
    assert window.importer.running
    qtbot.waitUntil(lambda: bool(window.session.project.takes), timeout=60_000)
    assert [take.id for take in window.session.project.takes] == ["声"]


def test_sounds_dropped_in_review_go_to_review(open_window, project_folder: Path, tmp_path: Path) -> None:
    window = open_window(str(project_folder))
    heard = []
    window.session.sounds_dropped.connect(heard.append)
    window.session.batch_dropped.connect(heard.append)
    window.show_room("review")
    window.take_paths((tmp_path / "voice.wav",))
    folder = tmp_path / "voices"
    folder.mkdir()
    (folder / "a.wav").touch()
    window.take_paths((folder,))
    assert heard == [(tmp_path / "voice.wav",), folder]


def test_an_avatar_dropped_anywhere_is_worn_in_review(
    open_window, project_folder: Path, tmp_path: Path, qtbot
) -> None:
    window = open_window(str(project_folder))
    window.take_paths((Maker(0).write(tmp_path / "私.vrm"),))
    review, _ = window.rooms["review"]
    qtbot.waitUntil(lambda: review.stage.worn is not None)
    assert review.isVisible()
    assert (project_folder / "avatars" / "私.vrm").is_file()


def test_an_avatar_dropped_on_live_is_worn_there(
    open_window, project_folder: Path, tmp_path: Path, qtbot
) -> None:
    window = open_window(str(project_folder))
    window.show_room("live")
    window.take_paths((Maker(0).write(tmp_path / "私.vrm"),))
    live, _ = window.rooms["live"]
    qtbot.waitUntil(lambda: live.stage.figure.avatar is not None)
    assert window.shown_room == "live"


def test_a_dropped_avatar_needs_a_project(open_window, tmp_path: Path) -> None:
    window = open_window()
    window.take_paths((tmp_path / "私.vrm",))
    assert window.findChild(QLabel, "toast_text").text() == "No project is open for 私.vrm."


def test_the_shortcuts_dialog_lists_keys_and_blocks_nothing(open_window, project_folder: Path) -> None:
    window = open_window(str(project_folder))
    window.show_shortcuts()
    dialog = window.findChild(ShortcutsDialog)
    assert dialog.isVisible()
    assert not dialog.isModal()
    words = {label.text() for label in dialog.findChildren(QLabel)}
    assert {"F1, Space", "Start and stop recording"} <= words
    dialog.close()


class Shown(QObject):
    """Notes every window that appears beside the main one, tooltips excepted."""

    def __init__(self, main: MainWindow) -> None:
        super().__init__()
        self.main, self.names = main, []

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 (Qt's name)
        appears = event.type() == QEvent.Type.Show and isinstance(watched, QWidget) and watched.isWindow()
        if appears and watched is not self.main and watched.windowType() != Qt.WindowType.ToolTip:
            self.names.append(f"{type(watched).__name__} {watched.objectName()}")
        return False


def test_no_window_flashes_while_a_project_opens(open_window, qapp, project_folder: Path, qtbot) -> None:
    """A widget that is shown before it has a parent is a window of its own for a moment."""
    window = open_window()
    qtbot.waitExposed(window)
    shown = Shown(window)
    qapp.installEventFilter(shown)
    try:
        window.start.open_project(project_folder)
        for name in tabs.NAMES:
            window.show_room(name)
            QApplication.processEvents()
    finally:
        qapp.removeEventFilter(shown)
    assert shown.names == []
    visible = [one for one in qapp.topLevelWidgets() if one.isVisible() and one.window() is not window]
    assert visible == []


def test_the_project_menu_reads_from_the_left(open_window) -> None:
    window = open_window()
    assert window.project_button.layoutDirection() == Qt.LayoutDirection.RightToLeft
    for menu in (window.menus.file, window.menus.recent):
        menu.popup(window.pos())
        assert menu.layoutDirection() == Qt.LayoutDirection.LeftToRight
        menu.close()


def test_status_facts_come_and_go(open_window, project_folder: Path) -> None:
    window = open_window(str(project_folder))
    window.session.status_changed.emit("sound", "Mic -18 dBFS", "good")
    fact = window.status.facts["sound"]
    assert fact.isVisible()
    assert fact.words.text() == "Mic -18 dBFS"
    window.session.status_changed.emit("sound", "", "")
    assert not fact.isVisible()


@contextmanager
def open_elsewhere(folder: Path) -> Iterator[None]:
    """Another process has a project open."""
    code = (
        "from pathlib import Path\n"
        "from studio.project import Project\n"
        f"project = Project.open(Path({str(folder)!r}))\n"
        "print('open', flush=True)\n"
        "input()\n"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], text=True, **pipes) as other:
        assert other.stdout.readline() == "open\n"
        yield
        other.communicate("\n", timeout=60)


def test_a_second_window_says_in_every_tab_that_it_only_looks(open_window, project_folder: Path) -> None:
    with open_elsewhere(project_folder):
        window = open_window(str(project_folder))
        told = window.status.facts["locked"]
        for name in tabs.NAMES:
            window.show_room(name)
            assert told.isVisible()
        assert told.words.text() == "Read-only"
        assert told.toolTip() == f"{window.session.project.name} is open in another window."
    window.close_project()
    assert not told.isVisible()
    window.start.open_project(project_folder)
    assert not window.session.project.read_only
    assert not told.isVisible()


def test_light_colours_are_kept(open_window, qapp: QApplication) -> None:
    window = open_window()
    before = window.menus.file.actions()[0].icon().pixmap(16, 16).toImage()
    window.menus.light.trigger()
    assert theme.colours().name == "light"
    after = window.menus.file.actions()[0].icon().pixmap(16, 16).toImage()
    assert after != before, "symbols follow the colours"
    assert window.session.settings.theme == "light"
    window.menus.light.trigger()
    assert theme.colours().name == "dark"


@pytest.mark.slow
def test_the_welcome_page_checks_the_machine(open_window, qtbot) -> None:
    window = open_window()
    window.start.check_machine()
    qtbot.waitUntil(lambda: len(window.start.checks) > 3, timeout=120_000)
    words = " ".join(one.text() for one in window.welcome.findChildren(QLabel) if one.isVisible())
    assert "Checking this computer" not in words
    window.start.copy_report()
    qtbot.waitUntil(lambda: "Saia Studio" in QApplication.clipboard().text())


@pytest.mark.slow
def test_the_sample_project_is_made_and_opened(open_window, qtbot) -> None:
    window = open_window()
    window.findChild(QPushButton, "open_sample").click()
    assert not window.welcome.new_button.isEnabled()
    qtbot.waitUntil(lambda: window.session.project is not None, timeout=240_000)
    assert len(window.session.project.takes) >= 3
    assert window.shown_room == "review", "there is something to see at once"
    assert window.room("review")[1].model.sides[0].selection.run == "sample_001"
    window.close_project()
    window.findChild(QPushButton, "open_sample").click()  # the second time it is there already
    assert window.session.project is not None


@pytest.mark.parametrize("size", [(1280, 800), (1920, 1080)])
def test_no_words_are_cut_off(open_window, project_folder: Path, qtbot, size: tuple[int, int]) -> None:
    window = open_window(str(project_folder))
    window.resize(*size)
    view = window.room("record")[0]
    qtbot.waitUntil(lambda: view.width() > 1000)
    for label in (*view.findChildren(QLabel), *window.status.findChildren(QLabel)):
        if label.isVisible() and label.text() and not label.wordWrap():
            assert label.fontMetrics().horizontalAdvance(label.text()) <= label.width() + 1, label.text()
    for button in view.findChildren(QPushButton):
        if button.isVisible():
            assert button.sizeHint().width() <= button.width() + 1, button.text()
