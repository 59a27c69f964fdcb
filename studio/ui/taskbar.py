"""How far long work is, on the window's button in the taskbar or dock, where the desktop shows that.

On Linux KDE, Ubuntu's dock and others that know the Unity launcher's signal do; they find the button by the
name of the program's desktop file, so one has to be installed. On Windows and macOS nothing is shown: their
taskbar and dock need calls that could not be tried where this was written.

Source: Unity's LauncherAPI, com.canonical.Unity.LauncherEntry.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject
from PySide6.QtGui import QGuiApplication

from studio.ui.session import Session

if TYPE_CHECKING:
    from PySide6.QtDBus import QDBusConnection

PATH, INTERFACE, SIGNAL = (
    "/com/canonical/unity/launcherentry/saia",
    "com.canonical.Unity.LauncherEntry",
    "Update",
)


class TaskbarProgress(QObject):
    """Tells the desktop the progress of trainings, exports and imports; of several, the mean.

    Args:
        session: says how far what is.
        parent: as everywhere in Qt.
        bus: the desktop's; the session's own where None.
    """

    def __init__(
        self, session: Session, parent: QObject | None = None, bus: QDBusConnection | None = None
    ) -> None:
        super().__init__(parent)
        self._bus = bus
        self._running: dict[str, float] = {}
        # Percent that the desktop shows; None for none.
        self._shown: int | None = None
        session.work_progressed.connect(self.show_work)
        session.import_progress.connect(self._on_import)
        app = QCoreApplication.instance()
        if app is not None:
            # A window that closes in mid-work must leave no bar behind.
            app.aboutToQuit.connect(self.clear)

    def show_work(self, work: str, fraction: float | None) -> None:
        """Show how far a piece of work is.

        Args:
            work: which.
            fraction: done of it, 0 to 1; below 0 where nobody can tell, None where it ended.
        """
        if fraction is None:
            self._running.pop(work, None)
        else:
            self._running[work] = min(max(fraction, 0.0), 1.0)
        self._show()

    def clear(self) -> None:
        """Show nothing any more."""
        self._running.clear()
        self._show()

    def _on_import(self, sentence: str, fraction: float | None) -> None:
        done = fraction if fraction is not None else -1.0
        self.show_work("import", done if sentence else None)

    def _show(self) -> None:
        parts = self._running.values()
        percent = round(100 * sum(parts) / len(parts)) if parts else None
        # By whole percents: a desktop redraws its dock for each.
        if percent != self._shown:
            self._shown = percent
            self._send(percent)

    def _send(self, percent: int | None) -> None:
        self._bus = self._bus or _session_bus()
        if self._bus is None:
            return
        from PySide6.QtDBus import QDBusMessage

        message = QDBusMessage.createSignal(PATH, INTERFACE, SIGNAL)
        facts = {"progress": (percent or 0) / 100, "progress-visible": percent is not None}
        message.setArguments([f"application://{QGuiApplication.desktopFileName()}.desktop", facts])
        # A signal: nobody is waited for.
        self._bus.send(message)


def _session_bus() -> QDBusConnection | None:
    """The desktop's bus; None where there is none, which Qt would otherwise try to start."""
    if not sys.platform.startswith("linux") or not os.environ.get("DBUS_SESSION_BUS_ADDRESS"):
        return None
    from PySide6.QtDBus import QDBusConnection

    bus = QDBusConnection.sessionBus()
    return bus if bus.isConnected() else None
