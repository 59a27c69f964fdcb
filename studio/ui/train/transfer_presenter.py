"""A run's model card, and the run as one file: out to another computer, and in from there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.evaluation import model_card
from studio.ipc.events import DoneEvent, UnpackDone
from studio.training.run_file import SUFFIX
from studio.ui import messages
from studio.ui.session import Session
from studio.ui.shortcuts import name_of
from studio.ui.tasks import ChildTask
from studio.ui.train.card_view import CardDialog
from studio.ui.train.model import TrainModel
from studio.ui.train.runs_view import RunsCard


class TransferPresenter(QObject):
    """Presenter of Model card, Export run and Import a run."""

    def __init__(self, view: RunsCard, model: TrainModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._tasks: set[ChildTask] = set()
        self.dialog: CardDialog | None = None
        """The model card that is open."""
        view.card_requested.connect(self.show_card)
        view.export_requested.connect(self.ask_export)
        view.import_requested.connect(self.ask_import)
        session.run_dropped.connect(self._on_dropped)

    def close(self) -> None:
        """The window closes."""
        for task in tuple(self._tasks):
            task.close()

    # -- the model card ----------------------------------------------------------------------------

    def show_card(self, run_id: str) -> None:
        """Show a run's card, written anew from what is known of it."""
        project = self._session.project
        if project is None or not run_id:
            return
        folder = project.run(run_id).folder
        dialog = self.dialog = CardDialog(run_id, self._view)
        dialog.licence_written.connect(lambda text: self._save_licence(folder, dialog, text))
        dialog.browser_requested.connect(lambda: self._browse(folder))
        dialog.show_card(model_card.card_html(folder), model_card.licence_of(folder))
        dialog.show_locked(self._session.locked_reason)
        dialog.finished.connect(lambda _: self._on_closed(dialog))
        dialog.show()

    def _save_licence(self, folder: Path, dialog: CardDialog, text: str) -> None:
        try:
            model_card.keep_licence(folder, text)
        except StudioError as error:
            messages.show_error(self._view, error)
            return
        dialog.show_card(model_card.card_html(folder), text, saved=True)

    def _browse(self, folder: Path) -> None:
        try:
            path = model_card.write_card(folder)
        except StudioError as error:
            messages.show_error(self._view, error)
            return
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(path)))

    def _on_closed(self, dialog: CardDialog) -> None:
        if dialog is self.dialog:
            self.dialog = None

    # -- a run as a file ---------------------------------------------------------------------------

    def ask_export(self, run_id: str) -> None:
        """Ask where to, and write the run there."""
        project = self._session.project
        if project is None or not run_id:
            return
        title = self.tr("Export {0}").format(run_id)
        kinds = self.tr("Run of Saia Studio (*{0})").format(SUFFIX)
        start = str(project.exports_folder / f"{project.name}_{run_id}{SUFFIX}")
        found, _ = QFileDialog.getSaveFileName(self._view, title, start, kinds)
        if not found:
            return
        # Not every system's dialog adds the ending of the kind that was chosen.
        whole = found.endswith(SUFFIX)
        target = Path(found if whole else found + SUFFIX)
        args = ["pack", str(project.folder), "--run", run_id, "-o", str(target)]
        # The dialog has asked about the very name that was typed, not about one with an ending more.
        args += ["--force"] if whole else []
        text = self.tr("{0} is in {1}. Open it in another project with Import a run.")
        self._start(args, lambda _: messages.show_note(self._view, text.format(run_id, target.name)))

    def ask_import(self) -> None:
        """Ask for a file, and bring it in."""
        if self._session.project is None:
            return
        kinds = self.tr("Run of Saia Studio (*{0})").format(SUFFIX)
        found, _ = QFileDialog.getOpenFileName(self._view, name_of("import_run"), str(Path.home()), kinds)
        if found:
            self._import(Path(found))

    def _on_dropped(self, path: Path) -> None:
        project = self._session.project
        if project is not None and project.read_only:
            messages.show_failure(self._view, self._session.locked_reason, project.read_only_remedy)
        else:
            self._import(path)

    def _import(self, source: Path) -> None:
        """Make a run of a file; it is looked at in a child process before it becomes one."""
        project = self._session.project
        if project is None:
            return

        def done(made: DoneEvent) -> None:
            assert isinstance(made, UnpackDone)
            text = self.tr("{0} is {1} now.").format(source.name, made.run)
            self._model.add_run(project.runs_folder / made.run, text)

        self._start(["unpack", str(source), str(project.folder)], done)

    def _start(self, args: list[str], done: Callable[[DoneEvent], None]) -> None:
        task = ChildTask(self)  # one for each: a second export must not end the first
        self._tasks.add(task)
        task.done.connect(done)
        task.failed.connect(lambda error: messages.show_error(self._view, error))
        task.ended.connect(lambda: self._on_ended(task))
        task.start(args)

    def _on_ended(self, task: ChildTask) -> None:
        self._tasks.discard(task)
        task.deleteLater()
