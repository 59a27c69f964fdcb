"""Progress in the taskbar, told over a real bus of this test's own and heard by another program."""

from __future__ import annotations

import shutil
import subprocess
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest
from PySide6.QtDBus import QDBusConnection
from PySide6.QtGui import QGuiApplication
from pytestqt.qtbot import QtBot

from studio.ui.session import Session
from studio.ui.taskbar import INTERFACE, TaskbarProgress
from tests.patience import until

pytestmark = pytest.mark.skipif(
    not (shutil.which("dbus-daemon") and shutil.which("dbus-monitor")),
    reason="needs dbus-daemon and dbus-monitor (Debian: the packages dbus-daemon and dbus-bin)",
)


@dataclass
class Desktop:
    """A bus, and what a program that draws taskbars hears on it."""

    address: str
    lines: list[str] = field(default_factory=list)

    @property
    def updates(self) -> list[tuple[str, float, bool]]:
        """Program, progress and whether it is seen, of each signal that came whole."""
        found = []
        for one in "\n".join(self.lines).split("signal time=")[1:]:
            if f"interface={INTERFACE}; member=Update" in one and one.count("boolean") == 1:
                words = one.split()
                progress = float(words[words.index("double") + 1])
                found.append((one.split('string "')[1].split('"')[0], progress, "boolean true" in one))
        return found


@pytest.fixture
def desktop() -> Iterator[Desktop]:
    server = subprocess.Popen(
        ["dbus-daemon", "--session", "--nofork", "--print-address=1"], stdout=subprocess.PIPE, text=True
    )
    assert server.stdout is not None
    made = Desktop(server.stdout.readline().strip())
    monitor = subprocess.Popen(
        ["dbus-monitor", "--address", made.address, f"interface='{INTERFACE}'"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip

    def listen() -> None:
        assert monitor.stdout is not None
        for line in monitor.stdout:
            made.lines.append(line.rstrip())

    thread = threading.Thread(target=listen)
    thread.start()
    # It says first which name it has on the bus.
    until(lambda: made.lines)
    yield made
    for one in (monitor, server):
        one.terminate()
        one.wait(60)
    thread.join(60)
    server.stdout.close()
    assert monitor.stdout is not None
    monitor.stdout.close()


def test_the_desktop_is_told_how_far_work_is(desktop: Desktop, qtbot: QtBot) -> None:
    QGuiApplication.setDesktopFileName("saia-studio")
    session, bus = Session(), QDBusConnection.connectToBus(desktop.address, "taskbar")
    taskbar = TaskbarProgress(session, bus=bus)
    program = "application://saia-studio.desktop"
    session.work_progressed.emit("train", -1.0)
    session.work_progressed.emit("train", 0.501)
    session.work_progressed.emit("train", 0.504)
    until(lambda: len(desktop.updates) == 2)
    assert desktop.updates == [(program, 0.0, True), (program, 0.5, True)], "one signal a percent"
    session.import_progress.emit("Importing…", 0.1)
    session.work_progressed.emit("train", None)
    session.import_progress.emit("", None)
    until(lambda: len(desktop.updates) == 5)
    assert desktop.updates[2:] == [(program, 0.3, True), (program, 0.1, True), (program, 0.0, False)]
    session.work_progressed.emit("export", 0.2)
    taskbar.clear()
    until(lambda: len(desktop.updates) == 7)
    assert desktop.updates[-1] == (program, 0.0, False)
    QDBusConnection.disconnectFromBus("taskbar")


def test_without_a_bus_nothing_is_started(monkeypatch: pytest.MonkeyPatch, qtbot: QtBot) -> None:
    monkeypatch.delenv("DBUS_SESSION_BUS_ADDRESS", raising=False)
    session = Session()
    taskbar = TaskbarProgress(session)
    session.work_progressed.emit("train", 0.5)
    taskbar.clear()
