"""What of a take is used: its ends, spans left out, and parts where somebody speaks."""

from __future__ import annotations

from PySide6.QtCore import QObject

from studio.dataset import edits, pauses
from studio.dataset.pauses import Cut
from studio.errors import StudioError
from studio.ipc.events import ChildEvent, ProgressEvent
from studio.sound.voice_activity import HOP, kept_voice
from studio.ui.curate.bench_view import Bench
from studio.ui.curate.model import CurateModel
from studio.ui.curate.view import CurateView
from studio.ui.session import Session
from studio.ui.tasks import Job
from studio.ui.widgets.timeline.content import Span
from studio.ui.widgets.timeline.time_view import minutes


class TrimPresenter(QObject):
    """Trims and excludes on the selection shown; each is one named step of undo."""

    def __init__(self, view: CurateView, model: CurateModel, session: Session) -> None:
        super().__init__(view)
        self._timeline, self._model = view.bench.timeline, model
        view.mark_requested.connect(self._on_mark)
        view.delete_requested.connect(self._on_delete)
        view.bench.trim_requested.connect(self._on_trim_to_span)
        view.bench.untrim_requested.connect(self._on_use_all)
        view.bench.exclude_requested.connect(lambda: model.exclude(self._timeline.span))
        view.bench.timeline.in_out_changed.connect(self.trim)

    def trim(self, span: Span) -> None:
        """Use only this stretch, in seconds of the take."""
        row = self._model.row
        if row is None or row.take is None:
            return
        start, end = span
        out = None if end >= row.take.info.duration - 1e-6 else end
        name = self.tr("Trim {0}").format(row.id)
        self._model.edit(name, lambda data: edits.trim(data, row.id, start, out))

    def _on_mark(self, which: str) -> None:
        start, end = self._timeline.in_out
        t = self._timeline.playhead
        if not self._model.editable:
            return
        if which == "in" and t < end - edits.SHORTEST:
            self.trim((t, end))
        elif which == "out" and t > start + edits.SHORTEST:
            self.trim((start, t))
        else:
            self._model.say(self.tr("The in point must come before the out point."))

    def _on_trim_to_span(self) -> None:
        if self._timeline.span is not None:
            self.trim(self._timeline.span)
            self._timeline.set_span(None)
            self._model.change_span()

    def _on_use_all(self) -> None:
        row = self._model.row
        if row is None or row.take is None:
            return
        end = row.take.info.duration
        name = self.tr("Use all of {0}").format(row.id)
        self._model.edit(
            name, lambda data: edits.include(edits.trim(data, row.id, 0.0, None), row.id, 0.0, end)
        )

    def _on_delete(self) -> None:
        label = self._timeline.chosen_label
        if label is not None and self._model.row is not None:
            self._model.remove_label(label)
        elif self._timeline.span is not None and self._model.editable:
            self._model.exclude(self._timeline.span)


class CutPresenter(QObject):
    """The question whether and how to cut the selection shown, and its answer."""

    def __init__(self, bench: Bench, model: CurateModel, session: Session) -> None:
        super().__init__(bench)
        self._bench, self._model, self._session = bench, model, session
        self._speech: tuple[Span, ...] = ()
        self._parts: tuple[Span, ...] = ()
        self._job = Job(self)
        self._job.told.connect(self._on_event)
        self._job.done.connect(lambda _: self._on_heard())
        self._job.failed.connect(self._on_failed)
        bench.pauses_requested.connect(self.start)
        bench.question.changed.connect(self._preview)
        bench.question.accepted.connect(self._cut)
        bench.question.dropped.connect(self.drop)
        model.project_changed.connect(self.drop)
        model.leaving.connect(self.drop)

    def start(self) -> None:
        """Listen for speech, in a child process unless that was done before, and show the parts."""
        row, project = self._model.row, self._session.project
        if row is None or row.take is None or row.take.audio_path is None or project is None:
            return
        if self._job.running:
            return
        if kept_voice(row.take.audio_path) is not None:
            self._on_heard()
            return
        self._bench.show_question(self.tr("Listening for pauses…"))
        self._job.start(["cut", str(project.folder), row.id, "--look"])

    def drop(self) -> None:
        """Leave the take whole."""
        self._job.cancel()
        self._speech = self._parts = ()
        self._bench.timeline.set_parts(())
        self._bench.show_question("")

    def close(self) -> None:
        """The window closes."""
        self._job.close()

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, ProgressEvent) and self._bench.question.isVisible():
            share = f"{event.fraction:.0%}"
            self._bench.show_question(self.tr("Listening for pauses… {0}").format(share))

    def _on_heard(self) -> None:
        row = self._model.row
        if row is None or row.take is None or row.take.audio_path is None:
            return
        chances = kept_voice(row.take.audio_path)
        if chances is None:
            self._on_failed(
                self.tr("What was heard could not be kept."), self.tr("Free some space on the disk.")
            )
            return
        self._speech = pauses.spoken(chances, HOP)
        if not self._speech:
            self.drop()
            self._model.say(self.tr("Nobody speaks in this take, so there is nothing to cut."))
            return
        self._preview(self._bench.question.cut)

    def _preview(self, cut: Cut) -> None:
        """Show what would stay, and how much that is."""
        row = self._model.row
        if row is None or not self._speech:
            return
        start, end = row.span
        self._parts = pauses.parts(self._speech, cut, start, end)
        self._bench.timeline.set_parts(self._parts)
        count, length = len(self._parts), sum(b - a for a, b in self._parts)
        if count < 2:
            self._bench.timeline.set_parts(())
            self._bench.show_question(self.tr("No pause is long enough to cut in."), "", adjust=True)
            return
        sentence = self.tr("{0} parts, {1} of {2} stay in use").format(
            count, minutes(length), minutes(end - start)
        )
        self._bench.show_question(sentence, self.tr("Cut into {0}").format(count), adjust=True)

    def _on_failed(self, what: str, remedy: str) -> None:
        self.drop()
        self._model.fail(StudioError(what, remedy))

    def _cut(self) -> None:
        row, parts = self._model.row, self._parts
        if row is None or row.take is None or len(parts) < 2:
            return
        end = row.take.info.duration
        self.drop()
        name = self.tr("Split {0} at its pauses").format(row.id)
        self._model.edit(name, lambda data: pauses.split_into(data, row.id, parts, end))
