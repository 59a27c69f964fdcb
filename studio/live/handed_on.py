"""The voice handed on as late as the avatar is, so that a stream's sound and lips agree.

To headphones, or to a virtual cable that the streaming program takes for its microphone.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from studio.capture import clock
from studio.capture.audio import find_output, library, opening
from studio.capture.reopen import SoundWatch
from studio.errors import StudioError
from studio.live.delay_line import DelayLine, Floats
from studio.live.sources import Heard

_LATENCY_S = 0.05
_SILENT_S, _AGAIN_S = 1.0, 1.0


class HandedOn:
    """A sound output that gives the voice, late. One that went away is opened again.

    Args:
        device: an output by name; "" for the system's own.
        late: seconds the avatar is behind the voice now.
    """

    def __init__(self, device: str, late: Callable[[], float]) -> None:
        self.device, self._late = device, late
        self._stream: Any = None
        self._line: DelayLine | None = None
        self._called = self._fed = 0.0
        self._gone = self._stopped = False
        self._said: deque[StudioError] = deque()
        self._watch: SoundWatch | None = None

    @property
    def gone(self) -> bool:
        """Whether it takes no sound, for now or for good."""
        return self._gone or self._stopped

    @property
    def name(self) -> str:
        """What people call the output."""
        return self.device or "The sound output"

    def start(self) -> None:
        """Open the output.

        Raises:
            StudioError: there is none of that name, or it cannot be opened.
        """
        with opening:
            self._open()
        self._watch = SoundWatch(lambda: self._gone and self._is_fed, self._reopen, _AGAIN_S)

    def feed(self, heard: Heard, muted: bool) -> None:
        """A block of the microphone; silence while it is muted."""
        self._fed = clock.now()
        line = self._line
        if line is not None:
            line.put(heard._replace(samples=np.zeros_like(heard.samples)) if muted else heard)
        if not self._gone and self._fed - self._called > _SILENT_S:
            self._gone = True
            what = f"{self.name} takes no sound any more."
            remedy = "Plug it in again; if your voice is not handed on by itself then, choose it again."
            self._said.append(StudioError(what, remedy))

    def problems(self) -> list[StudioError]:
        """What went wrong or right again since the last call, as sentences."""
        said = list(self._said)
        self._said.clear()
        return said

    def rest(self) -> None:
        """Close it until sound comes again: devices are about to be looked for anew."""
        with opening:
            self._gone = True
            self._close()

    def stop(self) -> None:
        """Silence; safe to call twice."""
        self._stopped = True
        if self._watch is not None:
            self._watch.stop()
        with opening:  # it may just be opened again
            self._close()

    @property
    def _is_fed(self) -> bool:
        return clock.now() - self._fed < _SILENT_S

    def _open(self) -> None:
        sd, index = library(), find_output(self.device)
        try:
            rate = round(sd.query_devices(index)["default_samplerate"])
            self._line = DelayLine(rate)
            self._stream = sd.OutputStream(
                samplerate=rate, device=index, channels=2, dtype="float32", latency=_LATENCY_S,
                callback=self._give,
            )  # fmt: skip
            self._called = clock.now()
            self._stream.start()
        except (sd.PortAudioError, ValueError) as error:
            self._close()
            what = f"{self.name} cannot be opened to hand your voice on."
            raise StudioError(what, "Choose another output for it, or none.") from error

    def _reopen(self, _may_refresh: bool) -> None:
        """Runs on the watch's thread."""
        with opening:
            if self._stopped:
                return
            self._close()
            self._open()
            self._gone = False
        self._said.append(StudioError(f"{self.name} takes your voice again.", "Nothing to do."))

    def _close(self) -> None:
        stream, self._stream, self._line = self._stream, None, None
        if stream is not None:
            with contextlib.suppress(library().PortAudioError):
                stream.close()

    def _give(self, out: Floats, frames: int, info: Any, _status: object) -> None:
        """Runs on the audio thread."""
        now = self._called = clock.now()
        line = self._line
        ahead = info.outputBufferDacTime - info.currentTime
        if info.outputBufferDacTime == 0.0 or not -1.0 < ahead < 5.0:  # some drivers do not say
            ahead = _LATENCY_S
        out[:] = 0.0 if line is None else line.take(frames, now + ahead - self._late())[:, None]
