"""A take read on the thread pool, and heard: the sound leads, the playhead follows at the display's rate."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from studio.errors import StudioError
from studio.motion import Motion
from studio.motion.curve_channels import CurveChannel, channels
from studio.playback.player import Player
from studio.sound.peaks import peaks
from studio.take.motion_file import load_motion
from studio.take.take import Take
from studio.ui import tasks
from studio.ui.widgets.timeline.content import PeakSource

FRAME_MS = 16
KEPT = 4
"""Takes kept in memory, so that going back is instant."""


@dataclass(frozen=True, eq=False)
class LoadedTake:
    """What is shown of a take.

    Args:
        take: which one.
        motion: None without motion, or where it cannot be read.
        peaks: None without sound, or where it cannot be read.
        channels: of the motion.
        problems: why something could not be read.
    """

    take: Take
    motion: Motion | None
    peaks: PeakSource | None
    channels: tuple[CurveChannel, ...] = ()
    problems: tuple[StudioError, ...] = ()

    @property
    def duration(self) -> float:
        """Seconds of the take's clock."""
        return self.take.info.duration


class TakePlayer(QObject):
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

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._kept: OrderedDict[str, LoadedTake] = OrderedDict()
        self._task: tasks.Task | None = None
        self._now: LoadedTake | None = None
        self._player: Player | None = None
        self._device: str | None = None
        self._sound: Path | None = None
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
    def player(self) -> Player | None:
        """What plays its sound; None while no take is shown."""
        return self._player

    @property
    def sound(self) -> Path | None:
        """The file that is heard: the recording, or what was made of it."""
        return self._sound if self._player is not None else None

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
            return
        kept = self._kept.get(str(take.folder))
        if kept is not None:
            self._on_loaded(device, kept)
            return
        read = partial(load, take)
        self._task = tasks.run(read, partial(self._on_loaded, device), self.failed.emit, self)

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
        """Let go of the sound device."""
        self._leave()

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
        self._follow(0.0)
        self.loaded.emit(loaded)
        for problem in loaded.problems:
            self.failed.emit(problem)

    def _open(self, sound: Path | None, duration: float) -> Player:
        self._sound = sound
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
        self.moved.emit(t)


def load(take: Take) -> LoadedTake:
    """Read a take; what cannot be read is left out and told."""
    problems: list[StudioError] = []
    motion, loudness = None, None
    try:
        motion = load_motion(take)
    except StudioError as error:
        problems.append(error)
    try:
        loudness = _peaks(take)
    except StudioError as error:
        problems.append(error)
    found = channels(motion) if motion is not None else ()
    return LoadedTake(take, motion, loudness, found, tuple(problems))


def _peaks(take: Take) -> PeakSource | None:
    return peaks(take.audio_path) if take.audio_path is not None else None
