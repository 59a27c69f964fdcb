"""Writes what is on screen through a child process, and says so only once it was read back."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices

from studio.export.options import RenderOptions, format_choices
from studio.export.range import cut_sound
from studio.files import leftovers
from studio.ipc.events import ChildEvent, FilesDone, ProgressEvent
from studio.motion import Motion
from studio.motion.motion import only_part
from studio.take.motion_file import write_motion
from studio.ui import messages, tasks, theme
from studio.ui.review.export_options import ExportOptions
from studio.ui.review.export_panel import ExportPanel, ExportRequest
from studio.ui.session import Session
from studio.ui.tasks import Job


@dataclass(frozen=True, eq=False)
class ExportInput:
    """What is on screen.

    Args:
        name: what its files are called.
        motion: as tuned.
        untuned: as captured or predicted.
        sound: its sound.
        start, end: the part that is used, seconds.
        whole: that is all of it.
        selection: the span selected on the timeline, seconds.
        at: where the picture stands, seconds.
        view: where it is seen from: degrees around and above, and how near.
        avatar: the one that is worn.
    """

    name: str
    motion: Motion
    untuned: Motion
    sound: Path | None
    start: float
    end: float
    whole: bool
    selection: tuple[float, float] | None = None
    at: float = 0.0
    view: tuple[float, float, float] = (0.0, 4.0, 1.0)
    avatar: Path | None = None

    def only_selection(self) -> ExportInput:
        """The same, of what is selected on the timeline."""
        if self.selection is None:
            return self
        return replace(self, start=self.selection[0], end=self.selection[1], whole=False)


class ExportPresenter(QObject):
    """The Export panel's thought.

    Args:
        panel: its layout.
        exhibit: gives what is on screen, None where there is nothing.
        session: the open project, and the frame rate of the last time.
    """

    def __init__(
        self, panel: ExportPanel, exhibit: Callable[[], ExportInput | None], session: Session
    ) -> None:
        super().__init__(panel)
        self._panel, self._exhibit, self._session = panel, exhibit, session
        self._job: Job | None = None
        self._scratch: Path | None = None
        self._turn = 0  # what was prepared for another wish is dropped
        self._preparing = False
        self._target = Path()
        self._files: list[Path] = []
        panel.show_formats(format_choices())
        panel.show_fps(session.settings.export_fps)
        panel.export_requested.connect(self._on_export)
        panel.cancel_requested.connect(self._on_cancel)
        panel.folder_requested.connect(self._on_folder)

    @property
    def busy(self) -> bool:
        """Whether an export is under way."""
        return self._scratch is not None

    def close(self) -> None:
        """The window closes."""
        if self._job is not None:
            self._job.close()
        self._clean()

    def _on_export(self, wish: ExportRequest) -> None:
        exhibit, project = self._exhibit(), self._session.project
        if exhibit is None or project is None or self.busy:
            return
        self._panel.show_result("", False)  # what the last one came to is no answer to this one
        if not self._may_write(wish):
            return
        if wish.fps != self._session.settings.export_fps:
            self._session.change_settings(export_fps=wish.fps)
        replaces = bool(wish.files_there)
        options = wish.options
        if options.selection:
            exhibit = exhibit.only_selection()
        self._target = wish.folder
        self._turn += 1
        turn, scratch = self._turn, Path(tempfile.mkdtemp(prefix=leftovers.scratch_prefix("review")))
        self._scratch, self._preparing = scratch, True
        self._panel.show_busy(-1.0)

        def prepared(sound: Path | None) -> None:
            if turn != self._turn:  # cancelled meanwhile; another may be under way by now
                shutil.rmtree(scratch, ignore_errors=True)
                return
            self._preparing = False
            words = ["export", str(project.folder), str(scratch / "motion.arrow"), f"--name={wish.name}"]
            words += ["-o", str(wish.folder), "--format", ",".join(one.name for one in wish.formats)]
            words += ["--audio", str(sound)] if sound else []
            words += ["--fps", f"{wish.fps:g}"] if wish.fps else []
            words += ["--force"] if replaces else []
            self._start(words + _look(exhibit, options))

        def failed(error: BaseException) -> None:
            if turn == self._turn:
                self._preparing = False
                self._on_error(error)
            else:
                shutil.rmtree(scratch, ignore_errors=True)

        tasks.run(lambda: _prepare(exhibit, scratch, options), prepared, failed, owner=self)

    def _may_write(self, wish: ExportRequest) -> bool:
        """Whether nothing is in the way, or a person wants it replaced."""
        there = wish.files_there
        if not there:
            return True
        return messages.ask(
            self._panel,
            self.tr("{0} is there already. Replace it?").format(there[0].name),
            self._what_is_replaced(there),
            self.tr("Replace"),
        )

    def _what_is_replaced(self, there: tuple[Path, ...]) -> str:
        """Which files go, and that nothing else does."""
        if len(there) == 1:
            return self.tr("Only this file is written over: {0}").format(there[0])
        files = "\n".join(str(file) for file in there)
        return self.tr("Only these files are written over:\n{0}").format(files)

    def _start(self, words: list[str]) -> None:
        job = self._job = Job(self)
        job.told.connect(self._on_event)
        job.done.connect(self._on_done)
        job.failed.connect(self._on_failed)
        job.cancelled.connect(self._on_cancelled)
        job.ended.connect(self._on_ended)
        job.start(words)

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, ProgressEvent):
            self._panel.show_busy(event.fraction)

    def _on_done(self, done: FilesDone) -> None:
        self._files = [Path(file) for file in done.files]
        self._panel.show_busy(None)
        names = ", ".join(_told_apart(self._files))
        told = [self.tr("Exported and read back: {0}.").format(names)] if names else []
        told += [f"{one.name}: {one.what} {one.remedy}" for one in done.failed]
        self._panel.show_result("\n".join(told), not done.failed)

    def _on_failed(self, what: str, remedy: str) -> None:
        self._panel.show_busy(None)
        # The same sentence is said at a terminal, where the folder stands behind -o.
        self._panel.show_result(f"{what} {remedy.replace(' with -o', '')}", False)

    def _on_error(self, error: BaseException) -> None:
        self._panel.show_busy(None)
        messages.show_error(self._panel, error)
        self._clean()

    def _on_ended(self) -> None:
        job, self._job = self._job, None
        if job is not None:
            job.deleteLater()
        self._panel.show_busy(None)
        self._clean()

    def _on_cancel(self) -> None:
        """End it, whether it is being prepared or written; of a half-written file nothing stays."""
        if self._job is not None:
            self._job.cancel()
        elif self._preparing:
            self._turn += 1
            self._scratch = None  # taken away once the pool is done with it
            self._on_cancelled()

    def _on_cancelled(self) -> None:
        leftovers.sweep_killed(self._target)  # the child may have been too busy to do so itself
        self._panel.show_busy(None)
        self._panel.show_result(self.tr("Cancelled."), False)

    def _on_folder(self) -> None:
        if self._files:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._files[0].parent)))

    def _clean(self) -> None:
        if self._scratch is not None:
            shutil.rmtree(self._scratch, ignore_errors=True)
            self._scratch = None


def _prepare(exhibit: ExportInput, scratch: Path, options: ExportOptions) -> Path | None:
    """Write the wanted part of motion and sound for the child. Runs on a pool thread."""
    motion = only_part(exhibit.motion if options.tuned else exhibit.untuned, options.part)
    if not exhibit.whole:
        motion = motion.cut(exhibit.start, exhibit.end)
    write_motion(scratch / "motion.arrow", motion)
    if exhibit.sound is None or exhibit.whole:
        return exhibit.sound
    return cut_sound(exhibit.sound, scratch / "sound.wav", exhibit.start, exhibit.end)


def _look(exhibit: ExportInput, options: ExportOptions) -> list[str]:
    """How films and stills are drawn: as they are seen on the stage."""
    at = max(exhibit.at - (0.0 if exhibit.whole else exhibit.start), 0.0)
    light = theme.colours().name == "light"
    width, height = options.size
    return RenderOptions(
        width, height, exhibit.view, at=at, clear=options.clear, light=light, avatar=exhibit.avatar
    ).args()


def _told_apart(files: list[Path]) -> list[str]:
    """The files' names, with their folders where two are called the same."""
    if len({file.name for file in files}) == len(files):
        return [file.name for file in files]
    return [f"{file.parent.name}/{file.name}" for file in files]
