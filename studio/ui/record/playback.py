"""A take of today heard again while the figure moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from studio.motion import Motion, Pose
from studio.take.take import Take
from studio.ui import tasks
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.playback.player import Player


@dataclass
class TakePlayback:
    """A take that is being played."""

    take: Take
    player: Player
    motion: Motion | None


class SavedTakePlayer(QObject):
    """Plays one take of today at a time.

    Signals:
        changed: another take is played, or none.
        failed: an exception: it cannot be played, or is not heard.
    """

    changed = Signal()
    failed = Signal(object)

    def __init__(self, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self._playback: TakePlayback | None = None
        self._opening = tasks.LatestTask(self)

    @property
    def take_id(self) -> str:
        """The take being played, "" for none."""
        return self._playback.take.id if self._playback else ""

    @property
    def current(self) -> TakePlayback | None:
        """What is played now; None once it has ended."""
        if self._playback is not None and not self._playback.player.playing:
            self.stop()
        return self._playback

    @property
    def pose(self) -> tuple[Motion, Pose] | None:
        """The pose of the take being played."""
        playback = self.current
        if playback is None or playback.motion is None or not len(playback.motion):
            return None
        return playback.motion, playback.motion.pose(playback.player.position)

    def toggle(self, take_id: str) -> None:
        """Play a take, or stop it."""
        playing = self.take_id
        self.stop()
        if take_id == playing or self._session.project is None or self._session.rolling:
            return
        take = self._session.project.take(take_id)
        self._opening.run(lambda: _play(take), self._on_opened, self.failed.emit, self._close)

    def stop(self) -> None:
        """Stop playing."""
        self._opening.drop()
        if self._playback is not None:
            playback, self._playback = self._playback, None
            self._close(playback)
            self.changed.emit()

    def _on_opened(self, playback: TakePlayback) -> None:
        self._playback = playback
        if playback.player.problem is not None:
            self.failed.emit(playback.player.problem)
        self.changed.emit()

    def _close(self, playback: TakePlayback) -> None:
        """Off the GUI thread: a sound device takes its time to close."""
        tasks.run(playback.player.close, lambda _: None, self.failed.emit, owner=self)


def _play(take: Take) -> TakePlayback:
    """Everything needed to play a take, already playing. Runs on a pool thread."""
    from studio.playback.player import Player
    from studio.take.motion_file import load_motion

    motion = load_motion(take)
    player = Player(take.audio_path, take.info.duration or None)
    player.play()
    return TakePlayback(take, player, motion)
