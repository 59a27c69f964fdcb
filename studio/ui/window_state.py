"""What the window remembers between starts: its size and where splitters stand."""

from __future__ import annotations

from PySide6.QtCore import QByteArray, QSettings
from PySide6.QtWidgets import QMainWindow, QSplitter, QWidget

from studio.settings import settings_folder


def _store() -> QSettings:
    return QSettings(str(settings_folder() / "window.ini"), QSettings.Format.IniFormat)


def restore_window(window: QMainWindow) -> bool:
    """Give the window the size and place it had; whether there were any."""
    geometry = _store().value("geometry")
    return isinstance(geometry, QByteArray) and window.restoreGeometry(geometry)


def save_window(window: QMainWindow) -> None:
    """Remember the window's size and place, and every named splitter in it."""
    store = _store()
    store.setValue("geometry", window.saveGeometry())
    for splitter in window.findChildren(QSplitter):
        if splitter.objectName():
            store.setValue(f"splitters/{splitter.objectName()}", splitter.saveState())


def restore_splitters(widget: QWidget) -> None:
    """Put every named splitter in a widget where it stood."""
    store = _store()
    for splitter in widget.findChildren(QSplitter):
        state = store.value(f"splitters/{splitter.objectName()}") if splitter.objectName() else None
        if isinstance(state, QByteArray):
            splitter.restoreState(state)
