"""Builds everything once and hands it over."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from PySide6.QtCore import QMessageLogContext, QTimer, QtMsgType, qInstallMessageHandler
from PySide6.QtWidgets import QApplication

from studio.ui import language, messages, theme
from studio.ui.main_window import MainWindow
from studio.ui.session import Session
from studio.ui.taskbar import TaskbarProgress


def build(words: list[str]) -> tuple[QApplication, MainWindow]:
    """The application and its window, not yet shown.

    Args:
        words: at most one: the folder of a project to open.
    """
    existing = QApplication.instance()
    app = existing if isinstance(existing, QApplication) else _application()
    app.setApplicationName("Saia Studio")
    app.setDesktopFileName("saia-studio")
    language.install(app)
    session = Session()
    theme.apply(app, session.settings.theme)
    window = MainWindow(session)
    TaskbarProgress(session, window)
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


def _application() -> QApplication:
    """The one application; where there is no screen, the process ends with a sentence and code 2.

    Qt itself would abort, which looks like a crash.
    """
    lines: list[str] = []

    def on_message(kind: QtMsgType, _context: QMessageLogContext, text: str) -> None:
        if kind == QtMsgType.QtFatalMsg:  # Qt aborts when this returns, and nothing can be raised through it
            sys.stderr.write(f"{_why_no_window(lines)}\n")
            sys.stderr.flush()
            os._exit(2)
        lines.append(text)

    before = qInstallMessageHandler(on_message)
    try:
        return QApplication(["saia"])
    finally:
        qInstallMessageHandler(before)
        sys.stderr.writelines(f"{text}\n" for text in lines)


def _why_no_window(lines: list[str]) -> str:
    """What happened and what to do, from what Qt said before it gave up."""
    if not any(text.startswith("could not connect to display") for text in lines):
        return (
            f"The window could not be opened: {' '.join(lines).rstrip('.')}. Run `saia doctor` to see more."
        )
    if display := os.environ.get("DISPLAY"):
        what, tour = f"The screen {display} does not answer", "env -u DISPLAY saia tour"
    else:
        what, tour = "There is no screen here", "saia tour"
    return f"{what}, so no window can be opened. Start the studio where there is a screen, or run `{tour}`."


def _close_on_interrupt(window: MainWindow) -> None:
    """Let Ctrl+C in a terminal close the window like its cross: a recording asks and is saved."""
    signal.signal(signal.SIGINT, lambda *_: window.close())
    ticks = QTimer(window)  # Python sees a signal only when it gets to run
    ticks.timeout.connect(lambda: None)
    ticks.start(300)
    if sys.platform != "win32":
        signal.signal(signal.SIGTERM, lambda *_: window.close())
