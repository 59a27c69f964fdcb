"""Writes what is on screen through a child process, and says so only once it was read back."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices

from studio import formats
from studio.motion import Motion
from studio.project import avatars
from studio.take.motion_file import write_motion
from studio.take.sound import read_span, write_sound
from studio.ui import background, messages
from studio.ui.jobs import Job
from studio.ui.review.export_panel import ExportPanel, ExportWish, FormatChoice
from studio.ui.session import Session


@dataclass(frozen=True, eq=False)
class Exhibit:
    """What is on screen: its motion as tuned, its sound, and the part that is used (seconds)."""

    name: str
    motion: Motion
    sound: Path | None
    start: float
    end: float
    whole: bool


class Exporting(QObject):
    """The Export panel's thought.

    Args:
        panel: its layout.
        exhibit: gives what is on screen, None where there is nothing.
        session: the open project, and the frame rate of the last time.
    """

    def __init__(self, panel: ExportPanel, exhibit: Callable[[], Exhibit | None], session: Session) -> None:
        super().__init__(panel)
        self._panel, self._exhibit, self._session = panel, exhibit, session
        self._job: Job | None = None
        self._scratch: Path | None = None
        self._files: list[Path] = []
        panel.show_formats(_choices())
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

    def _on_export(self, wish: ExportWish) -> None:
        exhibit, project = self._exhibit(), self._session.project
        if exhibit is None or project is None or self.busy:
            return
        self._panel.show_result("", False)  # what the last one came to is no answer to this one
        if not self._may_write(wish):
            return
        if wish.fps != self._session.settings.export_fps:
            self._session.change_settings(export_fps=wish.fps)
        replaces = bool(wish.files_there)
        self._scratch = scratch = Path(tempfile.mkdtemp(prefix="saia-review-"))
        self._panel.show_busy(-1.0)

        def prepared(sound: Path | None) -> None:
            words = ["export", str(project.folder), str(scratch / "motion.arrow"), "--force"]
            words += ["-o", str(wish.path)]
            words += ["--audio", str(sound)] if sound else []
            words += ["--fps", f"{wish.fps:g}"] if wish.fps else []
            worn = avatars.chosen(project.folder)  # films and bodies are of whom Review shows
            words += ["--avatar", str(worn)] if worn is not None else []
            words += ["--force"] if replaces else []
            self._start(words)

        background.run(lambda: _prepare(exhibit, scratch), prepared, self._on_error, owner=self)

    def _may_write(self, wish: ExportWish) -> bool:
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
        job.event_received.connect(self._on_event)
        job.done.connect(self._on_done)
        job.failed.connect(self._on_failed)
        job.ended.connect(self._on_ended)
        job.start(words)

    def _on_event(self, event: dict[str, Any]) -> None:
        if event.get("event") == "progress":
            self._panel.show_busy(float(event.get("fraction") or 0.0))

    def _on_done(self, facts: dict[str, Any]) -> None:
        self._files = [Path(str(file)) for file in facts.get("files", ())]
        self._panel.show_busy(None)
        names = ", ".join(_told_apart(self._files))
        self._panel.show_result(self.tr("Exported and read back: {0}.").format(names), True)

    def _on_failed(self, what: str, remedy: str) -> None:
        self._panel.show_busy(None)
        self._panel.show_result(f"{what} {remedy}", False)

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
        if self._job is not None:
            self._job.cancel()

    def _on_folder(self) -> None:
        if self._files:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._files[0].parent)))

    def _clean(self) -> None:
        if self._scratch is not None:
            shutil.rmtree(self._scratch, ignore_errors=True)
            self._scratch = None


def _prepare(exhibit: Exhibit, scratch: Path) -> Path | None:
    """Write the used part of motion and sound for the child. Runs on a pool thread."""
    motion, sound = exhibit.motion, exhibit.sound
    if not exhibit.whole:
        motion = motion.between(exhibit.start, exhibit.end).shifted(-exhibit.start)
    write_motion(scratch / "motion.arrow", motion)
    if sound is None or exhibit.whole:
        return sound
    trimmed = scratch / "sound.wav"
    write_sound(trimmed, read_span(sound, exhibit.start, exhibit.end), "PCM_24")
    return trimmed


def _told_apart(files: list[Path]) -> list[str]:
    """The files' names, with their folders where two are called the same."""
    if len({file.name for file in files}) == len(files):
        return [file.name for file in files]
    return [f"{file.parent.name}/{file.name}" for file in files]


def _choices() -> list[FormatChoice]:
    found = [
        FormatChoice(name, m.TITLE, formats.written_suffix(m), m.NOTE)
        for name, m in formats.writers().items()
    ]
    order = {"vrma": 0, "bvh": 1, "saia_csv": 2}
    return sorted(found, key=lambda choice: (order.get(choice.name, 9), choice.title))
