"""The Train tab: its model, its cards, and what it tells people in words."""

from __future__ import annotations

from PySide6.QtCore import QObject

from studio.ui import messages, undo
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.ui.train.compare_presenter import ComparePresenter
from studio.ui.train.model import TrainModel
from studio.ui.train.progress_presenter import ProgressPresenter
from studio.ui.train.recipe_presenter import DataPresenter, RecipePresenter
from studio.ui.train.runs_presenter import RunsPresenter
from studio.ui.train.transfer_presenter import TransferPresenter
from studio.ui.train.verdict_presenter import VerdictPresenter
from studio.ui.train.view import TrainView
from studio.ui.undo import UndoScope


class TrainPresenter(QObject):
    """Builds the model and the cards; they know the model, and nobody here.

    Args:
        view: the tab.
        session: the open project.
        child: runs the training; tests give one of their own.
    """

    def __init__(self, view: TrainView, session: Session, child: ChildTask | None = None) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        model = self.model = TrainModel(session, child, self)
        self.undo_scope = model.undo_scope
        model.told.connect(self._on_told)
        model.failed.connect(lambda error: messages.show_error(view, error))
        model.data_changed.connect(self._on_data)
        self.data = DataPresenter(view.data, model, session)
        self.recipe = RecipePresenter(view.recipe, model, session)
        self.progress = ProgressPresenter(view.progress, model, session)
        self.runs = RunsPresenter(view.runs, model, session)
        self.compare = ComparePresenter(view.runs, model, session)
        self.transfer = TransferPresenter(view.runs, model, session)
        self.verdict = VerdictPresenter(view.runs.verdict, model, session)
        view.record_requested.connect(lambda: session.tab_requested.emit("record"))
        view.import_requested.connect(self.transfer.ask_import)
        model.open()

    def activate(self) -> None:
        """The tab is shown."""
        self.model.activate()

    def deactivate(self) -> None:
        """Another tab is shown; the training goes on."""
        self.model.deactivate()

    def may_close(self) -> bool:
        """Whether the window may close; a training under way asks what becomes of it."""
        return self.progress.may_close()

    def close(self) -> None:
        """The window closes: the child ends, keeping what it has."""
        self.compare.close()
        self.verdict.close()
        self.transfer.close()
        self.model.close()

    def _on_data(self) -> None:
        self._view.show_empty(self.model.facts is None)
        self._view.show_locked(self._session.locked_reason)

    def _on_told(self, sentence: str, remedy: str, scope: UndoScope | None) -> None:
        if scope is None:
            messages.show_note(self._view, sentence, remedy)
        else:
            undo.tell_change(self._view, scope, sentence, remedy)
