"""The motion a run makes of a sound: read where it was made before, else made by a child process.

A child writes it piece by piece; what is there is handed on at once, while the rest is made.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from studio.errors import StudioError
from studio.files import leftovers
from studio.ipc.events import ChildEvent, PieceEvent, ProgressEvent
from studio.motion import Motion
from studio.motion.motion import concatenate
from studio.project import Project, Run
from studio.project.run import generated_path
from studio.take.motion_file import read_motion
from studio.ui import tasks
from studio.ui.tasks import Job


class GenerateTask(QObject):
    """One wish at a time; a new one ends that before.

    Signals:
        grown: the beginning of the motion, as far as it is made, a Motion.
        predicted: the whole motion, a Motion.
        progressed: (words, fraction) while it is made; ("", None) when that is over, below 0 where unknown.
        failed: a StudioError or another exception; no motion comes.
    """

    grown = Signal(object)
    predicted = Signal(object)
    progressed = Signal(str, object)
    failed = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._job: Job | None = None
        self._path = Path()  # where a child writes the whole motion
        self._wish = 0  # the newest wins
        self._pieces = _Pieces()
        self._ending: dict[Job, _Pieces] = {}  # children nobody waits for, and what they may still write

    @property
    def busy(self) -> bool:
        """Whether a child process is making motion."""
        return self._job is not None

    def request(self, project: Project, run: Run, sound: Path, words: Sequence[str] = ()) -> None:
        """Ask for what a run makes of a sound; the words are further ones for `saia generate`."""
        self.cancel()
        try:
            path = generated_path(run, sound, words)
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            remedy = self.tr("Choose another sound, or add it again.")
            self.failed.emit(StudioError(self.tr("{0} cannot be read.").format(error.filename), remedy))
            return
        if path.is_file():
            self._read(path)
        else:
            self._generate([str(project.folder), run.id, str(sound), *words], run.id, path)

    def cancel(self) -> None:
        """Ask for nothing any more; a child process is ended."""
        self._wish += 1
        job, self._job = self._job, None
        pieces, self._pieces = self._pieces, _Pieces()
        if job is not None and job.running:
            self._ending[job] = pieces  # until it has ended the child may write one more
        else:
            pieces.drop()
        if job is not None:
            job.cancel()
            self.progressed.emit("", None)

    def close(self) -> None:
        """The window closes: no child stays behind, and nothing of what one wrote."""
        self._wish += 1
        if self._job is not None:
            self._job.close()
        self._pieces.drop()
        ending, self._ending = self._ending, {}
        for job, pieces in ending.items():
            job.close()
            pieces.drop()

    def _read(self, path: Path) -> None:
        wish = self._wish

        def done(motion: Motion) -> None:
            if wish == self._wish:
                self.predicted.emit(motion)

        def failed(error: BaseException) -> None:
            if wish == self._wish:
                self.failed.emit(error)

        tasks.run(lambda: _read_kept(path), done, failed, owner=self)

    def _generate(self, words: list[str], run_id: str, path: Path) -> None:
        job = self._job = Job(self)
        pieces = self._pieces = _Pieces.begin()
        job.told.connect(lambda event: self._on_event(job, event))
        job.done.connect(lambda _: self._on_generated(job, path))
        job.failed.connect(lambda what, remedy: self._on_failed(job, what, remedy))
        job.ended.connect(lambda: self._on_ended(job))
        more = ["--pieces", str(pieces.folder)] if pieces.folder is not None else []
        job.start(["generate", *words, "--force", "-o", str(path), *more])
        self.progressed.emit(self.tr("{0} listens").format(run_id), -1.0)

    def _grow(self) -> None:
        """Read the pieces that came meanwhile, and hand on what there is; one reading at a time."""
        wish, pieces = self._wish, self._pieces
        waiting = pieces.waiting
        if pieces.reading or not waiting:
            return
        pieces.reading = True
        before = pieces.motion

        def work() -> Motion:
            parts = [read_motion(file) for file in waiting]
            return concatenate([before, *parts] if before is not None else parts)

        def done(motion: Motion) -> None:
            if wish != self._wish:
                return
            pieces.reading = False
            pieces.motion, pieces.read = motion, pieces.read + len(waiting)
            if pieces.complete:
                self._complete()
            else:
                self.grown.emit(motion)
                self._grow()

        def failed(_error: BaseException) -> None:
            pieces.reading = False  # the whole file is read at the end
            if wish == self._wish and pieces.over:
                self._read_whole()

        tasks.run(work, done, failed, owner=self)

    def _complete(self) -> None:
        """The last piece is there: all of it together is the whole."""
        motion = self._pieces.motion
        self._pieces.drop()
        if motion is not None:
            self.predicted.emit(motion)

    def _read_whole(self) -> None:
        """The child has ended, and its pieces are not all of it: read what it wrote at last."""
        self._pieces.drop()
        self._read(self._path)

    def _on_event(self, job: Job, event: ChildEvent) -> None:
        if job is not self._job:
            return  # a child that was cancelled may still speak
        if isinstance(event, PieceEvent):
            self._pieces.files.append(Path(event.file))
            self._grow()
        elif isinstance(event, ProgressEvent):
            words = self.tr("{0} %").format(round(100 * event.fraction))
            if event.eta_s is not None and event.eta_s >= 1:
                words += "  " + self.tr("{0} s left").format(round(event.eta_s))
            self.progressed.emit(words, event.fraction)

    def _on_generated(self, job: Job, path: Path) -> None:
        pieces = self._pieces
        if job is not self._job or not path.is_file():
            return
        self._path, pieces.over = path, True
        if pieces.complete:
            self._complete()
        elif not pieces.reading:
            self._read_whole()

    def _on_failed(self, job: Job, what: str, remedy: str) -> None:
        if job is self._job:
            self._wish += 1  # a piece on its way is of no use
            self._pieces.drop()
            self.failed.emit(StudioError(what, remedy))

    def _on_ended(self, job: Job) -> None:
        job.deleteLater()
        left = self._ending.pop(job, None)
        if left is not None:
            left.drop()
        if job is self._job:
            self._job = None
            self.progressed.emit("", None)


def _read_kept(path: Path) -> Motion:
    """The motion kept in a file; one that cannot be read is removed. Runs on a pool thread."""
    try:
        return read_motion(path)
    except BaseException:
        with suppress(OSError):
            path.unlink(missing_ok=True)  # only kept to save time; the next wish makes it again
        raise


class _Pieces:
    """What a child has written so far.

    Attributes:
        folder: where it writes to, None where there is no room for it.
        files: the pieces there are, in their order.
        read: how many of them are part of the motion.
        motion: the beginning, None before the first piece.
        reading: a pool thread is at it.
        over: the child has ended, no more pieces come.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self.files: list[Path] = []
        self.read = 0
        self.motion: Motion | None = None
        self.reading = self.over = False

    @classmethod
    def begin(cls) -> _Pieces:
        """A new folder; without one the motion is seen when all of it is there."""
        try:
            return cls(Path(tempfile.mkdtemp(prefix=leftovers.scratch_prefix("pieces"))))
        except OSError:
            return cls()

    @property
    def waiting(self) -> list[Path]:
        """What was not read yet."""
        return self.files[self.read :]

    @property
    def complete(self) -> bool:
        """Whether the motion is all of it."""
        return self.over and self.motion is not None and not self.waiting

    def drop(self) -> None:
        """Forget all of it. An hour of pieces is removed on the pool, where nobody waits for the disk."""
        folder = self.folder
        if folder is not None:
            tasks.run(lambda: shutil.rmtree(folder, ignore_errors=True), lambda _: None)
        self.folder, self.files, self.read, self.motion = None, [], 0, None
        self.reading = self.over = False
