"""Presenter of the Curate tab: builds its model and its cards, and shows what the model has to say."""

from __future__ import annotations

from collections.abc import Collection

from PySide6.QtCore import QObject, QTimer

from studio.ui import messages, undo
from studio.ui.bone_table import BoneTablePresenter
from studio.ui.curate.alignment_presenter import AlignmentPresenter
from studio.ui.curate.bench_presenter import BenchPresenter
from studio.ui.curate.labels_presenter import LabelPresenter
from studio.ui.curate.library_presenter import DataCardPresenter, InspectorPresenter, LibraryPresenter
from studio.ui.curate.missing_media_presenter import MissingMediaPresenter
from studio.ui.curate.model import CurateModel
from studio.ui.curate.suggestions_presenter import SuggestionsPresenter
from studio.ui.curate.timeline_presenter import CurvesPresenter, SoundPicturePresenter
from studio.ui.curate.tools_presenter import CleaningPresenter, CutPresenter, TrimPresenter
from studio.ui.curate.view import CurateView
from studio.ui.session import Session

WARM_UP_MS = 300


class CuratePresenter(QObject):
    """Builds the model and the cards; they know the model, and nobody here."""

    def __init__(self, view: CurateView, session: Session) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        model = self.model = CurateModel(session, self)
        self.undo_scope = model.undo_scope
        model.message_requested.connect(self._show_message)
        model.failed.connect(lambda error: messages.show_error(view, error))
        model.rows_changed.connect(lambda: view.show_empty(not model.rows))
        # How far the first import has come is seen in the library.
        session.import_progress.connect(lambda text, _: view.show_empty(not (model.rows or text)))
        # These come first: what may be typed must be known, and which row is shown, before others show it.
        self.inspector = InspectorPresenter(view.inspector, model, session)
        self.library = LibraryPresenter(view, model, session)
        self.bench = BenchPresenter(view, model, session)
        self.labels = LabelPresenter(view, model, session)
        self.trimming = TrimPresenter(view, model, session)
        self.cutting = CutPresenter(view.bench, model, session)
        self.aligning = AlignmentPresenter(view.bench, model, session)
        self.picture = SoundPicturePresenter(view.bench, model, session)
        self.curves = CurvesPresenter(view.bench, model, session)
        self.cleaning = CleaningPresenter(view.bench, model, session)
        self.suggestions = SuggestionsPresenter(view.library, model, session)
        self.card = DataCardPresenter(view.library, model, session)
        self.media = MissingMediaPresenter(view, model, session)
        self.bones = BoneTablePresenter(session, view)
        view.inspector.bones_requested.connect(self.bones.ask_of)
        model.playing.playing_changed.connect(self._on_looked)
        view.library.fix_button.clicked.connect(self._on_looked)
        view.record_requested.connect(lambda: session.tab_requested.emit("record"))
        model.open()

    def activate(self) -> None:
        """The tab is shown."""
        self.model.activate()
        self._view.library.table.setFocus()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def show_take(self, take: str) -> None:
        """Select a take and show it."""
        self.model.show_take(take)

    def show_takes(self, takes: Collection[str]) -> None:
        """Select takes in the library and bring them into sight."""
        self.model.show_takes(takes)

    def deactivate(self) -> None:
        """Another tab is shown: be silent."""
        self.model.deactivate()

    def close(self) -> None:
        """The window closes."""
        for card in (self.suggestions, self.card, self.cutting, self.cleaning, self.picture):
            card.close()
        self.model.close()
        self.bench.close()

    def _on_looked(self, on: bool) -> None:
        """A take is played, or what is to be fixed is shown: a tab that only opens checks nothing."""
        if on:
            self._session.step_done.emit("check")

    def _show_message(self, sentence: str, remedy: str, changed: bool) -> None:
        if changed:
            undo.tell_change(self._view, self.undo_scope, sentence, remedy)
        else:
            messages.show_note(self._view, sentence, remedy)

    def _warm_up(self) -> None:
        if self.model.active and not self._session.rolling:
            self._view.stage.figure.warm_up()
