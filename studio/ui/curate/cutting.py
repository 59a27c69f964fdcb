"""One take cut into many where nobody speaks: shown and adjusted first, done when it is wanted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject

from studio.dataset import silence
from studio.dataset.silence import Cut
from studio.errors import StudioError
from studio.take.voice_activity import HOP, kept_voice
from studio.ui.curate.bench import Bench
from studio.ui.jobs import Job
from studio.ui.widgets.time_view import minutes
from studio.ui.widgets.timeline_content import Span

if TYPE_CHECKING:
    from studio.ui.curate.presenter import CuratePresenter
    from studio.ui.session import Session


class Cutting(QObject):
    """The question whether and how to cut the selection shown, and its answer."""

    def __init__(self, bench: Bench, session: Session, room: CuratePresenter) -> None:
        super().__init__(room)
        self._bench, self._session, self._room = bench, session, room
        self._speech: tuple[Span, ...] = ()
        self._parts: tuple[Span, ...] = ()
        self._job = Job(self)
        self._job.event_received.connect(self._on_event)
        self._job.done.connect(lambda _: self._on_heard())
        self._job.failed.connect(self._on_failed)
        bench.pauses_requested.connect(self.start)
        bench.question.changed.connect(self._preview)
        bench.question.accepted.connect(self._cut)
        bench.question.dropped.connect(self.drop)

    def start(self) -> None:
        """Listen for speech, in a child process unless that was done before, and show the parts."""
        row, project = self._room.row, self._session.project
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

    def _on_event(self, event: dict[str, Any]) -> None:
        if event["event"] == "progress" and self._bench.question.isVisible():
            share = f"{float(event.get('fraction', 0)):.0%}"
            self._bench.show_question(self.tr("Listening for pauses… {0}").format(share))

    def _on_heard(self) -> None:
        row = self._room.row
        if row is None or row.take is None or row.take.audio_path is None:
            return
        chances = kept_voice(row.take.audio_path)
        if chances is None:
            self._on_failed(
                self.tr("What was heard could not be kept."), self.tr("Free some space on the disk.")
            )
            return
        self._speech = silence.spoken(chances, HOP)
        if not self._speech:
            self.drop()
            self._room.say(self.tr("Nobody speaks in this take, so there is nothing to cut."))
            return
        self._preview(self._bench.question.cut)

    def _preview(self, cut: Cut) -> None:
        """Show what would stay, and how much that is."""
        row = self._room.row
        if row is None or not self._speech:
            return
        start, end = row.span
        self._parts = silence.parts(self._speech, cut, start, end)
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
        self._room.fail(StudioError(what, remedy))

    def _cut(self) -> None:
        row, parts = self._room.row, self._parts
        if row is None or row.take is None or len(parts) < 2:
            return
        end = row.take.info.duration
        self.drop()
        name = self.tr("Split {0} at its pauses").format(row.id)
        self._room.edit(name, lambda data: silence.split_into(data, row.id, parts, end))
