"""The menus and their keys."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QApplication, QMenu, QMessageBox

from studio import __version__
from studio.ui import messages, rooms, theme

if TYPE_CHECKING:
    from studio.ui.main_window import MainWindow


class Menus(QObject):
    """All actions of the window, gathered in menus: behind a button, on macOS in the menu bar."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window)
        self._window = window
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
        window, menu = self._window, self.file
        start = window.start
        self._add(menu, self.tr("New project…"), start.choose_new, "Ctrl+N", "mdi6.plus")
        self._add(
            menu, self.tr("Open a project…"), start.choose_project, "Ctrl+O", "mdi6.folder-open-outline"
        )
        self.recent = menu.addMenu(self.tr("Open recent"))
        self.recent.aboutToShow.connect(self._fill_recent)
        self._add(menu, self.tr("Open the sample project"), start.open_sample, "", "mdi6.human-greeting")
        menu.addSeparator()
        importing = self._add(menu, self.tr("Import files…"), window.import_files, "Ctrl+I", "mdi6.import")
        folder = self._add(menu, self.tr("Import a folder…"), window.import_folder)
        menu.addSeparator()
        pack = self._add(
            menu, self.tr("Pack the project…"), window.packing.ask_pack, "", "mdi6.zip-box-outline"
        )
        self._add(menu, self.tr("Open a packed project…"), window.packing.ask_unpack)
        menu.addSeparator()
        show = self._add(menu, self.tr("Show the project's folder"), window.show_project_folder)
        close = self._add(menu, self.tr("Close the project"), window.close_project, "Ctrl+W")
        self._needs_project += [importing, folder, pack, show, close]
        self._quit = self._add(menu, self.tr("Quit"), window.close, "Ctrl+Q")
        menu.removeAction(self._quit)  # it stands at the end of the whole menu
        window.addAction(self._quit)

    def _build_edit(self, menu: QMenu) -> None:
        window = self._window
        self.undo = self._add(menu, self.tr("Undo"), window.undo, "Ctrl+Z", "mdi6.undo")
        self.redo = self._add(menu, self.tr("Redo"), window.redo, "Ctrl+Shift+Z", "mdi6.redo")
        self.redo.setShortcuts([QKeySequence("Ctrl+Shift+Z"), QKeySequence("Ctrl+Y")])
        menu.aboutToShow.connect(self._name_undo)
        self._needs_project += [self.undo, self.redo]

    def _build_view(self, menu: QMenu) -> None:
        first = (self.tr("Record"), self.tr("Curate"), self.tr("Train"))
        names = (*first, self.tr("Review"), self.tr("Live"))
        for index, (room, text) in enumerate(zip(rooms.NAMES, names, strict=True)):
            show = partial(self._window.show_room, room)
            action = self._add(menu, text, show, f"Ctrl+{index + 1}", rooms.ICONS[room])
            self._needs_project.append(action)
        menu.addSeparator()
        self._light = self._add(menu, self.tr("Light colours"), self._on_light)
        self._light.setCheckable(True)
        self._light.setChecked(theme.colours().name == "light")
        self._add(menu, self.tr("Full screen"), self._on_full_screen, "F11")

    def _build_help(self, menu: QMenu) -> None:
        window = self._window
        self._add(menu, self.tr("List of keys"), window.show_shortcuts, "Ctrl+/", "mdi6.keyboard-outline")
        self._add(menu, self.tr("Copy diagnostics"), window.start.copy_report)
        self._add(menu, self.tr("About Saia Studio"), self._on_about)

    def _add(
        self, menu: QMenu, text: str, work: Callable[[], object], keys: str = "", icon: str = ""
    ) -> QAction:
        action = QAction(text, self._window)
        action.triggered.connect(lambda _checked=False: work())
        if keys:
            action.setShortcut(QKeySequence(keys))
            action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
        if icon:
            theme.set_icon(action, icon, "muted")
        menu.addAction(action)
        self._window.addAction(action)
        return action

    def _fill_recent(self) -> None:
        from pathlib import Path

        self.recent.clear()
        folders = self._window.session.settings.recent_projects
        for folder in folders:
            action = self.recent.addAction(folder)
            action.triggered.connect(lambda _c=False, f=folder: self._window.start.open_project(Path(f)))
        if not folders:
            self.recent.addAction(self.tr("No projects yet")).setEnabled(False)

    def _name_undo(self) -> None:
        project = self._window.session.project
        for action, name, word in (
            (self.undo, project.undo_name if project else "", self.tr("Undo")),
            (self.redo, project.redo_name if project else "", self.tr("Redo")),
        ):
            action.setText(f"{word}: {name}" if name else word)

    def _on_light(self) -> None:
        if self._window.session.rolling:  # restyling everything stalls the window for half a second
            self._light.setChecked(not self._light.isChecked())
            messages.show_note(self._window, self.tr("Colours can be changed after the recording."))
            return
        name = "light" if self._light.isChecked() else "dark"
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        theme.apply(app, name)
        self._window.session.change_settings(theme=name)

    def _on_full_screen(self) -> None:
        window = self._window
        if window.isFullScreen():
            window.showNormal()
        else:
            window.showFullScreen()

    def _on_about(self) -> None:
        box = QMessageBox(self._window)
        box.setWindowTitle(self.tr("About Saia Studio"))
        box.setIconPixmap(self._window.windowIcon().pixmap(64, 64))
        box.setText(f"Saia Studio {__version__}")
        box.setInformativeText(
            self.tr(
                "Record a voice and its motion, train, and let the voice alone move the avatar.\nMIT licence."
            )
        )
        box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        box.open()
