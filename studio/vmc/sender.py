"""Sends motion to a VMC program over UDP at a steady rate, in time with the sound."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from studio.errors import StudioError, say
from studio.motion import Pose
from studio.motion.neutral import WAVE_SECONDS, between, neutral_pose, wave_pose
from studio.vmc import MARIONETTE_PORT, PERFORMER_PORT
from studio.vmc.encode import SendOptions, encode_frame
from studio.vmc.pace import Pace, PoseArrivals

# An avatar that is left in mid-gesture looks broken; half a second back to rest does not look like a cut.
FADE_SECONDS = 0.5
REFUSED_FOR = 1.0
"""Seconds a target counts as refusing after its last refusal."""
STARVED = 0.1
"""Seconds without a frame after which even a late one goes out: where a machine is too busy to make any frame
in time an avatar stutters, and does not freeze."""


@dataclass(frozen=True)
class Destination:
    """Where to send and how.

    Args:
        host: name or address.
        port: UDP port.
        fps: frames per second, 1 to 240.
        options: names, bundles, rotations only.
    """

    host: str = "127.0.0.1"
    port: int = MARIONETTE_PORT
    fps: float = 60.0
    options: SendOptions = field(default_factory=SendOptions)


@dataclass(frozen=True)
class TargetPreset:
    """A program people send to, and the port to begin with: its own default, else the protocol's.

    What a program listens on is the person's setting there; the hint says so instead of guessing at menus.
    """

    title: str
    port: int

    @property
    def hint(self) -> str:
        """What to do in that program, one sentence."""
        return say("In {title}, turn on VMC receiving and set the same port as here.", title=self.title)


PRESETS: tuple[TargetPreset, ...] = (
    TargetPreset("VSeeFace", PERFORMER_PORT),
    TargetPreset("Warudo", MARIONETTE_PORT),
    TargetPreset("VNyan", MARIONETTE_PORT),
    TargetPreset("VMagicMirror", MARIONETTE_PORT),
    TargetPreset("EVMC4U", MARIONETTE_PORT),
    TargetPreset("VirtualMotionCapture", PERFORMER_PORT),
)


class TargetStatus(StrEnum):
    """How a target is doing."""

    OFF = "off"
    SENDING = "sending"
    REFUSED = "refused"
    ERROR = "error"


@dataclass(frozen=True)
class TargetState:
    """What a display shows of a target.

    Args:
        status: the state.
        sent, dropped: frames sent, and frames left out because their time had passed.
        problem: what is wrong and what to do, or None.
    """

    status: TargetStatus
    sent: int
    dropped: int
    problem: StudioError | None = None


@dataclass(frozen=True)
class PoseSource:
    """What is sent: the pose at each position of the player.

    Args:
        pose_at: position in seconds -> pose, with the names of its shapes and of its bones; called on the
            sender's thread.
        position: the player's position in seconds; called on the sender's thread.
        arrivals: where each pose is to leave as soon as it has been made; None for an even beat.
    """

    pose_at: Callable[[float], tuple[Pose, tuple[str, ...], tuple[str, ...]]]
    position: Callable[[], float]
    arrivals: PoseArrivals | None = None


@dataclass(frozen=True)
class _Frame:
    pose: Pose
    shape_names: tuple[str, ...]
    bone_names: tuple[str, ...]


class VmcTarget:
    """Sends the pose of a source to one destination at a steady rate, or as its poses are made.

    A frame whose time has passed is dropped, never queued. The sender's time T only rises, whatever
    the player does. Stopping fades to a neutral pose once. Frames leave on this object's own thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._destination = Destination()
        self._source: PoseSource | None = None
        self._wave_start: float | None = None
        self._sent = self._dropped = 0
        self._refused_at = self._sent_at = float("-inf")
        self._problem: StudioError | None = None
        self._began = time.monotonic()
        self._fade = True
        self._last_position: float | None = None

    @property
    def running(self) -> bool:
        """Whether frames are leaving (fading out counts)."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def state(self) -> TargetState:
        """Status, counters and problem at this moment."""
        status, problem = TargetStatus.SENDING, self._problem
        if not self.running:
            status = TargetStatus.ERROR if problem is not None else TargetStatus.OFF
        elif problem is not None:
            status = TargetStatus.ERROR
        elif time.monotonic() - self._refused_at < REFUSED_FOR:
            status, problem = TargetStatus.REFUSED, _refused(self._destination)
        return TargetState(status, self._sent, self._dropped, problem)

    def show(self, source: PoseSource | None) -> None:
        """What to send from now on; takes effect with the next frame."""
        self._source = source

    def start(self, destination: Destination, source: PoseSource | None = None) -> None:
        """Begin to send, or go on to another destination.

        Raises:
            StudioError: the host is not known or the port is impossible.
        """
        self.stop(fade=False)
        if source is not None:
            self._source = source
        sock = _connected(destination)
        self._destination, self._problem = destination, None
        self._sent = self._dropped = 0
        self._refused_at = self._sent_at = float("-inf")
        self._stop = threading.Event()
        self._fade = True
        self._thread = threading.Thread(
            target=self._run, args=(sock, destination, self._stop), name="VMC sender", daemon=True
        )
        self._thread.start()

    def wave(self) -> None:
        """Send a greeting of a few seconds instead of the source, once."""
        self._wave_start = time.monotonic()

    def stop(self, fade: bool = True, wait: bool = True) -> None:
        """Stop sending.

        Args:
            fade: go to the neutral pose first (half a second).
            wait: return only when the last frame has left.
        """
        thread = self._thread
        if thread is None:
            return
        self._fade = fade
        self._stop.set()
        if wait:
            thread.join(timeout=FADE_SECONDS + 10.0)
            self._thread = None

    def _run(self, sock: socket.socket, destination: Destination, stop: threading.Event) -> None:
        """Runs on the sender's thread until stopped."""
        with sock:
            pace = Pace(destination.fps, self._source.arrivals if self._source is not None else None)
            last: _Frame | None = None
            while not stop.is_set():
                self._dropped += pace.wait(stop)
                frame = self._frame(pace.due)
                if frame is not None:
                    last = frame
                    self._send(sock, destination, frame, pace)
            # Nothing was sent yet: then there is no pose to fade from.
            if self._fade and last is not None:
                self._fade_out(sock, destination, last)

    def _frame(self, due: float) -> _Frame | None:
        start = self._wave_start
        if start is not None and due - start < WAVE_SECONDS:
            return _Frame(*wave_pose(due - start))
        source = self._source
        if source is None:
            return None
        position = source.position()
        # The frame leaves a little later than it is made; a paused player must not tremble by that.
        moving = self._last_position is not None and position != self._last_position
        ahead = max(due - time.monotonic(), 0.0) if moving else 0.0
        self._last_position = position
        return _Frame(*source.pose_at(position + ahead))

    def _fade_out(self, sock: socket.socket, destination: Destination, last: _Frame) -> None:
        rest = neutral_pose(last.shape_names, last.bone_names, last.pose.positions)
        pace, count = Pace(destination.fps), max(round(FADE_SECONDS * destination.fps), 1)
        for step in range(1, count + 1):
            # Stopped a second time: whoever asks twice does not want to wait for the fade.
            if not self._fade:
                return
            pace.wait(threading.Event())
            pose = between(last.pose, rest, step / count)
            frame = _Frame(pose, last.shape_names, last.bone_names)
            # An avatar must not be left half way: the last frame goes out however late it is.
            self._send(sock, destination, frame, pace, even_late=step == count)

    def _send(
        self,
        sock: socket.socket,
        destination: Destination,
        frame: _Frame,
        pace: Pace,
        even_late: bool = False,
    ) -> None:
        datagrams = encode_frame(
            frame.pose, frame.shape_names, frame.bone_names, pace.due - self._began, destination.options
        )
        now = time.monotonic()
        # Late by a whole step, a frame is dropped; but where all are late, some must still get out.
        if now - pace.due > pace.step and now - self._sent_at < STARVED and not even_late:
            self._dropped += 1
            return
        pace.hold()
        try:
            for datagram in datagrams:
                # Non-blocking: a full buffer of the network drops the datagram, and the next frame is sent in
                # time.
                self._at_once(sock.send, datagram)
            # Windows reports a closed port at the next receive, Linux at the next send.
            self._at_once(sock.recv, 1)
        except OSError as error:
            self._problem = _unreachable(destination, error)
        else:
            self._sent += 1
            self._sent_at = time.monotonic()
            self._problem = None

    def _at_once(self, call: Callable[[Any], object], argument: object) -> None:
        try:
            call(argument)
        except BlockingIOError:
            pass
        except (ConnectionRefusedError, ConnectionResetError):
            self._refused_at = time.monotonic()


def _connected(destination: Destination) -> socket.socket:
    host, port = destination.host, destination.port
    if not 1 <= port <= 65535:
        raise StudioError(say("Port {port} is not possible.", port=port), "Choose a port from 1 to 65535.")
    try:
        # The first address, as every program does; a name may have one of IPv6.
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        sock = socket.socket(family, kind, protocol)
    except (OSError, UnicodeError) as error:
        remedy = "Check the spelling; on this computer it is 127.0.0.1."
        raise StudioError(say("There is no computer called {host}.", host=host), remedy) from error
    try:
        # Some performers send to the whole network, 255 at the end; without this the system forbids it.
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        # Connected, so that the system tells when nobody listens on the port.
        sock.connect(address)
        sock.setblocking(False)
    except OSError as error:
        sock.close()
        raise _unreachable(destination, error) from error
    return sock


def _refused(destination: Destination) -> StudioError:
    return StudioError(
        say("Nothing is receiving on {host} port {port}.", host=destination.host, port=destination.port),
        "Start the avatar program and turn on its VMC receiver, or choose its port.",
    )


def _unreachable(destination: Destination, error: OSError) -> StudioError:
    return StudioError(
        say(
            "Sending to {host} port {port} fails: {reason}.",
            host=destination.host,
            port=destination.port,
            reason=error.strerror or error,
        ),
        "Check the address and the network.",
    )
