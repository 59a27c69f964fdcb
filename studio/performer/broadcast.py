"""The performer live: its voice from a loudspeaker and its motion over VMC, in time with each other."""

from __future__ import annotations

import math
import queue
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from studio.errors import RequestError, StudioError, say, together
from studio.motion import Motion, Pose
from studio.motion.neutral import between, neutral_pose
from studio.performer.loudspeaker import Loudspeaker
from studio.performer.performance import ScriptedScene, scenes
from studio.performer.script import Script
from studio.sound.voice_line import LineSender
from studio.vmc.encode import SendOptions, encode_frame

NO_SOUND = "none"
"""As device: keep silent and go by the clock alone."""

_AHEAD_SCENES = 2
_NAP = 0.05
_LATE_FRAMES = 2.0
# How long the way to rest takes.
_REST_SECONDS = 0.5


class Broadcast:
    """Speaks and sends until it is stopped, then goes to rest within half a second.

    `start` and every property return at once: speech is prepared and devices are opened on its own threads.

    Args:
        host, port: where VMC frames go.
        fps: frames a second.
        device: output device, by PortAudio name or index; None is the default, or the clock alone where there
            is none; "none" is no sound.
        seed: who performs, and what.
        bundle: False sends one message a datagram.
        jitter_ms: every frame is late by 0 to this, evenly spread; their order stays.
        loss: share of datagrams that are not sent, 0..1.
        seconds: how long; None is until `stop`.
        voice_source: "auto", "espeak" or "bundled".
        voice_port: of this computer, where the voice goes too, to be recorded without a sound device; None is
            nowhere.
        on_line: called with each sentence as its voice begins. Runs on the sending thread.
        open_speaker: opens the device.
        make_scenes: makes what is performed. Runs on the script's thread.

    Raises:
        RequestError: a number is out of range.
    """

    def __init__(
        self,
        host: str,
        port: int,
        fps: float = 60.0,
        device: str | int | None = None,
        seed: int = 0,
        bundle: bool = True,
        jitter_ms: float = 0.0,
        loss: float = 0.0,
        *,
        seconds: float | None = None,
        voice_source: str = "auto",
        voice_port: int | None = None,
        on_line: Callable[[str], None] | None = None,
        open_speaker: Callable[[str | int | None], Loudspeaker] = Loudspeaker,
        make_scenes: Callable[[Script, float], Iterator[ScriptedScene]] = scenes,
    ) -> None:
        _check(port, fps, jitter_ms, loss, seconds)
        if voice_port is not None:
            _check_port(voice_port)
        self.host, self.port, self.fps, self.device = host, port, fps, device
        self.seed, self.jitter_ms, self.loss = seed, jitter_ms, loss
        self._options = SendOptions(bundle=bundle)
        self._seconds = math.inf if seconds is None else seconds
        self._voice_source, self._on_line = voice_source, on_line or (lambda _text: None)
        self._open_device, self._make_scenes = open_speaker, make_scenes
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._speaking = ""
        self._clock = _Clock()
        self._line = LineSender(voice_port) if voice_port is not None else None
        # Two scenes ahead: speech takes longer to make than a frame, and one that is not needed is made in
        # vain.
        self._scenes: queue.Queue[ScriptedScene | StudioError] = queue.Queue(maxsize=_AHEAD_SCENES)
        self._dice = np.random.default_rng((seed, 801))
        self._spoken_line = -1
        self._last: tuple[Motion, int] | None = None
        self.error: StudioError | None = None
        self.problem = ""
        self.frames_sent = self.frames_dropped = self.datagrams_sent = self.datagrams_lost = 0

    def start(self) -> None:
        """Begin, on its own threads; a performer that has ended cannot begin again."""
        assert self._thread is None, "a Broadcast performs once"
        self._thread = threading.Thread(target=self._run, name="practice performer", daemon=True)
        self._thread.start()

    def stop(self, timeout: float = 30.0) -> None:
        """End, and wait for it."""
        self._stopping.set()
        self.wait(timeout)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end; True where it came within `timeout` seconds."""
        if self._thread is not None:
            self._thread.join(timeout)
        return not self.alive

    @property
    def alive(self) -> bool:
        """Whether it performs or is getting ready."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def speaking(self) -> str:
        """The sentence being said; "" between sentences."""
        return self._speaking

    @property
    def audible(self) -> bool:
        """Whether a sound device plays the voice."""
        return self._clock.speaker is not None

    @property
    def position(self) -> float:
        """Seconds of the performance gone by (as heard, where it is audible); below 0 before it begins."""
        return self._clock.position()

    @property
    def _unheard(self) -> str:
        """What it means that no sound device plays the voice."""
        heard = say("You can't hear the performer.")
        return heard if self._line else say("The performer goes on without a voice.")

    def _run(self) -> None:
        """Runs on the performer's thread."""
        writer = threading.Thread(target=self._write, name="practice script", daemon=True)
        try:
            # First, since a host that does not exist need not wait for speech.
            target = _resolved(self.host, self.port)
            writer.start()
            first = self._next_scene()
            self._open_speaker()
            with socket.socket(target[0], socket.SOCK_DGRAM) as channel:
                self._perform(first, channel, target[1])
                self._leave(channel, target[1])
        except StudioError as error:
            self.error = error
        finally:
            self._stopping.set()
            self._speaking = ""
            self._clock.close()
            if self._line is not None:
                self._line.close()
            # The writer may wait for room.
            with suppress(queue.Empty):
                self._scenes.get_nowait()
            # A thread left in mid-computation would abort a process that ends.
            if writer.is_alive():
                writer.join()

    def _write(self) -> None:
        """Prepare scenes ahead. Runs on the script's thread."""
        try:
            script = Script(self.seed, voice_source=self._voice_source)
            for scene in self._make_scenes(script, self.fps):
                self._offer(scene)
                if self._stopping.is_set() or scene.line.end >= self._seconds:
                    return
        except StudioError as error:
            self._offer(error)

    def _offer(self, scene: ScriptedScene | StudioError) -> None:
        while not self._stopping.is_set():
            with suppress(queue.Full):
                self._scenes.put(scene, timeout=0.1)
                return

    def _next_scene(self) -> ScriptedScene | None:
        """The next scene, once it is ready; None when asked to stop."""
        while not self._stopping.is_set():
            with suppress(queue.Empty):
                scene = self._scenes.get(timeout=0.1)
                if isinstance(scene, StudioError):
                    raise scene
                return scene
        return None

    def _open_speaker(self) -> None:
        if self.device == NO_SOUND:
            return
        try:
            speaker = self._open_device(self.device)
        except RequestError:
            raise
        except StudioError as error:
            self.problem = together(" ", error.what, self._unheard)
            return
        self._clock.speaker = speaker

    def _perform(self, first: ScriptedScene | None, channel: socket.socket, address: tuple[str, int]) -> None:
        """Send scene after scene; the sound of the next is queued before this one is over."""
        if first is None:
            return
        self._put(first)
        scene, upcoming = first, self._after(first)
        # Only now: the clock must not run while speech is still being made.
        self._clock.begin()
        while not self._stopping.is_set():
            self._send_scene(scene, channel, address)
            if upcoming is None:
                return
            scene, upcoming = upcoming, self._after(upcoming)

    def _after(self, scene: ScriptedScene) -> ScriptedScene | None:
        """The scene after one, its sound queued; None where that one is the last."""
        if scene.line.end >= self._seconds:
            return None
        upcoming = self._next_scene()
        if upcoming is not None:
            self._put(upcoming)
        return upcoming

    def _put(self, scene: ScriptedScene) -> None:
        self._clock.put(scene)
        if self._line is not None:
            self._line.put(scene.samples)

    def _send_scene(self, scene: ScriptedScene, channel: socket.socket, address: tuple[str, int]) -> None:
        motion, due = scene.motion, -math.inf
        # Frames are made ahead; only their sending is in real time.
        for i, t in enumerate(motion.times):
            if t >= self._seconds:
                return
            # The schedule is the frame's own time, so that neither waits nor jitter ever add up.
            due = max(due, float(t) + float(self._dice.uniform(0.0, self.jitter_ms)) / 1000.0)
            if not self._wait_until(due):
                return
            self._tell(scene, float(t))
            if self._clock.position() > due + _LATE_FRAMES / self.fps:
                self.frames_dropped += 1
                continue
            datagrams = encode_frame(
                _pose(motion, i), motion.shape_names, motion.bone_names, float(t), self._options
            )
            self._send(datagrams, channel, address)
            self._last = motion, i
            self.frames_sent += 1

    def _leave(self, channel: socket.socket, address: tuple[str, int]) -> None:
        """Fall silent and go to rest, so that the avatar is not left in mid-gesture with its mouth open."""
        self._speaking = ""
        if self._line is not None:
            self._line.fall_silent(self._clock.position())
        self._clock.hush()
        if self._last is None:
            return
        motion, i = self._last
        last = _pose(motion, i)
        rest = neutral_pose(motion.shape_names, motion.bone_names, last.positions)
        count, began = max(round(_REST_SECONDS * self.fps), 1), time.monotonic()
        for step in range(1, count + 1):
            time.sleep(max(began + step / self.fps - time.monotonic(), 0.0))
            pose, t = between(last, rest, step / count), float(motion.times[i]) + step / self.fps
            datagrams = encode_frame(pose, motion.shape_names, motion.bone_names, t, self._options)
            self._send(datagrams, channel, address)

    def _send(self, datagrams: list[bytes], channel: socket.socket, address: tuple[str, int]) -> None:
        for datagram in datagrams:
            if self.loss and self._dice.random() < self.loss:
                self.datagrams_lost += 1
                continue
            try:
                channel.sendto(datagram, address)
            except OSError as error:
                self.problem = say(
                    "Motion cannot be sent to {host}: {reason}.",
                    host=self.host,
                    reason=error.strerror or error,
                )
                self.datagrams_lost += 1
            else:
                self.datagrams_sent += 1

    def _tell(self, scene: ScriptedScene, t: float) -> None:
        line = scene.line
        sounding = line.voice_start <= t < line.voice_end
        self._speaking = line.text if sounding else ""
        if sounding and line.index > self._spoken_line:
            self._spoken_line = line.index
            self._on_line(line.text)

    def _wait_until(self, t: float) -> bool:
        """Wait for a moment of the performance; False when asked to stop."""
        while not self._stopping.is_set():
            position = self._clock.position()
            if self._line is not None:
                self._line.send_until(position)
            left = t - position
            if left <= 0:
                return True
            if self._clock.lost():
                self.problem = together(" ", say("The sound device stopped."), self._unheard)
            # In short naps, so that a stop is answered soon.
            time.sleep(min(left, _NAP))
        return False


class _Clock:
    """What time it is in the performance: what the loudspeaker plays, else what the wall clock says."""

    def __init__(self) -> None:
        self.speaker: Loudspeaker | None = None
        self._zero: float | None = None
        self._last = -math.inf

    def put(self, scene: ScriptedScene) -> None:
        if self.speaker is not None:
            self.speaker.put(scene.samples)

    def begin(self) -> None:
        if self.speaker is not None:
            self.speaker.start()
        else:
            self._zero = time.monotonic()

    def position(self) -> float:
        speaker = self.speaker
        if speaker is not None:
            heard = speaker.position()
        else:
            heard = time.monotonic() - self._zero if self._zero is not None else -math.inf
        # A clock that is corrected never runs backwards.
        self._last = max(self._last, heard)
        return self._last

    def lost(self) -> bool:
        """Whether the device has just gone; time then goes on by the wall clock from where it was."""
        speaker = self.speaker
        if speaker is None or not speaker.gone:
            return False
        # Its clock ran on by extrapolation while it was silent; that is where the motion stands.
        self._zero = time.monotonic() - max(self.position(), 0.0)
        self.speaker = None
        speaker.close()
        return True

    def hush(self) -> None:
        if self.speaker is not None:
            self.speaker.hush()

    def close(self) -> None:
        speaker, self.speaker = self.speaker, None
        if speaker is not None:
            speaker.close()


def _pose(motion: Motion, i: int) -> Pose:
    return Pose(
        motion.shapes[i],
        motion.positions[i],
        motion.rotations[i],
        motion.root_position[i],
        motion.root_rotation[i],
    )


def _resolved(host: str, port: int) -> tuple[socket.AddressFamily, tuple[str, int]]:
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    except OSError as error:
        what = say("There is no computer called {host}.", host=host)
        raise RequestError(what, "Write its name or number, such as 127.0.0.1.") from error
    return found[0][0], (str(found[0][4][0]), port)


def _check(port: int, fps: float, jitter_ms: float, loss: float, seconds: float | None) -> None:
    _check_port(port)
    if not 1.0 <= fps <= 240.0:
        raise RequestError(
            say("{fps} frames a second cannot be sent.", fps=f"{fps:g}"), "Choose a rate from 1 to 240."
        )
    if not 0.0 <= loss <= 1.0:
        raise RequestError(
            say("A loss of {loss} is not a share.", loss=f"{loss:g}"), "Choose a number from 0 to 1."
        )
    if not 0.0 <= jitter_ms <= 1000.0:
        raise RequestError(
            say("A jitter of {jitter} ms cannot be made.", jitter=f"{jitter_ms:g}"),
            "Choose 0 to 1000 ms.",
        )
    if seconds is not None and not 0.0 < seconds < math.inf:
        raise RequestError(
            say("A performance of {seconds} s cannot be given.", seconds=f"{seconds:g}"),
            "Choose a time above 0.",
        )


def _check_port(port: int) -> None:
    if not 0 < port < 65536:
        raise RequestError(say("{port} is not a port.", port=port), "Choose a number from 1 to 65535.")
