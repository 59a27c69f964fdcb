"""The performer's own avatar: one for all tabs, opened on the pool, kept in the project."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import shiboken6
from PySide6.QtCore import QObject, QThreadPool, Signal, SignalInstance
from PySide6.QtWidgets import QFileDialog, QWidget

from studio.errors import StudioError
from studio.ui import messages, tasks

if TYPE_CHECKING:
    from studio.motion.avatar import Avatar
    from studio.project import Project
    from studio.settings import Settings
    from studio.ui.widgets.avatar_button import AvatarButton
    from studio.ui.widgets.face_dialog import FaceDialog

# The window has a store from its first moment, and an avatar only with a project: what opens one, the half of
# all that is imported, is imported where it is used.


class AvatarSession(Protocol):
    """What is needed of the session, which is built with a store and so cannot be imported here."""

    project: Project | None
    settings: Settings
    avatars: AvatarStore

    @property
    def project_opened(self) -> SignalInstance:
        """Another project is open."""

    @property
    def avatar_dropped(self) -> SignalInstance:
        """A .vrm was dropped on the window; carries its path."""

    def change_settings(self, **values: object) -> None:
        """Change preferences by field name."""


class AvatarView(Protocol):
    """A picture that can show an avatar.

    Attributes:
        avatar: the button that chooses one.
    """

    avatar: AvatarButton

    @property
    def avatar_too_slow(self) -> SignalInstance:
        """The avatar is left away from now on, since drawing it takes too long."""

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Show it, and name it on the button; None for the stick figure."""


@dataclass(frozen=True, eq=False)
class _Opened:
    """An avatar that was read, where it lies in the project, and whether the choice could be kept."""

    avatar: Avatar
    path: Path
    unkept: StudioError | None = None


class AvatarStore(QObject):
    """The avatar of the open project, the same in every tab; the session has the only one.

    Args:
        session: the open project.
        parent: as everywhere in Qt.

    Signals:
        changed: another avatar is shown, none, or the one before still, since another could not be opened.
        opening: an avatar of this name is being opened.
    """

    changed = Signal()
    opening = Signal(str)

    def __init__(self, session: AvatarSession, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self.avatar: Avatar | None = None
        self.path: Path | None = None
        """Where the file of the avatar lies in the project."""
        self._reading = tasks.LatestTask(self)
        self._driven = False
        """Whether another choice for its faces is kept, or on its way to the disk."""
        # One after the other: the choice that was made last holds.
        self._in_order = QThreadPool(self)
        self._in_order.setMaxThreadCount(1)
        session.avatar_dropped.connect(lambda path: self.choose(Path(str(path))))
        session.project_opened.connect(self._on_project)
        self._on_project()

    def choose(self, path: Path | None, asking: QWidget | None = None) -> None:
        """Show an avatar from anywhere, or none, and remember it in the project.

        Args:
            path: its file; None for the stick figure.
            asking: where to say that it cannot be opened.
        """
        project = self._session.project
        if project is None:
            return
        if path is None:
            self._clear()
            from studio.project import avatars

            with suppress(StudioError):  # a folder that is only looked at: off for now
                if not project.read_only:
                    avatars.choose(project.folder, None)
            return
        self._open(path, project.folder, not project.read_only, asking)

    def choices(self) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
        """The studio's own avatar and the project's, and those elsewhere that were used lately."""
        from studio.project import avatars

        project = self._session.project
        own = avatars.offered(project.folder) if project is not None else ()
        names = {path.name for path in own}
        recent = [Path(text) for text in self._session.settings.recent_avatars]
        return own, tuple(path for path in recent if path.name not in names and path.is_file())

    def drive(self, drivers: Mapping[str, str], asking: QWidget | None = None) -> None:
        """Let other blend shapes move the avatar's faces, and keep that beside its file in the project.

        Args:
            drivers: by an expression's name, "" for nothing; those that are left out go by their names.
            asking: where to say that it cannot be kept.
        """
        project = self._session.project
        if self.avatar is None or self.path is None or project is None:
            return
        self.avatar = self.avatar.driven_by(drivers)
        self.changed.emit()
        if project.read_only:
            what = self.tr("This project can only be looked at: the choice holds until it is closed.")
            messages.show_note(asking, what)
            return
        self._driven = self._driven or bool(drivers)
        folder, path, copied = project.folder, self.path, self._driven
        tasks.run(
            lambda: _kept(folder, path, drivers, copied),
            lambda kept: self._on_kept(folder, path, kept, asking),
            lambda error: _show_error(asking, error),
            owner=self,
            pool=self._in_order,
        )

    def _on_kept(self, folder: Path, path: Path, kept: Path, asking: QWidget | None) -> None:
        project = self._session.project
        if kept == path or self.path != path or project is None or project.folder != folder:
            return
        from studio.project import avatars

        self.path = kept
        try:
            avatars.choose(folder, kept)
        except StudioError as error:
            _show_error(asking, error)

    def _open(
        self, path: Path, folder: Path, keep: bool, asking: QWidget | None = None, quiet: bool = False
    ) -> None:
        """Read an avatar on the pool.

        Args:
            path: where it lies.
            folder: the project's.
            keep: copy it into the project and remember it.
            asking: where to say what went wrong.
            quiet: it is not new: it came with the project.
        """
        self.opening.emit(path.stem)

        def loaded(found: _Opened) -> None:
            self._show(found, None if quiet or found.path == path else path)
            if found.unkept is not None:
                _show_error(asking, found.unkept)

        def failed(error: BaseException) -> None:
            self.changed.emit()
            _show_error(asking, error)

        self._reading.run(lambda: _opened(path, folder, keep), loaded, failed)

    def _show(self, found: _Opened, source: Path | None) -> None:
        self.avatar, self.path, self._driven = found.avatar, found.path, False
        if source is not None:
            recent = self._session.settings.with_recent_avatar(source).recent_avatars
            self._session.change_settings(recent_avatars=recent)
        self.changed.emit()

    def _clear(self) -> None:
        self._reading.drop()
        self.avatar, self.path, self._driven = None, None, False
        self.changed.emit()

    def _on_project(self) -> None:
        self._clear()
        project = self._session.project
        if project is None:
            return
        from studio.project import avatars

        chosen = avatars.chosen(project.folder)
        if chosen is not None:
            self._open(chosen, project.folder, keep=False, quiet=True)


class Avatars(QObject):
    """Presenter of an avatar button: shows its picture as the avatar that the store holds."""

    def __init__(self, view: AvatarView, session: AvatarSession) -> None:
        super().__init__(view.avatar)
        self._view, self._session, self._store = view, session, session.avatars
        self._faces: FaceDialog | None = None
        button = view.avatar
        button.wanted.connect(lambda path: self._store.choose(path, view.avatar))
        button.browse_requested.connect(self._browse)
        button.menu_opening.connect(self._show_choices)
        button.faces_requested.connect(self._show_faces)
        view.avatar_too_slow.connect(self._on_too_slow)
        self._store.changed.connect(self._show)
        self._store.opening.connect(button.show_busy)
        self._show()

    @property
    def worn(self) -> Path | None:
        """The file of the avatar that is shown."""
        return self._store.path

    def _show(self) -> None:
        self._view.set_avatar(self._store.avatar)
        # Another avatar has other faces.
        shown = self._store.avatar
        if self._faces is not None and (shown is None or shown.skeleton is not self._faces.skeleton):
            self._faces.reject()

    def _show_choices(self) -> None:
        self._view.avatar.show_choices(*self._store.choices(), self._store.path)

    def _browse(self) -> None:
        recent = self._session.settings.recent_avatars
        start = str(Path(recent[0]).parent) if recent else str(Path.home())
        title, kinds = self.tr("Open a VRM avatar"), self.tr("VRM avatars (*.vrm)")
        name, _ = QFileDialog.getOpenFileName(self._view.avatar, title, start, kinds)
        if name:
            self._store.choose(Path(name), self._view.avatar)

    def _show_faces(self) -> None:
        avatar = self._store.avatar
        if avatar is None:
            return
        if self._faces is not None:
            self._faces.raise_()
            return
        # It draws: tabs have that loaded, the first page has not.
        from studio.ui.widgets.face_dialog import FaceDialog

        dialog = FaceDialog(avatar, self._view.avatar.window())
        dialog.drivers_changed.connect(lambda drivers: self._store.drive(drivers, self._view.avatar))
        dialog.finished.connect(self._on_faces_closed)
        self._faces = dialog
        dialog.show()

    def _on_faces_closed(self) -> None:
        self._faces = None

    def _on_too_slow(self) -> None:
        what = self.tr("This computer is too slow to draw this avatar.")
        instead = self.tr("A stick figure with its proportions is shown instead.")
        messages.show_note(self._view.avatar, f"{what} {instead}")


def _show_error(asking: QWidget | None, error: BaseException) -> None:
    """Show an error where somebody asked, as long as that is there."""
    # Reading takes seconds, in which the tab that asked may have been closed.
    there = asking is not None and shiboken6.isValid(asking)
    messages.show_error(asking if there else None, error)


def _kept(folder: Path, path: Path, drivers: Mapping[str, str], copied: bool) -> Path:
    """Keep what moves an avatar's faces, beside a copy in the project where `copied`, and give its file.

    Runs on the thread pool: a copy takes as long as the disk does.
    """
    from studio import formats
    from studio.project import avatars

    if path == avatars.OWN and copied:
        path = avatars.adopt(folder, path, changed=True)
    if path != avatars.OWN:
        formats.keep_drivers(path, drivers)
    return path


def _opened(path: Path, folder: Path, keep: bool) -> _Opened:
    """Read an avatar, and only one that can be read is copied. Runs on the thread pool."""
    from studio import formats
    from studio.project import avatars

    avatar = formats.read_avatar(path)
    _ = avatar.skins  # here, where nobody waits for pictures
    if not keep:
        return _Opened(avatar, path)
    try:
        copy = avatars.adopt(folder, path)
        avatars.choose(folder, copy)
        # What was chosen for its faces in this project comes before what came with the file.
        if own := formats.read_drivers(copy):
            avatar = avatar.driven_by(own)
        elif avatar.drivers:
            formats.keep_drivers(copy, avatar.drivers)
    except StudioError as error:
        return _Opened(avatar, path, error)
    return _Opened(avatar, copy)
