"""Hearing and seeing a take: the sound leads, the playhead and the figure follow at the display's rate."""

from __future__ import annotations

from collections import OrderedDict
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Qt, QTimer, Signal

from studio.errors import StudioError
from studio.motion import Motion, Pose, rotation
from studio.playback.player import Player
from studio.take.take import Take
from studio.ui import background
from studio.ui.curate.loading import LoadedTake, load
from studio.ui.widgets.pane import Pane

FRAME_MS = 16
KEPT = 4
"""Takes kept in memory, so that going back is instant."""


class Playing(QObject):
    """The take shown, and the player of its sound.

    Signals:
        loaded: a LoadedTake is ready to be shown.
        moved: the playhead is at this second.
        playing_changed: it began or stopped to play.
        failed: a StudioError that somebody should see.
    """

    loaded = Signal(object)
    moved = Signal(float)
    playing_changed = Signal(bool)
    failed = Signal(object)

    def __init__(self, stage: Pane, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._stage = stage
        self._kept: OrderedDict[str, LoadedTake] = OrderedDict()
        self._task: background.Task | None = None
        self._now: LoadedTake | None = None
        self._player: Player | None = None
        self._device: str | None = None
        self._offset = 0.0
        self._was_playing = False
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(FRAME_MS)
        self._timer.timeout.connect(self._tick)

    @property
    def take(self) -> LoadedTake | None:
        """The take shown, None while it is being read."""
        return self._now

    @property
    def position(self) -> float:
        """Seconds."""
        return self._player.position if self._player else 0.0

    @property
    def playing(self) -> bool:
        """Whether it plays."""
        return self._player is not None and self._player.playing

    def show(self, take: Take | None, device: str | None = None) -> None:
        """Show a take, reading it on the thread pool unless it was shown lately; None shows nothing."""
        self._leave()
        if take is None:
            self._clear_stage()
            return
        kept = self._kept.get(str(take.folder))
        if kept is not None:
            self._on_loaded(device, kept)
            return
        read = partial(load, take)
        self._task = background.run(read, partial(self._on_loaded, device), self.failed.emit, self)

    def toggle(self) -> None:
        """Play or pause."""
        if self._player is None:
            return
        self._player.toggle()
        if self._player.playing:
            self._timer.start()
        self._tick()

    def pause(self) -> None:
        """Stop where it is."""
        if self._player is not None:
            self._player.pause()
            self._tick()

    def seek(self, t: float) -> None:
        """Go to a moment in seconds, playing or not."""
        if self._player is not None:
            self._player.seek(t)
            self._follow(self._player.position if self._player.playing else min(max(t, 0.0), self.duration))

    def set_loop(self, loop: tuple[float, float] | None) -> None:
        """Repeat a span in seconds, or play through."""
        if self._player is not None:
            self._player.set_loop(loop)

    def hear(self, sound: Path) -> None:
        """Play another file in place of this take's sound, going on from where it stands."""
        before = self._player
        if before is None or self._now is None:
            return
        position, playing, loop = before.position, before.playing, before.loop
        before.close()
        self._player = self._open(sound, self._now.duration)
        self._player.set_loop(loop)
        self._player.seek(position)
        if playing:
            self._player.play()

    def set_offset(self, offset: float) -> None:
        """Show motion this many seconds later against the sound."""
        self._offset = offset
        if self._now is not None:
            self._show_pose(self.position)

    @property
    def duration(self) -> float:
        """Seconds of the take shown."""
        return self._now.duration if self._now else 0.0

    def forget(self, folder: str = "") -> None:
        """Read this take (all where none is named) from disk the next time."""
        if folder:
            self._kept.pop(folder, None)
        else:
            self._kept.clear()

    def close(self) -> None:
        """Let go of sound device and OpenGL."""
        self._leave()
        self._stage.figure.dispose()

    def _leave(self) -> None:
        self._timer.stop()
        if self._task is not None:
            self._task.forget()
            self._task = None
        player, self._player, self._now = self._player, None, None
        if player is not None:
            player.close()
        self._report_playing(False)

    def _on_loaded(self, device: str | None, loaded: LoadedTake) -> None:
        self._task = None
        self._keep(loaded)
        self._device = device or None
        self._player = self._open(loaded.take.audio_path, loaded.duration)
        self._now = loaded
        if loaded.motion is None or not len(loaded.motion):
            self._stage.show_nothing(self.tr("This take has no motion."))
        self._follow(0.0)
        self.loaded.emit(loaded)
        for problem in loaded.problems:
            self.failed.emit(problem)

    def _open(self, sound: Path | None, duration: float) -> Player:
        try:
            return Player(sound, duration, self._device)
        except StudioError:
            # The sound cannot be read, which was told already: the clock leads.
            return Player(None, duration)

    def _keep(self, loaded: LoadedTake) -> None:
        key = str(loaded.take.folder)
        self._kept[key] = loaded
        self._kept.move_to_end(key)
        while len(self._kept) > KEPT:
            self._kept.popitem(last=False)

    def _tick(self) -> None:
        if self._player is None:
            return
        playing = self._player.playing
        self._follow(self._player.position)
        if not playing:
            self._timer.stop()
        if playing and not self._was_playing and self._player.problem is not None:
            self.failed.emit(self._player.problem)
        self._report_playing(playing)

    def _report_playing(self, playing: bool) -> None:
        if playing != self._was_playing:
            self._was_playing = playing
            self.playing_changed.emit(playing)

    def _follow(self, t: float) -> None:
        self._show_pose(t)
        self.moved.emit(t)

    def _show_pose(self, t: float) -> None:
        motion = self._now.motion if self._now else None
        if motion is None or not len(motion):
            return
        pose = motion.pose(t - self._offset)
        world = world_of(motion, pose)
        self._stage.show_pose(
            motion.skeleton, world, dict(zip(motion.shape_names, pose.shapes.tolist(), strict=True))
        )

    def _clear_stage(self) -> None:
        self._stage.show_nothing(self.tr("Choose a take to see it move."))


def world_of(motion: Motion, pose: Pose) -> NDArray[np.floating]:
    """World positions (J, 3) of one pose, the root applied."""
    joints, _ = motion.skeleton.forward(pose.positions, pose.rotations)
    turned = rotation.rotate(np.broadcast_to(pose.root_rotation, (len(joints), 4)), joints)
    return turned + pose.root_position
