"""The motion a run makes of a sound: read where it was made before, else made by a child process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from studio.errors import StudioError
from studio.motion import Motion
from studio.project import Project, Run
from studio.take.motion_file import read_motion
from studio.ui import background
from studio.ui.jobs import Job
from studio.ui.review.clip import generated_path


class Predicting(QObject):
    """One wish at a time; a new one ends that before.

    Signals:
        predicted: the motion, a Motion.
        progressed: (words, fraction) while it is made; ("", None) when that is over, below 0 where unknown.
        failed: a StudioError or another exception; no motion comes.
    """

    predicted = Signal(object)
    progressed = Signal(str, object)
    failed = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._job: Job | None = None
        self._wish = 0  # the newest wins

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
        if job is not None:
            job.cancel()
            self.progressed.emit("", None)

    def close(self) -> None:
        """The window closes."""
        self._wish += 1
        if self._job is not None:
            self._job.close()

    def _read(self, path: Path) -> None:
        wish = self._wish

        def done(motion: Motion) -> None:
            if wish == self._wish:
                self.predicted.emit(motion)

        def failed(error: BaseException) -> None:
            path.unlink(missing_ok=True)  # only kept to save time; the next wish makes it again
            if wish == self._wish:
                self.failed.emit(error)

        background.run(lambda: read_motion(path), done, failed, owner=self)

    def _generate(self, words: list[str], run_id: str, path: Path) -> None:
        job = self._job = Job(self)
        job.event_received.connect(lambda event: self._on_event(job, event))
        job.done.connect(lambda _: self._on_generated(job, path))
        job.failed.connect(lambda what, remedy: self._on_failed(job, what, remedy))
        job.ended.connect(lambda: self._on_ended(job))
        job.start(["generate", *words, "--force", "-o", str(path)])
        self.progressed.emit(self.tr("{0} listens").format(run_id), -1.0)

    def _on_event(self, job: Job, event: dict[str, Any]) -> None:
        if job is not self._job or event.get("event") != "progress":
            return  # a child that was cancelled may still speak
        fraction, eta = float(event.get("fraction") or 0.0), event.get("eta_s")
        words = self.tr("{0} %").format(round(100 * fraction))
        if isinstance(eta, int | float) and eta >= 1:
            words += "  " + self.tr("{0} s left").format(round(eta))
        self.progressed.emit(words, fraction)

    def _on_generated(self, job: Job, path: Path) -> None:
        if job is self._job and path.is_file():
            self._read(path)

    def _on_failed(self, job: Job, what: str, remedy: str) -> None:
        if job is self._job:
            self.failed.emit(StudioError(what, remedy))

    def _on_ended(self, job: Job) -> None:
        job.deleteLater()
        if job is self._job:
            self._job = None
            self.progressed.emit("", None)
