"""What the whole window shares: the open project, the settings, and word of what changed."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from studio.errors import StudioError
from studio.ui.avatar_store import AvatarStore
from studio.ui.language import native

if TYPE_CHECKING:
    from studio.dataset.dataset import Dataset
    from studio.project import Project
    from studio.settings import Settings
    from studio.take.take import Take


@dataclass
class MicrophoneRequest:
    """A request to list the microphones anew, which is possible only while none is open.

    Args:
        accepted: whoever may have one open closes it for that moment, lists them, and says so here at once.
    """

    accepted: bool = False


class Session(QObject):
    """The open project and what happened to it.

    Signals:
        project_opened: a project was opened or closed; read `project`.
        takes_changed: takes were added or removed.
        dataset_changed: choices about takes were edited, undone or redone.
        runs_changed: a training run appeared, ended or went.
        settings_changed: preferences were changed, with the names of those that differ now.
        status_changed: (key, text, health) for the status strip; health is "good", "warn", "bad" or "".
        rolling_changed: a recording began or ended.
        sounds_dropped: sound files were dropped on the window while Review was shown, a tuple of paths.
        batch_dropped: a folder of sounds was.
        performance_dropped: sound files were dropped while Live was shown, a tuple of paths.
        microphones_requested: a MicrophoneRequest: list the microphones anew.
        microphones_listed: that was done.
        avatar_dropped: a .vrm was dropped on the window.
        run_dropped: a run's file was dropped on the window.
        import_requested: bring in these paths; an empty tuple asks for files first.
        import_folder_requested: ask for a folder, and bring it in.
        import_cancelled: end the import that is going on.
        import_pictured: what a video shows that is being imported, a JPEG.
        import_progress: (sentence, fraction done or None); an empty sentence when it is over.
        work_progressed: (which work, fraction done): below 0 where nobody can tell, None when it is over.
        tab_requested: show the tab of this name ("record", "curate", "train", "review", "live").
        review_requested: show a run in Review, by its id.
        watch_requested: the same, and play it from the start.
        run_shown: Review shows what this run makes, by its id.
        news_changed: (tab, what is new there and not seen yet; "" for nothing).
        take_requested: show a take in Curate, by its id.
        step_done: a step on the way to going live that no file tells of ("check", "watch", "live").
    """

    project_opened = Signal()
    takes_changed = Signal()
    dataset_changed = Signal()
    runs_changed = Signal()
    settings_changed = Signal(object)
    status_changed = Signal(str, str, str)
    rolling_changed = Signal(bool)
    sounds_dropped = Signal(object)
    batch_dropped = Signal(object)
    performance_dropped = Signal(object)
    microphones_requested = Signal(object)
    microphones_listed = Signal()
    avatar_dropped = Signal(object)
    run_dropped = Signal(object)
    import_requested = Signal(object)
    import_folder_requested = Signal()
    import_cancelled = Signal()
    import_progress = Signal(str, object)
    work_progressed = Signal(str, object)
    import_pictured = Signal(bytes)
    tab_requested = Signal(str)
    review_requested = Signal(str)
    watch_requested = Signal(str)
    run_shown = Signal(str)
    news_changed = Signal(str, str)
    take_requested = Signal(str)
    step_done = Signal(str)

    def __init__(self, settings: Settings | None = None, parent: QObject | None = None) -> None:
        super().__init__(parent)
        if settings is None:
            from studio import settings as preferences

            settings = preferences.load()
        self.settings = settings
        self.project: Project | None = None
        self.rolling = False
        self.avatars = AvatarStore(self, self)
        """The performer's own avatar, one for all tabs."""

    @property
    def locked_reason(self) -> str:
        """Why the open project is only to look at, in one sentence; "" where it can be changed."""
        return native(self.project.read_only_in_window) if self.project is not None else ""

    def open_project(self, folder: Path) -> Project:
        """Open a project folder and tell everyone; the one open before is left.

        Raises:
            StudioError: the folder is no project or can't be read; the one open before stays.
        """
        from studio.project import Project

        if self.project is not None and _same(self.project.folder, folder):
            self.refresh_takes()
            return self.project
        return self._show(Project.open(folder))

    def create_project(self, folder: Path, name: str = "") -> Project:
        """Make a project folder and open it.

        Raises:
            StudioError: the folder exists and holds something else, or can't be written.
        """
        from studio.project import Project

        return self._show(Project.create(folder, name))

    def close_project(self) -> None:
        """Leave the project: back to the welcome page. Every edit was saved when it was made."""
        if self.project is not None:
            self.project.close()
            self.project = None
            self.project_opened.emit()

    def edit(self, name: str, dataset: Dataset, tab: str = "") -> None:
        """Make a new state of the choices, named for undo.

        Args:
            name: what undo calls it.
            dataset: the choices.
            tab: where it is done, for a tab whose undo takes back its own edits alone.
        """
        assert self.project is not None
        self.project.edit(name, dataset, tab)
        self.dataset_changed.emit()

    def undo(self) -> str:
        """Take back the last edit; its name, "" where there is none."""
        return self._step(self.project.undo) if self.project and not self.project.read_only else ""

    def redo(self) -> str:
        """Make the edit taken back last again; its name, "" where there is none."""
        return self._step(self.project.redo) if self.project and not self.project.read_only else ""

    def _step(self, step: Callable[[], str]) -> str:
        assert self.project is not None
        before, takes = self.project.dataset, self.project.takes
        try:
            return step()
        finally:  # where it cannot be written it is done all the same, and must be seen
            if self.project.takes != takes:  # undoing a removal brings a take back
                self.takes_changed.emit()
            if self.project.dataset is not before:
                self.dataset_changed.emit()

    def adopt(self, take: Take, performer: str = "") -> None:
        """Tell everyone of a take that was just saved in the open project's folder, and who is seen in it."""
        if self.project is not None:
            self.project.adopt(take, performer)
            self.takes_changed.emit()

    def remove_take(self, take_id: str, tab: str = "") -> None:
        """Move a take to the trash; undo brings it back.

        Args:
            take_id: the take's.
            tab: where it is done, as for `edit`.

        Raises:
            StudioError: the project is read-only or cannot be written.
        """
        assert self.project is not None
        self.project.remove_take(take_id, tab)
        self.takes_changed.emit()
        self.dataset_changed.emit()

    def refresh_takes(self) -> tuple[str, ...]:
        """Look for takes that appeared on disk; the new ids."""
        new = self.project.refresh() if self.project else ()
        self.takes_changed.emit()
        return new

    def adopt_import(self, take_ids: Collection[str], name: str) -> None:
        """Look for takes that appeared on disk; those of an import are one step of undo of this name.

        Raises:
            StudioError: the choices cannot be written.
        """
        assert self.project is not None
        try:
            self.project.adopt_import(take_ids, name)
        finally:
            self.takes_changed.emit()
            self.dataset_changed.emit()

    def set_rolling(self, rolling: bool) -> None:
        """Say that a recording began or ended."""
        if rolling != self.rolling:
            self.rolling = rolling
            self.rolling_changed.emit(rolling)

    def change_settings(self, **values: object) -> None:
        """Change preferences by field name and keep them; what cannot be kept holds until the end."""
        from studio import settings as preferences
        from studio.ui import messages

        before = self.settings
        # Changed first and saved after: what cannot be saved still holds until the window closes.
        self.settings = before.changed(**values)
        try:
            preferences.change(**values)
        except StudioError as error:  # a full disk must not keep a take from beginning
            messages.show_error(None, error)
        differ = {name for name in values if getattr(before, name) != getattr(self.settings, name)}
        self.settings_changed.emit(frozenset(differ))

    def _show(self, project: Project) -> Project:
        if self.project is not None:
            self.project.close()
        self.project = project
        self._remember(project.folder)
        self.project_opened.emit()
        return project

    def _remember(self, folder: Path) -> None:
        from studio import settings as preferences

        self.settings = self.settings.with_recent(folder)
        with suppress(StudioError):  # a list that can't be kept is no reason not to open a project
            preferences.save(preferences.load().with_recent(folder))


def _same(a: Path, b: Path) -> bool:
    with suppress(OSError):
        return a.resolve() == b.resolve()
    return False
