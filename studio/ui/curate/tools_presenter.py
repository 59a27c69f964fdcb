"""Presenters of the tools of the bench: trims and spans left out, cuts at pauses, and cleaned sound."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject

from studio.dataset import edits, pauses
from studio.dataset.pauses import Cut
from studio.errors import StudioError
from studio.ipc.events import ChildEvent, ProgressEvent
from studio.sound.peaks import Peaks, peaks
from studio.sound.voice_activity import HOP, kept_voice
from studio.take.cleaned import cached_clean
from studio.ui import tasks
from studio.ui.curate.bench_view import Bench
from studio.ui.curate.model import CurateModel
from studio.ui.curate.view import CurateView
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
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
            self._model.show_message(self.tr("The in point must come before the out point."))

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
        self._job = ChildTask(self)
        self._job.told.connect(self._on_event)
        self._job.done.connect(lambda _: self._on_speech())
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
            self._on_speech()
            return
        self._bench.show_question(self.tr("Listening for pauses…"))
        self._job.start(["cut", str(project.folder), row.id, "--look"])

    def drop(self) -> None:
        """Leave the take whole."""
        self._job.drop()
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

    def _on_speech(self) -> None:
        row = self._model.row
        if row is None or row.take is None or row.take.audio_path is None:
            return
        chances = kept_voice(row.take.audio_path)
        if chances is None:
            what = self.tr("The result could not be saved.")
            self._on_failed(StudioError(what, self.tr("Free some space on the disk.")))
            return
        self._speech = pauses.spoken(chances, HOP)
        if not self._speech:
            self.drop()
            self._model.show_message(self.tr("There is no speech in this take, so there is nothing to cut."))
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
            self._bench.show_question(self.tr("No pause is long enough to cut at."), "", adjust=True)
            return
        sentence = self.tr("{0} parts, {1} of {2} stay in use").format(
            count, minutes(length), minutes(end - start)
        )
        self._bench.show_question(sentence, self.tr("Cut into {0}").format(count), adjust=True)

    def _on_failed(self, error: BaseException) -> None:
        self.drop()
        self._model.fail(error)

    def _cut(self) -> None:
        row, parts = self._model.row, self._parts
        if row is None or row.take is None or len(parts) < 2:
            return
        end = row.take.info.duration
        self.drop()
        name = self.tr("Split {0} at its pauses").format(row.id)
        self._model.edit(name, lambda data: pauses.split_into(data, row.id, parts, end))


class CleaningPresenter(QObject):
    """Which sound of the take shown is heard and seen, and how that choice is made."""

    def __init__(self, bench: Bench, model: CurateModel, session: Session) -> None:
        super().__init__(bench)
        self._bench, self._model, self._session = bench, model, session
        self._before = False
        self._request: tuple[str, tuple[str, ...]] | None = None
        """Way and selections that the child at work is for; no selections where it only makes again."""
        self._tried: set[tuple[Path, str]] = set()
        self._sound: Path | None = None
        self._measuring = tasks.LatestTask(self)
        self._job = ChildTask(self)
        self._job.told.connect(self._on_event)
        self._job.done.connect(lambda _: self._on_made())
        self._job.failed.connect(model.fail)
        self._job.ended.connect(self._on_ended)
        bench.clean.chosen.connect(self.choose)
        bench.clean.stopped.connect(self._job.cancel)
        bench.clean.compared.connect(self.toggle)
        model.project_changed.connect(self.clear)
        model.shown_changed.connect(self.reset)
        model.choices_changed.connect(self.show)

    def choose(self, way: str) -> None:
        """Use a way of cleaning ("" for none) for all selected takes, once their sound is made."""
        rows = [row for row in self._model.chosen_rows or (self._model.row,) if row is not None]
        sounds = {row.id: row.take.audio_path for row in rows if row.take and row.take.audio_path}
        if not sounds:
            self._model.show_message(self.tr("This take has no sound to clean."))
        elif not self._job.running and self._model.editable:
            self._request = (way, tuple(sounds))
            if all(_is_there(sound, way) for sound in sounds.values()):
                self._on_made()
            else:
                self._start(way, sounds)

    def clear(self) -> None:
        """Another project is shown: what is being made for the one before is not waited for."""
        self._request = None
        self._tried.clear()
        self._job.drop()
        self.reset()

    def toggle(self) -> None:
        """Hear the recording in place of the cleaned sound, and back."""
        row = self._model.row
        if row is None or not row.selection.clean:
            self._model.show_message(
                self.tr("No sound is cleaned yet."),
                self.tr("Choose an option under Clean sound; then press B to compare it with the recording."),
            )
            return
        self._before = not self._before
        self.show()

    def reset(self) -> None:
        """Another take comes: it is heard as it was chosen."""
        self._before, self._sound = False, None
        self._measuring.drop()

    def show(self) -> None:
        """Hear and see what is chosen for the take shown."""
        row, loaded = self._model.row, self._model.playing.take
        if row is None or loaded is None or loaded.take != row.take or loaded.take.audio_path is None:
            return
        recorded, way = loaded.take.audio_path, row.selection.clean
        cleaned = cached_clean(recorded, way)
        if way and cleaned is None and not self._job.running and (recorded, way) not in self._tried:
            # Its cache was deleted, or the project comes from elsewhere: made again, once.
            self._tried.add((recorded, way))
            self._request = (way, ())
            self._start(way, {row.id: recorded})
        before = self._before and bool(way)
        sound = recorded if before or cleaned is None else cleaned
        if not self._job.running:
            self._bench.clean.show_way(way, before)
        if sound != (self._sound or recorded):
            self._model.playing.hear(sound)
            self._measuring.run(partial(peaks, sound), partial(self._on_peaks, sound))
        self._sound = sound

    def close(self) -> None:
        """The window closes."""
        self._job.close()

    def _start(self, way: str, sounds: Mapping[str, Path]) -> None:
        assert self._session.project is not None
        self._bench.clean.show_progress(0.0)
        folder = str(self._session.project.folder)
        self._job.start(["clean", folder, *sounds, "--way", way, "--prepare"])

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, ProgressEvent):
            self._bench.clean.show_progress(event.fraction)

    def _on_made(self) -> None:
        request, self._request = self._request, None
        self._before = False
        if request is None or not request[1]:
            return
        way, ids = request
        there = [one for one in ids if one in self._model.dataset]
        who = there[0] if len(there) == 1 else self.tr("{0} takes").format(len(there))
        name = self.tr("Clean the sound of {0}") if way else self.tr("Use {0} as recorded")
        self._model.edit(
            name.format(who), lambda data: edits.update(data, there, lambda s: replace(s, clean=way))
        )

    def _on_ended(self) -> None:
        row = self._model.row
        self._bench.clean.show_way(row.selection.clean if row else "", False)
        self.show()

    def _on_peaks(self, sound: Path, found: Peaks) -> None:
        if sound == self._sound:
            self._model.sound_changed.emit(found, sound)


def _is_there(sound: Path, way: str) -> bool:
    return not way or cached_clean(sound, way) is not None
