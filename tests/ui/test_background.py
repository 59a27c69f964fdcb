"""Background work: results come back on the GUI thread, or not at all."""

import threading

from PySide6.QtCore import QObject

from studio.errors import StudioError
from studio.ui import background


def test_the_result_comes_back_on_the_gui_thread(qtbot) -> None:
    seen = []

    def done(value: int) -> None:
        seen.append((value, threading.current_thread() is threading.main_thread()))

    background.run(lambda: 42, done)
    qtbot.waitUntil(lambda: bool(seen))
    assert seen == [(42, True)]


def test_work_leaves_the_gui_thread(qtbot) -> None:
    seen = []
    background.run(lambda: threading.current_thread() is threading.main_thread(), seen.append)
    qtbot.waitUntil(lambda: bool(seen))
    assert seen == [False]


def test_an_error_comes_back_as_it_was_raised(qtbot) -> None:
    seen = []

    def fail() -> None:
        raise StudioError("The disk is full.", "Make room.")

    background.run(fail, lambda _r: None, seen.append)
    qtbot.waitUntil(lambda: bool(seen))
    assert str(seen[0]) == "The disk is full. Make room."


def test_nobody_is_told_once_the_owner_is_gone(qtbot) -> None:
    seen, begun, go = [], threading.Event(), threading.Event()
    owner = QObject()

    def work() -> int:
        begun.set()
        go.wait(60)
        return 1

    background.run(work, seen.append, owner=owner)
    assert begun.wait(60)
    from shiboken6 import delete

    delete(owner)
    go.set()
    assert background.wait(60_000)
    after = []
    background.run(lambda: 2, after.append)
    qtbot.waitUntil(lambda: after == [2])
    assert seen == []


def test_forgotten_work_tells_nobody(qtbot) -> None:
    seen, after = [], []
    background.run(lambda: 1, seen.append).forget()
    background.run(lambda: 2, after.append)
    qtbot.waitUntil(lambda: after == [2])
    assert seen == []
