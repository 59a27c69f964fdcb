"""Word from the desktop while the window is not in front: a notification of what ended meanwhile."""

from __future__ import annotations

import sys

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QSystemTrayIcon, QWidget

SHOWN_MS = 10_000
_PORTAL = ("org.freedesktop.portal.Desktop", "/org/freedesktop/portal/desktop")
_NOTIFICATION = "org.freedesktop.portal.Notification"


class DesktopNotifier(QObject):
    """Shows notifications of the system, where it has any.

    Args:
        window: nothing is shown while it is in front; a click on a notification brings it there.
    """

    def __init__(self, window: QWidget) -> None:
        super().__init__(window)
        self._window = window
        self._tray: QSystemTrayIcon | None = None

    @property
    def is_away(self) -> bool:
        """Whether the window is not in front."""
        return not self._window.window().isActiveWindow()

    def notify(self, title: str, text: str) -> bool:
        """Tell something by the desktop; whether that was tried.

        Args:
            title: a few words.
            text: one sentence.
        """
        if not self.is_away:
            return False
        if QSystemTrayIcon.isSystemTrayAvailable():
            self._by_tray(title, text)
            return True
        # GNOME has no tray; its portal takes notifications from everybody.
        return sys.platform.startswith("linux") and self._by_portal(title, text)

    def _by_tray(self, title: str, text: str) -> None:
        if self._tray is None:
            self._tray = QSystemTrayIcon(self._window.window().windowIcon(), self)
            self._tray.messageClicked.connect(self._on_clicked)
        # There only for its message: a studio that is not hidden needs no place in the tray.
        self._tray.show()
        self._tray.showMessage(title, text, self._window.window().windowIcon(), SHOWN_MS)
        QTimer.singleShot(2 * SHOWN_MS, self._tray, self._tray.hide)

    def _by_portal(self, title: str, text: str) -> bool:
        from PySide6.QtDBus import QDBusConnection, QDBusMessage

        bus = QDBusConnection.sessionBus()
        if not bus.isConnected():
            return False
        message = QDBusMessage.createMethodCall(*_PORTAL, _NOTIFICATION, "AddNotification")
        message.setArguments(["saia-training", {"title": title, "body": text}])
        # Sent and not called: a desktop that is slow to answer must not hold up the window.
        return bool(bus.send(message))

    def _on_clicked(self) -> None:
        self._window.window().showNormal()
        self._window.window().activateWindow()
