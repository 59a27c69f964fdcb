"""The command palette: every action, setting, take and run, found by typing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QAction, QKeyEvent, QShortcut
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QDialog,
    QLineEdit,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio import actions
from studio.project.run import run_title
from studio.settings import Settings
from studio.ui import messages, tabs, theme
from studio.ui.language import native
from studio.ui.session import Session
from studio.ui.shortcuts import name_of, sequence, tip_of, translated

MOST = 200
"""Lines shown at once: beyond that nobody scrolls, and types a letter more."""
WIDTH, HEIGHT = 560, 420


class Window(Protocol):
    """What the palette asks of whoever shows it."""

    session: Session

    @property
    def shown_room(self) -> str:
        """The name of the tab shown."""

    def show_room(self, name: str) -> None:
        """Show a tab."""

    def room(self, name: str) -> tuple[QWidget, tabs.Presenter]:
        """A tab's view and presenter."""

    def show_settings(self, name: str = "") -> None:
        """Show every setting, one of them with the keyboard."""

    def findChild(self, kind: type[QAction], name: str) -> QAction | None:
        """An action of the menus."""


@dataclass(frozen=True)
class PaletteEntry:
    """One line: what it is called, where it belongs, its key, what choosing it does, and what tells of it."""

    title: str
    place: str
    key: str
    choose: Callable[[], object]
    about: str = ""


class CommandPalette(QDialog):
    """Type, choose with the arrows, press Enter."""

    def __init__(self, window: QWidget, found: list[PaletteEntry]) -> None:
        super().__init__(window)
        self.setObjectName("palette")
        self.setWindowTitle(name_of("open_palette").rstrip("…"))
        self.setMinimumSize(WIDTH, HEIGHT)
        self._window, self._found = window, found
        self.search = QLineEdit()
        self.search.setObjectName("palette_search")
        self.search.setPlaceholderText(self.tr("Type an action, a setting, a take or a run"))
        self.search.setAccessibleName(self.tr("Search"))
        self.search.textChanged.connect(self._show)
        self.search.installEventFilter(self)
        self.list = QTreeWidget()
        self.list.setObjectName("palette_list")
        self.list.setHeaderHidden(True)
        self.list.setRootIsDecorated(False)
        self.list.setColumnCount(3)
        self.list.setUniformRowHeights(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.itemClicked.connect(lambda item, _column: self._choose(item))
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        column.addWidget(self.search)
        column.addWidget(self.list, 1)
        self._show("")

    def _show(self, typed: str) -> None:
        self.list.clear()
        for entry in matching(self._found, typed)[:MOST]:
            item = QTreeWidgetItem([entry.title, entry.place, entry.key])
            item.setData(0, Qt.ItemDataRole.UserRole, entry)
            item.setForeground(1, theme.colour("muted"))
            item.setForeground(2, theme.colour("muted"))
            self.list.addTopLevelItem(item)
        if not self.list.topLevelItemCount():
            nothing = QTreeWidgetItem([self.tr("Nothing matches.")])
            nothing.setFlags(Qt.ItemFlag.NoItemFlags)
            self.list.addTopLevelItem(nothing)
        self.list.setCurrentIndex(self.list.model().index(0, 0))
        for column, share in enumerate((0.58, 0.2, 0.14)):
            self.list.setColumnWidth(column, round(share * WIDTH))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        # The keyboard stays in the field, and the arrows move the list all the same.
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            moving = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)
            if event.key() in moving:
                QApplication.sendEvent(self.list, event)
                return True
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self._choose(self.list.currentItem())
                return True
        return super().eventFilter(watched, event)

    def _choose(self, item: QTreeWidgetItem | None) -> None:
        entry = item.data(0, Qt.ItemDataRole.UserRole) if item is not None else None
        if isinstance(entry, PaletteEntry):
            self.accept()
            # After this window is gone: what is chosen may open one of its own or want the keyboard.
            QTimer.singleShot(0, self._window, entry.choose)


def matching(found: list[PaletteEntry], typed: str) -> list[PaletteEntry]:
    """Entries that hold every word typed, or are told of with it; those whose name begins with it first."""
    words = typed.casefold().split()
    hit = [
        one
        for one in found
        if all(word in f"{one.title} {one.place} {one.about}".casefold() for word in words)
    ]
    first = typed.casefold().strip()
    return sorted(hit, key=lambda one: not one.title.casefold().startswith(first)) if first else hit


def entries(window: Window) -> Iterator[PaletteEntry]:
    """All there is to find now: what cannot be done at the moment is left out."""
    is_open = window.session.project is not None
    for action in actions.ACTIONS.values():
        if action.id == "open_palette":
            continue
        name = translated(action.name).rstrip("…")
        key, told = action.keys[0] if action.keys else "", translated(action.help or action.listed)
        in_menu = window.findChild(QAction, f"action_{action.id}")
        if in_menu is not None:
            if in_menu.isEnabled():
                yield PaletteEntry(name, _tr("Menu"), key, in_menu.trigger, told)
            continue
        place = next((one for one in action.places if one in tabs.NAMES), "")
        # A gesture is no name of anything, and a label's number says nothing here.
        if place and is_open and not action.gesture and "{" not in name:
            # The tab that is shown, where it is one of those the action works in.
            place = window.shown_room if window.shown_room in action.places else place
            do = partial(_do, window, place, action.id)
            yield PaletteEntry(name, name_of(f"show_{place}"), key, do, told)
    for setting, about in Settings.shown().items():
        show = partial(window.show_settings, setting)
        yield PaletteEntry(translated(about.title), _tr("Setting"), "", show, translated(about.help))
    if window.session.project is None:
        return
    for take in window.session.project.takes:
        yield PaletteEntry(take.id, _tr("Take"), "", partial(window.session.take_requested.emit, take.id))
    for run in window.session.project.usable_runs:
        yield PaletteEntry(
            native(run_title(run.id)), _tr("Run"), "", partial(window.session.review_requested.emit, run.id)
        )


def _do(window: Window, place: str, action: str) -> None:
    """Show the tab and press what does the action there: its button, or else its key."""
    window.show_room(place)
    view = window.room(place)[0]
    words = {name_of(action), tip_of(action)}
    for button in view.findChildren(QAbstractButton):
        if button.isVisible() and words & {button.text(), button.toolTip(), button.accessibleName()}:
            if button.isEnabled():
                button.click()
            else:
                why = button.toolTip()
                messages.show_note(view, _tr("“{0}” cannot be done now.").format(name_of(action)), why)
            return
    for shortcut in view.findChildren(QShortcut):
        if actions.ACTIONS[action].keys and shortcut.key() == sequence(action):
            shortcut.activated.emit()
            return
    if actions.ACTIONS[action].keys:
        key = Qt.Key(sequence(action)[0].key())  # type: ignore[index]
        for kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
            QApplication.sendEvent(view, QKeyEvent(kind, key, Qt.KeyboardModifier.NoModifier))


def _tr(text: str) -> str:
    return QCoreApplication.translate("Palette", text)
