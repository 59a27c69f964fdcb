"""A project as one file, to take elsewhere; and such a file made a project again. Children do the work."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QFileDialog, QWidget

from studio.errors import StudioError
from studio.files.atomic import safe_name
from studio.ipc.events import DoneEvent, UnpackDone
from studio.ui import messages
from studio.ui.messages import counted
from studio.ui.session import Session
from studio.ui.tasks import ChildTask

SUFFIX = ".zip"


class PackTask(QObject):
    """Runs `saia pack` and `saia unpack`, one at a time.

    Args:
        session: with the project to pack.
        window: shows what came of it.
        open_project: opens what was unpacked.
    """

    def __init__(self, session: Session, window: QWidget, open_project: Callable[[Path], object]) -> None:
        super().__init__(window)
        self._session, self._window, self._open_project = session, window, open_project
        self._target = Path()
        self._unpacks = False
        self._task = ChildTask(self)
        self._task.done.connect(self._on_done)
        self._task.failed.connect(lambda error: messages.show_error(self._window, error))
        self._task.ended.connect(lambda: self._show_status(""))

    @property
    def running(self) -> bool:
        """Whether something is being packed or unpacked."""
        return self._task.running

    def ask_pack(self) -> None:
        """Ask where the packed project shall lie, and pack it there."""
        project = self._session.project
        if project is not None:
            place = project.folder.parent / f"{safe_name(project.name)}{SUFFIX}"
            title, kinds = self.tr("Pack the project"), self.tr("Packed project (*.zip)")
            found, _ = QFileDialog.getSaveFileName(self._window, title, str(place), kinds)
            if found:
                self.pack(Path(found))

    def ask_unpack(self) -> None:
        """Ask for a packed project, and open it."""
        title, kinds = self.tr("Open a packed project"), self.tr("Packed project (*.zip)")
        found, _ = QFileDialog.getOpenFileName(self._window, title, str(self._home()), kinds)
        if found:
            self.ask_place(Path(found))

    def ask_place(self, packed: Path) -> None:
        """Ask where a packed project shall become a folder, and open it there."""
        title = self.tr("Unpack {0}: choose a new folder").format(packed.name)
        place = free_folder(self._home(), packed.stem)
        kinds = self.tr("Project folder (*)")
        found, _ = QFileDialog.getSaveFileName(self._window, title, str(place), kinds)
        if found:
            self.unpack(packed, Path(found))

    def pack(self, target: Path) -> None:
        """Pack the open project into a zip."""
        project = self._session.project
        if project is None or self._is_busy():
            return
        self._target = target if target.suffix.lower() == SUFFIX else target.with_name(target.name + SUFFIX)
        self._unpacks = False
        self._show_status(self.tr("Packing {0}…").format(project.name))
        self._task.start(["pack", str(project.folder), "-o", str(self._target)])

    def unpack(self, packed: Path, folder: Path) -> None:
        """Make a project folder of a zip, and open it."""
        if self._is_busy():
            return
        self._target, self._unpacks = folder, True
        self._show_status(self.tr("Unpacking {0}…").format(packed.name))
        self._task.start(["unpack", str(packed), str(folder)])

    def close(self) -> None:
        """End the child; a half-made file goes with it."""
        self._task.close()

    def _is_busy(self) -> bool:
        if self._task.running:
            what = self.tr("Something is still being packed.")
            messages.show_error(self._window, StudioError(what, self.tr("Wait until it is done.")))
        return self._task.running

    def _on_done(self, done: DoneEvent) -> None:
        target = self._target
        if self._unpacks:
            if self._session.rolling:
                messages.show_note(self._window, self.tr("Unpacked into {0}.").format(target.name))
            else:
                self._open_project(target)
            if isinstance(done, UnpackDone) and done.left_out:
                one = self.tr("{0} file of the zip is part of no project and was left out.")
                many = self.tr("{0} files of the zip are part of no project and were left out.")
                messages.show_note(self._window, counted(done.left_out, one, many))
            return

        def show_it() -> None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(target.parent)))

        text = self.tr("The whole project is in {0}.").format(target.name)
        messages.show_note(self._window, text, "", (self.tr("Show the folder"), show_it))

    def _home(self) -> Path:
        recent = self._session.settings.recent_projects
        return Path(recent[0]).parent if recent else Path.home()

    def _show_status(self, sentence: str) -> None:
        self._session.status_changed.emit("job", sentence, "")


def free_folder(place: Path, name: str) -> Path:
    """A folder of this name that is not there yet, or of this name with a number."""
    folder, number = place / name, 2
    while folder.exists():
        folder, number = place / f"{name} {number}", number + 1
    return folder
