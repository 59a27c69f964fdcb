"""Counts what there is to learn from, and puts right what a click can."""

from __future__ import annotations

from PySide6.QtCore import QObject

from studio.ui.session import Session
from studio.ui.train.data_view import DataCard
from studio.ui.train.model import TrainModel


class DataPresenter(QObject):
    """Presenter of the data card."""

    def __init__(self, view: DataCard, model: TrainModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        view.curate_requested.connect(lambda: session.tab_requested.emit("curate"))
        view.validation_requested.connect(model.set_aside)
        model.data_changed.connect(self._show)

    def _show(self) -> None:
        self._view.show_locked(self._session.locked_reason)
        if self._model.facts is not None:
            self._view.show_facts(self._model.facts)
