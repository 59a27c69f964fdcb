"""Presenter of the Live tab: builds its model and its cards, and asks before a performance is closed."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer

from studio.ui import messages
from studio.ui.avatar_store import Avatars
from studio.ui.live.avatar_window_presenter import AvatarWindowPresenter
from studio.ui.live.latency_presenter import DelayedVoicePresenter, LatencyPresenter
from studio.ui.live.model import LiveModel
from studio.ui.live.obs_presenter import ObsPresenter
from studio.ui.live.send_presenter import LiveSendPresenter
from studio.ui.live.source_presenter import LiveSourcePresenter, LiveTuningPresenter, MicrophonePresenter
from studio.ui.live.stage_presenter import LiveStagePresenter, StatusPresenter
from studio.ui.live.stream_presenter import RemotePresenter
from studio.ui.live.view import LiveView
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.ui.undo import UndoScope

WARM_UP_MS = 300


class LivePresenter(QObject):
    """Builds the model and the cards; they know the model, and nobody here.

    Args:
        view: the layout.
        session: the open project and the settings.
        child: runs the performance; tests give one that starts nothing.
    """

    def __init__(self, view: LiveView, session: Session, child: ChildTask | None = None) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        self.undo_scope = UndoScope(self)
        model = self.model = LiveModel(session, self, child)
        self.targets = LiveSendPresenter(view.send, model, session)
        self.tunings = LiveTuningPresenter(view.source, model, session)
        self.microphones = MicrophonePresenter(view.source, model, session)
        self.source = LiveSourcePresenter(view.source, model, session)
        self.stage = LiveStagePresenter(view, model, session)
        self.status = StatusPresenter(view, model)
        self.latency = LatencyPresenter(view.latency, model)
        self.voice = DelayedVoicePresenter(view.latency.voice, model, session)
        self.obs = ObsPresenter(view.stream.obs, model, session)
        self.remote = RemotePresenter(view.stream, model, session)
        self.avatars = Avatars(view.stage, session)
        self.window = AvatarWindowPresenter(view.stream, model, session)
        model.about_to_start.connect(lambda: messages.dismiss_error(view))
        model.task.failed.connect(self._on_failed)
        model.task.forced.connect(self._on_forced)
        model.open()

    def activate(self) -> None:
        """The tab is shown."""
        self.model.activate()
        self.tunings.refresh()
        self.microphones.refresh()
        self.voice.refresh()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def deactivate(self) -> None:
        """Another tab is shown; the performance goes on, only its picture rests."""
        self.model.deactivate()

    def may_close(self) -> bool:
        """Whether the window may close; while live it asks, for the avatar stops with it."""
        if not self.model.task.running:
            return True
        question, details = self.tr("You are live."), self.tr("The avatar stops when the window closes.")
        return messages.ask(self._view, question, details, self.tr("End and close"))

    def close(self) -> None:
        """The window closes."""
        self.window.close()
        self.stage.close()
        self.status.close()
        self.remote.close()
        self.obs.close()
        self.model.task.close()
        self.targets.close()
        self._view.stage.figure.dispose()

    def _on_failed(self, error: BaseException) -> None:
        messages.show_error(self._view, self.microphones.explained(error))

    def _on_forced(self) -> None:
        what = self.tr("Live stopped responding and was ended.")
        messages.show_warning(self._view, what, self.tr("Nothing is lost: you can go live again."))

    def _warm_up(self) -> None:
        if self.model.active and not self._session.rolling:
            self._view.stage.figure.warm_up()
