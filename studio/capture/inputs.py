"""The recorder's motion and sound inputs, polled by its thread: rows, blocks, statistics, clock fit."""

from __future__ import annotations

import contextlib
import logging
import math
import os
import pickle
import socket
import subprocess
import threading
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from studio import clock, launch
from studio.capture import listener
from studio.capture.device_names import line_port
from studio.capture.health import is_quiet
from studio.capture.microphone import AudioInput, SoundBlock, input_devices
from studio.capture.practice_voice import PracticeVoice
from studio.capture.receiver import Receiver, ReceiverStats
from studio.sound.level import LevelMeter
from studio.vmc.rows import RowBlock
from studio.vmc.udp import bind_wide

_REFIT_S = 2.0
# Seconds without a block after which a microphone that said nothing of leaving counts as gone.
_LOST_S = 5.0
_POINTS = 2000
# How long the listener may take to end; on a busy machine it may just be starting.
_PATIENCE_S = 5.0
# Reports of the listener kept for a recorder that is held up: some minutes.
_KEPT_TURNS = 60_000
_log = logging.getLogger(__name__)


class MotionInput:
    """Motion ports, listened to by a process of their own.

    Should that process not start, or end by itself, the ports are listened to here.

    Args:
        ports: (port, host) of each; 0 asks for any free one.

    Attributes:
        ports: those bound. host: of the first.
        stats: counters and names, a few hundredths of a second old.
        latest: the last block of rows, None before any.
        dismissed: when the sender was last ended on purpose. awaited: whether one of our own gets ready.

    Raises:
        StudioError: a port cannot be opened.
    """

    def __init__(self, ports: Sequence[tuple[int, str]]) -> None:
        self.opened = clock.now()
        self.stats = ReceiverStats()
        self.latest: RowBlock | None = None
        self.dismissed, self.awaited = -math.inf, False
        self._sockets: list[socket.socket] = []
        try:
            for port, host in ports:
                # Bound here and not in the listener: a port that is taken is an error that `open_motion`
                # raises at once.
                self._sockets += bind_wide(port, host)
        except Exception:
            self._close_sockets()
            raise
        self.ports = tuple(dict.fromkeys(int(one.getsockname()[1]) for one in self._sockets))
        self.host = ports[0][1]
        # A deque's append and popleft are atomic: the reading thread and the recorder's need no lock.
        self._reports: deque[listener.Report] = deque(maxlen=_KEPT_TURNS)
        self._pictures: list[tuple[float, ...]] = []
        self._local_receiver: Receiver | None = None
        self._child: subprocess.Popen[bytes] | None = None
        # Set where the listener could not start or ended by itself; `poll` then listens in this process.
        self._listener_ended = threading.Event()
        # At last, since the reading thread uses all of it.
        self._start()

    @property
    def port(self) -> int:
        """The first one."""
        return self.ports[0]

    @property
    def listener_pid(self) -> int | None:
        """The process that listens; None where this one does."""
        return self._child.pid if self._child is not None else None

    def poll(self, now: float) -> list[RowBlock]:
        """The rows that have arrived since the last call, in order.

        Args:
            now: the present, seconds of `clock.now()`.
        """
        # Duplicates of the bound sockets: the ports were never free in between, and no packet was refused.
        if self._listener_ended.is_set() and self._local_receiver is None and self._sockets:
            self._local_receiver = Receiver([one.dup() for one in self._sockets])
        sent: list[listener.SentBlock] = []
        with contextlib.suppress(IndexError):
            while True:
                more, pictures, self.stats = self._reports.popleft()
                sent += more
                self._pictures += pictures
        blocks = listener.received(sent, self.latest.names if self.latest is not None else None)
        if self._local_receiver is not None:
            blocks += self._local_receiver.poll(now)
            self._pictures += self._local_receiver.poll_pictures()
            self.stats = self._local_receiver.stats(now)
        if blocks:
            self.latest = blocks[-1]
        return blocks

    def poll_pictures(self) -> list[tuple[float, ...]]:
        """What cameras have said of their pictures up to the last `poll`; rows of motion.filmed."""
        pictures, self._pictures = self._pictures, []
        return pictures

    def received_until(self, t: float) -> bool:
        """Whether everything that arrived before a moment has been taken in."""
        return self.stats.until >= t

    def close(self) -> None:
        """End the listener and close the ports."""
        # Taken out first: the reading thread then knows that the listener was asked to end.
        child, self._child = self._child, None
        if self._local_receiver is not None:
            self._local_receiver.close()
        if child is not None:
            assert child.stdin is not None
            with contextlib.suppress(OSError):
                # The end of its stdin is what asks the listener to end.
                child.stdin.close()
            try:
                child.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
            self._reader.join(2.0)
        self._close_sockets()

    def _start(self) -> None:
        handed: dict[str, Any] = {}
        if os.name == "posix":
            handed["pass_fds"] = [one.fileno() for one in self._sockets]
        else:
            # Without this, Windows opens a console window for the listener.
            handed["creationflags"] = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        try:
            child = subprocess.Popen(
                launch.studio(listener.WORD),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=launch.environment(),
                # Unbuffered: what is written to the pipe leaves at once.
                bufsize=0,
                **handed,
            )
            assert child.stdin is not None
            listener.write(child.stdin, [_handed(one, child.pid) for one in self._sockets])  # type: ignore[arg-type]
        except OSError as error:
            _log.warning("motion is listened to in this process: %s", error)
            self._listener_ended.set()
            return
        self._child = child
        self._reader = threading.Thread(target=self._read, args=(child,), name="motion input", daemon=True)
        self._reader.start()

    def _read(self, child: subprocess.Popen[bytes]) -> None:
        """Runs on the motion thread: a few hundred times a second, whatever the packets are."""
        assert child.stdout is not None
        # Buffered for reading, on a duplicate: closing it must not close the descriptor that Popen owns.
        pipe = os.fdopen(os.dup(child.stdout.fileno()), "rb", buffering=1 << 18)
        with pipe, contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                self._reports.append(pickle.load(pipe))
        child.stdout.close()
        # None where `close` asked for the end.
        if self._child is not None:
            _log.warning("the listener ended by itself with %s", child.poll())
        self._listener_ended.set()

    def _close_sockets(self) -> None:
        for one in self._sockets:
            one.close()
        self._sockets.clear()


def _handed(opened: socket.socket, to: int) -> Any:
    """A socket in the form another process can open."""
    if os.name == "posix":
        return opened.fileno()
    return opened.share(to)  # type: ignore[attr-defined,unused-ignore]


class SoundInput:
    """A microphone: blocks, level, and how its clock runs.

    Args:
        device: a name, a number, or None for the default one; "performer" is the practice performer's voice.
        form: sample rate and channels it has to have; 0 takes its own.

    Raises:
        StudioError: it cannot be opened.
    """

    def __init__(self, device: str | int | None, form: tuple[int, int] = (0, 0)) -> None:
        self._device = device
        port = line_port(device)
        self.audio = AudioInput(device, *form) if port is None else PracticeVoice(port)
        self.audio.start()
        assert self.audio.device is not None
        self.name = self.audio.device.name
        self.meter = LevelMeter(self.audio.sample_rate)
        self.seconds = 0.0
        self.last_loud = clock.now()
        self.fit: clock.ClockFit | None = None
        self._points: deque[tuple[float, float]] = deque(maxlen=_POINTS)
        self._delays: deque[float] = deque(maxlen=200)
        self._fitted_at = clock.now()

    def poll(self, now: float) -> list[SoundBlock]:
        """The blocks the device has handed over since the last call; level and clock follow them.

        Args:
            now: the present, seconds of `clock.now()`.
        """
        blocks = self.audio.drain()
        for block in blocks:
            self.meter.feed(block.samples)
            # One pair a block, both at its first sample: the line through them is the device's clock.
            self._points.append((self.seconds, block.captured))
            self._delays.append(block.arrived - block.captured)
            self.seconds += len(block.samples) / self.audio.sample_rate
        if not is_quiet(self.meter.rms_dbfs):
            self.last_loud = now
        # Seldom is enough: the two clocks part by some millionths.
        if now - self._fitted_at > _REFIT_S and self._points:
            self._fitted_at = now
            points = np.array(self._points)
            self.fit = clock.fit(points[:, 0], points[:, 1])
        return blocks

    @property
    def lost(self) -> bool:
        """Whether it vanished, or has been silent in a way that no microphone is."""
        return self.audio.ended or self.audio.silent_for > _LOST_S

    def reopened(self, refresh: bool) -> SoundInput:
        """This microphone opened again, with its sample rate and channels; the old stream is abandoned.

        Args:
            refresh: look for what was plugged in first; other streams of this process would be cut off.

        Raises:
            StudioError: it is not there.
        """
        # Another rate or number of channels could not be appended to the take's sound file.
        form = self.audio.sample_rate, self.audio.channels
        self.audio.abandon()
        if refresh:
            input_devices(refresh=True)
        found = SoundInput(self._device, form)
        # The display goes on counting where it was.
        found.seconds = self.seconds
        return found

    @property
    def delay_ms(self) -> float | None:
        """How much later sound is handed over than it was captured."""
        return float(np.median(self._delays)) * 1e3 if self._delays else None

    def close(self) -> None:
        """Stop and close the device."""
        self.audio.stop()
