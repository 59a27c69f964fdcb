"""Review's lists: what can be reviewed, and the runs that can generate."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.project import Project, Run
from studio.training.styles import RunChoice, newest, run_choice
from studio.ui import messages, tasks, undo
from studio.ui.review import sounds
from studio.ui.review.clip import ReviewItem, review_items
from studio.ui.review.source_card import ReviewListCard
from studio.ui.session import Session
from studio.ui.undo import Step, StepsUndo


class ReviewList(QObject):
    """Keeps the sources of a project and the sounds that were dropped on it.

    Signals:
        changed: the lists are to be shown anew.
        wanted: key of a source that is to come on the stage.
        going: key of a sound whose file is about to go.

    Attributes:
        steps: sounds removed since the project was opened.
    """

    changed = Signal()
    wanted = Signal(str)
    going = Signal(str)

    def __init__(self, card: ReviewListCard, session: Session) -> None:
        super().__init__(card)
        self._card, self._session = card, session
        self._sounds: dict[Path, float] = {}  # what was dropped, with its seconds
        self.steps = StepsUndo(self)
        self.sources: tuple[ReviewItem, ...] = ()
        card.add_requested.connect(self._on_add)
        card.removed.connect(self.remove)

    @property
    def _project(self) -> Project | None:
        return self._session.project

    def open(self) -> None:
        """Another project, or none."""
        project = self._project
        self.steps.forget()
        self._sounds = dict.fromkeys(sounds.kept_sounds(project), 0.0) if project is not None else {}

    def refresh(self) -> None:
        """Read the sources again."""
        self.sources = review_items(self._project, self._sounds) if self._project is not None else ()

    def find(self, key: str) -> ReviewItem | None:
        """A source by its key."""
        return next((source for source in self.sources if source.key == key), None)

    def show(self, chosen: ReviewItem | None) -> None:
        """Fill the list on screen."""
        self._card.show_sources(self.sources, chosen.key if chosen else "")

    def note_duration(self, source: ReviewItem, seconds: float) -> bool:
        """Keep how long a dropped sound turned out to be; whether that was news."""
        if source.sound not in self._sounds or self._sounds[source.sound] == seconds:
            return False
        self._sounds[source.sound] = seconds
        return True

    def first(self) -> ReviewItem | None:
        """A take nobody trained on where there is one: that is what a model is judged by."""
        for split in ("test", "val"):
            for source in self.sources:
                if source.selection is not None and source.selection.split == split:
                    return source
        return self.sources[0] if self.sources else None

    def runs(self) -> tuple[RunChoice, ...]:
        """The runs that can generate, with their styles."""
        return tuple(run_choice(run) for run in self._usable())

    def newest_run(self) -> str:
        """The run trained last, so that a person sees what it learnt without looking for it."""
        runs = self._usable()
        return newest(runs).id if runs else ""

    def add(self, paths: list[Path]) -> None:
        """Keep sounds in the project and show the first; one that is none is told of, the others stay."""
        project = self._project
        if project is None or not paths:
            return

        def kept(found: list[Path | StudioError]) -> None:
            if project is not self._project:
                return
            good = [path for path in found if isinstance(path, Path)]
            for error in found:
                if isinstance(error, StudioError):
                    messages.show_error(self._card, error)
            if good:
                self._sounds = dict.fromkeys(good, 0.0) | self._sounds
                self.changed.emit()
                self.wanted.emit(f"sound:{good[0]}")

        tasks.run(lambda: [_kept(project, path) for path in paths], kept, owner=self)

    def remove(self, key: str, why: str = "") -> None:
        """Take a dropped sound off the list; its file goes to the project's trash.

        Args:
            key: of the sound.
            why: what is wrong with it, said before.
        """
        project, source = self._project, self.find(key)
        if project is None or source is None or source.sound is None or source.take is not None:
            return
        sound = _MovingSound(self, project, source.sound)
        try:
            sound.put_away()
        except StudioError as error:
            messages.show_error(self._card, error)
            return
        name = source.sound.name
        told = (
            self.tr("{0} is in the project's trash.") if sound.kept else self.tr("{0} is no longer listed.")
        )
        if why:
            messages.show_error(self._card, StudioError(why, told.format(name)))
            return
        self.steps.push(Step(self.tr("Remove {0}").format(name), sound.bring_back, sound.put_away))
        undo.tell_change(self._card, self.steps, told.format(name))

    def unlist(self, sound: Path) -> None:
        """Take a sound off the list, whatever becomes of its file."""
        self._sounds.pop(sound, None)
        self.changed.emit()

    def relist(self, sound: Path) -> None:
        """Put a sound on the list again and show it."""
        self._sounds = {sound: 0.0} | self._sounds
        self.changed.emit()
        self.wanted.emit(f"sound:{sound}")

    def _usable(self) -> list[Run]:
        return [run for run in self._project.runs if run.has_weights] if self._project is not None else []

    def _on_add(self) -> None:
        kinds = self.tr("Sound and video (*.wav *.mp3 *.flac *.ogg *.m4a *.aac *.mp4 *.mov *.mkv *.webm)")
        found, _ = QFileDialog.getOpenFileNames(self._card, self.tr("Add a sound"), "", kinds)
        self.add([Path(name) for name in found])


class _MovingSound:
    """A dropped sound on its way between the list and the trash.

    Attributes:
        kept: where it lies in the trash; None while it is listed, or where only its place in the list went.
    """

    def __init__(self, listing: ReviewList, project: Project, sound: Path) -> None:
        self._listing, self._project, self._sound = listing, project, sound
        self.kept: Path | None = None

    def put_away(self) -> None:
        """Off the list; StudioError where its copy cannot be moved to the trash."""
        sound, project = self._sound, self._project
        self._listing.going.emit(f"sound:{sound}")
        if not project.read_only and sound.parent == project.folder / sounds.FOLDER:
            self.kept = sounds.remove(project, sound)
        self._listing.unlist(sound)

    def bring_back(self) -> None:
        """On the list again; StudioError where its copy cannot be moved back."""
        kept, self.kept = self.kept, None
        if kept is not None:
            self._sound = sounds.bring_back(self._project, kept, self._sound.name)
        self._listing.relist(self._sound)


def _kept(project: Project, path: Path) -> Path | StudioError:
    """The sound's copy in the project, or why there is none. Runs on a pool thread."""
    try:
        return sounds.keep(project, path)
    except StudioError as error:
        return error
