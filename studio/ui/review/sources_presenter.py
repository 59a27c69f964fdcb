"""Presenter of the list of what can be reviewed: sounds are added and removed, takes are chosen."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.project import Project, sounds
from studio.ui import tasks, undo
from studio.ui.language import native
from studio.ui.review.clip import ReviewItem, sound_key
from studio.ui.review.model import ReviewModel
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from studio.ui.undo import Step, StepsUndo


class SourcesPresenter(QObject):
    """Presenter of the list of dropped sounds and takes.

    Args:
        view: the tab.
        model: what is listed.
        session: knows the open project.

    Attributes:
        steps: sounds removed since the project was opened.
    """

    def __init__(self, view: ReviewView, model: ReviewModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._card, self._model, self._session = view, view.sources_card, model, session
        self.steps = StepsUndo(self)
        self._card.add_requested.connect(self._on_add)
        self._card.removed.connect(self.remove)
        self._card.chosen.connect(model.show_key)
        model.project_changed.connect(self.steps.forget)
        model.items_changed.connect(self._show)
        model.item_changed.connect(self._show)
        model.load_failed.connect(self._on_load_failed)
        session.sounds_dropped.connect(lambda paths: self.add(list(paths)))

    def add(self, paths: list[Path]) -> None:
        """Copy sounds into the project and show the first; of one that is none a message tells."""
        project = self._session.project
        if project is None or not paths:
            return

        def show(found: list[Path | StudioError]) -> None:
            if project is not self._session.project:
                return
            for error in found:
                if isinstance(error, StudioError):
                    self._model.failed.emit(error)
            self._list([path for path in found if isinstance(path, Path)])

        tasks.run(lambda: [_add(project, path) for path in paths], show, owner=self)

    def remove(self, key: str, why: str = "") -> None:
        """Remove a dropped sound from the list; its file goes to the project's trash.

        Args:
            key: of the sound.
            why: what is wrong with it, said before.
        """
        project, item = self._session.project, self._model.find(key)
        if project is None or item is None or item.sound is None or item.take is not None:
            return
        sound, name = item.sound, item.sound.name
        # None while it is listed, and where only its place in the list went.
        trashed: Path | None = None

        def put_away() -> None:
            nonlocal trashed
            self._model.release(sound_key(sound))
            # One that was not copied, since the project may only be looked at, is somebody else's file.
            if not project.read_only and sound.parent == project.folder / sounds.FOLDER:
                trashed = sounds.trash_sound(project, sound)
            self._model.sounds.pop(sound, None)
            self._model.refresh()

        def bring_back() -> None:
            nonlocal sound, trashed
            before, trashed = trashed, None
            # Its name may be another sound's by now.
            if before is not None:
                sound = sounds.restore_sound(project, before, sound.name)
            self._list([sound])

        try:
            put_away()
        except StudioError as error:
            self._model.failed.emit(error)
            return
        place = self.tr("{0} is in the project's trash.") if trashed else self.tr("{0} is no longer listed.")
        if why:
            self._model.failed.emit(StudioError(why, place.format(name)))
            return
        self.steps.push(Step(self.tr("Remove {0}").format(name), bring_back, put_away))
        undo.tell_change(self._card, self.steps, place.format(name))

    def _list(self, paths: list[Path]) -> None:
        """Put sounds on top of the list and show the first."""
        if paths:
            self._model.sounds = dict.fromkeys(paths, 0.0) | self._model.sounds
            self._model.refresh()
            self._model.show_key(sound_key(paths[0]))

    def _show(self) -> None:
        item = self._model.item
        self._view.show_empty(not self._model.items)
        self._card.show_sources(self._model.items, item.key if item is not None else "")

    def _on_load_failed(self, item: ReviewItem, error: BaseException) -> None:
        # A dropped sound that cannot be read is of no use in the list; a take may be mended by other means.
        if item.take is None and isinstance(error, StudioError):
            self.remove(item.key, why=native(error.what))
        else:
            self._model.failed.emit(error)

    def _on_add(self) -> None:
        kinds = self.tr("Sound and video (*.wav *.mp3 *.flac *.ogg *.m4a *.aac *.mp4 *.mov *.mkv *.webm)")
        found, _ = QFileDialog.getOpenFileNames(self._card, self.tr("Add a sound"), "", kinds)
        self.add([Path(name) for name in found])


def _add(project: Project, path: Path) -> Path | StudioError:
    """The sound's copy in the project, or why there is none. Runs on a pool thread."""
    try:
        return sounds.add_sound(project, path)
    except StudioError as error:
        return error
