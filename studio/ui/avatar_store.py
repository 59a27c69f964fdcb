"""The performer's own avatar: one for all rooms, opened on the pool, kept in the project."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import shiboken6
from PySide6.QtCore import QObject, Qt, Signal, SignalInstance
from PySide6.QtWidgets import QFileDialog, QWidget

from studio import formats
from studio.errors import StudioError
from studio.motion.avatar import Avatar
from studio.project import avatars
from studio.ui import messages, tasks
from studio.ui.session import Session
from studio.ui.widgets.avatar_button import AvatarButton


class AvatarView(Protocol):
    """A picture that can wear an avatar.

    Attributes:
        avatar: the button that chooses one.
    """

    avatar: AvatarButton

    @property
    def avatar_too_slow(self) -> SignalInstance:
        """The avatar is left away from now on, since drawing it takes too long."""

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Wear it, and name it on the button; None for the stick figure."""


@dataclass(frozen=True, eq=False)
class _Opened:
    """An avatar that was read, where it lies in the project, and whether the choice could be kept."""

    avatar: Avatar
    path: Path
    unkept: StudioError | None = None


class AvatarStore(QObject):
    """What is worn in the open project, the same in every room; get the session's by `AvatarStore.of`.

    Signals:
        changed: another avatar is worn, none, or the one before still, since another could not be opened.
        opening: an avatar of this name is being opened.
    """

    changed = Signal()
    opening = Signal(str)

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self._session = session
        self.avatar: Avatar | None = None
        self.path: Path | None = None
        """Where the file of the avatar lies in the project."""
        self._reading = tasks.LatestTask(self)  # the newest wish wins
        session.avatar_dropped.connect(lambda path: self.wear(Path(str(path))))
        session.project_opened.connect(self._on_project)
        self._on_project()

    @classmethod
    def of(cls, session: Session) -> AvatarStore:
        """The wardrobe of a session, made when it is first asked for."""
        found = session.findChild(cls, options=Qt.FindChildOption.FindDirectChildrenOnly)
        return found if isinstance(found, cls) else cls(session)

    def wear(self, path: Path | None, asking: QWidget | None = None) -> None:
        """Wear an avatar from anywhere, or none, and remember it in the project.

        Args:
            path: its file; None for the stick figure.
            asking: where to say that it cannot be opened.
        """
        project = self._session.project
        if project is None:
            return
        if path is None:
            self._take_off()
            with suppress(StudioError):  # a folder that is only looked at: off for now
                if not project.read_only:
                    avatars.choose(project.folder, None)
            return
        self._open(path, project.folder, not project.read_only, asking)

    def choices(self) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
        """The project's avatars, and those elsewhere that were used lately."""
        project = self._session.project
        own = avatars.kept(project.folder) if project is not None else ()
        names = {path.name for path in own}
        recent = [Path(text) for text in self._session.settings.recent_avatars]
        return own, tuple(path for path in recent if path.name not in names and path.is_file())

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
            self._put_on(found, None if quiet else path)
            if found.unkept is not None:
                _say(asking, found.unkept)

        def failed(error: BaseException) -> None:
            self.changed.emit()
            _say(asking, error)

        self._reading.run(lambda: _opened(path, folder, keep), loaded, failed)

    def _put_on(self, found: _Opened, source: Path | None) -> None:
        self.avatar, self.path = found.avatar, found.path
        if source is not None:
            recent = self._session.settings.with_recent_avatar(source).recent_avatars
            self._session.change_settings(recent_avatars=recent)
        self.changed.emit()

    def _take_off(self) -> None:
        self._reading.drop()
        self.avatar = self.path = None
        self.changed.emit()

    def _on_project(self) -> None:
        self._take_off()
        project = self._session.project
        chosen = avatars.chosen(project.folder) if project is not None else None
        if project is not None and chosen is not None:
            self._open(chosen, project.folder, keep=False, quiet=True)


class Avatars(QObject):
    """Thought of an avatar button: dresses its picture in what the wardrobe holds."""

    def __init__(self, wearer: AvatarView, session: Session) -> None:
        super().__init__(wearer.avatar)
        self._wearer, self._session = wearer, session
        self._wardrobe = AvatarStore.of(session)
        button = wearer.avatar
        button.wanted.connect(lambda path: self._wardrobe.wear(path, wearer.avatar))
        button.browse_requested.connect(self._browse)
        button.menu_opening.connect(self._show_choices)
        wearer.avatar_too_slow.connect(self._on_too_slow)
        self._wardrobe.changed.connect(self._dress)
        self._wardrobe.opening.connect(button.show_busy)
        self._dress()

    @property
    def worn(self) -> Path | None:
        """The file of the avatar that is worn."""
        return self._wardrobe.path

    def _dress(self) -> None:
        self._wearer.set_avatar(self._wardrobe.avatar)

    def _show_choices(self) -> None:
        self._wearer.avatar.show_choices(*self._wardrobe.choices(), self._wardrobe.path)

    def _browse(self) -> None:
        recent = self._session.settings.recent_avatars
        start = str(Path(recent[0]).parent) if recent else str(Path.home())
        title, kinds = self.tr("Open a VRM avatar"), self.tr("VRM avatars (*.vrm)")
        name, _ = QFileDialog.getOpenFileName(self._wearer.avatar, title, start, kinds)
        if name:
            self._wardrobe.wear(Path(name), self._wearer.avatar)

    def _on_too_slow(self) -> None:
        what = self.tr("This computer draws the avatar too slowly.")
        instead = self.tr("The stick figure with its proportions is shown instead.")
        messages.show_note(self._wearer.avatar, f"{what} {instead}")


def _say(asking: QWidget | None, error: BaseException) -> None:
    """Show an error where somebody asked, as long as that is there."""
    there = asking is not None and shiboken6.isValid(asking)
    messages.show_error(asking if there else None, error)


def _opened(path: Path, folder: Path, keep: bool) -> _Opened:
    """Read an avatar, and only one that can be read is copied. Runs on the thread pool."""
    avatar = formats.read_avatar(path)
    _ = avatar.skins  # here, where nobody waits for pictures
    if not keep:
        return _Opened(avatar, path)
    try:
        copy = avatars.adopt(folder, path)
        avatars.choose(folder, copy)
    except StudioError as error:
        return _Opened(avatar, path, error)
    return _Opened(avatar, copy)
