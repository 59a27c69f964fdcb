"""Files that come in or go out: dropped and chosen ones imported, projects packed and unpacked."""

from __future__ import annotations

import base64
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QFileDialog, QWidget

from studio.errors import StudioError
from studio.files.atomic import safe_name
from studio.ipc.events import (
    BonesEvent,
    ChildEvent,
    DoneEvent,
    ImportDone,
    ProblemEvent,
    TakeEvent,
    TrackingEvent,
    UnpackDone,
)
from studio.ui import messages, undo
from studio.ui.bone_table import BoneTablePresenter, ImportedSkeleton
from studio.ui.language import native, sentences
from studio.ui.messages import counted
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.ui.video_import import VideoQuestions

if TYPE_CHECKING:
    from studio.take.take import Take

SOUNDS = frozenset(
    {".wav", ".mp3", ".flac", ".ogg", ".m4a", ".aac", ".opus", ".mp4", ".mov", ".mkv", ".webm"}
)


@dataclass(frozen=True)
class Drop:
    """What to do with dropped paths; only one of the eight is filled.

    Args:
        project: a project folder to open.
        packed: a packed project to open.
        run: a run that was exported elsewhere.
        sounds: sounds to generate motion for at once.
        batch: a folder of nothing but sounds, to make motion files of.
        performed: sounds to perform live, the first of them.
        avatar: a .vrm to wear.
        imports: files and folders to bring into the project.
    """

    project: Path | None = None
    packed: Path | None = None
    run: Path | None = None
    sounds: tuple[Path, ...] = ()
    batch: Path | None = None
    performed: tuple[Path, ...] = ()
    avatar: Path | None = None
    imports: tuple[Path, ...] = ()


def sort_drop(paths: tuple[Path, ...], room: str) -> Drop:
    """What is meant by dropping paths.

    Args:
        paths: existing files and folders.
        room: the name of the room shown, "" for the welcome page.
    """
    from studio.training.run_file import SUFFIX as RUN_SUFFIX  # not needed for the window to come up

    # What means the same in every tab comes first; what a sound means depends on the tab.
    first = paths[0] if len(paths) == 1 else None
    if first is not None and (first.name == "project.json" or (first / "project.json").is_file()):
        return Drop(project=first.parent if first.name == "project.json" else first)
    if first is not None and first.suffix.lower() == ".zip":
        return Drop(packed=first)
    if first is not None and first.suffix.lower() == RUN_SUFFIX:
        return Drop(run=first)
    if first is not None and first.suffix.lower() == ".vrm":
        return Drop(avatar=first)
    if room in ("review", "live") and paths and all(path.suffix.lower() in SOUNDS for path in paths):
        return Drop(sounds=paths) if room == "review" else Drop(performed=paths)
    if first is not None and room == "review" and _holds_sounds_alone(first):
        return Drop(batch=first)
    return Drop(imports=paths)


def _holds_sounds_alone(folder: Path) -> bool:
    """Whether there is nothing in a folder that could be a take's motion."""
    try:
        inside = [path for path in folder.iterdir() if not path.name.startswith(".")]
        return bool(inside) and all(path.suffix.lower() in SOUNDS and path.is_file() for path in inside)
    except OSError:
        return False  # a file, or a folder that may not be read: the import says so


class TakesTab(Protocol):
    """The tab that shows what was imported, and whose undo takes it back."""

    @property
    def undo_scope(self) -> undo.UndoScope:
        """What undo acts on there."""

    def show_takes(self, takes: Collection[str]) -> None:
        """Select takes by id and bring them into sight."""


class Importer(QObject):
    """Runs `saia import` for dropped or chosen paths, one batch at a time; a batch is one step of undo.

    Args:
        session: with the project to import into.
        window: shows what came of it.
        curate: gives the tab that shows the takes, built when first asked for.
    """

    def __init__(self, session: Session, window: QWidget, curate: Callable[[], TakesTab]) -> None:
        super().__init__(window)
        self._session = session
        self._window = window
        self._curate = curate
        self._folder = Path()
        self._saved: list[str] = []
        self._notes: list[str] = []
        self._adopted = True
        self._refused: list[tuple[str, str]] = []
        self._paths: tuple[Path, ...] = ()
        self._skeleton: ImportedSkeleton | None = None
        """One whose bones were guessed, or could not be: what the person may correct."""
        self.bones = BoneTablePresenter(session, window)
        self._questions = VideoQuestions(window, self._begin, self._show_status)
        self._task = ChildTask(self)
        self._task.told.connect(self._on_event)
        self._task.done.connect(self._on_done)
        self._task.failed.connect(self._on_failed)
        self._task.ended.connect(self._on_ended)
        session.import_cancelled.connect(self._task.cancel)
        session.import_cancelled.connect(self._questions.cancel)

    @property
    def running(self) -> bool:
        """Whether a batch is being imported."""
        return self._task.running or self._questions.running

    def start(self, paths: tuple[Path, ...]) -> None:
        """Import paths, or say why not."""
        project = self._session.project
        if project is None:
            what = self.tr("No project is open.")
            messages.show_error(self._window, StudioError(what, self.tr("Open or create a project first.")))
        elif self.running:
            what = self.tr("Another import is still running.")
            messages.show_error(self._window, StudioError(what, self.tr("Try again when it has finished.")))
        else:
            self._folder = project.folder
            self._refused.clear()
            self._saved.clear()
            self._notes.clear()
            self._adopted = False
            self._skeleton = None
            # How far it has come is seen there; whoever is recording stays with the recording.
            if not self._session.rolling:
                self._session.tab_requested.emit("curate")
            self._show_status(self.tr("Importing…"), None)
            self._paths = paths
            self._questions.ask(paths)

    def close(self) -> None:
        """End the child; what it has saved stays."""
        self._questions.close()
        self._task.close()

    def _begin(self, args: list[str]) -> None:
        """Import what was asked about; another project may be open by now."""
        project = self._session.project
        if project is None or project.folder != self._folder:
            self._show_status("", None)
            return
        self._show_status(self.tr("Importing…"), None)
        self._task.start(["import", str(self._folder), *map(str, self._paths), *args])

    def _on_event(self, event: ChildEvent) -> None:
        match event:
            case BonesEvent() if self._skeleton is None:
                self._skeleton = ImportedSkeleton.of_event(event)
            case ProblemEvent():
                self._refused.append((event.what, event.remedy))
                self._show_status(self.tr("Importing…"), event.fraction)
            case TrackingEvent():
                done = (len(self._saved) + len(self._refused) + event.fraction) / max(event.of, 1)
                text = self.tr("Tracking the face in {0}…").format(Path(event.path).name)
                self._show_status(text, done)
                if event.jpeg:
                    self._session.import_pictured.emit(base64.b64decode(event.jpeg))
            case TakeEvent():
                self._saved.append(event.take)
                self._notes += [note for note in event.notes if note not in self._notes]
                self._show_status(self.tr("Imported {0}").format(event.take), event.fraction)

    def _on_done(self, _done: ImportDone) -> None:
        if not self._adopt():
            return
        text = self._text(len(self._saved))
        if self._refused:
            what, remedy = self._refused[0]
            one, many = self.tr("1 file could not be read."), self.tr("{0} files could not be read.")
            left = counted(len(self._refused), one, many)
            self._tell(f"{text} {left}", sentences(what, remedy), warn=True)
            self._offer_bones()
        elif self._skeleton is not None:
            guess = self.tr("Bones of {0} were matched by their names.").format(self._skeleton.path.name)
            messages.show_note(self._window, text, guess, (self.tr("Check the bones"), self._show_bones))
        else:
            self._tell(text, self._what_to_know())

    def _tell(self, text: str, remedy: str, warn: bool = False) -> None:
        """Say what came in, with Undo beside it."""
        project, rolling = self._session.project, self._session.rolling
        if rolling or (project is not None and project.read_only):
            # A tab that has to be built first would hold up a recording.
            show = (self.tr("Show in Curate"), lambda: self._session.tab_requested.emit("curate"))
            (messages.show_warning if warn else messages.show_note)(self._window, text, remedy, show)
        else:
            undo.tell_change(self._window, self._curate().undo_scope, text, remedy, warn=warn)

    def _adopt(self) -> bool:
        """Select what was saved, as one step of undo, and show it; False where another project is open."""
        project, saved = self._session.project, tuple(self._saved)
        # Another project may have been opened meanwhile; its takes are none of this import's.
        if project is None or project.folder != self._folder:
            return False
        if self._adopted:
            return True
        self._adopted = True
        one = self.tr("Import {0}").format(*saved[:1] or ("",))
        try:
            self._session.adopt_import(saved, counted(len(saved), one, self.tr("Import {0} takes")))
        except StudioError as error:
            messages.show_error(self._window, error)
            return False
        if saved and not self._session.rolling:
            self._curate().show_takes(saved)
        return True

    def _what_to_know(self) -> str:
        """What was noted while reading, the first of it, and what of the takes training does not use."""
        parts = [*map(native, self._notes[:1]), self._unused_text(), self._left_out_text()]
        if len(self._notes) > 1:
            one, many = self.tr("1 more note is kept with it."), self.tr("{0} more notes are kept with them.")
            parts.append(counted(len(self._notes) - 1, one, many))
        return " ".join(part for part in parts if part)

    def _takes(self) -> list[Take]:
        project = self._session.project
        return [take for take in project.takes if take.id in self._saved] if project is not None else []

    def _left_out_text(self) -> str:
        """Why parts of the new takes are left out and how long they are, the longest first; "" for none."""
        seconds: dict[str, float] = {}
        for start, end, why in (one for take in self._takes() if take.trains for one in take.info.left_out):
            seconds[why] = seconds.get(why, 0.0) + end - start
        longest = sorted(seconds, key=lambda why: -seconds[why])
        named = [self.tr("{0} {1} s").format(native(why).lower(), f"{seconds[why]:.1f}") for why in longest]
        return self.tr("Left out of training: {0}.").format(", ".join(named)) if named else ""

    def _unused_text(self) -> str:
        """How many of the new takes training cannot use; "" for none."""
        count = sum(not take.trains for take in self._takes())
        if not count:
            return ""
        if len(self._saved) == 1:
            return self.tr("It is not used: training needs both sound and motion.")
        one = self.tr("1 take is not used: training needs both sound and motion.")
        return counted(count, one, self.tr("{0} takes are not used: training needs both sound and motion."))

    def _text(self, count: int) -> str:
        return counted(count, self.tr("1 take imported."), self.tr("{0} takes imported."))

    def _on_failed(self, error: StudioError) -> None:
        self._adopt()
        messages.show_error(self._window, error)
        self._offer_bones()

    def _offer_bones(self) -> None:
        """Where a skeleton could not be recognised at all, ask at once which joint is which bone."""
        if self._skeleton is not None and self._skeleton.take is None:
            self._show_bones()

    def _show_bones(self) -> None:
        if self._skeleton is not None:
            self.bones.ask(self._skeleton)

    def _on_ended(self) -> None:
        self._show_status("", None)
        # A cancelled or failed batch keeps the takes it had finished.
        if not self._adopted and self._adopt() and self._saved:
            self._tell(self._text(len(self._saved)), self._what_to_know())

    def _show_status(self, sentence: str, fraction: float | None) -> None:
        self._session.status_changed.emit("job", sentence, "")
        self._session.import_progress.emit(sentence, fraction)


SUFFIX = ".zip"


class PackTask(QObject):
    """Runs `saia pack` and `saia unpack`, one at a time.

    Args:
        session: with the project to pack.
        window: shows what came of it.
        open_project: opens what was unpacked.
    """

    def __init__(self, session: Session, window: QWidget, open_project: Callable[[Path], object]) -> None:
        super().__init__(window)
        self._session, self._window, self._open_project = session, window, open_project
        self._target = Path()
        self._unpacks = False
        self._task = ChildTask(self)
        self._task.done.connect(self._on_done)
        self._task.failed.connect(lambda error: messages.show_error(self._window, error))
        self._task.ended.connect(lambda: self._show_status(""))

    @property
    def running(self) -> bool:
        """Whether something is being packed or unpacked."""
        return self._task.running

    def ask_pack(self) -> None:
        """Ask where the packed project shall lie, and pack it there."""
        project = self._session.project
        if project is not None:
            place = project.folder.parent / f"{safe_name(project.name)}{SUFFIX}"
            title, kinds = self.tr("Export project as .zip"), self.tr("Project (*.zip)")
            found, _ = QFileDialog.getSaveFileName(self._window, title, str(place), kinds)
            if found:
                self.pack(Path(found))

    def ask_unpack(self) -> None:
        """Ask for a packed project, and open it."""
        title, kinds = self.tr("Open project .zip"), self.tr("Project (*.zip)")
        found, _ = QFileDialog.getOpenFileName(self._window, title, str(self._home()), kinds)
        if found:
            self.ask_place(Path(found))

    def ask_place(self, packed: Path) -> None:
        """Ask where a packed project shall become a folder, and open it there."""
        title = self.tr("Unpack {0}: choose a new folder").format(packed.name)
        # A folder that is there would have to be asked about; a free name never does harm.
        place = free_folder(self._home(), packed.stem)
        kinds = self.tr("Project folder (*)")
        found, _ = QFileDialog.getSaveFileName(self._window, title, str(place), kinds)
        if found:
            self.unpack(packed, Path(found))

    def pack(self, target: Path) -> None:
        """Pack the open project into a zip."""
        project = self._session.project
        if project is None or self._is_busy():
            return
        self._target = target if target.suffix.lower() == SUFFIX else target.with_name(target.name + SUFFIX)
        self._unpacks = False
        self._show_status(self.tr("Packing {0}…").format(project.name))
        self._task.start(["pack", str(project.folder), "-o", str(self._target)])

    def unpack(self, packed: Path, folder: Path) -> None:
        """Make a project folder of a zip, and open it."""
        if self._is_busy():
            return
        self._target, self._unpacks = folder, True
        self._show_status(self.tr("Unpacking {0}…").format(packed.name))
        self._task.start(["unpack", str(packed), str(folder)])

    def close(self) -> None:
        """End the child; a half-made file goes with it."""
        self._task.close()

    def _is_busy(self) -> bool:
        if self._task.running:
            what = self.tr("Another .zip is still being made.")
            messages.show_error(self._window, StudioError(what, self.tr("Wait until it has finished.")))
        return self._task.running

    def _on_done(self, done: DoneEvent) -> None:
        target = self._target
        if self._unpacks:
            if self._session.rolling:
                messages.show_note(self._window, self.tr("Unpacked into {0}.").format(target.name))
            else:
                self._open_project(target)
            if isinstance(done, UnpackDone) and done.left_out:
                one = self.tr("{0} file in the zip does not belong to a project and was skipped.")
                many = self.tr("{0} files in the zip do not belong to a project and were skipped.")
                messages.show_note(self._window, counted(done.left_out, one, many))
            return

        def show_it() -> None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(target.parent)))

        text = self.tr("The project was saved to {0}.").format(target.name)
        messages.show_note(self._window, text, "", (self.tr("Open folder"), show_it))

    def _home(self) -> Path:
        recent = self._session.settings.recent_projects
        return Path(recent[0]).parent if recent else Path.home()

    def _show_status(self, sentence: str) -> None:
        self._session.status_changed.emit("job", sentence, "")


def free_folder(place: Path, name: str) -> Path:
    """A folder of this name that is not there yet, or of this name with a number."""
    folder, number = place / name, 2
    while folder.exists():
        folder, number = place / f"{name} {number}", number + 1
    return folder
