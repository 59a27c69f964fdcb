"""The player: one position that everything on screen and on the wire follows, and its transport.

The sound that is heard leads. Without a sound or without a device the monotonic clock leads, and `problem`
says so. The transport's state machine only says whether the position moves.
Source: the transport's form is Ardour's (transport_fsm.h): states, events, one table, nothing implied.
"""

from __future__ import annotations

import threading
import time
from enum import StrEnum
from pathlib import Path

from studio.errors import StudioError
from studio.playback.sound_output import SoundOutput
from studio.sound.resample import SLOWEST
from studio.sound.sound_file import SoundSource


class TransportState(StrEnum):
    """Where the transport stands."""

    STOPPED = "stopped"
    """Silent at a position."""
    STARTING = "starting"
    """Asked to roll; the first sound is on its way to the ear."""
    ROLLING = "rolling"
    """Heard and moving."""
    ENDED = "ended"
    """Silent at the end; playing again begins at the start."""
    CLOSED = "closed"
    """Done for good; everything is ignored."""


class Event(StrEnum):
    """What can happen to a transport."""

    PLAY = "play"
    PAUSE = "pause"
    SEEK = "seek"
    PLAYED = "heard"
    """The first sample after a start or a seek reached the ear."""
    END = "end"
    CLOSE = "close"


_S, _E = TransportState, Event

TABLE: dict[tuple[TransportState, Event], TransportState] = {
    (_S.STOPPED, _E.PLAY): _S.STARTING,
    (_S.STOPPED, _E.PAUSE): _S.STOPPED,
    (_S.STOPPED, _E.SEEK): _S.STOPPED,
    # A last block may reach the ear after the pause.
    (_S.STOPPED, _E.PLAYED): _S.STOPPED,
    (_S.STOPPED, _E.END): _S.STOPPED,
    (_S.STARTING, _E.PLAY): _S.STARTING,
    (_S.STARTING, _E.PAUSE): _S.STOPPED,
    (_S.STARTING, _E.SEEK): _S.STARTING,
    (_S.STARTING, _E.PLAYED): _S.ROLLING,
    (_S.STARTING, _E.END): _S.ENDED,
    (_S.ROLLING, _E.PLAY): _S.ROLLING,
    (_S.ROLLING, _E.PAUSE): _S.STOPPED,
    (_S.ROLLING, _E.SEEK): _S.STARTING,
    (_S.ROLLING, _E.PLAYED): _S.ROLLING,
    (_S.ROLLING, _E.END): _S.ENDED,
    (_S.ENDED, _E.PLAY): _S.STARTING,
    (_S.ENDED, _E.PAUSE): _S.ENDED,
    (_S.ENDED, _E.SEEK): _S.STOPPED,
    (_S.ENDED, _E.PLAYED): _S.ENDED,
    (_S.ENDED, _E.END): _S.ENDED,
    **{(state, _E.CLOSE): _S.CLOSED for state in _S},
    **{(_S.CLOSED, event): _S.CLOSED for event in _E},
}
"""Every state with every event; a pair that is missing is a fault of this file (a test counts them)."""

MOVING = frozenset({TransportState.STARTING, TransportState.ROLLING})
"""States in which sound is on its way or heard."""


def after(state: TransportState, event: Event) -> TransportState:
    """The state that follows."""
    return TABLE[state, event]


class Player:
    """Plays a sound, or only time, and says where it is. All methods may be called from any thread.

    Args:
        sound: the file to hear; None plays time alone.
        duration: seconds to play; the sound's own length where None.
        device: a PortAudio name or index; the system's default where None.

    Raises:
        StudioError: the sound cannot be read, or neither a sound nor a duration is given.
    """

    def __init__(
        self, sound: Path | None, duration: float | None = None, device: str | int | None = None
    ) -> None:
        # Reentrant: `play` settles the position first, which may end the transport and stop the output.
        self._lock = threading.RLock()
        self._path, self._device = sound, device
        self._state = TransportState.STOPPED
        self._position = 0.0
        self._loop: tuple[float, float] | None = None
        self._speed = 1.0
        self._output: SoundOutput | None = None
        self._clock_start = 0.0
        self._problem: StudioError | None = None
        # Opened for its length, and so that a bad file is an error here and not at play.
        source = SoundSource(sound) if sound is not None else None
        if duration is None:
            if source is None:
                raise StudioError("There is nothing to play.", "Choose a sound or a motion.")
            duration = source.duration
        self.duration = duration
        # Kept for the first play where it was decoded, which takes long. A file is not held open until then:
        # on Windows it could not be moved.
        self._decoded = source if source is not None and source.decoded else None
        if source is not None and self._decoded is None:
            source.close()

    @property
    def state(self) -> TransportState:
        """Where the transport stands."""
        with self._lock:
            self._settle()
            return self._state

    @property
    def playing(self) -> bool:
        """Whether it moves, or is about to."""
        return self.state in MOVING

    @property
    def position(self) -> float:
        """Seconds from the start, of what is in the ear right now."""
        with self._lock:
            self._settle()
            return self._position

    @property
    def loop(self) -> tuple[float, float] | None:
        """The looped span (start, end) in seconds, or None."""
        return self._loop

    @property
    def speed(self) -> float:
        """1 as it was recorded, less is slower."""
        return self._speed

    @property
    def problem(self) -> StudioError | None:
        """Why no sound is heard although there should be, or None."""
        with self._lock:
            self._settle()
            return self._problem

    def play(self) -> None:
        """Roll from where it stands; from the start after the end."""
        with self._lock:
            self._settle()
            if self._state in MOVING or self._state is TransportState.CLOSED:
                return
            if self._state is TransportState.ENDED:
                self._position = self._loop[0] if self._loop else 0.0
            self._state = after(self._state, Event.PLAY)
            self._open_output()
            self._roll()

    def pause(self) -> None:
        """Stop where it is."""
        with self._lock:
            self._settle()
            self._state = after(self._state, Event.PAUSE)
            if self._output is not None:
                self._output.stop()

    def toggle(self) -> None:
        """Play or pause."""
        if self.playing:
            self.pause()
        else:
            self.play()

    def seek(self, t: float) -> None:
        """Go to a moment (seconds), rolling or not."""
        with self._lock:
            self._settle()
            self._state = after(self._state, Event.SEEK)
            if self._state is TransportState.CLOSED:
                return
            self._position = min(max(t, 0.0), self.duration)
            if self._state in MOVING:
                self._roll()

    def set_loop(self, loop: tuple[float, float] | None) -> None:
        """Repeat a span (start, end in seconds), or play through where None."""
        with self._lock:
            self._settle()
            if loop is not None:
                start, end = max(min(loop), 0.0), min(max(loop), self.duration)
                # Shorter than a chunk of sound, it would be a tone and not a loop.
                loop = (start, end) if end - start > 0.05 else None
            self._loop = loop
            if self._state in MOVING:
                self._roll()

    def set_speed(self, speed: float) -> None:
        """Play slower, 0.25 to 1, in the same pitch; rolling or not."""
        with self._lock:
            self._settle()
            self._speed = min(max(speed, SLOWEST), 1.0)
            if self._state in MOVING:
                self._state = after(self._state, Event.SEEK)
                self._roll()

    def close(self) -> None:
        """Let go of the device; the player ends."""
        with self._lock:
            self._state = after(self._state, Event.CLOSE)
            output, self._output = self._output, None
            decoded, self._decoded = self._decoded, None
        for one in (output, decoded):
            if one is not None:
                one.close()

    def _open_output(self) -> None:
        """Find a device, unless one is open; without one the clock leads."""
        if self._path is None:
            return
        if self._output is not None and self._output.gone:
            self._output.close()
            self._output = None
        if self._output is None:
            try:
                source, self._decoded = self._decoded or SoundSource(self._path), None
                self._output = SoundOutput(source, self.duration, self._device)
                self._problem = None
            except StudioError as error:
                self._problem = error

    def _roll(self) -> None:
        if self._output is not None:
            self._output.start(self._position, self._loop, self._speed)
        self._clock_start = time.monotonic() - self._position / self._speed

    def _settle(self) -> None:
        """Bring position and state up to now."""
        if self._state not in MOVING:
            return
        if self._output is not None and self._output.gone:
            self._leave_output()
        heard = self._output.heard() if self._output is not None else self._clock_position()
        if heard is None:
            return
        # Every position that is heard is the event; in most states the table answers it with the same state.
        self._state = after(self._state, Event.PLAYED)
        self._position = min(heard, self.duration)
        # A loop up to the very end comes around by itself; everything else ends here.
        if self._position >= self.duration - 1e-4 and not self._loops_at_end():
            self._state = after(self._state, Event.END)
            self._position = self.duration
            if self._output is not None:
                self._output.stop()

    def _loops_at_end(self) -> bool:
        return self._loop is not None and self._loop[1] >= self.duration - 1e-3

    def _clock_position(self) -> float:
        t = (time.monotonic() - self._clock_start) * self._speed
        if self._loop is not None and self._position < self._loop[1] <= t:
            start, end = self._loop
            t = start + (t - end) % (end - start)
            self._clock_start = time.monotonic() - t / self._speed
        return t

    def _leave_output(self) -> None:
        """The device went away in mid-play: go on by the clock from here, and say so."""
        output, self._output = self._output, None
        self._problem = StudioError(
            "The sound device stopped answering.",
            "Check its cable and play it again; the motion goes on.",
        )
        self._clock_start = time.monotonic() - self._position / self._speed
        if output is not None:
            # On a thread of its own: closing a device that is gone can take seconds.
            threading.Thread(target=output.close, name="close lost device", daemon=True).start()
