"""Where the window and its splitters stand: at the first start, and as they were left."""

from __future__ import annotations

from PySide6.QtCore import QByteArray, QPoint, QRect, QSettings, QSize
from PySide6.QtWidgets import QMainWindow, QSplitter, QWidget

from studio.settings import settings_folder

FIRST_SIZE = QSize(1440, 900)
FIRST_SHARE = 0.9
"""At most this much of the screen is taken at the first start."""
LEAST_SIZE = QSize(1024, 640)
"""The smallest window in which nothing is cut; a smaller screen takes what it has."""


def first_place(screen: QRect) -> QRect:
    """Where the window stands at its first start: in the middle of what a screen leaves free."""
    most = (screen.size() * FIRST_SHARE).expandedTo(LEAST_SIZE).boundedTo(screen.size())
    place = QRect(QPoint(), FIRST_SIZE.boundedTo(most))
    place.moveCenter(screen.center())
    return place


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
