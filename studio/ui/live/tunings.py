"""The presets of Review's Tune panel that Live can lay over the motion."""

from __future__ import annotations

import json
from collections.abc import Callable

from PySide6.QtCore import QObject

from studio.ipc.commands import Command
from studio.playback.layers import presets
from studio.ui import tasks
from studio.ui.live.source_card import LiveSourceCard
from studio.ui.session import Session


class LiveTuningPresenter(QObject):
    """Thought of the tuning list.

    Args:
        card: where the list is.
        session: for the project's own presets.
        tell: says a line to the child; does nothing where there is none.
    """

    def __init__(self, card: LiveSourceCard, session: Session, tell: Callable[[Command], None]) -> None:
        super().__init__(card)
        self._card, self._session, self._tell = card, session, tell
        self._presets: dict[str, presets.Preset] = {}
        self._chosen = ""
        card.tuning_chosen.connect(self._on_chosen)

    def read(self) -> None:
        """List the presets there are, which Review may have changed."""
        project = self._session.project
        folder = project.folder / presets.FOLDER if project is not None else None

        def read() -> dict[str, presets.Preset]:
            own = presets.saved(folder)[0] if folder is not None else ()
            found = (one for one in (*presets.shipped(), *own) if not one.tuning.neutral)
            return {one.title: one for one in found}

        tasks.run(read, self._show, owner=self)

    def send(self) -> None:
        """Tell the child which one is chosen."""
        preset = self._presets.get(self._chosen)
        plain = presets.to_plain(preset.tuning) if preset is not None else {}
        self._tell(Command("tune", json.dumps(plain, ensure_ascii=False)))

    def _show(self, found: dict[str, presets.Preset]) -> None:
        self._presets = found
        self._card.show_tunings(list(found), self._chosen)

    def _on_chosen(self, title: str) -> None:
        self._chosen = title
        self.send()
