"""Sound output device, the file position that is audible right now, and what people notice of its sync.

Source: ITU-R BT.1359-1, Relative timing of sound and vision for broadcasting: viewers detect sound that is
45 ms early or 125 ms late, and mind 90 ms early or 185 ms late.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from studio.errors import StudioError
from studio.sound.resample import Stretch
from studio.sound.sound_file import Samples, SoundSource

EARLY_MS, LATE_MS = 45.0, 125.0
MINDED_EARLY_MS, MINDED_LATE_MS = 90.0, 185.0
# In steps that people can set by hand, finer than anybody notices.
_STEP_MS = 5


class SyncPerception(StrEnum):
    """What viewers make of motion that lags its sound."""

    UNSEEN = "unseen"
    SEEN = "seen"
    MINDED = "minded"


def sync_perception(motion_late_ms: float) -> SyncPerception:
    """What viewers make of motion so many milliseconds after its sound; negative where it is before it."""
    # Motion that is late makes the sound early.
    early, late = motion_late_ms, -motion_late_ms  # of the sound
    if early >= MINDED_EARLY_MS or late >= MINDED_LATE_MS:
        return SyncPerception.MINDED
    return SyncPerception.SEEN if early >= EARLY_MS or late >= LATE_MS else SyncPerception.UNSEEN


def sound_delay_ms(motion_late_ms: float) -> int:
    """How much to delay the sound so that it meets the lips; 0 where nobody notices."""
    if sync_perception(motion_late_ms) is SyncPerception.UNSEEN:
        return 0
    return max(_STEP_MS * round(motion_late_ms / _STEP_MS), 0)


SLOW_HZ, FAST_HZ, FAST_SECONDS = 0.1, 2.0, 1.0
LOST_LOCK = 0.15
"""Seconds of disagreement after which the estimate starts anew (a device was suspended or moved)."""


class StreamClock:
    """When each frame of an output stream reaches the ear, on the monotonic clock.

    A device reports its latency coarsely and unevenly; this smooths the reports by a delay-locked loop.
    Source: Adriaensen 2005, Using a DLL to filter time.

    Args:
        sample_rate: frames per second, as asked of the device.
    """

    def __init__(self, sample_rate: float) -> None:
        self._period = 1.0 / sample_rate
        self._frame = 0
        self._time = math.nan
        self._began = 0
        # One tuple, replaced whole: readers on other threads never see halves of two updates.
        self._line: tuple[int, float, float] | None = None

    def report(self, frame: int, time: float) -> None:
        """The device said that a frame will be heard at a time. Runs on the audio thread."""
        step = frame - self._frame
        expected = self._time + step * self._period
        error = time - expected
        # Written as `not <`, so that it is true of the first report too, where expected is NaN.
        if not abs(error) < LOST_LOCK:
            self._frame, self._time, self._began = frame, time, frame
        else:
            young = (frame - self._began) * self._period < FAST_SECONDS
            # Fast in the first second, to find the line; slow afterwards, so that coarse reports do not move
            # it.
            omega = min(2 * math.pi * (FAST_HZ if young else SLOW_HZ) * step * self._period, 0.5)
            self._time = expected + math.sqrt(2) * omega * error
            self._frame = frame
        self._line = (self._frame, self._time, self._period)

    def frame_at(self, time: float) -> float:
        """The frame that is heard at a time; -inf before the first report."""
        if self._line is None:
            return -math.inf
        frame, when, period = self._line
        return frame + (time - when) / period


@dataclass(frozen=True)
class Span:
    """A run of output frames and the part of the file they play.

    Args:
        first: output frame where it begins.
        count: output frames.
        position: seconds in the file at its first frame.
        speed: file seconds per output frame; 0 for silence while waiting.
        generation: counts seeks; older spans no longer matter.
    """

    first: int
    count: int
    position: float
    speed: float
    generation: int


class PlayedSpans:
    """What was given to the device lately, to look up the file position of an output frame."""

    def __init__(self) -> None:
        # Far more than a device holds at once; older ones were heard long ago.
        self._spans: deque[Span] = deque(maxlen=1024)

    def add(self, span: Span) -> None:
        """Runs on the audio thread."""
        self._spans.append(span)

    def position(self, frame: float, generation: int) -> float | None:
        """File position heard at an output frame; None before anything of this generation is heard."""
        # Copied: the audio thread appends while this reads, and a deque that changes cannot be walked.
        for span in reversed(tuple(self._spans)):
            if span.generation != generation:
                return None
            if span.first <= frame:
                return span.position + min(frame - span.first, span.count) * span.speed
        return None


CHUNK_SECONDS = 0.05
AHEAD_CHUNKS = 12
FADE_SECONDS = 0.004
SILENT_DEVICE = 1.0
"""Seconds without a callback after which a device counts as gone (a suspended one never says so)."""


@dataclass(frozen=True)
class Chunk:
    """Frames ready to play, and the file position and speed (file seconds per frame) they stand for."""

    samples: Samples
    position: float
    speed: float


class Feed:
    """What plays from one start or seek on: a queue, filled ahead by the feeder, emptied by the callback.

    Args:
        generation: counts starts and seeks.
        position: seconds in the file where it begins.
        loop: (start, end) seconds, or None.
        speed: 1 as it was recorded, less is slower.
    """

    def __init__(
        self, generation: int, position: float, loop: tuple[float, float] | None, speed: float = 1.0
    ) -> None:
        self.generation = generation
        self.position = position
        self.speed = speed
        self.stretch: Stretch | None = None
        # Seconds in the file of the next stretched sample.
        self.stretched = position
        # A start behind the loop's end plays through to the end instead.
        self.loop = loop if loop is not None and position < loop[1] else None
        self.queue: deque[Chunk] = deque()
        # Frames of the first chunk already played.
        self.used = 0


class SoundOutput:
    """Plays a sound file through the default (or a named) device.

    Args:
        source: the sound; this closes it, also where no device can play it.
        duration: seconds to play; silence after the sound where it is shorter.
        device: a PortAudio name or index; the system's default where None.

    Raises:
        StudioError: no device can play it.
    """

    def __init__(self, source: SoundSource, duration: float, device: str | int | None = None) -> None:
        self._source, self._duration = source, duration
        self._feed: Feed | None = None
        self._generation = 0
        self._spans = PlayedSpans()
        self._frame = 0
        self._tail = np.zeros(2, dtype=np.float32)
        self._last_callback = time.monotonic()
        self._closing = threading.Event()
        self._wake = threading.Event()
        self._finished = False
        try:
            self._stream, self.sample_rate = _open_stream(device, source.sample_rate, self)
        except StudioError:
            source.close()
            raise
        self._clock = StreamClock(self.sample_rate)
        fade = max(int(FADE_SECONDS * self.sample_rate), 1)
        self._ramp = np.linspace(1.0, 0.0, fade, dtype=np.float32)[:, None]
        self._feeder = threading.Thread(target=self._run, name="sound feeder", daemon=True)
        self._feeder.start()
        self._start_stream()

    @property
    def gone(self) -> bool:
        """Whether the device stopped asking for sound."""
        return self._finished or time.monotonic() - self._last_callback > SILENT_DEVICE

    def start(self, position: float, loop: tuple[float, float] | None = None, speed: float = 1.0) -> None:
        """Play from a position on; also the way to seek, and to change the speed, while playing."""
        # New spans are told from those of before the seek, which are still on their way to the ear.
        self._generation += 1
        self._feed = Feed(self._generation, position, loop, speed)
        self._wake.set()

    def stop(self) -> None:
        """Fall silent (within a few milliseconds and what the device still holds)."""
        self._feed = None

    def heard(self, t: float | None = None) -> float | None:
        """The file position in the ear at a monotonic time (now where None); None before the first sample."""
        t = time.monotonic() if t is None else t
        return self._spans.position(self._clock.frame_at(t), self._generation)

    def close(self) -> None:
        """Close the device and the sound."""
        self._feed = None
        self._closing.set()
        self._wake.set()
        # Before the stream closes: the feeder reads the file, which is closed last.
        self._feeder.join(timeout=10.0)
        self._stream.close(ignore_errors=True)
        self._source.close()

    def _start_stream(self) -> None:
        import sounddevice

        try:
            self._stream.start()
        except sounddevice.PortAudioError as error:
            self.close()
            raise _no_device() from error

    def callback(self, out: Samples, frames: int, info: Any, _status: object) -> None:
        """Fill one block. Runs on the audio thread."""
        now = time.monotonic()
        self._last_callback = now
        delay = info.outputBufferDacTime - info.currentTime
        # Some drivers give no times; then the stream's own latency must do.
        if info.outputBufferDacTime == 0.0 or not -1.0 < delay < 5.0:
            delay = float(self._stream.latency)
        # The moment at which the device will play the block: it asks for it a buffer's length before.
        self._clock.report(self._frame, now + delay)
        feed = self._feed
        done = self._play(feed, out, frames) if feed is not None else 0
        if done < frames:
            self._fall_silent(out[done:])
        self._frame += frames

    def finished(self) -> None:
        """The stream ended, asked or not. Runs on the audio thread."""
        self._finished = True

    def _play(self, feed: Feed, out: Samples, frames: int) -> int:
        done = 0
        while done < frames and feed.queue:
            chunk = feed.queue[0]
            # Chunks and blocks have nothing to do with each other; either may be the shorter.
            count = min(frames - done, len(chunk.samples) - feed.used)
            out[done : done + count] = chunk.samples[feed.used : feed.used + count]
            # Each part of a block is noted on its own: a loop or a seek may fall into its middle.
            position = chunk.position + feed.used * chunk.speed
            self._spans.add(Span(self._frame + done, count, position, chunk.speed, feed.generation))
            done += count
            feed.used += count
            if feed.used == len(chunk.samples):
                feed.queue.popleft()
                feed.used = 0
        if done:
            self._tail[:] = out[done - 1]
        self._wake.set()
        return done

    def _fall_silent(self, out: Samples) -> None:
        out[:] = 0.0
        count = min(len(out), len(self._ramp))
        # A cut to zero would click.
        out[:count] = self._tail * self._ramp[:count]
        self._tail[:] = 0.0

    def _run(self) -> None:
        """Keep the queue filled ahead. Runs on the feeder thread."""
        while not self._closing.is_set():
            self._wake.wait(0.2)
            self._wake.clear()
            feed = self._feed
            # Looked at again with every chunk: after a seek, nobody plays the old feed any more.
            while feed is not None and feed is self._feed and len(feed.queue) < AHEAD_CHUNKS:
                if not self._fill(feed):
                    break

    def _fill(self, feed: Feed) -> bool:
        """Queue the next chunk; False at the end."""
        rate = self._source.sample_rate
        end = self._duration if feed.loop is None else feed.loop[1]
        left = round((end - feed.position) * rate)
        if left <= 0:
            if feed.stretch is not None:
                self._queue_stretched(feed, feed.stretch.finish())
                # The stretcher may give a little less; silence makes a loop last as long as its span.
                missing = round((end - feed.stretched) * self.sample_rate / feed.speed)
                self._queue_stretched(feed, np.zeros((max(missing, 0), 2), np.float32))
                feed.stretch = None
            if feed.loop is None:
                return False
            feed.position = feed.loop[0]
            return True
        first, count = round(feed.position * rate), min(left, round(CHUNK_SECONDS * rate))
        samples = self._source.read_at(first, count, self.sample_rate)
        # A start in the middle of a sound would click.
        if feed.queue == deque() and feed.used == 0:
            samples = _faded_in(samples, len(self._ramp))
        if feed.speed != 1.0:
            if feed.stretch is None:
                feed.stretch, feed.stretched = Stretch(self.sample_rate, feed.speed), feed.position
            self._queue_stretched(feed, feed.stretch.feed(samples))
        elif len(samples):
            feed.queue.append(Chunk(samples, feed.position, count / rate / len(samples)))
        feed.position = (first + count) / rate
        return True

    def _queue_stretched(self, feed: Feed, samples: Samples) -> None:
        """Queue slowed sound; a second of it is less than a second of the file."""
        if len(samples):
            speed = feed.speed / self.sample_rate
            feed.queue.append(Chunk(np.ascontiguousarray(samples), feed.stretched, speed))
            feed.stretched += len(samples) * speed


def _faded_in(samples: Samples, fade: int) -> Samples:
    count = min(fade, len(samples))
    samples[:count] *= np.linspace(0.0, 1.0, count, dtype=np.float32)[:, None]
    return samples


def _open_stream(device: str | int | None, rate: int, output: SoundOutput) -> tuple[Any, int]:
    """An output stream at the file's rate, else at the device's own."""
    try:
        import sounddevice
    except OSError as error:
        what = "Sound cannot be played: the PortAudio library is missing."
        raise StudioError(
            what, "Install it (on Debian: apt install libportaudio2) and start again."
        ) from error
    try:
        own = int(sounddevice.query_devices(device, "output")["default_samplerate"])
    except (sounddevice.PortAudioError, ValueError) as error:
        raise _no_device() from error
    # The file's own rate first: then nothing is resampled by us.
    for candidate in (rate, own):
        try:
            stream = sounddevice.OutputStream(
                samplerate=candidate,
                device=device,
                channels=2,
                dtype="float32",
                # Low enough that pause and seek feel immediate, high enough for a busy machine.
                latency=0.06,
                callback=output.callback,
                finished_callback=output.finished,
            )
        except sounddevice.PortAudioError:
            continue
        return stream, candidate
    raise _no_device()


def _no_device() -> StudioError:
    return StudioError("No sound device can play.", "Plug in headphones or speakers, then play it again.")
