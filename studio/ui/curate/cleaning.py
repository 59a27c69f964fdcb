"""Cleaned sound as a choice: made in a child process, heard before and after with one key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject

from studio.dataset import edits
from studio.errors import StudioError
from studio.take.cleaned import kept_clean
from studio.take.peaks import Peaks, peaks
from studio.ui import background
from studio.ui.curate.bench import Bench
from studio.ui.jobs import Job

if TYPE_CHECKING:
    from studio.ui.curate.presenter import CuratePresenter
    from studio.ui.session import Session


class Cleaning(QObject):
    """Which sound of the take shown is heard and seen, and how that choice is made."""

    def __init__(self, bench: Bench, session: Session, room: CuratePresenter) -> None:
        super().__init__(room)
        self._bench, self._session, self._room = bench, session, room
        self._before = False
        self._wished: tuple[str, tuple[str, ...]] | None = None
        """Way and selections that the child at work is for; no selections where it only makes again."""
        self._tried: set[tuple[Path, str]] = set()
        self._heard: Path | None = None
        self._task: background.Task | None = None
        self._job = Job(self)
        self._job.event_received.connect(self._on_event)
        self._job.done.connect(lambda _: self._on_made())
        self._job.failed.connect(lambda what, remedy: self._room.fail(StudioError(what, remedy)))
        self._job.ended.connect(self._on_ended)
        bench.clean.chosen.connect(self.choose)
        bench.clean.stopped.connect(self._job.cancel)
        bench.clean.compared.connect(self.toggle)

    def choose(self, way: str) -> None:
        """Use a way of cleaning ("" for none) for all selected takes, once their sound is made."""
        rows = [row for row in self._room.chosen_rows or (self._room.row,) if row is not None]
        sounds = {row.id: row.take.audio_path for row in rows if row.take and row.take.audio_path}
        if not sounds:
            self._room.say(self.tr("This take has no sound to clean."))
        elif not self._job.running and self._room.editable:
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
        row = self._room.row
        if row is None or not row.selection.clean:
            self._room.say(
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
        row, loaded = self._room.row, self._room.playing.take
        if row is None or loaded is None or loaded.take != row.take or loaded.take.audio_path is None:
            return
        recorded, way = loaded.take.audio_path, row.selection.clean
        cleaned = kept_clean(recorded, way)
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
            self._room.playing.hear(sound)
            self._task = background.run(partial(peaks, sound), partial(self._on_peaks, sound), owner=self)
        self._heard = sound

    def close(self) -> None:
        """The window closes."""
        self._job.close()

    def _start(self, way: str, sounds: Mapping[str, Path]) -> None:
        assert self._session.project is not None
        self._bench.clean.show_progress(0.0)
        folder = str(self._session.project.folder)
        self._job.start(["clean", folder, *sounds, "--way", way, "--prepare"])

    def _on_event(self, event: dict[str, Any]) -> None:
        if event["event"] == "progress":
            self._bench.clean.show_progress(float(event.get("fraction", 0.0)))

    def _on_made(self) -> None:
        wished, self._wished = self._wished, None
        self._before = False
        if wished is None or not wished[1]:
            return
        way, ids = wished
        there = [one for one in ids if one in self._room.dataset]
        who = there[0] if len(there) == 1 else self.tr("{0} takes").format(len(there))
        name = self.tr("Clean the sound of {0}") if way else self.tr("Use {0} as recorded")
        self._room.edit(
            name.format(who), lambda data: edits.update(data, there, lambda s: replace(s, clean=way))
        )

    def _on_ended(self) -> None:
        row = self._room.row
        self._bench.clean.show_way(row.selection.clean if row else "", False)
        self.show()

    def _on_peaks(self, sound: Path, found: Peaks) -> None:
        self._task = None
        if sound == self._heard:
            self._room.picture.show(found, sound)


def _is_there(sound: Path, way: str) -> bool:
    return not way or kept_clean(sound, way) is not None
