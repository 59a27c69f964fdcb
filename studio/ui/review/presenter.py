"""The Review tab: builds its model and its cards."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer

from studio.project.run import BASE_VOICE
from studio.ui import messages
from studio.ui.review.batch_presenter import BatchPresenter
from studio.ui.review.export_presenter import ExportPresenter
from studio.ui.review.model import ReviewModel
from studio.ui.review.moods_presenter import MoodsPresenter
from studio.ui.review.preset_presenter import TuningPresetPresenter
from studio.ui.review.run_presenter import RunPresenter
from studio.ui.review.send_presenter import SendPresenter
from studio.ui.review.sources_presenter import SourcesPresenter
from studio.ui.review.stage_presenter import StagePresenter
from studio.ui.review.style_presenter import StylePresenter
from studio.ui.review.transport_presenter import TransportPresenter
from studio.ui.review.tune_presenter import TunePresenter
from studio.ui.review.view import ReviewView
from studio.ui.review.vote_presenter import VotePresenter
from studio.ui.session import Session
from studio.ui.undo import JointUndo

WARM_UP_MS = 300
"""The first picture takes OpenGL about a second: later than the tab, which is seen at once."""


class ReviewPresenter(QObject):
    """Builds the model and the cards; they know the model, and nobody here."""

    def __init__(self, view: ReviewView, session: Session) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        model = self.model = ReviewModel(session, self)
        model.failed.connect(lambda error: messages.show_error(view, error))
        # The vote comes first: it ends while the motions that it was about are still there.
        self.vote = VotePresenter(view.bar, model, session)
        self.stage = StagePresenter(view, model, session)
        self.transport = TransportPresenter(view, model)
        self.sources = SourcesPresenter(view, model, session)
        self.runs = RunPresenter(view.bar, model, session)
        self.style = StylePresenter(view.bar, model, session)
        self.moods = MoodsPresenter(view, model, session)
        self.tune = TunePresenter(view, model, session)
        self.presets = TuningPresetPresenter(view.tune, session)
        self.send = SendPresenter(view.send, model, session)
        self.export = ExportPresenter(view, model, session)
        self.batch = BatchPresenter(view, model, session)
        scopes = (self.moods.steps, view.tune.undo_scope, self.presets.steps, self.sources.steps)
        self.undo_scope = JointUndo(scopes, self)
        self.transport.played.connect(self._on_played)
        model.motion_changed.connect(self._tell_shown)
        view.train_requested.connect(lambda: session.tab_requested.emit("train"))
        model.open()

    def activate(self) -> None:
        """The tab is shown."""
        self.model.activate()
        self.transport.activate()
        self._tell_shown()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def show_run(self, run: str) -> None:
        """Show a run; where the tab is not shown, once it is."""
        self.model.show_run(run)

    def watch(self, run: str) -> None:
        """Show a run, and play it from the start as soon as its motion is there."""
        self.transport.play_from_start(run)
        self.model.show_run(run)

    def deactivate(self) -> None:
        """Another tab is shown; sending goes on, the sound rests."""
        self.transport.deactivate()
        self.model.deactivate()

    def close(self) -> None:
        """The window closes."""
        # The model goes last, with the player that all of them follow.
        self.stage.close()
        for card in (self.transport, self.runs, self.style, self.moods, self.send, self.export, self.batch):
            card.close()
        self.model.close()
        self._view.stage.dispose()

    def _on_played(self) -> None:
        if self.model.side.selection.run != BASE_VOICE:
            self._session.step_done.emit("watch")

    def _tell_shown(self) -> None:
        run = self.model.side.selection.run
        if self.model.active and self.model.predicted is not None and run:
            self._session.run_shown.emit(run)

    def _warm_up(self) -> None:
        # It takes a core for a moment, which a recording under way may need.
        if self.model.active and not self._session.rolling:
            self._view.stage.warm_up()
