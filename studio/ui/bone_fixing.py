"""Bones matched by name, put right by a person in a table, kept with the project, imported again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QWidget

from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import messages
from studio.ui.bone_dialog import BoneDialog
from studio.ui.session import Session


@dataclass(frozen=True)
class Skeleton:
    """A file whose joints were matched to bones.

    Args:
        path: the file.
        pairs: (joint, the bone it was taken for or "") in the file's order.
        audio: the sound that belongs to it, None without.
        take: id of the take just made of it, which a new one shall replace; None to replace none.
    """

    path: Path
    pairs: tuple[tuple[str, str], ...]
    audio: Path | None = None
    take: str | None = None

    @classmethod
    def of_event(cls, event: dict[str, Any]) -> Skeleton:
        """What `saia import` tells of one."""
        audio, take = event.get("audio"), event.get("take")
        pairs = tuple((str(joint), str(bone)) for joint, bone in event["bones"])
        return cls(Path(event["path"]), pairs, Path(audio) if audio else None, str(take) if take else None)


class BoneFixing(QObject):
    """Shows the table and does what it says."""

    def __init__(self, session: Session, window: QWidget) -> None:
        super().__init__(window)
        self._session, self._window = session, window
        self.dialog: BoneDialog | None = None

    def ask(self, skeleton: Skeleton) -> None:
        """Let the person correct which joint is which bone."""
        if self.dialog is not None:
            self.dialog.close()
        made = self.dialog = BoneDialog(skeleton.path.name, skeleton.pairs, self._window.window())
        made.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        made.table_accepted.connect(lambda table: self._use(skeleton, table))
        made.finished.connect(lambda _: self._forget(made))
        made.show()

    def ask_of(self, take: Take) -> None:
        """Let the person correct a take imported before; its file is read again."""
        from studio.formats import bvh
        from studio.formats._bone_tables import BONES_FROM, load_tables

        path, project = Path(take.info.extra.get(BONES_FROM, "")), self._session.project
        if project is None:
            return
        try:
            pairs = bvh.matched(path, load_tables(project.folder))
        except StudioError as error:
            messages.show_error(self._window, error)
        else:
            self.ask(Skeleton(path, pairs, take.audio_path))

    def _use(self, skeleton: Skeleton, table: dict[str, str]) -> None:
        from studio.formats._bone_tables import keep_table

        project = self._session.project
        if project is None:
            return
        try:
            keep_table(project.folder, [joint for joint, _ in skeleton.pairs], table)
            if skeleton.take is not None and any(take.id == skeleton.take for take in project.takes):
                self._session.remove_take(skeleton.take)
        except StudioError as error:
            messages.show_error(self._window, error)
            return
        self._session.import_requested.emit(tuple(p for p in (skeleton.path, skeleton.audio) if p))

    def _forget(self, dialog: BoneDialog) -> None:
        if self.dialog is dialog:
            self.dialog = None
