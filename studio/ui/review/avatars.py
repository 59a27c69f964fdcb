"""Which avatar Review wears: opened on the pool, copied into the project, remembered there."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio import formats
from studio.errors import StudioError
from studio.motion.avatar import Avatar
from studio.project import avatars
from studio.ui import background, messages
from studio.ui.review.stage import Stage
from studio.ui.session import Session


@dataclass(frozen=True, eq=False)
class _Opened:
    """An avatar that was read, where it lies in the project, and whether the choice could be kept."""

    avatar: Avatar
    path: Path
    unkept: StudioError | None = None


class Avatars(QObject):
    """Thought of the avatar button."""

    def __init__(self, stage: Stage, session: Session) -> None:
        super().__init__(stage)
        self._stage, self._session = stage, session
        self._worn: Path | None = None
        self._loads = 0  # the newest wish wins
        button = stage.avatar
        button.wanted.connect(self.wear)
        button.browse_requested.connect(self._browse)
        button.menu_opening.connect(self._show_choices)
        stage.avatar_too_slow.connect(self._on_too_slow)
        session.avatar_dropped.connect(lambda path: self.wear(Path(str(path))))
        session.project_opened.connect(self._on_project)
        self._on_project()

    @property
    def worn(self) -> Path | None:
        """The file of the avatar that is worn."""
        return self._worn

    def wear(self, path: Path | None) -> None:
        """Wear an avatar from anywhere, or none, and remember it in the project."""
        project = self._session.project
        if project is None:
            return
        if path is None:
            self._take_off()
            with suppress(StudioError):  # a folder that is only looked at: off for now
                if not project.read_only:
                    avatars.choose(project.folder, None)
            return
        self._open(path, project.folder, keep=not project.read_only)

    def _open(self, path: Path, folder: Path, keep: bool, quiet: bool = False) -> None:
        """Read an avatar on the pool.

        Args:
            path: where it lies.
            folder: the project's.
            keep: copy it into the project and remember it.
            quiet: it is not new: it came with the project.
        """
        self._loads += 1
        turn = self._loads
        self._stage.avatar.show_busy(path.stem)

        def loaded(found: _Opened) -> None:
            if turn == self._loads:
                self._put_on(found, path, quiet)

        def failed(error: BaseException) -> None:
            if turn == self._loads:
                self._stage.avatar.show_avatar(self._stage.worn)
                messages.show_error(self._stage, error)

        background.run(lambda: _opened(path, folder, keep), loaded, failed, owner=self)

    def _put_on(self, found: _Opened, source: Path, quiet: bool) -> None:
        self._worn = found.path
        self._stage.set_avatar(found.avatar)
        if not quiet:
            recent = self._session.settings.with_recent_avatar(source).recent_avatars
            self._session.change_settings(recent_avatars=recent)
        if found.unkept is not None:
            messages.show_error(self._stage, found.unkept)

    def _take_off(self) -> None:
        self._loads += 1
        self._worn = None
        self._stage.set_avatar(None)

    def _on_project(self) -> None:
        self._take_off()
        project = self._session.project
        chosen = avatars.chosen(project.folder) if project is not None else None
        if project is not None and chosen is not None:
            self._open(chosen, project.folder, keep=False, quiet=True)

    def _show_choices(self) -> None:
        project = self._session.project
        own = avatars.kept(project.folder) if project is not None else ()
        names = {path.name for path in own}
        recent = [Path(text) for text in self._session.settings.recent_avatars]
        recent = [path for path in recent if path.name not in names and path.is_file()]
        self._stage.avatar.show_choices(own, recent, self._worn)

    def _browse(self) -> None:
        recent = self._session.settings.recent_avatars
        start = str(Path(recent[0]).parent) if recent else str(Path.home())
        title, kinds = self.tr("Open a VRM avatar"), self.tr("VRM avatars (*.vrm)")
        name, _ = QFileDialog.getOpenFileName(self._stage, title, start, kinds)
        if name:
            self.wear(Path(name))

    def _on_too_slow(self) -> None:
        what = self.tr("This computer draws the avatar too slowly.")
        messages.show_note(
            self._stage, what + " " + self.tr("The stick figure with its proportions is shown instead.")
        )


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
