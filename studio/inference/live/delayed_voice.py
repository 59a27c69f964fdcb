"""Plays the voice on a sound output with the avatar's delay, despite two sound cards' clocks."""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio import clock
from studio.capture.microphone import SoundWatch, find_output, library, opening
from studio.errors import StudioError, say
from studio.inference.live.audio_source import AudioBlock
from studio.inference.live.timing import SampleClock
from studio.sound.resample import Resampler

Floats = NDArray[np.float32]

KEPT_S = 4.0
"""Sound that is kept: more than any avatar is late."""
JUMP_S = 0.06
"""An error that is gone over at once; a smaller one is made up for unheard."""
_CAUGHT_UP_EACH_S = 0.5
_MOST_BENT = 0.004
"""How much faster or slower the voice may run meanwhile: 7 cents, which nobody hears."""
_FADE_S = 0.004
_SPARE_S = 0.005
_SHORT_S = 0.2
"""Sound that is missing by more is not late, it has stopped."""
_REMEMBERED_S = 4.0
_NEIGHBOURS = 3


class DelayLine:
    """Sound in with the moments it was captured at, sound out that was captured at given moments.

    Args:
        rate: samples a second going out.
    """

    def __init__(self, rate: int) -> None:
        self.rate = rate
        # A ring and not a list of blocks: the audio thread must not allocate or wait for memory.
        self._ring = np.zeros(round(KEPT_S * rate), dtype=np.float32)
        self._written = 0
        self._samples_in = 0  # samples that came in of the stream at hand
        self._began = 0  # which sample of the ring began it
        self._clock: SampleClock | None = None
        self._resampler: Resampler | None = None
        self._place: float | None = None
        self._missing = [0.0, 0.0]  # samples that came too late, at most: lately, and before that
        self._most = self._before = 0.0
        self._since = 0
        self._tail = np.float32(0.0)
        self._lock = threading.Lock()

    def put(self, block: AudioBlock) -> None:
        """One more block."""
        with self._lock:
            # A device that came back has another clock and perhaps another rate; nothing of the old line
            # holds.
            if block.restarted or self._resampler is None or self._resampler.rate != block.rate:
                self._resampler, self._clock = Resampler(block.rate, self.rate), SampleClock(self.rate)
                self._samples_in, self._began = 0, self._written
                self._missing, self._most, self._before = [0.0, 0.0], 0.0, 0.0
            assert self._clock is not None
            # Where the block would lie if resampling took no time; from counted samples, so nothing adds up.
            at = self._began + round(self._samples_in * self.rate / block.rate)
            self._clock.follow(at, block.captured)
            self._samples_in += len(block.samples)
            self._write(self._resampler.feed(block.samples))

    def take(self, count: int, moment: float) -> Floats:
        """The next samples (count,), the first of them captured at a moment as nearly as nobody hears."""
        with self._lock:
            if self._clock is None:
                # Silence: an output that is opened before the first block has nothing to give yet.
                return np.zeros(count, dtype=np.float32)
            at = self._clock.sample(moment)
            self._notice(at + count + _NEIGHBOURS - self._written)
            target, place = at - self._extra, self._place
            left = self._written - count - _NEIGHBOURS
            # Where sound is missing that would be there a little later, better later; where it has stopped,
            # on into silence.
            jumps = place is None or abs(target - place) > JUMP_S * self.rate or place > left >= target
            if place is None or jumps:
                place = target
            bent = (target - place) / self.rate * _CAUGHT_UP_EACH_S
            # At most a few parts in a thousand, which nobody hears as pitch.
            speed = 1.0 + float(np.clip(bent, -_MOST_BENT, _MOST_BENT))
            out = self._read(place + speed * np.arange(count, dtype=np.float64))
            self._place = place + speed * count
            return self._joined(out, jumps)

    @property
    def _extra(self) -> float:
        """Samples it is later than requested, for sound takes its time to come: what was missing lately."""
        missing = max(self._missing)
        return missing + _SPARE_S * self.rate if missing > 0 else 0.0

    def _notice(self, missing: float) -> None:
        """So many samples are not there yet; what was missing counts once some came, and for some seconds."""
        if missing < self._before and self._most <= _SHORT_S * self.rate:
            self._missing[0] = max(self._missing[0], self._most)
        self._most = missing if missing < self._before else max(self._most, missing)
        self._before = missing
        # In two halves, so that a hold-up is remembered for at least one of them and forgotten after both.
        if self._written - self._since > _REMEMBERED_S * self.rate:
            self._missing, self._since = [0.0, self._missing[0]], self._written

    def _write(self, samples: Floats) -> None:
        size = len(self._ring)
        # After a long hold-up more may come at once than the ring holds; only its end can still be played.
        samples = samples[-size:]
        at = (self._written + np.arange(len(samples))) % size
        self._ring[at] = samples
        self._written += len(samples)

    def _read(self, places: NDArray[np.float64]) -> Floats:
        """Samples between samples, silence where there are none.

        Source: the cubic of Catmull and Rom 1974 through four neighbours.
        """
        size = len(self._ring)
        whole = np.floor(places).astype(np.int64)
        # All four neighbours have to be there, else the cubic would mix in what the ring held before.
        there = (whole - 1 >= max(self._written - size, 0)) & (whole + 2 < self._written)
        a, b, c, d = (self._ring[(whole + k) % size] for k in (-1, 0, 1, 2))
        t = (places - whole).astype(np.float32)
        cubic = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
        return np.where(there, cubic, np.float32(0.0)).astype(np.float32, copy=False)

    def _joined(self, out: Floats, jumps: bool) -> Floats:
        """Without a click where it begins elsewhere than the last piece ended."""
        if jumps and len(out):
            fade = np.linspace(0.0, 1.0, min(len(out), round(_FADE_S * self.rate)), dtype=np.float32)
            out[: len(fade)] = self._tail * (1 - fade) + out[: len(fade)] * fade
        self._tail = out[-1] if len(out) else self._tail
        return out


_LATENCY_S = 0.05
_SILENT_S, _AGAIN_S = 1.0, 1.0


class DelayedVoiceOutput:
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
        self._problems: deque[StudioError] = deque()
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

    def feed(self, block: AudioBlock, muted: bool) -> None:
        """A block of the microphone; silence while it is muted."""
        self._fed = clock.now()
        line = self._line
        if line is not None:
            line.put(block._replace(samples=np.zeros_like(block.samples)) if muted else block)
        # PortAudio reports no error for a device that was unplugged: its callback just stops coming.
        if not self._gone and self._fed - self._called > _SILENT_S:
            self._gone = True
            what = say("{name} takes no sound any more.", name=self.name)
            remedy = "Plug it in again; if your voice does not return, choose it again."
            self._problems.append(StudioError(what, remedy))

    def problems(self) -> list[StudioError]:
        """What went wrong or right again since the last call, as sentences."""
        problems = list(self._problems)
        self._problems.clear()
        return problems

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
            what = say("{name} cannot be opened for your delayed voice.", name=self.name)
            raise StudioError(what, "Choose another output for it, or none.") from error

    def _reopen(self, _may_refresh: bool) -> None:
        """Runs on the watch's thread."""
        with opening:
            if self._stopped:
                return
            self._close()
            self._open()
            self._gone = False
        self._problems.append(
            StudioError(say("{name} takes your voice again.", name=self.name), "Nothing to do.")
        )

    def _close(self) -> None:
        stream, self._stream, self._line = self._stream, None, None
        if stream is not None:
            with contextlib.suppress(library().PortAudioError):
                stream.close()

    def _give(self, out: Floats, frames: int, info: Any, _status: object) -> None:
        """Runs on the audio thread."""
        now = self._called = clock.now()
        line = self._line
        # When this block will be heard, and not now: the delay is of what reaches the ear.
        ahead = info.outputBufferDacTime - info.currentTime
        if info.outputBufferDacTime == 0.0 or not -1.0 < ahead < 5.0:  # some drivers do not say
            ahead = _LATENCY_S
        out[:] = 0.0 if line is None else line.take(frames, now + ahead - self._late())[:, None]
