"""Sound made fit for a model: one rate, less noise where wished, the level it has learnt from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.live.gain import Gain
from studio.live.gate import Gate
from studio.live.moments import SampleClock
from studio.live.resample import Resampler
from studio.live.sources import Heard
from studio.take import voice_activity
from studio.take.cleaned import RNNOISE_FRAME, RNNOISE_LATE, RNNOISE_RATE, VoiceNetwork

Floats = NDArray[np.float32]


class Conditioning:
    """One stream of blocks on its way to a model.

    Args:
        rate: the model's samples a second.
        gain: the automatic gain.
        gate: the voice gate; None for none.
        suppress: whether noise is taken out, which costs 30 ms.
    """

    def __init__(self, rate: int, gain: Gain, gate: Gate | None, suppress: bool = False) -> None:
        self.rate, self.gain, self.gate = rate, gain, gate
        self._suppressing = suppress
        self._given = 0  # samples at the model's rate
        self._first = 0  # which of them began the stream at hand
        self._taken = 0  # samples of the stream at hand
        self._clock: SampleClock | None = None
        self._resampler: Resampler | None = None
        self._to_gate: Resampler | None = None
        self._voice: _VoiceAlone | None = None
        self.muted = False

    @property
    def late(self) -> float:
        """Seconds that sound comes out later than it goes in, by filters alone."""
        filters = (self._voice, self._resampler)
        return sum(one.delay for one in filters if one is not None)

    @property
    def drift_ppm(self) -> float:
        """How much longer the device's second is than the computer's."""
        return self._clock.drift_ppm if self._clock is not None else 0.0

    @property
    def speaking(self) -> bool:
        """Whether somebody speaks; always where there is no gate."""
        return self.gate is None or self.gate.open

    def moment(self, t: float) -> float:
        """When the sound at a time of the model's stream (seconds) was captured, on the computer's clock."""
        assert self._clock is not None
        behind = self._voice.behind if self._voice is not None else 0.0
        return self._clock.moment((t - self._first / self.rate - behind) * self._clock.rate)

    def take(self, heard: Heard) -> tuple[Floats, bool]:
        """The block as the model gets it (N,), and whether it follows a gap."""
        if heard.anew or self._clock is None or heard.rate != self._clock.rate:
            self._begin(heard.rate)
        assert self._clock is not None
        assert self._resampler is not None
        gap = self._clock.follow(self._taken, heard.captured)
        self._taken += len(heard.samples)
        samples = np.zeros_like(heard.samples) if self.muted else heard.samples
        if self._voice is not None:
            samples = self._voice.feed(samples)
        out = self._resampler.feed(samples)
        self._given += len(out)
        if self.gate is not None:
            self.gate.feed(out if self._to_gate is None else self._to_gate.feed(out))
        return self.gain.feed(out, self.speaking and not self.muted), gap

    def _begin(self, rate: int) -> None:
        self._clock, self._taken, self._first = SampleClock(rate), 0, self._given
        self._voice = _VoiceAlone(rate) if self._suppressing else None
        self._resampler = Resampler(RNNOISE_RATE if self._suppressing else rate, self.rate)
        if self._to_gate is None and self.rate != voice_activity.RATE:
            self._to_gate = Resampler(self.rate, voice_activity.RATE)


class _VoiceAlone:
    """RNNoise in a stream, at its own rate.

    Args:
        rate: samples a second coming in.
    """

    def __init__(self, rate: int) -> None:
        self._there = Resampler(rate, RNNOISE_RATE)
        self._network = VoiceNetwork(1)
        self._rest = np.zeros(0, dtype=np.float32)

    @property
    def behind(self) -> float:
        """Seconds the voice lies behind the sound it was in."""
        return RNNOISE_LATE / RNNOISE_RATE

    @property
    def delay(self) -> float:
        """Seconds it costs at most."""
        return self._there.delay + (RNNOISE_LATE + RNNOISE_FRAME) / RNNOISE_RATE

    def feed(self, samples: Floats) -> Floats:
        self._rest = np.concatenate([self._rest, self._there.feed(samples)])
        whole = len(self._rest) // RNNOISE_FRAME * RNNOISE_FRAME
        answer = self._network.answer(np.ascontiguousarray(self._rest[:whole, None]))
        self._rest = self._rest[whole:]
        return np.ascontiguousarray(answer[:, 0])
