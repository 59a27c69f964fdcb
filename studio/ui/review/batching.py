"""A batch in a child process: starts it, follows its queue, and asks before files are written over."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, QUrl
from PySide6.QtGui import QDesktopServices

from studio.errors import StudioError
from studio.export.options import format_choices
from studio.files import leftovers
from studio.ipc.commands import skip
from studio.ipc.events import ChildEvent, EntryEvent, FilesDone, QueueEvent, QueueProgressEvent
from studio.playback.layers import Tuning, presets
from studio.training.run_choice import RunSelection
from studio.ui import messages
from studio.ui.messages import counted
from studio.ui.review.batch_dialog import BatchDialog, BatchRequest
from studio.ui.review.listing import ReviewList
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from studio.ui.tasks import Job


def words_of(wish: BatchRequest, project: Path, takes: Sequence[str]) -> list[str]:
    """The command that makes a batch, of its sounds or of all takes of a project."""
    wanted = wish.wanted
    if wish.sounds:
        words = ["generate", str(project), wanted.run, *(str(path) for path in wish.sounds)]
    else:
        words = ["export", str(project), *(f"{wanted.run}:{take}" if wanted.run else take for take in takes)]
    words += wanted.words if wanted.run else ()
    return [*words, "-o", str(wish.folder), "--format", ",".join(wish.formats)]


class BatchPresenter(QObject):
    """Thought of the batch dialog; one batch at a time."""

    def __init__(
        self, view: ReviewView, listing: ReviewList, session: Session, tuning: Callable[[], Tuning]
    ) -> None:
        super().__init__(view)
        self._view, self._listing, self._session, self._tuning = view, listing, session, tuning
        self._dialog: BatchDialog | None = None
        self._job: Job | None = None
        self._wish: BatchRequest | None = None
        self._scratch: Path | None = None
        self._leaving = False  # the child is of the project before, and is ending
        view.sources_card.batch_requested.connect(self.show)
        session.batch_dropped.connect(self._on_dropped)
        session.project_opened.connect(self._on_project)

    @property
    def dialog(self) -> BatchDialog | None:
        """The dialog, where it was opened."""
        return self._dialog

    @property
    def busy(self) -> bool:
        """Whether a batch is under way."""
        return self._job is not None

    def show(self) -> None:
        """Open the dialog, or bring back the one whose batch is under way."""
        project = self._session.project
        if project is None:
            return
        if self._dialog is None or not self.busy:
            self._drop_dialog()
            folder = project.exports_folder / "batch"
            dialog = BatchDialog(self._listing.runs(), self._wanted(), format_choices(), folder, self._view)
            dialog.start_requested.connect(self._on_start)
            dialog.skip_requested.connect(self._on_skip)
            dialog.cancel_requested.connect(self._on_cancel)
            dialog.folder_requested.connect(self._on_folder)
            self._dialog = dialog
        self._dialog.show()
        self._dialog.raise_()

    def _wanted(self) -> RunSelection:
        """What the bar over the stage shows, else the newest run as it moves unasked.

        In a blind vote that is A, wherever it hides.
        """
        bar = self._view.bar
        second = bar.two.isChecked() and not bar.vote.running and bar.shown_number == 2
        wanted = (bar.second if second else bar.first).wanted
        runs = self._listing.runs()
        return wanted if wanted.run or not runs else RunSelection(runs[-1].id)

    def close(self) -> None:
        """The window closes."""
        if self._job is not None:
            self._job.close()
        self._clean()

    def _on_dropped(self, folder: Path) -> None:
        """Offer motion of all sounds in a folder; behind a batch under way it waits in the form."""
        self.show()
        if self._dialog is not None:
            self._dialog.set_sounds([folder])

    def _on_project(self) -> None:
        """Another project: what is under way belongs to the one before."""
        self._on_cancel()
        self._leaving = self.busy
        self._drop_dialog()

    def _drop_dialog(self) -> None:
        if self._dialog is not None:
            self._dialog.close()
            self._dialog.deleteLater()
            self._dialog = None

    def _on_start(self, wish: BatchRequest) -> None:
        if self.busy and self._dialog is not None:
            words = self.tr("The batch before is ending: press Start again in a moment.")
            self._dialog.show_told(words, "warn")
            return
        self._wish = wish
        self._start(wish, force=False)

    def _start(self, wish: BatchRequest, force: bool) -> None:
        project, dialog = self._session.project, self._dialog
        if project is None or dialog is None or self.busy:
            return
        takes = [source.key.partition(":")[2] for source in self._listing.sources if source.take]
        if not takes and not wish.sounds:
            dialog.show_told(self.tr("There is no take in this project yet."), "warn")
            return
        words = words_of(wish, project.folder, takes) + (["--force"] if force else [])
        try:
            words += self._tuned() if wish.tuned else []
        except (OSError, StudioError) as error:
            messages.show_error(dialog, error)
            return
        job = self._job = Job(self)
        job.told.connect(self._on_event)
        job.done.connect(self._on_done)
        job.failed.connect(self._on_failed)
        job.cancelled.connect(self._on_cancelled)
        job.ended.connect(self._on_ended)
        dialog.show_entries([])
        dialog.show_folder_button(False)
        dialog.show_told(self.tr("Getting ready."))
        dialog.show_busy(True)
        job.start(words)

    def _tuned(self) -> list[str]:
        """The sliders as they stand, as a file the command reads."""
        self._scratch = Path(tempfile.mkdtemp(prefix=leftovers.scratch_prefix("batch")))
        path = self._scratch / "tuning.json"
        presets.write(path, "Batch", self._tuning())
        return ["--tune", str(path)]

    def _on_event(self, event: ChildEvent) -> None:
        dialog = self._dialog
        if dialog is None or self._leaving:
            return
        match event:
            case QueueEvent():
                dialog.show_entries(list(event.names))
            case EntryEvent():
                words = f"{event.what} {event.remedy}" if event.what else ""
                dialog.show_entry(event.index, event.state, words)
            case QueueProgressEvent():
                dialog.show_progress(event.index, event.entry, event.fraction, self._left(event))

    def _left(self, event: QueueProgressEvent) -> str:
        done = self.tr("{0} %").format(round(100 * event.fraction))
        if event.eta_s is None or event.eta_s < 1:
            return done
        minutes, seconds = divmod(round(event.eta_s), 60)
        return f"{done}   " + self.tr("{0} left").format(f"{minutes}:{seconds:02d}")

    def _on_done(self, done: FilesDone) -> None:
        made, failed, left = len(done.files), len(done.failed), len(done.cancelled)
        files = counted(made, self.tr("1 file"), self.tr("{0} files"))
        words = self.tr("{0} written and read back.").format(files)
        words += " " + self.tr("{0} failed; the list says why.").format(failed) if failed else ""
        words += " " + self.tr("{0} cancelled.").format(left) if left else ""
        self._tell(words, "warn" if failed else "good")
        if self._dialog is not None and not self._leaving:
            self._dialog.show_folder_button(made > 0)

    def _on_failed(self, what: str, remedy: str) -> None:
        name = self._job.there if self._job is not None else ""
        if name and not self._leaving:
            self._tell(self.tr("Nothing was written."))
            QTimer.singleShot(0, self, lambda: self._ask(name))
        else:
            self._tell(f"{what} {remedy.replace(' with -o', '')}", "bad")

    def _ask(self, name: str) -> None:
        """Whether files that are there may be written over."""
        wish = self._wish
        if wish is None or self._dialog is None or self.busy:
            return
        question = self.tr("{0} is there already. Replace what is there?").format(name)
        details = self.tr("Files of the same names in {0} are written over.").format(wish.folder)
        if messages.ask(self._dialog, question, details, self.tr("Replace")):
            self._start(wish, force=True)

    def _tell(self, words: str, role: str = "muted") -> None:
        if self._dialog is not None and not self._leaving:
            self._dialog.show_told(words, role)

    def _on_skip(self, index: int) -> None:
        if self._job is not None:
            self._job.tell(skip(index))

    def _on_cancel(self) -> None:
        if self._job is not None:
            self._job.cancel()

    def _on_cancelled(self) -> None:
        if self._wish is not None:
            leftovers.sweep_killed(self._wish.folder)  # the child may have been too busy to do so itself
        self._tell(self.tr("Cancelled. What was finished stays."))

    def _on_ended(self) -> None:
        job, self._job = self._job, None
        if job is not None:
            job.deleteLater()
        self._clean()
        left, self._leaving = self._leaving, False
        if self._dialog is not None:
            self._dialog.show_busy(False)
        if left:
            self._tell(self.tr("The batch before has ended."))

    def _on_folder(self) -> None:
        if self._wish is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._wish.folder)))

    def _clean(self) -> None:
        if self._scratch is not None:
            shutil.rmtree(self._scratch, ignore_errors=True)
            self._scratch = None
