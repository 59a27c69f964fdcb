"""The two inputs of a recorder, each with all that is known about it. Driven by the recorder's thread."""

from __future__ import annotations

import contextlib
import logging
import os
import pickle
import socket
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from studio.capture import clock, listener
from studio.capture.audio import AudioInput, Block, input_devices
from studio.capture.health import is_quiet
from studio.capture.meter import LevelMeter
from studio.capture.port import bind_wide
from studio.capture.receiver import Batch, Heard, Receiver, unpacked
from studio.capture.rows import Names, Row

_REFIT_S = 2.0
_LOST_S = 5.0
"""Seconds without a block after which a microphone that said nothing of leaving counts as gone."""
_POINTS = 2000
_PATIENCE_S = 5.0
"""How long the listener may take to end; on a busy machine it may just be starting."""
_KEPT_TURNS = 60_000
"""Minutes of what the listener told, for a recorder that is held up."""
_log = logging.getLogger(__name__)


class MotionInput:
    """Motion ports, listened to by a process of their own.

    Should that process not start, or end by itself, the ports are listened to here.

    Args:
        ports: (port, host) of each; 0 asks for any free one.

    Attributes:
        ports: those bound. host: of the first.
        heard: counters and names, a few hundredths of a second old.
        row: the latest, None before any.

    Raises:
        StudioError: a port cannot be opened.
    """

    def __init__(self, ports: Sequence[tuple[int, str]]) -> None:
        self.opened = clock.now()
        self.heard = Heard()
        self.row: Row | None = None
        self._sockets: list[socket.socket] = []
        try:
            for port, host in ports:
                self._sockets += bind_wide(port, host)
        except Exception:
            self._close_sockets()
            raise
        self.ports = tuple(dict.fromkeys(int(one.getsockname()[1]) for one in self._sockets))
        self.host = ports[0][1]
        self._names: Names | None = None
        self._told: deque[tuple[list[Batch], Heard]] = deque(maxlen=_KEPT_TURNS)
        self._here: Receiver | None = None
        self._child: subprocess.Popen[bytes] | None = None
        self._gone = threading.Event()
        self._start()

    @property
    def port(self) -> int:
        """The first one."""
        return self.ports[0]

    def take_in(self, now: float) -> list[Row]:
        """Whatever came, as rows."""
        if self._gone.is_set() and self._here is None and self._sockets:
            self._here = Receiver([one.dup() for one in self._sockets])
        rows: list[Row] = []
        with contextlib.suppress(IndexError):
            while True:
                said, self.heard = self._told.popleft()
                for batch in said:
                    more, self._names = unpacked(batch, self._names)
                    rows += more
        if self._here is not None:
            rows += self._here.take_in(now)
            self.heard = self._here.heard(now)
        if rows:
            self.row = rows[-1]
        return rows

    def heard_until(self, t: float) -> bool:
        """Whether everything that arrived before a moment has been taken in."""
        return self.heard.until >= t

    def close(self) -> None:
        """Let the ports go."""
        child, self._child = self._child, None
        if self._here is not None:
            self._here.close()
        if child is not None:
            assert child.stdin is not None
            with contextlib.suppress(OSError):
                child.stdin.close()
            try:
                child.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
            self._reader.join(2.0)
        self._close_sockets()

    def _start(self) -> None:
        words = [sys.executable, *(() if getattr(sys, "frozen", False) else ("-m", "studio")), listener.WORD]
        handed: dict[str, Any] = {}
        if os.name == "posix":
            handed["pass_fds"] = [one.fileno() for one in self._sockets]
        else:
            handed["creationflags"] = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        # A child that finds `studio` however this program was started.
        root = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join(filter(None, (root, os.environ.get("PYTHONPATH", ""))))
        try:
            child = subprocess.Popen(
                words,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": path},
                bufsize=0,
                **handed,
            )
            assert child.stdin is not None
            listener.write(child.stdin, [_handed(one, child.pid) for one in self._sockets])  # type: ignore[arg-type]
        except OSError as error:
            _log.warning("motion is listened to in this process: %s", error)
            self._gone.set()
            return
        self._child = child
        self._reader = threading.Thread(target=self._read, args=(child,), name="motion input", daemon=True)
        self._reader.start()

    def _read(self, child: subprocess.Popen[bytes]) -> None:
        """Runs on the motion thread: a few hundred times a second, whatever the packets are."""
        assert child.stdout is not None
        told = os.fdopen(os.dup(child.stdout.fileno()), "rb", buffering=1 << 18)
        with told, contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                self._told.append(pickle.load(told))
        child.stdout.close()
        if self._child is not None:
            _log.warning("the listener ended by itself with %s", child.poll())
        self._gone.set()

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
        device: a name, a number, or None for the default one.
        form: sample rate and channels it has to have; 0 takes its own.

    Raises:
        StudioError: it cannot be opened.
    """

    def __init__(self, device: str | int | None, form: tuple[int, int] = (0, 0)) -> None:
        self._wanted = device
        self.audio = AudioInput(device, *form)
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

    def take_in(self, now: float) -> list[Block]:
        """Whatever was heard."""
        blocks = self.audio.drain()
        for block in blocks:
            self.meter.feed(block.samples)
            self._points.append((self.seconds, block.captured))
            self._delays.append(block.arrived - block.captured)
            self.seconds += len(block.samples) / self.audio.sample_rate
        if not is_quiet(self.meter.rms_dbfs):
            self.last_loud = now
        if now - self._fitted_at > _REFIT_S and self._points:
            self._fitted_at = now
            points = np.array(self._points)
            self.fit = clock.fit(points[:, 0], points[:, 1])
        return blocks

    @property
    def lost(self) -> bool:
        """Whether it vanished, or has been silent in a way that no microphone is."""
        return self.audio.ended or self.audio.silent_for > _LOST_S

    def again(self, refresh: bool) -> SoundInput:
        """The same microphone, opened anew in the form it had; this one is let go.

        Args:
            refresh: look for what was plugged in first; other streams of this process would be cut off.

        Raises:
            StudioError: it is not there.
        """
        form = self.audio.sample_rate, self.audio.channels
        self.audio.let_go()
        if refresh:
            input_devices(refresh=True)
        found = SoundInput(self._wanted, form)
        found.seconds = self.seconds
        return found

    @property
    def delay_ms(self) -> float | None:
        """How much later sound is handed over than it was captured."""
        return float(np.median(self._delays)) * 1e3 if self._delays else None

    def close(self) -> None:
        """Let the device go."""
        self.audio.stop()
