"""The menus and their keys."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from typing import Protocol

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QApplication, QMainWindow, QMenu, QMessageBox, QWidget

from studio import __version__, actions
from studio.ui import messages, tabs, theme, undo
from studio.ui.imports import PackTask
from studio.ui.session import Session
from studio.ui.shortcuts import name_of, translated
from studio.ui.undo import UndoScope
from studio.ui.welcome_presenter import StartPresenter


class MenuCommands(Protocol):
    """What the menus ask of whoever has them; the window is one, but menus need not know windows."""

    session: Session
    start: StartPresenter
    packing: PackTask

    @property
    def undo_scope(self) -> UndoScope | None:
        """What Undo and Redo act on now."""

    def import_files(self) -> None:
        """Ask for files and import them."""

    def import_folder(self) -> None:
        """Ask for a folder and import it."""

    def show_project_folder(self) -> None:
        """Open the project's folder on the desktop."""

    def close_project(self) -> None:
        """Back to the welcome page."""

    def show_room(self, name: str) -> None:
        """Show a tab."""

    def show_settings(self) -> None:
        """Show every setting."""

    def show_shortcuts(self) -> None:
        """List every key."""

    def show_palette(self) -> None:
        """Find anything by typing."""


class Menus(QObject):
    """All actions of the window, gathered in menus: behind a button, on macOS in the menu bar."""

    def __init__(self, window: QMainWindow, commands: MenuCommands) -> None:
        super().__init__(window)
        self._window, self._commands = window, commands
        self._needs_project: list[QAction] = []
        self.file = QMenu(self.tr("File"), window)
        self.all = QMenu(window)
        self._build_file()
        edit, view, help_ = QMenu(self.tr("Edit"), window), QMenu(self.tr("View"), window), QMenu(
            self.tr("Help"), window
        )  # fmt: skip
        self._build_edit(edit)
        self._build_view(view)
        self._build_help(help_)
        commands.session.settings_changed.connect(self._on_settings)
        for menu in (self.file, edit, view, help_):
            self.all.addMenu(menu)
            if sys.platform == "darwin":
                window.menuBar().addMenu(menu)
        self.all.addSeparator()
        self.all.addAction(self._quit)

    def show_project(self, is_open: bool) -> None:
        """Offer what needs a project only while one is open."""
        for action in self._needs_project:
            action.setEnabled(is_open)

    def _build_file(self) -> None:
        commands, menu, start = self._commands, self.file, self._commands.start
        self._add(menu, "new_project", start.choose_new, "mdi6.plus")
        self._add(menu, "open_project", start.choose_project, "mdi6.folder-open-outline")
        self.recent = menu.addMenu(self.tr("Open recent"))
        self.recent.aboutToShow.connect(self._fill_recent)
        self._add(menu, "open_sample", start.open_sample, "mdi6.human-greeting")
        menu.addSeparator()
        self._add(menu, "import_files", commands.import_files, "mdi6.import")
        self._add(menu, "import_folder", commands.import_folder)
        menu.addSeparator()
        self._add(menu, "pack_project", commands.packing.ask_pack, "mdi6.zip-box-outline")
        self._add(menu, "unpack_project", commands.packing.ask_unpack)
        menu.addSeparator()
        self._add(menu, "show_project_folder", commands.show_project_folder)
        self._add(menu, "close_project", commands.close_project)
        menu.addSeparator()
        self._add(menu, "settings", commands.show_settings, "mdi6.cog-outline")
        self._quit = self._add(menu, "quit", self._window.close)
        menu.removeAction(self._quit)  # it comes at the end of the whole menu, and its key works all the same

    def _build_edit(self, menu: QMenu) -> None:
        self.undo = self._add(menu, "undo", partial(self._on_step, undo.undo), "mdi6.undo")
        self.redo = self._add(menu, "redo", partial(self._on_step, undo.redo), "mdi6.redo")
        self.show_undo()

    def _build_view(self, menu: QMenu) -> None:
        for tab in tabs.NAMES:
            self._add(menu, f"show_{tab}", partial(self._commands.show_room, tab), tabs.ICONS[tab])
        menu.addSeparator()
        self.next_steps = self._add(menu, "next_steps", self._on_next_steps)
        self.next_steps.setCheckable(True)
        self.next_steps.setChecked(self._commands.session.settings.next_steps)
        self.light = self._add(menu, "light_colours", self._on_light)
        self.light.setCheckable(True)
        self.light.setChecked(theme.colours().name == "light")
        self._add(menu, "full_screen", self._on_full_screen)

    def _build_help(self, menu: QMenu) -> None:
        self._add(menu, "open_palette", self._commands.show_palette, "mdi6.magnify")
        self._add(menu, "list_keys", self._commands.show_shortcuts, "mdi6.keyboard-outline")
        self._add(menu, "copy_diagnostics", self._commands.start.copy_report)
        self._add(menu, "about", self._on_about)

    def _add(self, menu: QMenu, id: str, work: Callable[[], object], icon: str = "") -> QAction:
        """An action of the table in a menu; the window has it too, so that its keys work anywhere."""
        declared = actions.ACTIONS[id]
        action = QAction(translated(declared.name), self._window)
        action.setObjectName(f"action_{id}")
        action.triggered.connect(lambda _checked=False: work())
        if declared.keys:
            action.setShortcuts([QKeySequence(key) for key in declared.keys])
            action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
        if icon:
            theme.set_icon(action, icon, "muted")
        # Undo and Redo follow what there is to take back, in `show_undo`.
        if "project" in declared.needs and id not in ("undo", "redo"):
            self._needs_project.append(action)
        menu.addAction(action)
        self._window.addAction(action)
        return action

    def _fill_recent(self) -> None:
        from pathlib import Path

        self.recent.clear()
        folders = self._commands.session.settings.recent_projects
        for folder in folders:
            action = self.recent.addAction(folder)
            action.triggered.connect(lambda _c=False, f=folder: self._commands.start.open_project(Path(f)))
        if not folders:
            self.recent.addAction(self.tr("No projects yet")).setEnabled(False)

    def show_undo(self) -> None:
        """Name what undo and redo would do in the tab shown; off where they would do nothing."""
        scope = self._commands.undo_scope
        for action, name, word in (
            (self.undo, scope.undo_name if scope else "", name_of("undo")),
            (self.redo, scope.redo_name if scope else "", name_of("redo")),
        ):
            action.setText(f"{word}: {name}" if name else word)
            action.setEnabled(bool(name))

    def _on_step(self, step: Callable[[QWidget, UndoScope], None]) -> None:
        scope = self._commands.undo_scope
        if scope is not None:
            step(self._window, scope)

    def _on_light(self) -> None:
        if self._commands.session.rolling:  # restyling everything stalls the window for half a second
            self.light.setChecked(not self.light.isChecked())
            messages.show_note(self._window, self.tr("You can change the theme after the recording."))
            return
        self._commands.session.change_settings(theme="light" if self.light.isChecked() else "dark")

    def _on_next_steps(self) -> None:
        self._commands.session.change_settings(next_steps=self.next_steps.isChecked())

    def _on_settings(self, changed: frozenset[str]) -> None:
        self.next_steps.setChecked(self._commands.session.settings.next_steps)
        if "theme" in changed:
            name = self._commands.session.settings.theme
            app = QApplication.instance()
            assert isinstance(app, QApplication)
            theme.apply(app, name)
            self.light.setChecked(name == "light")

    def _on_full_screen(self) -> None:
        window = self._window
        if window.isFullScreen():
            window.showNormal()
        else:
            window.showFullScreen()

    def _on_about(self) -> None:
        box = QMessageBox(self._window)
        box.setWindowTitle(name_of("about"))
        box.setIconPixmap(self._window.windowIcon().pixmap(64, 64))
        box.setText(f"Saia Studio {__version__}")
        box.setInformativeText(
            self.tr(
                "Record a voice and its motion, train, and let the voice alone move the avatar.\nMIT licence."
            )
        )
        box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        box.open()
