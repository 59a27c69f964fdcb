"""The frame around the five rooms: tabs, status, menus, keys, drag and drop."""

from __future__ import annotations

import gc
from pathlib import Path

from PySide6.QtCore import QEvent, Qt, QTimer, QUrl, SignalInstance
from PySide6.QtGui import (
    QCloseEvent,
    QDesktopServices,
    QDragEnterEvent,
    QDropEvent,
    QIcon,
    QShortcut,
)
from PySide6.QtWidgets import (
    QFileDialog,
    QFrame,
    QHBoxLayout,
    QLabel,
    QMainWindow,
    QSizePolicy,
    QStackedWidget,
    QTabBar,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.errors import StudioError
from studio.paths import resource
from studio.ui import messages, tabs, theme
from studio.ui.focus import FocusKeeper
from studio.ui.imports import Importer, PackTask, sort_drop
from studio.ui.menus import Menus
from studio.ui.next_steps_presenter import StepsPresenter
from studio.ui.next_steps_view import StepStrip
from studio.ui.session import Session
from studio.ui.shortcuts import ShortcutsDialog, name_of, sequence, tip_of
from studio.ui.status_strip import StatusStrip
from studio.ui.tabs import Presenter
from studio.ui.undo import UndoScope
from studio.ui.welcome_presenter import StartPresenter
from studio.ui.welcome_view import WelcomePage
from studio.ui.window_place import LEAST_SIZE, first_place, restore_splitters, restore_window, save_window

BAR_PX = 52
BUILD_AHEAD_MS = 400
"""Rooms not yet seen are built one by one in this rhythm, while nothing is recorded."""


class MainWindow(QMainWindow):
    """The studio's window; give it a session, show it."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.setObjectName("main_window")
        self.session = session
        self.rooms: dict[str, tuple[QWidget, Presenter]] = {}
        self._active = ""
        self.setWindowTitle("Saia Studio")
        self.setWindowIcon(QIcon(str(resource("icons", "saia.svg"))))
        screen = self.screen().availableGeometry()
        self.setMinimumSize(LEAST_SIZE.boundedTo(screen.size()))
        self.setAcceptDrops(True)
        self.welcome = WelcomePage()
        self.stack = QStackedWidget()
        self.stack.addWidget(self.welcome)
        self.start = StartPresenter(self.welcome, session, self)
        self.importer = Importer(session, self, lambda: self.room("curate")[1])  # type: ignore[arg-type, return-value]
        self.packing = PackTask(session, self, self.start.open_project)
        self.menus = Menus(self, self)
        self.steps = StepsPresenter(StepStrip(), session, self._on_step)
        self._build_frame()
        self._connect()
        FocusKeeper(self, lambda: self.rooms[self._active][0] if self._active else None)
        self._build_ahead = QTimer(self)
        self._build_ahead.setInterval(BUILD_AHEAD_MS)
        self._build_ahead.timeout.connect(self._on_build_ahead)
        if not restore_window(self):
            self.setGeometry(first_place(screen))
        self._on_project_opened()

    def room(self, name: str) -> tuple[QWidget, Presenter]:
        """The view and presenter of a room, built when first asked for."""
        if name not in self.rooms:
            view, presenter = tabs.build(name, self.session)
            presenter.undo_scope.changed.connect(self.menus.show_undo)
            restore_splitters(view)
            self.stack.addWidget(view)
            self.rooms[name] = (view, presenter)
        return self.rooms[name]

    def show_room(self, name: str) -> None:
        """Show "record", "curate", "train", "review" or "live"; without a project the welcome page stays."""
        if self.session.project is None:
            return
        self.tabs.setCurrentIndex(tabs.NAMES.index(name))
        # The tab bar says so too, after it was moved by this very method.
        if name == self._active:
            return
        messages.dismiss_error(self)
        view, presenter = self.room(name)
        if self._active:
            self.rooms[self._active][1].deactivate()
        self._active = name
        self.stack.setCurrentWidget(view)
        presenter.activate()
        self.menus.show_undo()
        self.steps.refresh()

    @property
    def shown_room(self) -> str:
        """The name of the room shown, "" on the welcome page."""
        return self._active

    # Menus

    def import_files(self) -> None:
        """Ask for files and import them."""
        title = self.tr("Import sound and motion")
        endings = "*.wav *.mp3 *.flac *.ogg *.m4a *.mp4 *.mov *.mkv *.webm *.csv *.bvh *.vrma *.vmd *.arrow"
        kinds = self.tr("Sound, motion and videos ({0});;All files (*)").format(endings)
        chosen, _ = QFileDialog.getOpenFileNames(self, title, str(Path.home()), kinds)
        if chosen:
            self.importer.start(tuple(Path(one) for one in chosen))

    def import_folder(self) -> None:
        """Ask for a folder with Audio, Blendshapes and Bones, and import it."""
        chosen = QFileDialog.getExistingDirectory(self, self.tr("Import a folder"), str(Path.home()))
        if chosen:
            self.importer.start((Path(chosen),))

    def show_project_folder(self) -> None:
        """Open the project's folder in the desktop's file window."""
        if self.session.project is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self.session.project.folder)))

    @property
    def undo_scope(self) -> UndoScope | None:
        """What Undo and Redo act on now: the shown room's own, None on the welcome page."""
        return self.rooms[self._active][1].undo_scope if self._active else None

    def show_palette(self) -> None:
        """Find anything by typing."""
        from studio.ui.command_palette import CommandPalette, entries

        dialog = CommandPalette(self, list(entries(self)))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.show()

    def show_settings(self, name: str = "") -> None:
        """Show every setting, one of them with the keyboard.

        Not modal: what is changed shows in the window at once.
        """
        from studio.ui.settings_dialog import SettingsDialog

        dialog = SettingsDialog(self.session, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.show()
        dialog.point_at(name)

    def show_shortcuts(self) -> None:
        """List every key. Not modal: a recording goes on and can be stopped."""
        dialog = ShortcutsDialog(self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.show()

    def close_project(self) -> None:
        """Back to the welcome page, unless something is being recorded."""
        if self.session.rolling:
            messages.show_note(self, self.tr("Stop the recording first."))
            return
        self.session.close_project()

    # Qt

    def closeEvent(self, event: QCloseEvent) -> None:
        # All are asked before any is closed: one that says no must not find the others closed already.
        for name, (_, presenter) in self.rooms.items():
            may_close = getattr(presenter, "may_close", None)
            if may_close is not None and not may_close():
                self.show_room(name)
                event.ignore()
                return
        self._build_ahead.stop()
        save_window(self)
        for _, presenter in self.rooms.values():
            presenter.close()
        self.start.close()
        self.importer.close()
        self.packing.close()
        if self.session.project is not None:
            self.session.project.close()
        event.accept()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if any(url.isLocalFile() for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        paths = tuple(Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile())
        if paths:
            event.acceptProposedAction()
            self.take_paths(paths)

    def take_paths(self, paths: tuple[Path, ...]) -> None:
        """Do what dropping these paths means here."""
        # Before there is a project a sound is something to say.
        drop = sort_drop(paths, self._active or "review")
        if drop.project is not None:
            if self.session.rolling:
                messages.show_note(self, self.tr("Stop the recording before opening another project."))
            else:
                self.start.open_project(drop.project)
        elif drop.packed is not None:
            self.packing.ask_place(drop.packed)
        elif drop.run is not None:
            self._take_for_project(drop.run, "train", self.session.run_dropped)
        elif drop.sounds and self.session.project is None:
            self.start.hello.say_file(drop.sounds[0])
        elif drop.sounds:
            self.session.sounds_dropped.emit(drop.sounds)
        elif drop.batch is not None and self.session.project is not None:
            self.session.batch_dropped.emit(drop.batch)
        elif drop.performed:
            self.session.performance_dropped.emit(drop.performed)
        elif drop.avatar is not None:
            tab = "live" if self._active == "live" else "review"
            self._take_for_project(drop.avatar, tab, self.session.avatar_dropped)
        else:
            self.importer.start(drop.imports)

    def _take_for_project(self, path: Path, tab: str, dropped: SignalInstance) -> None:
        """Show the tab that does something with what was dropped; without a project nothing can."""
        if self.session.project is None:
            what = self.tr("No project is open for {0}.").format(path.name)
            messages.show_error(self, StudioError(what, self.tr("Open or create a project first.")))
            return
        self.show_room(tab)
        dropped.emit(path)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        # The first change of the palette comes while the window is still being built.
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "tabs"):
            self._style_tabs()

    # The frame

    def _build_frame(self) -> None:
        bar = QFrame()
        theme.as_role(bar, "bar")
        bar.setFixedHeight(BAR_PX)
        row = QHBoxLayout(bar)
        row.setContentsMargins(theme.BETWEEN, 0, theme.INSIDE, 0)
        row.setSpacing(theme.INSIDE)
        mark = QLabel()
        mark.setPixmap(self.windowIcon().pixmap(26, 26))
        row.addWidget(mark)
        self.project_button = QToolButton()
        self.project_button.setObjectName("project_menu")
        self.project_button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.project_button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.project_button.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
        # The arrow stands behind the name by that; the menu would inherit it and be mirrored.
        self.menus.file.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self.menus.recent.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self.project_button.setMenu(self.menus.file)
        self.project_button.setMaximumWidth(260)
        # With a click's focus Space would open this menu again, and not do what the tab says.
        self.project_button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        theme.as_role(self.project_button, "quiet")
        row.addWidget(self.project_button)
        row.addSpacing(theme.BETWEEN)
        self.tabs = QTabBar()
        self.tabs.setObjectName("rooms")
        self.tabs.setDrawBase(False)
        self.tabs.setExpanding(False)
        self.tabs.setUsesScrollButtons(False)
        self.tabs.setIconSize(theme.icon_size(big=True))
        self.tabs.setAccessibleName(self.tr("Rooms"))
        capture, train = (self.tr("Record"), self.tr("Curate")), (self.tr("Train"), self.tr("Review"))
        for text in (*capture, *train, self.tr("Live")):
            self.tabs.addTab(text)
        self._style_tabs()
        row.addWidget(self.tabs)
        self.status = StatusStrip()
        place = self._build_place()
        row.addWidget(place, 1)
        tabs.Folding(self.tabs, self.status, place)
        row.addSpacing(theme.INSIDE)
        row.addWidget(self._build_menu_button())
        column = QVBoxLayout()
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(bar)
        column.addWidget(self.steps.strip)
        column.addWidget(self.stack, 1)
        page = QWidget()
        page.setObjectName("page")
        page.setLayout(column)
        self.setCentralWidget(page)

    def _build_place(self) -> QWidget:
        """The room between the tabs and the menu: facts at its right, and messages over it for a while."""
        place = QWidget()
        # What it holds folds to the room there is; it asks for none, so that the tabs keep theirs.
        place.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        messages.Toast(self, place)
        row = QHBoxLayout(place)
        row.setContentsMargins(0, 0, 0, 0)
        row.addStretch(1)
        row.addWidget(self.status)
        return place

    def _build_menu_button(self) -> QWidget:
        button = QToolButton()
        button.setObjectName("main_menu")
        theme.set_icon(button, "mdi6.menu", "muted")
        button.setAccessibleName(name_of("open_menu"))
        button.setToolTip(tip_of("open_menu"))
        button.setShortcut(sequence("open_menu"))
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        button.setMenu(self.menus.all)
        theme.as_role(button, "quiet")
        return button

    def _style_tabs(self) -> None:
        for index, name in enumerate(tabs.NAMES):
            self.tabs.setTabIcon(index, theme.icon(tabs.ICONS[name], "muted", active="accent"))
        theme.set_icon(self.project_button, "mdi6.chevron-down", "muted")

    def _connect(self) -> None:
        session = self.session
        self.tabs.currentChanged.connect(lambda index: self.show_room(tabs.NAMES[index]))
        session.project_opened.connect(self._on_project_opened)
        session.status_changed.connect(self.status.show_fact)
        session.tab_requested.connect(self.show_room)
        session.review_requested.connect(self._on_review_requested)
        session.watch_requested.connect(self._on_watch_requested)
        self._news = tabs.NewsDots(self.tabs, session)
        session.take_requested.connect(self._on_take_requested)
        session.import_requested.connect(self._on_import_requested)
        session.import_folder_requested.connect(self.import_folder)
        session.rolling_changed.connect(self._on_rolling_changed)
        self.status.clicked.connect(self._on_status_clicked)
        one_key = QShortcut(sequence("record"), self)
        # From any window of the program, dialogs too: nobody looks for the right one before a take.
        one_key.setContext(Qt.ShortcutContext.ApplicationShortcut)
        # A key held too long would stop what it has just started.
        one_key.setAutoRepeat(False)
        one_key.activated.connect(self._on_one_key)

    def _on_project_opened(self) -> None:
        project = self.session.project
        self.tabs.setVisible(project is not None)
        self.tabs.updateGeometry()  # QTabBar tells no layout how it grew while it was hidden
        self.menus.show_project(project is not None)
        if project is None:
            gc.unfreeze()
            if self._active:
                self.rooms[self._active][1].deactivate()
                self._active = ""
            self.stack.setCurrentWidget(self.welcome)
            self.menus.show_undo()
            self.setWindowTitle("Saia Studio")
            self.project_button.setText("Saia Studio")
            self.start.refresh()
            self.status.clear()
            return
        self._show_locked()
        self.setWindowTitle(f"{project.name} - Saia Studio")
        name = self.project_button.fontMetrics().elidedText(project.name, Qt.TextElideMode.ElideMiddle, 200)
        self.project_button.setText(name)
        self.project_button.setToolTip(str(project.folder))
        self.show_room(self._active or "record")
        self._build_ahead.start()

    def _show_locked(self) -> None:
        """Say in every tab, as long as it lasts, that nothing can be changed here."""
        why = self.session.locked_reason
        self.status.show_fact("locked", self.tr("Read-only") if why else "", "warn" if why else "")
        self.status.facts["locked"].setToolTip(why)

    def _on_build_ahead(self) -> None:
        """Build one unseen room while nobody is waiting, so that switching to it later does not stutter."""
        if self.session.rolling or self.session.project is None:
            return
        unseen = [name for name in tabs.NAMES if name not in self.rooms]
        if not unseen:
            self._build_ahead.stop()
            gc.freeze()
            return
        self.room(unseen[0])

    def _on_import_requested(self, paths: tuple[Path, ...]) -> None:
        if paths:
            self.importer.start(paths)
        else:
            self.import_files()

    def _on_rolling_changed(self, rolling: bool) -> None:
        self.status.show_fact("rolling", self.tr("Recording") if rolling else "", "")
        if rolling:
            messages.dismiss_error(self)
            # A full collection over a quarter of a million objects holds up every thread for 100 ms;
            # what is alive now is left out of those to come.
            gc.freeze()

    def _on_one_key(self) -> None:
        """F1: record where Record is shown, stop wherever one is, else come to Record."""
        if self.session.project is None:
            return
        if self._active != "record" and not self.session.rolling:
            self.show_room("record")
            return
        self.room("record")[1].toggle()  # type: ignore[attr-defined]

    def _on_review_requested(self, run: str) -> None:
        # Review may not have been built yet, and would not hear the signal itself.
        self.room("review")[1].show_run(run)  # type: ignore[attr-defined]
        self.show_room("review")

    def _on_watch_requested(self, run: str) -> None:
        self.room("review")[1].watch(run)  # type: ignore[attr-defined]
        self.show_room("review")

    def _on_step(self, tab: str, button: str) -> None:
        """Show where a step is done, with the focus on its button; Watch chooses the newest trained run."""
        project = self.session.project
        runs = [run for run in project.runs if run.has_weights] if project is not None else []
        if tab == "review" and runs:
            newest = max(runs, key=lambda run: (run.folder.stat().st_mtime, run.id))
            self.session.review_requested.emit(newest.id)
        self.show_room(tab)
        found = self.room(tab)[0].findChild(QWidget, button)
        if found is not None:
            found.setFocus(Qt.FocusReason.TabFocusReason)

    def _on_take_requested(self, take: str) -> None:
        # As above.
        self.show_room("curate")
        self.room("curate")[1].show_take(take)  # type: ignore[attr-defined]

    def _on_status_clicked(self, key: str) -> None:
        home = {
            "rolling": "record", "motion": "record", "sound": "record", "job": "curate", "train": "train",
            "sending": "review", "live": "live",
        }  # fmt: skip
        if key in home:
            self.show_room(home[key])
