"""What all steps of the tour share: the window, the hands, and what was made so far."""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from studio.errors import StudioError
from studio.ui.tour.driver import PATIENCE, Driver

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


def _unused(folder: Path) -> Path:
    """The folder, or one with a number where it is taken: an earlier tour is left as it is."""
    candidate, number = folder, 2
    while candidate.exists():
        candidate = folder.with_name(f"{folder.name} {number}")
        number += 1
    return candidate
