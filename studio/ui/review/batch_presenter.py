"""Presenter of the batch dialog: one batch in a child process, followed through its queue."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, QUrl
from PySide6.QtGui import QDesktopServices

from studio.errors import FileThereError, StudioError
from studio.export.options import format_choices
from studio.files import leftovers
from studio.ipc.commands import skip
from studio.ipc.events import ChildEvent, EntryEvent, FilesDone, QueueEvent, QueueProgressEvent
from studio.playback.layers import presets
from studio.training.styles import RunSelection
from studio.ui import messages
from studio.ui.language import sentences
from studio.ui.messages import counted
from studio.ui.review.batch_view import BatchDialog, BatchRequest
from studio.ui.review.model import ReviewModel
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from studio.ui.tasks import ChildTask


def batch_arguments(request: BatchRequest, project: Path, takes: Sequence[str]) -> list[str]:
    """The command that makes a batch, of its sounds or of all takes of a project."""
    run = request.selection.run
    if request.sounds:
        command = ["generate", str(project), run, *(str(path) for path in request.sounds)]
    else:
        command = ["export", str(project), *(f"{run}:{take}" if run else take for take in takes)]
    command += request.selection.words if run else ()
    return [*command, "-o", str(request.folder), "--format", ",".join(request.formats)]


class BatchPresenter(QObject):
    """Presenter of the batch dialog: starts and follows one batch at a time.

    Args:
        view: the tab; its bar says which run is proposed.
        model: what can be reviewed, and the sliders.
        session: knows the open project.
        child: runs the command; one of its own where None.
    """

    def __init__(
        self, view: ReviewView, model: ReviewModel, session: Session, child: ChildTask | None = None
    ) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._dialog: BatchDialog | None = None
        self._request: BatchRequest | None = None
        # The child is of the project before, and is ending.
        self._outdated = False
        self._child = child or ChildTask(self)
        self._child.told.connect(self._on_event)
        self._child.done.connect(self._on_done)
        self._child.failed.connect(self._on_failed)
        self._child.cancelled.connect(self._on_cancelled)
        self._child.ended.connect(self._on_ended)
        view.sources_card.batch_requested.connect(self.show)
        session.batch_dropped.connect(self._on_dropped)
        model.project_changed.connect(self._on_project)

    @property
    def dialog(self) -> BatchDialog | None:
        """The dialog, where it was opened."""
        return self._dialog

    @property
    def busy(self) -> bool:
        """Whether a batch is under way."""
        return self._child.running

    def show(self) -> None:
        """Open the dialog, or bring back the one whose batch is under way."""
        project = self._session.project
        if project is None:
            return
        # A new form each time: runs, styles and the folder may be others than when it was opened last.
        if self._dialog is None or not self.busy:
            self._remove_dialog()
            folder = project.exports_folder / "batch"
            choices, runs = format_choices(), self._model.runs()
            dialog = BatchDialog(runs, self._proposed_selection(), choices, folder, self._view)
            dialog.start_requested.connect(self._on_start)
            dialog.skip_requested.connect(lambda index: self._child.tell(skip(index)))
            dialog.cancel_requested.connect(self._child.cancel)
            dialog.folder_requested.connect(self._on_folder)
            self._dialog = dialog
        self._dialog.show()
        self._dialog.raise_()

    def close(self) -> None:
        """The window closes."""
        self._child.close()

    def _proposed_selection(self) -> RunSelection:
        """What the bar over the stage shows, else the newest run as it moves unasked.

        In a blind vote that is A, wherever it hides.
        """
        bar = self._view.bar
        # As the bar shows it, its style and seed too: a batch that moved otherwise would surprise.
        second = bar.two.isChecked() and not bar.vote.running and bar.shown_number == 2
        shown = (bar.second if second else bar.first).wanted
        return shown if shown.run else RunSelection(self._model.newest_run)

    def _on_dropped(self, folder: Path) -> None:
        """Offer motion of all sounds in a folder; behind a batch under way it waits in the form."""
        self.show()
        if self._dialog is not None:
            self._dialog.set_sounds([folder])

    def _on_project(self) -> None:
        """Another project: what is under way belongs to the one before."""
        # Cancelled and followed to its end, not just dropped: only then is it known that nobody writes into
        # its folder any more, and what it left half-written can be removed.
        self._outdated = self.busy
        self._child.cancel()
        self._remove_dialog()

    def _remove_dialog(self) -> None:
        if self._dialog is not None:
            self._dialog.close()
            self._dialog.deleteLater()
            self._dialog = None

    def _on_start(self, request: BatchRequest) -> None:
        if self.busy and self._dialog is not None:
            text = self.tr("The previous batch is still stopping. Try again in a moment.")
            self._dialog.show_message(text, "warn")
            return
        self._request = request
        self._start(request, force=False)

    def _start(self, request: BatchRequest, force: bool) -> None:
        project, dialog, tuning = self._session.project, self._dialog, self._model.tuning
        if project is None or dialog is None or self.busy:
            return
        takes = [item.key.partition(":")[2] for item in self._model.items if item.take]
        if not takes and not request.sounds:
            dialog.show_message(self.tr("This project has no takes yet."), "warn")
            return
        arguments = batch_arguments(request, project.folder, takes) + (["--force"] if force else [])

        def prepare(scratch: Path) -> list[str]:
            path = scratch / "tuning.json"
            presets.write(path, "Batch", tuning)
            return [*arguments, "--tune", str(path)]

        dialog.show_entries([])
        dialog.show_folder_button(False)
        dialog.show_message(self.tr("Getting ready."))
        dialog.show_busy(True)
        if request.tuned:
            self._child.prepare_and_start(prepare, "batch")
        else:
            self._child.start(arguments)

    def _on_event(self, event: ChildEvent) -> None:
        dialog = self._dialog
        if dialog is None or self._outdated:
            return
        match event:
            case QueueEvent():
                dialog.show_entries(list(event.names))
            case EntryEvent():
                text = sentences(event.what, event.remedy) if event.what else ""
                dialog.show_entry(event.index, event.state, text)
            case QueueProgressEvent():
                dialog.show_progress(event.index, event.entry, event.fraction, self._progress_text(event))
                self._session.work_progressed.emit("batch", event.fraction)

    def _progress_text(self, event: QueueProgressEvent) -> str:
        done = self.tr("{0} %").format(round(100 * event.fraction))
        if event.eta_s is None or event.eta_s < 1:
            return done
        minutes, seconds = divmod(round(event.eta_s), 60)
        return f"{done}   " + self.tr("{0} left").format(f"{minutes}:{seconds:02d}")

    def _on_done(self, done: FilesDone) -> None:
        made, failed, cancelled = len(done.files), len(done.failed), len(done.cancelled)
        files = counted(made, self.tr("1 file"), self.tr("{0} files"))
        text = self.tr("{0} written and read back.").format(files)
        text += " " + self.tr("{0} failed; the list says why.").format(failed) if failed else ""
        text += " " + self.tr("{0} cancelled.").format(cancelled) if cancelled else ""
        self._show_message(text, "warn" if failed else "good")
        if self._dialog is not None and not self._outdated:
            self._dialog.show_folder_button(made > 0)

    def _on_failed(self, error: BaseException) -> None:
        if isinstance(error, FileThereError) and not self._outdated:
            self._show_message(self.tr("Nothing was written."))
            # Later: the question waits for its answer, and the end of this child is told of first.
            QTimer.singleShot(0, self, lambda: self._ask(error.file))
        elif isinstance(error, StudioError):
            self._show_message(sentences(error.what, error.remedy), "bad")
        else:
            self._show_message(self.tr("Nothing was written."), "bad")
            messages.show_error(self._dialog, error)

    def _ask(self, name: str) -> None:
        """Whether files that are there may be written over."""
        request = self._request
        if request is None or self._dialog is None or self.busy:
            return
        question = self.tr("{0} already exists. Replace its contents?").format(name)
        details = self.tr("Files with the same names in {0} will be replaced.").format(request.folder)
        if messages.ask(self._dialog, question, details, self.tr("Replace")):
            self._start(request, force=True)

    def _show_message(self, text: str, role: str = "muted") -> None:
        if self._dialog is not None and not self._outdated:
            self._dialog.show_message(text, role)

    def _on_cancelled(self) -> None:
        if self._request is not None:
            # The child may have been too busy to do so itself.
            leftovers.sweep_killed(self._request.folder)
        self._show_message(self.tr("Cancelled. What was finished stays."))

    def _on_ended(self) -> None:
        self._session.work_progressed.emit("batch", None)
        was_outdated, self._outdated = self._outdated, False
        if self._dialog is not None:
            self._dialog.show_busy(False)
        if was_outdated:
            self._show_message(self.tr("The previous batch has stopped."))

    def _on_folder(self) -> None:
        if self._request is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._request.folder)))
