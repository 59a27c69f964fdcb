"""Runs that are removed: into the project's trash, with a way back; what they made goes on the pool."""

from __future__ import annotations

import shutil
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, Signal
from PySide6.QtWidgets import QWidget

from studio.errors import StudioError
from studio.project import Run
from studio.project.run_trash import MOST_KEPT, bring_run_back, put_run_away, thin_out
from studio.ui import background, messages
from studio.ui.review.clip import generated_folder


class Removing(QObject):
    """Puts runs into the trash and offers to undo it.

    Signals:
        removed: id of a run that is gone.
        returned: id of a run that is back.
    """

    removed = Signal(str)
    returned = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._parent = parent

    def remove(self, folder: Path, told: str) -> None:
        """Put a run away.

        Args:
            folder: the run's.
            told: the sentence that says so.
        """
        try:
            kept = put_run_away(folder)
        except StudioError as error:
            messages.show_error(self._parent, error)
            return
        made = generated_folder(Run(folder.name, folder, ""))

        def tidy() -> None:
            shutil.rmtree(made, ignore_errors=True)  # it can be made again
            thin_out(folder.parent.parent)

        background.run(tidy, lambda _: None, owner=self)
        self.removed.emit(folder.name)
        action = (self.tr("Undo"), lambda: self._bring_back(kept, folder.parent))
        messages.show_note(self._parent, told, where_it_goes(), action)

    def _bring_back(self, kept: Path, runs: Path) -> None:
        try:
            back = bring_run_back(kept, runs)
        except StudioError as error:
            messages.show_error(self._parent, error)
            return
        self.returned.emit(back.name)


def where_it_goes() -> str:
    """Where a removed run lies, and for how long."""
    words = QCoreApplication.translate(
        "Removing", "It lies in .trash/runs of the project's folder, with the {0} removed last."
    )
    return words.format(MOST_KEPT)
