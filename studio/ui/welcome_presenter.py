"""What the welcome page does: projects opened and made, the sample built, the computer checked."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from platformdirs import user_data_path
from PySide6.QtCore import QObject, QStandardPaths, QTimer
from PySide6.QtWidgets import QApplication, QFileDialog, QWidget

from studio.errors import StudioError
from studio.ipc.events import ChildEvent, DoctorDone, DoneEvent, SystemCheckEvent, TakeEvent
from studio.ui import messages, tasks
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.ui.welcome_view import WelcomePage

if TYPE_CHECKING:
    from studio.project import Project
    from studio.ui.hello_presenter import HelloPresenter

HELLO_MS = 120
"""After the first paint: the figure and all it needs must not keep the window from coming up."""
SAMPLE = "SAIA_SAMPLE"
"""Environment variable: where the sample project lies or is to be made, in place of the user's own folder."""


class StartPresenter(QObject):
    """Presenter of the welcome page, and what the File menu does with projects."""

    def __init__(self, page: WelcomePage, session: Session, window: QWidget) -> None:
        super().__init__(window)
        self._page = page
        self._session = session
        self._window = window
        self.checks: tuple[SystemCheckEvent, ...] = ()
        """What was found out about this machine."""
        self._checked = False
        self._hello: HelloPresenter | None = None
        self._sample = ChildTask(self)
        self._sample_folder = Path()
        self._doctor = ChildTask(self)
        self._connect()
        self.refresh()

    def refresh(self) -> None:
        """List the recent projects as they are now."""
        self._page.show_recent(tuple(Path(folder) for folder in self._session.settings.recent_projects))

    def check_machine(self, again: bool = False) -> None:
        """Look at the machine with `saia doctor`, once unless asked again."""
        if self._doctor.running or (self._checked and not again):
            return
        self._checked = True
        self._page.show_checking()
        self._doctor.start(["doctor"])

    def open_project(self, folder: Path) -> None:
        """Open a project folder, or say why not; what was found damaged in it is told."""
        try:
            self._show_problems(self._session.open_project(folder))
        except StudioError as error:
            messages.show_error(self._window, error)
        self.refresh()

    def choose_project(self) -> None:
        """Ask for a folder and open it."""
        title = self.tr("Open a project")
        chosen = QFileDialog.getExistingDirectory(self._window, title, str(self._home()))
        if chosen:
            self.open_project(Path(chosen))

    def choose_new(self) -> None:
        """Ask for a name and a place, and make a project there."""
        title = self.tr("New project: choose a name")
        place = self._free_place(self.tr("My project"))
        chosen, _ = QFileDialog.getSaveFileName(
            self._window, title, str(place), self.tr("Project folder (*)")
        )
        if chosen:
            self.create_project(Path(chosen))

    def create_project(self, folder: Path) -> None:
        """Make a project folder and open it, or say why not."""
        try:
            self._session.create_project(folder, folder.name)
            self._session.tab_requested.emit("record")
        except StudioError as error:
            messages.show_error(self._window, error)
        self.refresh()

    def open_sample(self) -> None:
        """Open the sample project; it is made first where it is not there yet."""
        folder = self._sample_place()
        if (folder / "project.json").is_file():
            self._show_sample(folder)
        elif not self._sample.running:
            self._sample_folder = folder
            self._page.show_progress(self.tr("Making the sample project…"), None)
            self._sample.start(["performer", "--sample", str(folder)])

    @property
    def hello(self) -> HelloPresenter:
        """What "Say something" does; made when first asked for."""
        if self._hello is None:
            from studio.ui.hello_presenter import HelloPresenter

            self._hello = HelloPresenter(self._page.hello, self._session, self._window)
        return self._hello

    def close(self) -> None:
        """End the children."""
        if self._hello is not None:
            self._hello.close()
        self._sample.close()
        self._doctor.close()

    def _connect(self) -> None:
        page = self._page
        page.hello.first_shown.connect(lambda: QTimer.singleShot(HELLO_MS, self, self._make_hello))
        page.new_requested.connect(self.choose_new)
        page.open_requested.connect(self.choose_project)
        page.sample_requested.connect(self.open_sample)
        page.cancel_requested.connect(self._sample.cancel)
        page.recent_requested.connect(self.open_project)
        page.forget_requested.connect(self._on_forget)
        page.check_requested.connect(lambda: self.check_machine(again=True))
        page.report_requested.connect(self.copy_report)
        self._sample.told.connect(self._on_sample_event)
        self._sample.done.connect(self._on_sample_done)
        self._sample.failed.connect(lambda error: messages.show_error(self._window, error))
        self._sample.ended.connect(lambda: self._page.show_progress("", None))
        self._doctor.done.connect(self._on_checked)
        self._doctor.failed.connect(self._on_check_failed)

    def _home(self) -> Path:
        # The sample lies where the studio keeps its own files: nobody looks for recordings there.
        own = self._sample_place().parent
        recent = [Path(one).parent for one in self._session.settings.recent_projects]
        documents = Path(QStandardPaths.writableLocation(QStandardPaths.StandardLocation.DocumentsLocation))
        usual = documents if documents.is_dir() else Path.home()
        return next((one for one in recent if one != own and one.is_dir()), usual)

    def _free_place(self, name: str) -> Path:
        """Where a new project may lie: its folder is not there yet, or a file dialog would go into it."""
        home = self._home()
        names = (name, *(f"{name} {number}" for number in range(2, 1000)))
        return next((home / one for one in names if not (home / one).exists()), home / name)

    def _show_problems(self, project: Project) -> None:
        """One message for what was found while opening, and for what is recovered."""
        if project.problems:
            what, remedy = project.problems[0]
            more = len(project.problems) - 1
            if more:
                remedy += " " + self.tr("{0} more such findings are in the takes' checks.").format(more)
            messages.show_failure(self._window, what, remedy)
        elif project.read_only:
            messages.show_note(
                self._window,
                self._session.locked_reason,
                self.tr("This project is read-only: you can browse it but not change it."),
            )

    def _on_forget(self, folder: Path) -> None:
        left = self._session.settings.without_recent(folder).recent_projects
        self._session.change_settings(recent_projects=left)
        self.refresh()

    def _on_sample_event(self, event: ChildEvent) -> None:
        if isinstance(event, TakeEvent):
            text = self.tr("Making the sample project…")
            self._page.show_progress(f"{text} {event.take}", event.fraction)

    def _on_sample_done(self, _done: DoneEvent) -> None:
        self._show_sample(self._sample_folder)

    def _make_hello(self) -> None:
        # The window may be gone again.
        if self._page.isVisible():
            _ = self.hello

    def _sample_place(self) -> Path:
        if chosen := os.environ.get(SAMPLE):
            return Path(chosen)
        return user_data_path("saia-studio", appauthor=False) / self.tr("Sample project")

    def _show_sample(self, folder: Path) -> None:
        """Open the sample where there is something to see at once: in Review, with its trained run."""
        from studio.performer.sample import RUN

        self.open_project(folder)
        project = self._session.project
        if project is not None and any(run.id == RUN and run.has_weights for run in project.runs):
            self._session.review_requested.emit(RUN)

    def _on_checked(self, done: DoctorDone) -> None:
        self.checks = done.checks
        self._page.show_checks(self.checks)

    def _on_check_failed(self, error: StudioError) -> None:
        self._page.show_checks((SystemCheckEvent(what=error.what, remedy=error.remedy),))

    def copy_report(self) -> None:
        """Put what `saia doctor` says on the clipboard, for a report."""
        tasks.run(_diagnostics, self._on_report, owner=self)

    def _on_report(self, head: str) -> None:
        lines = (f"[{'ok' if check.ok else '!!'}] {check.name}: {check.what}" for check in self.checks)
        QApplication.clipboard().setText("\n".join((head, *lines)))
        messages.show_note(self._window, self.tr("The report is on the clipboard."))


def _diagnostics() -> str:
    import platform

    from PySide6 import __version__ as qt

    from studio import __version__

    return f"Saia Studio {__version__}, Python {platform.python_version()}, Qt {qt}, {platform.platform()}"
