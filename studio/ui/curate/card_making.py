"""The data card as a file: asked for, counted by a child process, opened with one click."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QFileDialog

from studio.take.safe_file import safe_name
from studio.ui import messages
from studio.ui.curate.library import Library
from studio.ui.jobs import Job
from studio.ui.session import Session


class CardMaking(QObject):
    """Runs `saia card` for the open project."""

    def __init__(self, library: Library, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._library, self._session = library, session
        self._path = Path()
        self._job = Job(self)
        self._job.event_received.connect(self._on_event)
        self._job.done.connect(self._on_done)
        self._job.failed.connect(lambda what, remedy: messages.show_failure(library, what, remedy))
        self._job.ended.connect(lambda: self._tell(""))
        library.card_requested.connect(self._ask)

    @property
    def running(self) -> bool:
        """Whether a card is being made."""
        return self._job.running

    def close(self) -> None:
        """End the child."""
        self._job.close()

    def make(self, path: Path) -> None:
        """Write the card of the open project."""
        project = self._session.project
        if project is None or self._job.running:
            return
        self._path = path if path.suffix.lower() in (".html", ".htm") else path.with_name(path.name + ".html")
        self._tell(self.tr("Counting for the data card…"))
        self._job.start(["card", str(project.folder), "-o", str(self._path)])

    def _ask(self) -> None:
        project = self._session.project
        if project is None:
            return
        name = f"{safe_name(project.name)}.html"
        place = str((project.exports_folder if project.exports_folder.is_dir() else Path.home()) / name)
        kinds = self.tr("Web page (*.html)")
        found, _ = QFileDialog.getSaveFileName(self._library, self.tr("Data card"), place, kinds)
        if found:
            self.make(Path(found))

    def _on_event(self, event: dict[str, Any]) -> None:
        fraction = event.get("fraction")
        if isinstance(fraction, int | float):
            self._tell(self.tr("Counting for the data card… {0}").format(f"{fraction:.0%}"))

    def _on_done(self, _facts: dict[str, Any]) -> None:
        path = self._path

        def show_it() -> None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(path)))

        show = (self.tr("Open"), show_it)
        messages.show_note(self._library, self.tr("The data card is in {0}.").format(path.name), "", show)

    def _tell(self, sentence: str) -> None:
        self._session.status_changed.emit("job", sentence, "")
