"""Review's lists: what can be reviewed, and the runs that can generate."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.project import Project, Run
from studio.ui import background, messages
from studio.ui.review import sounds
from studio.ui.review.clip import RunChoice, Source, newest, run_choice, sources
from studio.ui.review.source_card import SourceCard
from studio.ui.session import Session


class Listing(QObject):
    """Keeps the sources of a project and the sounds that were dropped on it.

    Signals:
        changed: the lists are to be shown anew.
        wanted: key of a source that is to come on the stage.
        going: key of a sound whose file is about to go.
    """

    changed = Signal()
    wanted = Signal(str)
    going = Signal(str)

    def __init__(self, card: SourceCard, session: Session) -> None:
        super().__init__(card)
        self._card, self._session = card, session
        self._sounds: dict[Path, float] = {}  # what was dropped, with its seconds
        self.sources: tuple[Source, ...] = ()
        card.add_requested.connect(self._on_add)
        card.removed.connect(self.remove)

    @property
    def _project(self) -> Project | None:
        return self._session.project

    def open(self) -> None:
        """Another project, or none."""
        project = self._project
        self._sounds = dict.fromkeys(sounds.kept_sounds(project), 0.0) if project is not None else {}

    def refresh(self) -> None:
        """Read the sources again."""
        self.sources = sources(self._project, self._sounds) if self._project is not None else ()

    def find(self, key: str) -> Source | None:
        """A source by its key."""
        return next((source for source in self.sources if source.key == key), None)

    def show(self, chosen: Source | None) -> None:
        """Fill the list on screen."""
        self._card.show_sources(self.sources, chosen.key if chosen else "")

    def note_duration(self, source: Source, seconds: float) -> bool:
        """Keep how long a dropped sound turned out to be; whether that was news."""
        if source.sound not in self._sounds or self._sounds[source.sound] == seconds:
            return False
        self._sounds[source.sound] = seconds
        return True

    def first(self) -> Source | None:
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

        background.run(lambda: [_kept(project, path) for path in paths], kept, owner=self)

    def remove(self, key: str, why: str = "") -> None:
        """Take a dropped sound off the list; its file goes to the project's trash.

        Args:
            key: of the sound.
            why: what is wrong with it, said before.
        """
        project, source = self._project, self.find(key)
        if project is None or source is None or source.sound is None or source.take is not None:
            return
        self.going.emit(key)
        try:
            if not project.read_only and source.sound.parent == project.folder / sounds.FOLDER:
                sounds.remove(project, source.sound)
        except StudioError as error:
            messages.show_error(self._card, error)
            return
        self._sounds.pop(source.sound, None)
        self.changed.emit()
        told = self.tr("{0} is in the project's trash.").format(source.sound.name)
        if why:
            messages.show_error(self._card, StudioError(why, told))
        else:
            messages.show_note(self._card, told)

    def _usable(self) -> list[Run]:
        return [run for run in self._project.runs if run.has_weights] if self._project is not None else []

    def _on_add(self) -> None:
        kinds = self.tr("Sound and video (*.wav *.mp3 *.flac *.ogg *.m4a *.aac *.mp4 *.mov *.mkv *.webm)")
        found, _ = QFileDialog.getOpenFileNames(self._card, self.tr("Add a sound"), "", kinds)
        self.add([Path(name) for name in found])


def _kept(project: Project, path: Path) -> Path | StudioError:
    """The sound's copy in the project, or why there is none. Runs on a pool thread."""
    try:
        return sounds.keep(project, path)
    except StudioError as error:
        return error
