"""Presenter of the Record tab: builds its model and its cards, and asks before a recording is closed."""

from __future__ import annotations

from PySide6.QtCore import QObject, Qt, QTimer

from studio.errors import StudioError
from studio.ui import messages
from studio.ui.record.health_presenter import HealthPresenter
from studio.ui.record.input_tests_presenter import LevelTestPresenter, SyncTestPresenter
from studio.ui.record.inputs_presenter import InputsPresenter
from studio.ui.record.model import RecordModel
from studio.ui.record.prompter_presenter import PrompterPresenter
from studio.ui.record.slate_presenter import SlatePresenter
from studio.ui.record.stage_presenter import RecordStagePresenter
from studio.ui.record.takes_presenter import TakesPresenter
from studio.ui.record.trackers_presenter import TrackersPresenter
from studio.ui.record.view import RecordView
from studio.ui.record.webcam_presenter import WebcamPresenter
from studio.ui.session import Session

WARM_UP_MS = 600


class RecordPresenter(QObject):
    """Builds the model and the cards; they know the model, and nobody here."""

    def __init__(self, view: RecordView, session: Session) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        model = self.model = RecordModel(session, self)
        self.undo_scope = model.undo_scope
        model.failed.connect(lambda error: messages.show_error(view, error))
        view.record_requested.connect(model.toggle)
        view.cancel_requested.connect(model.countdown.cancel)
        # The inputs come first: the others tell of problems that they have found in the same look.
        self.inputs = InputsPresenter(view.inputs, model, session)
        self.sync = SyncTestPresenter(view.inputs, model, session)
        self.level = LevelTestPresenter(view.inputs, model)
        self.health = HealthPresenter(view.health, model, session)
        self.takes = TakesPresenter(view.takes, model, session)
        self.slate = SlatePresenter(view.slate_bar, model, session)
        self.prompter = PrompterPresenter(view.prompter, model, session)
        self.trackers = TrackersPresenter(view.trackers, model, session)
        self.webcam = WebcamPresenter(view.trackers.webcam, model, session)
        view.trackers.opened.connect(self.webcam.look)
        view.trackers.closed.connect(self.webcam.rest)
        self.stage = RecordStagePresenter(view, model, session)
        model.open()

    def activate(self) -> None:
        """The tab is shown."""
        self.model.activate()
        # So that the space bar is free.
        self._view.figure.setFocus(Qt.FocusReason.OtherFocusReason)
        self.takes.refresh()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def deactivate(self) -> None:
        """Another tab is shown: inputs and a recording go on, only the pictures rest."""
        self.model.deactivate()

    def toggle(self) -> None:
        """What the one key does now, whichever tab is shown: begin, cancel or stop a take."""
        self.model.toggle()

    def may_close(self) -> bool:
        """Whether the window may close; a running recording asks, and is saved."""
        model, session = self.model, self._session
        model.countdown.cancel()
        model.wait()
        if not session.rolling or model.recorder is None:
            return True
        question = self.tr("A recording is running.")
        details = self.tr("It is saved before the window closes.")
        if not messages.ask(self._view, question, details, self.tr("Stop and save")):
            return False
        try:
            # Nothing where it was stopped while the question was shown.
            model.finish()
        except StudioError as error:
            model.fail(error)
            return False
        return True

    def close(self) -> None:
        """The window closes: let go of microphone, port and OpenGL."""
        self.inputs.close()
        self.webcam.close()
        self.model.close()
        self._view.figure.dispose()

    def _warm_up(self) -> None:
        """Make the figure's first picture while nobody is waiting for anything."""
        model = self.model
        if not self._session.rolling and not model.busy and not model.countdown.running:
            self._view.figure.warm_up()
