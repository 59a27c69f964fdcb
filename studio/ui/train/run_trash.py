"""Runs that are removed or brought in, as steps of undo: into the project's trash and back.

What they made is deleted on the pool.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, Signal

from studio.errors import StudioError
from studio.project.run import generated_folder
from studio.project.trash import MOST_KEPT, bring_run_back, put_run_away, thin_out
from studio.ui import tasks
from studio.ui.undo import Step, StepsUndo


class RunTrash(QObject):
    """Puts runs into the trash, and back by undo.

    Args:
        parent: as everywhere in Qt.
        busy: whether a run's folder is being trained in, which undo and redo leave where it is.

    Attributes:
        steps: the runs removed and brought in since the project was opened.

    Signals:
        removed: id of a run that is gone.
        returned: id of a run that is back.
        told: (sentence, remedy, the UndoScope that can take it back).
        failed: a StudioError.
    """

    removed = Signal(str)
    returned = Signal(str)
    told = Signal(str, str, object)
    failed = Signal(object)

    def __init__(self, parent: QObject, busy: Callable[[Path], bool]) -> None:
        super().__init__(parent)
        self._busy = busy
        self.steps = StepsUndo(self)

    def remove(self, folder: Path, sentence: str) -> None:
        """Put a run away, and say so in this sentence."""
        run = _MovingRun(self, folder)
        try:
            run.put_away()
        except StudioError as error:
            self.failed.emit(error)
            return
        name = self.tr("Remove {0}").format(folder.name)
        self.steps.push(Step(name, run.bring_back, partial(self._put_away_again, run)))
        self.told.emit(sentence, trash_text(), self.steps)

    def add_imported(self, folder: Path, sentence: str) -> None:
        """A run came from elsewhere, which undo removes again; say so in this sentence."""
        run = _MovingRun(self, folder)
        name = self.tr("Import {0}").format(folder.name)
        self.steps.push(Step(name, partial(self._put_away_again, run), run.bring_back))
        self.told.emit(sentence, "", self.steps)

    def _put_away_again(self, run: _MovingRun) -> None:
        """StudioError while somebody trains on it: the child would write into a folder that is gone."""
        if self._busy(run.folder):
            what = self.tr("{0} is being trained.").format(run.folder.name)
            raise StudioError(what, self.tr("Stop the training first."))
        run.put_away()


class _MovingRun:
    """A run on its way between the runs and the trash; it may come back under another name."""

    def __init__(self, owner: RunTrash, folder: Path) -> None:
        self._owner, self._runs = owner, folder.parent
        self.folder = folder

    def put_away(self) -> None:
        """Into the trash; StudioError where it cannot be moved."""
        folder = self.folder
        self.folder = put_run_away(folder)
        # Motion that the run made lies elsewhere and would outlive it.
        made = generated_folder(folder.parent.parent, folder.name)

        def tidy() -> None:
            shutil.rmtree(made, ignore_errors=True)  # it can be made again
            thin_out(folder.parent.parent)

        tasks.run(tidy, lambda _: None, owner=self._owner)
        self._owner.removed.emit(folder.name)

    def bring_back(self) -> None:
        """Among the runs again; StudioError where it cannot be moved."""
        self.folder = bring_run_back(self.folder, self._runs)
        self._owner.returned.emit(self.folder.name)


def trash_text() -> str:
    """Where a removed run lies, and for how long."""
    text = QCoreApplication.translate(
        "Removing", "Moved to the project's trash (.trash/runs), which keeps the last {0} runs."
    )
    return text.format(MOST_KEPT)
