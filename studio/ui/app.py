"""Builds everything once and hands it over."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from studio.ui import messages, theme
from studio.ui.main_window import MainWindow
from studio.ui.session import Session


def build(words: list[str]) -> tuple[QApplication, MainWindow]:
    """The application and its window, not yet shown.

    Args:
        words: at most one: the folder of a project to open.
    """
    existing = QApplication.instance()
    app = existing if isinstance(existing, QApplication) else QApplication(["saia"])
    app.setApplicationName("Saia Studio")
    app.setDesktopFileName("saia-studio")
    session = Session()
    theme.apply(app, session.settings.theme)
    window = MainWindow(session)
    if words:
        window.start.open_project(Path(words[0]))
    return app, window


def run_window(words: list[str]) -> int:
    """Open the window and stay until it is closed; the exit code."""
    app, window = build(words)
    messages.catch_unexpected()
    _close_on_interrupt(window)
    window.show()
    if not words:
        QTimer.singleShot(0, window, window.start.check_machine)
    return app.exec()


def _close_on_interrupt(window: MainWindow) -> None:
    """Let Ctrl+C in a terminal close the window like its cross: a recording asks and is saved."""
    signal.signal(signal.SIGINT, lambda *_: window.close())
    ticks = QTimer(window)  # Python sees a signal only when it gets to run
    ticks.timeout.connect(lambda: None)
    ticks.start(300)
    if sys.platform != "win32":
        signal.signal(signal.SIGTERM, lambda *_: window.close())
