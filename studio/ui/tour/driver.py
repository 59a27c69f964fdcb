"""What leads the tour through the window: controls used as a person does, and what was made so far."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from PySide6.QtCore import QPoint, QSize, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QLineEdit,
    QListView,
    QSpinBox,
    QWidget,
)

from studio.errors import StudioError
from studio.vmc.assemble import FrameAssembler

if TYPE_CHECKING:
    from studio.project import Project
    from studio.ui.main_window import MainWindow

PROJECT = "My project"


class Guide:
    """Leads through the window.

    Args:
        folder: where everything goes.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.pictures = folder / "screenshots"
        self.project_folder = _unused(folder / PROJECT)
        self.run_id = ""
        self.exported: list[Path] = []
        self._driver: Driver | None = None
        self._window: MainWindow | None = None
        try:
            self.pictures.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StudioError(
                f"{folder} cannot be written: {error.strerror}.", "Name another --out."
            ) from error

    @property
    def driver(self) -> Driver:
        """Hands and eyes; there once the window is open."""
        assert self._driver is not None, "the first step opens the window"
        return self._driver

    @property
    def window(self) -> MainWindow:
        """The real main window."""
        assert self._window is not None, "the first step opens the window"
        return self._window

    @property
    def project(self) -> Project:
        """The project that is open in the window.

        Raises:
            StudioError: none is.
        """
        project = self.window.session.project
        if project is None:
            raise StudioError("No project is open.", "")
        return project

    @property
    def files(self) -> list[Path]:
        """Screenshots, takes, the trained run and the exports, as far as they were made."""
        made = list(self._driver.files) if self._driver else []
        with suppress(StudioError, AssertionError):
            made += [take.folder for take in self.project.takes]
            made += [run.folder for run in self.project.runs]
        return made + self.exported

    def open_window(self, words: list[str]) -> None:
        """Build the real window and show it."""
        from PySide6.QtCore import QCoreApplication, Qt

        # A desktop's own dialogs can't be answered by a program.
        QCoreApplication.setAttribute(Qt.ApplicationAttribute.AA_DontUseNativeDialogs)
        # The tour leaves a person's own settings and recent projects alone.
        os.environ["SAIA_SETTINGS"] = str(self.folder / ".settings")
        from studio import settings
        from studio.ui.app import build

        if self._driver is None:
            settings.save(settings.load().changed(vmc_port=_free_port()))

        _, self._window = build(words)
        earlier = self._driver.files if self._driver else []
        self._driver = Driver(self._window, self.pictures)
        self._driver.files = earlier
        self._window.show()
        self.driver.wait(self._window.isVisible, PATIENCE, "the window was visible")

    def show_room(self, name: str) -> None:
        """Go to a tab by clicking it."""
        from PySide6.QtCore import Qt
        from PySide6.QtTest import QTest

        from studio.ui.tabs import NAMES

        tabs = self.window.tabs
        spot = tabs.tabRect(NAMES.index(name)).center()
        QTest.mouseClick(tabs, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, spot)
        self.driver.wait(lambda: self.window.shown_room == name, PATIENCE, f"the tab {name} was shown")

    def close_window(self) -> None:
        """Close the window as its cross does."""
        if self._window is not None:
            window, self._window = self._window, None
            window.close()
            if self._driver is not None:
                self._driver.rest(0.2)

    def picture_of_failure(self) -> None:
        """Keep what the window looked like when a step failed."""
        if self._window is not None:
            path = self.pictures / "failure.png"
            self._window.grab().toImage().save(str(path))

    def close(self) -> None:
        """Close whatever is open."""
        self.close_window()


def _free_port() -> int:
    """A UDP port no other receiver on this machine listens on: the usual one may be in use."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


W = TypeVar("W", bound=QWidget)

SIZES = (QSize(1280, 800), QSize(1920, 1080))
"""Window sizes of the screenshots, pixels."""
PATIENCE = 90.0
"""Seconds the window may take for anything but training: a busy machine is no failure."""
LOOK_MS = 20
LEAST_COLOURS = 24
"""A picture with fewer colours shows nothing."""


class Driver:
    """Uses one window.

    Args:
        window: the studio's main window, shown.
        pictures: the folder screenshots go to.
    """

    def __init__(self, window: QWidget, pictures: Path) -> None:
        self.window = window
        self.pictures = pictures
        self.files: list[Path] = []

    def find(self, name: str, kind: type[W]) -> W:
        """The control with an object name, in the window or in a dialog.

        Raises:
            StudioError: there is none.
        """
        for top in (self.window, *QApplication.topLevelWidgets()):
            if top.objectName() == name and isinstance(top, kind):
                return top
            found = top.findChildren(kind, name)
            shown = [one for one in found if one.isVisible()]
            if found:
                return (shown or found)[0]
        raise StudioError(f"The window has no {kind.__name__} named {name}.", "Was it renamed?")

    def click(self, name: str, seconds: float = PATIENCE) -> None:
        """Press a button with the mouse, once it is visible and enabled."""
        button = self.find(name, QAbstractButton)
        self.wait(lambda: button.isVisible() and button.isEnabled(), seconds, f"the button {name} was ready")
        spot = QPoint(min(button.width() // 2, 12), button.height() // 2)
        QTest.mouseClick(button, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, spot)

    def is_ready(self, name: str) -> bool:
        """Whether a control is there, visible and enabled."""
        control = self.window.findChild(QWidget, name)
        return control is not None and control.isVisible() and control.isEnabled()

    def type_into(self, name: str, text: str) -> None:
        """Replace the text of a line or the value of a number box, key by key, and press Enter."""
        field: QLineEdit | QSpinBox | QDoubleSpinBox
        widget = self.find(name, QWidget)
        assert isinstance(widget, QLineEdit | QSpinBox | QDoubleSpinBox), f"{name} takes no text"
        field = widget
        field.setFocus()
        field.selectAll()
        QTest.keyClicks(field, text)
        QTest.keyClick(field, Qt.Key.Key_Return)

    def choose(self, name: str, entry: str) -> None:
        """Choose the entry of a list box whose text or data contains some words."""
        box = self.find(name, QComboBox)

        def place() -> int:
            entries = [(box.itemText(i), str(box.itemData(i))) for i in range(box.count())]
            return next((i for i, both in enumerate(entries) if any(entry in text for text in both)), -1)

        self.wait(lambda: place() >= 0, PATIENCE, f"{name} offered {entry}")
        box.setCurrentIndex(place())
        # As the mouse would; setCurrentIndex alone does not say it.
        box.activated.emit(box.currentIndex())

    def choose_row(self, name: str, entry: str) -> None:
        """Click the row of a table or list that holds some text."""
        view = self.find(name, QAbstractItemView)

        def row() -> int:
            model = view.model()
            columns = range(1 if isinstance(view, QListView) else model.columnCount())
            for i in range(model.rowCount()):
                if any(entry in str(model.index(i, column).data() or "") for column in columns):
                    return i
            return -1

        self.wait(lambda: row() >= 0, PATIENCE, f"{name} listed {entry}")
        index = view.model().index(row(), 0)
        view.scrollTo(index)
        spot = view.visualRect(index).center()
        QTest.mouseClick(view.viewport(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, spot)

    def answer_file_dialog(self, path: Path, act: Callable[[], None]) -> None:
        """Do something that asks for a file, and name one as a person would.

        Args:
            path: what to enter.
            act: opens the dialog; returns when it is closed.
        """
        answered: list[str] = []
        look = QTimer()
        look.setInterval(100)

        def enter() -> None:
            for dialog in QApplication.topLevelWidgets():
                if isinstance(dialog, QFileDialog) and dialog.isVisible():
                    look.stop()
                    line = dialog.findChild(QLineEdit, "fileNameEdit")
                    assert line is not None, "Qt names the line so"
                    line.setText(str(path))
                    answered.append(str(path))
                    dialog.accept()

        look.timeout.connect(enter)
        look.start()
        act()
        self.wait(lambda: bool(answered), PATIENCE, "a file dialog opened")

    def press(self, key: Qt.Key, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        """Press a key in the window."""
        QTest.keyClick(self.window, key, modifier)

    def wait(self, condition: Callable[[], bool], seconds: float, hope: str) -> None:
        """Let the window live until something is so.

        Args:
            condition: what is hoped for.
            seconds: patience.
            hope: what it means, to follow "It was waited in vain until".

        Raises:
            StudioError: it did not come true.
        """
        deadline = time.monotonic() + seconds
        met = condition()
        while not met and time.monotonic() < deadline:
            # Turns an event loop of its own: the tour is a user, and users wait.
            QTest.qWait(LOOK_MS)
            met = condition()
        if not met:
            shown = self.message()
            hint = f" The window says: {shown}" if shown else ""
            raise StudioError(f"After {seconds:.0f} s it was still not so that {hope}.{hint}", "")

    def rest(self, seconds: float) -> None:
        """Let the window live for a moment, as a person looks at it."""
        QTest.qWait(int(seconds * 1000))

    def message(self) -> str:
        """The message over the window, "" where it shows none."""
        from studio.ui.messages import toast_of

        toast = toast_of(self.window)
        if toast is None or not toast.isVisible():
            return ""
        return f"{toast.text.text()} {toast.remedy.text()}".strip()

    def dismiss_message(self) -> None:
        """Close the message over the window, if one is shown."""
        if self.message():
            self.click("toast_close")

    def picture(self, name: str) -> None:
        """Save the window at every size, without a message over it, and look whether anything is on it."""
        self.dismiss_message()
        before = self.window.size()
        for size in SIZES:
            self.window.resize(size)
            # Figures and plots redraw on their own timers.
            self.rest(0.35)
            image = self.window.grab().toImage()
            path = self.pictures / f"{name}_{size.width()}x{size.height()}.png"
            if not image.save(str(path)):
                raise StudioError(f"The picture {path.name} could not be written.", "Is the disk full?")
            colours = {
                image.pixel(x, y) for x in range(0, image.width(), 7) for y in range(0, image.height(), 7)
            }
            if len(colours) < LEAST_COLOURS:
                raise StudioError(f"The picture {path.name} is empty.", "")
            self.files.append(path)
        self.window.resize(before)
        self.rest(0.1)


class Listener:
    """Receives VMC on a free port until it is closed."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self.packets = 0
        self._assembler = FrameAssembler()
        self.frames = 0
        self.moving: set[str] = set()
        self._last: dict[str, float] = {}

    def read(self) -> None:
        """Take in what has arrived; never waits."""
        while True:
            try:
                datagram = self._socket.recv(65536)
            except BlockingIOError:
                return
            self.packets += 1
            for frame in self._assembler.feed(time.monotonic(), datagram):
                self.frames += 1
                for name, value in frame.shapes.items():
                    if abs(self._last.setdefault(name, value) - value) > 0.01:
                        self.moving.add(name)

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()


def _unused(folder: Path) -> Path:
    """The folder, or one with a number where it is taken: an earlier tour is left as it is."""
    candidate, number = folder, 2
    while candidate.exists():
        candidate = folder.with_name(f"{folder.name} {number}")
        number += 1
    return candidate
