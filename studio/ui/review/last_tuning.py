"""Keeps where Tune's sliders stand with the project: the next start begins where the last one ended."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, QThreadPool, QTimer

from studio.errors import StudioError
from studio.files import atomic
from studio.playback.layers import Tuning, presets
from studio.project.contents import is_project
from studio.ui import messages, tasks
from studio.ui.review.tune_panel import TunePanel
from studio.ui.session import Session

FILE = "tuning.json"
"""In a project's folder, beside its presets: where the sliders stood last."""
RESTED_MS = 500
"""Sliders that have not moved for so long are written."""


class LastTuning(QObject):
    """Reads it when a project is opened, writes it when the sliders rest. Files are touched on the pool.

    Args:
        panel: the Tune panel.
        session: knows the open project.
    """

    def __init__(self, panel: TunePanel, session: Session) -> None:
        super().__init__(panel)
        self._panel, self._session = panel, session
        self._folder: Path | None = None  # None where nothing is kept: no project, or one only to look at
        self._kept: Tuning | None = Tuning()  # None where it could not be written
        self._turn = 0
        self._told = self._touched = False
        self._pool = QThreadPool(self)
        self._pool.setMaxThreadCount(1)  # one after another: what was written is what is read
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.setInterval(RESTED_MS)
        self._resting.timeout.connect(self._write)
        panel.tuning_changed.connect(self._on_changed)
        session.project_opened.connect(self._on_project)
        app = QCoreApplication.instance()
        if app is not None:
            app.aboutToQuit.connect(self.close)
        self._on_project()

    def close(self) -> None:
        """The window closes: what has not rested yet is written now."""
        self._write()
        self._pool.waitForDone()

    def _on_project(self) -> None:
        """Another project, or none: keep what this one's sliders say, and show the other's."""
        self._write()
        self._turn += 1
        self._folder, self._told, self._touched = None, False, False
        project = self._session.project
        if project is None:
            return
        turn, folder = self._turn, project.folder

        def show(found: Tuning) -> None:
            if turn != self._turn:
                return
            self._kept = found
            self._folder = None if project.read_only else folder
            if self._touched:
                self._resting.start()  # somebody was quicker than the disk
            else:
                self._panel.begin(found)

        def failed(error: BaseException) -> None:
            if turn != self._turn:
                return
            if not isinstance(error, atomic.NewerVersionError):
                show(Tuning())
            elif not self._touched:
                self._panel.begin(Tuning())  # the file is left as it is
            what = self.tr("Where the sliders of Tune stood last could not be read.")
            remedy = self.tr("They begin as if nothing was tuned; your presets are as they were.")
            messages.show_warning(self._panel, what, remedy)

        tasks.run(lambda: _read(folder), show, failed, owner=self, pool=self._pool)

    def _on_changed(self, _tuning: Tuning) -> None:
        self._touched = True
        if self._session.project is not None:
            self._resting.start()

    def _write(self) -> None:
        """Keep what is tuned, where it is another than what is kept."""
        self._resting.stop()
        folder, tuning = self._folder, self._panel.tuning
        if folder is None or tuning == self._kept:
            return
        self._kept, turn = tuning, self._turn

        def failed(error: BaseException) -> None:
            if turn == self._turn:
                self._kept = None  # the next time sliders rest, or the window closes, it is tried again
            self._on_error(error)

        tasks.run(lambda: _keep(folder, tuning), lambda _: None, failed, owner=self, pool=self._pool)

    def _on_error(self, error: BaseException) -> None:
        """Said once a project: a full disk would say it with each slider."""
        if not self._told:
            self._told = True
            messages.show_error(self._panel, error)


def _read(folder: Path) -> Tuning:
    """Where the sliders stood, those that change nothing where it was never kept."""
    path = folder / FILE
    return presets.read(path).tuning if path.is_file() else Tuning()


def _keep(folder: Path, tuning: Tuning) -> None:
    if not is_project(folder):
        return  # it was moved or removed meanwhile, and is not to come back as an empty folder
    try:
        presets.write(folder / FILE, "Last", tuning)
    except StudioError as error:
        remedy = f"{error.remedy} Until then the sliders of Tune are forgotten when the studio closes."
        raise StudioError(error.what, remedy) from error
