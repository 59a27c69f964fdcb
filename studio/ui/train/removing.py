"""Runs that are removed or brought in, as steps of undo: into the project's trash and back.

What they made is deleted on the pool.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, Signal
from PySide6.QtWidgets import QWidget

from studio.errors import StudioError
from studio.project import Run
from studio.project.run import generated_folder
from studio.project.trash import MOST_KEPT, bring_run_back, put_run_away, thin_out
from studio.ui import messages, tasks, undo
from studio.ui.undo import Step, StepsUndo


class RunTrashPresenter(QObject):
    """Puts runs into the trash and offers to undo it.

    Args:
        parent: where messages are shown.
        busy: whether a run's folder is being trained in, which undo and redo leave where it is.

    Attributes:
        steps: the runs removed and brought in since the project was opened.

    Signals:
        removed: id of a run that is gone.
        returned: id of a run that is back.
    """

    removed = Signal(str)
    returned = Signal(str)

    def __init__(self, parent: QWidget, busy: Callable[[Path], bool]) -> None:
        super().__init__(parent)
        self._parent, self._busy = parent, busy
        self.steps = StepsUndo(self)

    def remove(self, folder: Path, told: str) -> None:
        """Put a run away.

        Args:
            folder: the run's.
            told: the sentence that says so.
        """
        run = _MovingRun(self, folder)
        try:
            run.put_away()
        except StudioError as error:
            messages.show_error(self._parent, error)
            return
        self.steps.push(
            Step(self.tr("Remove {0}").format(folder.name), run.bring_back, partial(self._again, run))
        )
        undo.tell_change(self._parent, self.steps, told, where_it_goes())

    def brought_in(self, folder: Path, told: str) -> None:
        """A run came from elsewhere, which undo removes again.

        Args:
            folder: the run's.
            told: the sentence that says so.
        """
        run = _MovingRun(self, folder)
        name = self.tr("Import {0}").format(folder.name)
        self.steps.push(Step(name, partial(self._again, run), run.bring_back))
        undo.tell_change(self._parent, self.steps, told)

    def _again(self, run: _MovingRun) -> None:
        """Put a run away once more; StudioError while somebody trains on it."""
        if self._busy(run.folder):
            what = self.tr("{0} is being trained.").format(run.folder.name)
            raise StudioError(what, self.tr("Stop the training first."))
        run.put_away()


class _MovingRun:
    """A run on its way between the runs and the trash; it may come back under another name."""

    def __init__(self, owner: RunTrashPresenter, folder: Path) -> None:
        self._owner, self._runs = owner, folder.parent
        self.folder = folder

    def put_away(self) -> None:
        """Into the trash; StudioError where it cannot be moved."""
        folder = self.folder
        self.folder = put_run_away(folder)
        made = generated_folder(Run(folder.name, folder, ""))

        def tidy() -> None:
            shutil.rmtree(made, ignore_errors=True)  # it can be made again
            thin_out(folder.parent.parent)

        tasks.run(tidy, lambda _: None, owner=self._owner)
        self._owner.removed.emit(folder.name)

    def bring_back(self) -> None:
        """Among the runs again; StudioError where it cannot be moved."""
        self.folder = bring_run_back(self.folder, self._runs)
        self._owner.returned.emit(self.folder.name)


def where_it_goes() -> str:
    """Where a removed run lies, and for how long."""
    words = QCoreApplication.translate(
        "Removing", "It lies in .trash/runs of the project's folder, with the {0} removed last."
    )
    return words.format(MOST_KEPT)
