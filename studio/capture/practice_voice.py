"""The practice performer as a microphone: its voice over a voice line, silence while it says nothing."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress

import numpy as np

from studio import clock
from studio.capture.device_names import PERFORMER_TITLE, performer_device
from studio.capture.microphone import AudioDevice, AudioInput
from studio.errors import StudioError, say
from studio.sound.voice_line import BLOCK_SAMPLES, LINE_RATE, MOST_BYTES, LineBlock, decode_block

SILENT_AFTER = 0.5
"""Seconds without a block after which the line is silent; a sender on a busy machine is late by less."""
# Another sender is listened to when the one before has said nothing for this long.
_LEFT_S = 1.0
# A line this far behind the present was asleep with the computer: that time is a gap and not silence.
_SLEPT_S = 5.0
_LOOK_S = 0.02
_ROOM_BYTES = 4 * 1024 * 1024


class PracticeVoice(AudioInput):
    """An open voice line, used like an open microphone.

    A line gives sound all the time: silence until somebody speaks and after they left, so that a take's sound
    runs on as a microphone's does.

    Args:
        port: of this computer.

    Attributes:
        port: the same.
    """

    def __init__(self, port: int) -> None:
        super().__init__(performer_device(port), LINE_RATE, 1)
        self.port = port
        self._socket: socket.socket | None = None
        self._thread: threading.Thread | None = None
        self._left = threading.Event()
        # Who is listened to, and the sample that comes next; None while the line is silent.
        self._sender: tuple[str, int] | None = None
        self._next: int | None = None
        # Whether it was heard before, and whether it came too late since: the line was silent meanwhile.
        self._spoke = self._late = False
        # Up to when sound was given, and when the last of a sender's came.
        self._end = self._spoken_at = 0.0

    def start(self) -> None:
        """Listen.

        Raises:
            StudioError: the port is taken or may not be opened.
        """
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _ROOM_BYTES)
            # This computer alone: whoever can send here is recorded.
            opened.bind(("127.0.0.1", self.port))
        except (OSError, OverflowError) as error:
            opened.close()
            raise StudioError(
                say("The practice performer's voice cannot be received on port {port}.", port=self.port),
                "Close the other program that uses it, or choose another port for the voice.",
                code="device_unavailable",
                in_window="Stop the practice performer and start it again.",
            ) from error
        opened.settimeout(_LOOK_S)
        self.device = AudioDevice(PERFORMER_TITLE, -1, 1, LINE_RATE, default=False)
        self._end = self.last_block_at = clock.now()
        self._socket = opened
        self._thread = threading.Thread(target=self._run, args=(opened,), name="practice voice", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Close the line; safe to call twice."""
        self._left.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(2.0)
        listening, self._socket = self._socket, None
        if listening is not None:
            listening.close()

    def _run(self, listening: socket.socket) -> None:
        """Runs on the line's thread."""
        while not self._left.is_set():
            data, sender = b"", None
            # Windows reports a vanished sender as an error here; the line lives on.
            with suppress(OSError):
                data, sender = listening.recvfrom(MOST_BYTES)
            block = decode_block(data)
            now = clock.now()
            # What is heard at no moment of now would take the line there, and nobody heard any more.
            near = block is not None and abs(block.captured - now) < _SLEPT_S
            if block is not None and near and self._is_heard(sender, now):
                self._speak(block, now)
            elif now - self._end > SILENT_AFTER:
                self._next = None
                self._be_silent(now - SILENT_AFTER / 2, now)

    def _is_heard(self, sender: tuple[str, int] | None, now: float) -> bool:
        """Whether this sender has the line: two at once would be one broken voice."""
        if sender != self._sender:
            if now - self._spoken_at < _LEFT_S:
                return False
            self._sender, self._next = sender, None
            self._spoke = self._late = False
        self._spoken_at = now
        return True

    def _speak(self, block: LineBlock, now: float) -> None:
        samples, captured, lost = block.samples, block.captured, False
        if self._next is None:
            # It begins to speak: silence up to that moment, and what would lie before the end is left out.
            self._be_silent(captured, now)
            early = round((self._end - captured) * LINE_RATE)
            self._late = self._late or (early > 0 and self._spoke)
            if early >= len(samples):
                return
            lost, self._late = self._late, False
            early = max(early, 0)
            samples, captured = samples[early:], captured + early / LINE_RATE
        else:
            lost = block.first != self._next
        self._next, self._spoke = block.first + len(block.samples), True
        self._end = captured + len(samples) / LINE_RATE
        self._push(captured, samples[:, None], lost, now)

    def _be_silent(self, until: float, now: float) -> None:
        """Give silence up to a moment, in whole blocks but for the last one."""
        if until - self._end > _SLEPT_S:
            self._end = until
        missing = round((until - self._end) * LINE_RATE)
        while missing > 0:
            count = min(missing, BLOCK_SAMPLES)
            self._push(self._end, np.zeros((count, 1), dtype=np.float32), False, now)
            self._end += count / LINE_RATE
            missing -= count
