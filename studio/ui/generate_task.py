"""The motion a run makes of a sound: read where it was made before, else made by a child process.

The child writes it piece by piece; what is there can be seen at once, while the rest is made.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from studio.errors import StudioError
from studio.ipc.events import ChildEvent, DoneEvent, PieceEvent, ProgressEvent
from studio.motion import Motion, MotionBuffer
from studio.project import Project, Run
from studio.project.run import generated_path, run_title
from studio.take.motion_file import read_motion
from studio.ui import tasks
from studio.ui.language import native
from studio.ui.tasks import ChildTask


class GenerateTask(QObject):
    """One request at a time; a new one replaces that before.

    Args:
        parent: as everywhere in Qt.
        child: runs the command; one of its own where None.

    Signals:
        grown: the beginning of the motion, as far as it is made, a Motion.
        predicted: the whole motion, a Motion.
        progressed: (text, fraction) while it is made; ("", None) when that is over, below 0 where unknown.
        failed: a StudioError or another exception; no motion comes.
    """

    grown = Signal(object)
    predicted = Signal(object)
    progressed = Signal(str, object)
    failed = Signal(object)

    def __init__(self, parent: QObject | None = None, child: ChildTask | None = None) -> None:
        super().__init__(parent)
        self._child = child or ChildTask(self)
        self._child.told.connect(self._on_event)
        self._child.done.connect(self._on_done)
        self._child.failed.connect(self._on_failed)
        self._child.ended.connect(self._on_ended)
        self._reading = tasks.LatestTask(self)
        self._arguments: list[str] = []
        # Where the whole motion lies, or the child writes it.
        self._path = Path()
        self._pieces = _Pieces()

    @property
    def busy(self) -> bool:
        """Whether a child process is making motion."""
        return self._child.running

    def request(self, project: Project, run: Run, sound: Path, arguments: Sequence[str] = ()) -> None:
        """Ask for what a run makes of a sound; the arguments are further ones of `saia generate`."""
        self.cancel()
        try:
            path = generated_path(project.folder, run, sound, arguments)
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            remedy = self.tr("Choose another sound, or add it again.")
            self.failed.emit(StudioError(self.tr("{0} cannot be read.").format(error.filename), remedy))
            return
        self._path = path
        if path.is_file():
            self._read_whole()
            return
        self._arguments = [
            "generate", str(project.folder), run.id, str(sound), *arguments, "--force", "-o", str(path)
        ]  # fmt: skip
        # Bound now: another request may come before the pool gets to it.
        command = self._arguments
        self._child.prepare_and_start(lambda scratch: [*command, "--pieces", str(scratch)], "pieces")
        self.progressed.emit(self.tr("{0} is listening").format(native(run_title(run.id))), -1.0)

    def cancel(self) -> None:
        """Ask for nothing any more; a child process is ended."""
        was_busy = self.busy
        self._child.drop()
        self._reading.drop()
        self._pieces = _Pieces()
        if was_busy:
            self.progressed.emit("", None)

    def close(self) -> None:
        """The window closes: no child stays behind, and nothing of what one wrote."""
        self._reading.drop()
        self._child.close()

    def _read_whole(self) -> None:
        path = self._path
        # A piece that is still being read is of no use any more.
        self._pieces = _Pieces()
        self._reading.run(lambda: _read_cached(path), self.predicted.emit, self.failed.emit)

    def _read_pieces(self) -> None:
        """Read the pieces that came meanwhile, and hand on what there is; one reading at a time."""
        pieces = self._pieces
        if pieces.reading or not pieces.files:
            return
        pieces.reading = True

        def grown(motion: Motion) -> None:
            pieces.reading = False
            if pieces is self._pieces:
                self.grown.emit(motion)
                self._read_pieces()

        def failed(_: BaseException) -> None:
            # Nobody is told, and `reading` stays: without this piece those behind it are of no use, and the
            # whole file is read at the end anyway.
            pieces.files.clear()

        tasks.run(pieces.read, grown, failed, owner=self)

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, PieceEvent):
            self._pieces.files.append(Path(event.file))
            self._read_pieces()
        elif isinstance(event, ProgressEvent):
            text = self.tr("{0} %").format(round(100 * event.fraction))
            if event.eta_s is not None and event.eta_s >= 1:
                text += "  " + self.tr("{0} s left").format(round(event.eta_s))
            self.progressed.emit(text, event.fraction)

    def _on_done(self, _done: DoneEvent) -> None:
        # The file, and not the pieces: the last of them is mostly still unread, and goes with the child.
        if self._path.is_file():
            self._read_whole()

    def _on_failed(self, error: BaseException) -> None:
        self._pieces = _Pieces()
        # No room for pieces: all of it is seen when it is there.
        if isinstance(error, OSError):
            self._child.start(self._arguments)
        else:
            self.failed.emit(error)

    def _on_ended(self) -> None:
        # It may have been started again.
        if not self.busy:
            self.progressed.emit("", None)


class _Pieces:
    """What a child has written so far of one request.

    Attributes:
        files: the pieces nobody read yet, in their order.
        reading: a pool thread is at it; then it alone touches the motion.
    """

    def __init__(self) -> None:
        self.files: list[Path] = []
        self.reading = False
        self._motion = MotionBuffer()

    def read(self) -> Motion:
        """Append what is there, and give all of it. Runs on a pool thread."""
        while self.files:
            file = self.files.pop(0)
            self._motion.append(read_motion(file))
            with suppress(OSError):
                # Here, where nobody waits: the folder goes on the GUI thread.
                file.unlink()
        return self._motion.motion


def _read_cached(path: Path) -> Motion:
    """The motion cached in a file; one that cannot be read is removed. Runs on a pool thread."""
    try:
        return read_motion(path)
    except BaseException:
        # It is only there to save time; the next request makes it again. Here, on the pool, since the window
        # never waits for a disk.
        with suppress(OSError):
            path.unlink(missing_ok=True)
        raise
