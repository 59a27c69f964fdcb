"""Cleaned sound as a choice: made in a child process, heard before and after with one key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject

from studio.dataset import edits
from studio.errors import StudioError
from studio.ipc.events import ChildEvent, ProgressEvent
from studio.sound.peaks import Peaks, peaks
from studio.take.cleaned import cached_clean
from studio.ui import tasks
from studio.ui.curate.bench_view import Bench
from studio.ui.curate.model import CurateModel
from studio.ui.session import Session
from studio.ui.tasks import Job


class CleaningPresenter(QObject):
    """Which sound of the take shown is heard and seen, and how that choice is made."""

    def __init__(self, bench: Bench, model: CurateModel, session: Session) -> None:
        super().__init__(bench)
        self._bench, self._model, self._session = bench, model, session
        self._before = False
        self._wished: tuple[str, tuple[str, ...]] | None = None
        """Way and selections that the child at work is for; no selections where it only makes again."""
        self._tried: set[tuple[Path, str]] = set()
        self._heard: Path | None = None
        self._task: tasks.Task | None = None
        self._job = Job(self)
        self._job.told.connect(self._on_event)
        self._job.done.connect(lambda _: self._on_made())
        self._job.failed.connect(lambda what, remedy: self._model.fail(StudioError(what, remedy)))
        self._job.ended.connect(self._on_ended)
        bench.clean.chosen.connect(self.choose)
        bench.clean.stopped.connect(self._job.cancel)
        bench.clean.compared.connect(self.toggle)
        model.project_changed.connect(self.forget_all)
        model.shown_changed.connect(self.forget)
        model.choices_changed.connect(self.show)

    def choose(self, way: str) -> None:
        """Use a way of cleaning ("" for none) for all selected takes, once their sound is made."""
        rows = [row for row in self._model.chosen_rows or (self._model.row,) if row is not None]
        sounds = {row.id: row.take.audio_path for row in rows if row.take and row.take.audio_path}
        if not sounds:
            self._model.say(self.tr("This take has no sound to clean."))
        elif not self._job.running and self._model.editable:
            self._wished = (way, tuple(sounds))
            if all(_is_there(sound, way) for sound in sounds.values()):
                self._on_made()
            else:
                self._start(way, sounds)

    def forget_all(self) -> None:
        """Another project is shown: what is being made for the one before is not waited for."""
        self._wished = None
        self._tried.clear()
        self._job.cancel()
        self.forget()

    def toggle(self) -> None:
        """Hear the recording in place of the cleaned sound, and back."""
        row = self._model.row
        if row is None or not row.selection.clean:
            self._model.say(
                self.tr("Nothing is cleaned yet."),
                self.tr("Choose a way under Clean sound; then B compares it with the recording."),
            )
            return
        self._before = not self._before
        self.show()

    def forget(self) -> None:
        """Another take comes: it is heard as it was chosen."""
        self._before, self._heard = False, None
        if self._task is not None:
            self._task.forget()
            self._task = None

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
            self._wished = (way, ())
            self._start(way, {row.id: recorded})
        before = self._before and bool(way)
        sound = recorded if before or cleaned is None else cleaned
        if not self._job.running:
            self._bench.clean.show_way(way, before)
        if sound != (self._heard or recorded):
            self._model.playing.hear(sound)
            self._task = tasks.run(partial(peaks, sound), partial(self._on_peaks, sound), owner=self)
        self._heard = sound

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
        wished, self._wished = self._wished, None
        self._before = False
        if wished is None or not wished[1]:
            return
        way, ids = wished
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
        self._task = None
        if sound == self._heard:
            self._model.sound_changed.emit(found, sound)


def _is_there(sound: Path, way: str) -> bool:
    return not way or cached_clean(sound, way) is not None
