"""A delay line that follows two clocks: sound in with its moments, sound out by its moments."""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

from studio.live.moments import SampleClock
from studio.live.resample import Resampler
from studio.live.sources import Heard

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
        self._ring = np.zeros(round(KEPT_S * rate), dtype=np.float32)
        self._written = 0
        self._taken = 0  # samples that came in of the stream at hand
        self._began = 0  # which sample of the ring began it
        self._clock: SampleClock | None = None
        self._resampler: Resampler | None = None
        self._place: float | None = None
        self._missing = [0.0, 0.0]  # samples that came too late, at most: lately, and before that
        self._most = self._before = 0.0
        self._since = 0
        self._tail = np.float32(0.0)
        self._lock = threading.Lock()

    def put(self, heard: Heard) -> None:
        """One more block."""
        with self._lock:
            if heard.anew or self._resampler is None or self._resampler.rate != heard.rate:
                self._resampler, self._clock = Resampler(heard.rate, self.rate), SampleClock(self.rate)
                self._taken, self._began = 0, self._written
                self._missing, self._most, self._before = [0.0, 0.0], 0.0, 0.0
            assert self._clock is not None
            at = self._began + round(self._taken * self.rate / heard.rate)
            self._clock.follow(at, heard.captured)
            self._taken += len(heard.samples)
            self._write(self._resampler.feed(heard.samples))

    def take(self, count: int, moment: float) -> Floats:
        """The next samples (count,), the first of them captured at a moment as nearly as nobody hears."""
        with self._lock:
            if self._clock is None:
                return np.zeros(count, dtype=np.float32)
            at = self._clock.sample(moment)
            self._notice(at + count + _NEIGHBOURS - self._written)
            wanted, place = at - self._extra, self._place
            left = self._written - count - _NEIGHBOURS
            # Where sound is missing that would be there a little later, better later; where it has stopped,
            # on into silence.
            jumps = place is None or abs(wanted - place) > JUMP_S * self.rate or place > left >= wanted
            if place is None or jumps:
                place = wanted
            bent = (wanted - place) / self.rate * _CAUGHT_UP_EACH_S
            speed = 1.0 + float(np.clip(bent, -_MOST_BENT, _MOST_BENT))
            out = self._read(place + speed * np.arange(count, dtype=np.float64))
            self._place = place + speed * count
            return self._joined(out, jumps)

    @property
    def _extra(self) -> float:
        """Samples it is later than wished, for sound takes its time to come: what was missing lately."""
        missing = max(self._missing)
        return missing + _SPARE_S * self.rate if missing > 0 else 0.0

    def _notice(self, missing: float) -> None:
        """So many samples are not there yet; what was missing counts once some came, and for some seconds."""
        if missing < self._before and self._most <= _SHORT_S * self.rate:
            self._missing[0] = max(self._missing[0], self._most)
        self._most = missing if missing < self._before else max(self._most, missing)
        self._before = missing
        if self._written - self._since > _REMEMBERED_S * self.rate:
            self._missing, self._since = [0.0, self._missing[0]], self._written

    def _write(self, samples: Floats) -> None:
        size = len(self._ring)
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
