"""The performer's voice on an output device, and which moment of it is in the ear."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, say
from studio.performer.speech import SAMPLE_RATE
from studio.playback.sound_output import StreamClock

SILENT_SECONDS = 1.0
"""Without a callback for this long the device counts as gone (a suspended one never says so)."""
# Seconds; nobody waits for this voice, so it is higher than the player's, and safer on a busy machine.
_LATENCY = 0.08


class Loudspeaker:
    """Plays what is queued, one block after another; underneath it runs silence and no time passes.

    Args:
        device: a PortAudio name or index; the system's default where None.

    Raises:
        RequestError: there is no output device of that name.
        StudioError: PortAudio is missing, or no device can play.
    """

    def __init__(self, device: str | int | None = None) -> None:
        self._queue: deque[NDArray[np.float32]] = deque()
        # Samples of the first block already played.
        self._used = 0
        # Samples of the performance given to the device.
        self._played = 0
        self._last_callback = time.monotonic()
        self._hushed = False
        self._gain = 1.0
        self._stream, self.sample_rate = self._open(device)
        self.name = str(device) if device is not None else "default"
        self._clock = StreamClock(self.sample_rate)

    def start(self) -> None:
        """Begin to play."""
        import sounddevice

        try:
            self._stream.start()
        except sounddevice.PortAudioError as error:
            raise _cannot_play() from error
        self._last_callback = time.monotonic()

    def put(self, samples: NDArray[np.float32]) -> None:
        """Queue mono samples (N,) at SAMPLE_RATE."""
        if self.sample_rate != SAMPLE_RATE:
            import soxr

            samples = np.asarray(soxr.resample(samples, SAMPLE_RATE, self.sample_rate), dtype=np.float32)
        self._queue.append(samples)

    @property
    def gone(self) -> bool:
        """Whether the device stopped asking for sound."""
        return time.monotonic() - self._last_callback > SILENT_SECONDS

    def position(self) -> float:
        """Seconds of the performance heard by now; -inf before its first sample."""
        return self._clock.frame_at(time.monotonic()) / self.sample_rate

    def hush(self) -> None:
        """Fade to silence; what is queued runs on unheard."""
        self._hushed = True

    def close(self) -> None:
        """Fall silent and give the device back."""
        self._queue.clear()
        self._stream.close(ignore_errors=True)

    def callback(self, out: NDArray[np.float32], frames: int, info: Any, _status: object) -> None:
        """Fill one block. Runs on the audio thread."""
        now = time.monotonic()
        self._last_callback = now
        delay = info.outputBufferDacTime - info.currentTime
        # Some drivers do not say.
        if not 0.0 < delay < 5.0:
            delay = float(self._stream.latency)
        done = 0
        if self._queue:
            # Only while something plays: in silence no time of the performance passes.
            self._clock.report(self._played, now + delay)
        while done < frames and self._queue:
            block = self._queue[0]
            count = min(frames - done, len(block) - self._used)
            out[done : done + count] = block[self._used : self._used + count, None]
            done += count
            self._used += count
            if self._used == len(block):
                self._queue.popleft()
                self._used = 0
        self._played += done
        if done < frames:
            out[done:] = 0.0
        # Over one block: a cut would click.
        if self._hushed:
            out *= np.linspace(self._gain, 0.0, frames, dtype=np.float32)[:, None]
            self._gain = 0.0

    def _open(self, device: str | int | None) -> tuple[Any, int]:
        try:
            import sounddevice
        except OSError as error:
            what = "Sound cannot be played: the PortAudio library is missing."
            remedy = "Install it (on Debian: apt install libportaudio2), or choose no sound."
            raise StudioError(what, remedy) from error
        try:
            known = sounddevice.query_devices(device, "output")
        except (sounddevice.PortAudioError, ValueError) as error:
            if device is None:
                raise _cannot_play() from error
            what = say("There is no output device called {device}.", device=device)
            raise RequestError(what, "Choose a device that is plugged in, or none.") from error
        # The performance's own rate first: then nothing is resampled.
        for rate in (SAMPLE_RATE, int(known["default_samplerate"])):
            try:
                stream = sounddevice.OutputStream(
                    samplerate=rate,
                    device=device,
                    channels=min(2, int(known["max_output_channels"])),
                    dtype="float32",
                    latency=_LATENCY,
                    callback=self.callback,
                )
            except sounddevice.PortAudioError:
                continue
            return stream, rate
        raise _cannot_play()


def _cannot_play() -> StudioError:
    return StudioError("No sound device can play.", "Plug in headphones or speakers, or choose no sound.")
