"""Shows a run's curves, figures and preview: of the training under way, or of one in the list."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QTimer

from studio.errors import StudioError
from studio.ipc.events import EpochEvent
from studio.motion import Motion
from studio.project import Run
from studio.training import preview
from studio.training.preview import BEST, CAPTURED, LATEST, Preview
from studio.ui import messages, tasks
from studio.ui.desktop import DesktopNotifier
from studio.ui.language import native, sentences
from studio.ui.session import Session
from studio.ui.shortcuts import name_of
from studio.ui.train.model import TrainModel
from studio.ui.train.preview_view import PreviewPane
from studio.ui.train.progress_view import CloseChoice, ProgressCard, ask_how_to_end
from studio.ui.train.run_facts import RunFacts, curves, epochs_of, run_facts
from studio.ui.train.task import run_text, strip_text, training_text


class ProgressPresenter(QObject):
    """Presenter of the progress card: what is seen of a run, and how the one under way is ended."""

    def __init__(self, view: ProgressCard, model: TrainModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._training = model.training
        self._closing = False  # the window goes once the training has ended
        self._preview = PreviewPresenter(view.preview)
        self._desktop = DesktopNotifier(view)
        self._ready = ""  # the run that is ready and was not watched yet
        self._said = "", ""  # the run of which a message said last that it is ready, and its words
        session.watch_requested.connect(self._on_watch)
        session.review_requested.connect(self._on_watch)
        session.run_shown.connect(self._on_watch)
        session.project_opened.connect(self._on_project_opened)
        view.watch_requested.connect(lambda: session.watch_requested.emit(model.shown))
        view.stop_requested.connect(model.training.stop)
        view.cancel_requested.connect(self.ask_cancel)
        view.offer_taken.connect(model.start_smaller)
        model.refreshed.connect(self._follow)
        model.shown_changed.connect(self._show)
        model.cancel_requested.connect(self.ask_cancel)
        training = model.training
        training.began.connect(self._on_began)
        training.changed.connect(self._show_buttons)
        training.done.connect(self._on_done)
        training.failed.connect(self._on_failed)
        training.ended.connect(self._on_ended)
        self._show_buttons()

    def may_close(self) -> bool:
        """Whether the window may close; a training under way asks what becomes of it."""
        training = self._training
        if not self._model.training.running:
            return True
        chosen = ask_how_to_end(self._view, training.run_id, training.resuming)
        if not training.running:  # it ended while the question was open
            return chosen is not CloseChoice.GO_ON
        if chosen is CloseChoice.KEEP:
            self._closing = True
            training.stop()
        elif chosen is CloseChoice.DISCARD:
            folder = training.folder
            self._model.close()
            if folder is not None and folder.is_dir():
                self._model.trash.remove(folder, self.tr("Removed {0}.").format(folder.name))
        return chosen is CloseChoice.DISCARD

    def ask_cancel(self) -> None:
        """Cancel the training under way, and ask first where it has learnt something."""
        if not self._training.running:
            return
        question = self.tr("Cancel this training?")
        details = self.tr("The run and what it has learnt so far are removed.")
        if self._training.resuming:
            details = self.tr("What it learnt before it was resumed stays.")
        # Nothing is lost before the first epoch, so nobody needs to be asked.
        if not self._training.progress.epochs or messages.ask(
            self._view, question, details, self.tr("Cancel training"), self.tr("Go on training")
        ):
            self._training.cancel()

    # -- the training under way --------------------------------------------------------------------

    def _on_began(self) -> None:
        self._closing = False
        self._show_ready("")
        self._view.show_alarm("")
        self._view.show_offer("", "")

    def _show_buttons(self) -> None:
        training = self._training
        running = training.running
        self._view.show_running(running, running and training.stopping, running and training.measuring)

    def _on_done(self, run: str, stopped: bool) -> None:
        text = self.tr("{0} stopped early and is ready.") if stopped else self.tr("{0} is ready.")
        text = text.format(run)
        # Review shows the open project: a run of one that was left cannot be seen there.
        action = (name_of("watch_run"), lambda: self._session.watch_requested.emit(run))
        if self._model.here:
            for tab in ("train", "review"):
                self._session.news_changed.emit(tab, text)
            self._ready, self._said = run, (run, text)
            self._model.read_verdict(
                run, lambda found: self._tell_ready(run, text, native(found.quality), action)
            )
        else:
            self._tell_ready(run, text, "", None)

    def _tell_ready(self, run: str, text: str, told: str, action: messages.Action | None) -> None:
        """Say that a run is ready and how good it is, unless it was watched meanwhile."""
        if action is not None and run != self._ready:
            return
        # A person who is away finds it still there; one who is not has the strip, which covers no tab.
        messages.show_note(self._view, text, told, action, stays=self._desktop.is_away)
        if self._session.settings.notify:
            self._desktop.notify(text, told)

    def _show_ready(self, run: str) -> None:
        """Keep in the status strip, until it is watched, that a run is ready; "" takes it away."""
        self._ready = run
        if not self._training.running:
            text = self.tr("{0} is ready").format(run) if run else ""
            self._session.status_changed.emit("train", text, "good" if run else "")

    def _on_watch(self, run: str) -> None:
        if run and run == self._ready:
            self._show_ready("")
        # Another training may have begun since; what its message offers is done all the same.
        if run and run == self._said[0]:
            messages.dismiss_note(self._view, self._said[1])

    def _on_project_opened(self) -> None:
        """What another project's run offers cannot be done in this one."""
        self._show_ready("")
        messages.dismiss_note(self._view, self._said[1])

    def _on_failed(self, error: StudioError) -> None:
        smaller = self._training.progress.smaller
        if smaller:
            remedy = self.tr("What was learnt is kept; a smaller batch may fit.")
            button = self.tr("Train with a smaller batch ({0})").format(smaller.rpartition(".")[2])
            self._view.show_offer(sentences(error.what, remedy), button)
            error = StudioError(error.what, remedy, code=error.code)
        self._closing = False  # who closed the window must see what became of the training
        messages.show_error(self._view, error)

    def _on_ended(self) -> None:
        self._view.show_log(self._training.log)
        self._session.work_progressed.emit("train", None)
        self._show_ready(self._ready)
        if self._closing:
            # Later, for this slot is still called by what the window would close.
            window = self._view.window()
            QTimer.singleShot(0, window, window.close)

    # -- what is seen ------------------------------------------------------------------------------

    def _follow(self) -> None:
        """Bring the display up to the training under way."""
        training = self._training
        # The strip is seen from every tab, the card from this one alone.
        self._session.status_changed.emit("train", strip_text(training.progress), "")
        self._session.work_progressed.emit("train", training.progress.fraction)
        if not self._model.active:
            return
        self._view.show_log(training.log)
        if self._model.shows_training:
            facts = training.progress.facts
            line = training_text(training.progress, training.stopping)
            title = training.run_id or self.tr("Preparing")
            self._view.show_progress(title, line, training.progress.fraction)
            self._show_facts(facts, training.progress.epochs, native(facts.advice))
            self._preview.follow(training.folder, live=True)

    def _show(self) -> None:
        if self._model.shows_training:
            self._view.show_watch(False)
            self._follow()
        else:
            run = self._model.shown_run
            self._view.show_watch(run is not None and run.has_weights)
            self._show_run(run)

    def _show_run(self, run: Run | None) -> None:
        self._preview.follow(run.folder if run is not None else None, live=False)
        if run is None:
            self._view.show_progress("", "", None)
            self._view.show_curves({}, None)
            self._view.show_alarm("")
            return
        epochs = epochs_of(run)
        facts = run_facts(epochs)
        still = self.tr("This model barely moves. Train longer, try another preset, or add takes.")
        self._view.show_progress(run.id, run_text(facts), None)
        self._show_facts(facts, epochs, still if facts.life == "still" else "")

    def _show_facts(self, facts: RunFacts, epochs: Sequence[EpochEvent], alarm: str) -> None:
        self._view.show_curves(curves(epochs), facts.best)
        self._view.show_alarm(alarm)


class PreviewPresenter(QObject):
    """Keeps a preview up to date with what the training child wrote; `follow` it as often as you like."""

    def __init__(self, pane: PreviewPane) -> None:
        super().__init__(pane)
        self._pane = pane
        self._run: Path | None = None
        self._stamp = 0
        self._live = False
        self._chosen = ""  # a chip that was pressed; "" takes the newest while it trains, else the best
        self._reading = tasks.LatestTask(self)
        pane.chosen.connect(self._on_chosen)

    def follow(self, run: Path | None, live: bool) -> None:
        """Show a run's preview, read again only where it changed.

        Args:
            run: its folder, None for no run.
            live: it is being trained.
        """
        if run != self._run:
            self._chosen = ""
        # By the time its file was written: this is asked twice a second, and reading costs more than looking.
        now = preview.stamp(run) if run is not None else 0
        if (run, now, live) == (self._run, self._stamp, self._live):
            return
        self._run, self._stamp, self._live = run, now, live
        self._read()

    def _on_chosen(self, which: str) -> None:
        self._chosen = which
        self._read()

    def _read(self) -> None:
        self._reading.drop()
        run = self._run
        which = self._chosen or (LATEST if self._live else BEST)
        if run is None or not self._stamp:
            self._pane.show_preview(None, None, "", which, False)
            return

        def work() -> tuple[Preview, Motion, Motion] | None:
            found = preview.read_preview(run)
            if found is None:
                return None
            seen = which if found.epochs[which] else LATEST
            return found, found.motion(CAPTURED), found.motion(seen)

        def show(result: tuple[Preview, Motion, Motion] | None) -> None:
            if result is None:
                self._pane.show_preview(None, None, "", which, False)
                return
            found, captured, predicted = result
            self._pane.show_preview(captured, predicted, self._caption(found, which), which, _differ(found))

        self._reading.run(work, show, lambda _: None)  # a damaged one is passed over

    def _caption(self, found: Preview, which: str) -> str:
        epoch = found.epochs[which] or found.epochs[LATEST]
        text = self.tr("Epoch {0}").format(epoch)
        return self.tr("{0}, kept").format(text) if epoch == found.epochs[BEST] else text


def _differ(found: Preview) -> bool:
    return 0 < found.epochs[BEST] != found.epochs[LATEST]
