"""One spoken sentence: its sound and when each phoneme begins; from espeak-ng or from the bundled clips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.performer import bundle, espeak
from studio.performer.sentences import Sentence

Samples = NDArray[np.float32]

SAMPLE_RATE = 48_000
LEVEL_DBFS = -23.0
"""Loudness every sentence is brought to (RMS of its voiced part): a microphone at a sensible gain."""

_FEMALE, _MALE = ("f1", "f2", "f3", "f4", "f5"), ("m1", "m2", "m3", "m7", "m8")


@dataclass(frozen=True)
class Phone:
    """One phoneme: beginning and length (seconds in the sentence), and its IPA letters ("" is silence)."""

    t: float
    duration: float
    name: str

    @property
    def end(self) -> float:
        """Seconds where it ends."""
        return self.t + self.duration


@dataclass(frozen=True, eq=False)
class Speech:
    """A spoken sentence.

    Args:
        sentence: what is said.
        samples: float32 (N,) mono at SAMPLE_RATE.
        phones: in order, without gaps, from 0 to the end.
    """

    sentence: Sentence
    samples: Samples
    phones: tuple[Phone, ...]

    @property
    def duration(self) -> float:
        """Seconds."""
        return len(self.samples) / SAMPLE_RATE


@dataclass(frozen=True)
class SpeakerVoice:
    """How one performer sounds.

    Args:
        variant: espeak-ng's voice variant.
        rate: words a minute.
        pitch, pitch_range: 0..100.
        speed: playback speed of bundled clips, which moves their pitch with it.
    """

    variant: str
    rate: int
    pitch: int
    pitch_range: int
    speed: float

    @classmethod
    def of(cls, performer: int) -> SpeakerVoice:
        """The voice of a performer, by number."""
        rng = np.random.default_rng((performer, 201))
        female = bool(rng.integers(4))  # three in four: the first voice people meet is Mia
        variants = _FEMALE if female else _MALE
        return cls(
            variant=variants[int(rng.integers(len(variants)))],
            rate=int(rng.integers(148, 176)),
            pitch=int(rng.integers(48, 66)) if female else int(rng.integers(32, 50)),
            pitch_range=int(rng.integers(55, 85)),
            speed=float(rng.uniform(0.95, 1.05)),
        )


def from_text(sentence: Sentence, voice: SpeakerVoice, take: tuple[int, ...] = ()) -> Speech | None:
    """A sentence spoken by espeak-ng; None where it is not installed.

    Args:
        sentence: what to say.
        voice: who says it.
        take: seeds the small differences between one sentence and the next.
    """
    rng = np.random.default_rng((202, *take))
    request = espeak.Request(
        sentence.text,
        f"{sentence.language}+{voice.variant}",
        rate=voice.rate + int(rng.integers(-12, 13)),
        pitch=voice.pitch + int(rng.integers(-5, 6)) + (6 if sentence.mood in ("Joy", "Surprised") else 0),
        pitch_range=voice.pitch_range,
    )
    reply = espeak.speak(request)
    if reply is None:
        return None
    samples = np.frombuffer(reply.pcm, dtype="<i2").astype(np.float32) / 32768.0
    starts = [(sample / reply.sample_rate, name) for sample, name in reply.phones]
    return finished(sentence, samples, reply.sample_rate, _joined(starts, len(samples) / reply.sample_rate))


def from_bundle(index: int, voice: SpeakerVoice, order_seed: int = 0) -> Speech:
    """Sentence number `index` of the bundled clips, in an order of the performer's own.

    Raises:
        StudioError: the clips are missing or damaged.
    """
    clips = bundle.clips()
    order = np.random.default_rng((order_seed, 203)).permutation(len(clips))
    clip = clips[int(order[index % len(clips)])]
    samples, rate = bundle.read_sound(clip)
    # Playing faster moves pitch and timing together, as a tape would: every time is divided by the speed.
    starts = [(t / voice.speed, name) for t, name in clip.phones]
    played_rate = rate * voice.speed
    phones = _joined(starts, len(samples) / played_rate)
    return finished(clip.sentence, samples, played_rate, phones)


def finished(sentence: Sentence, samples: Samples, rate: float, phones: tuple[Phone, ...]) -> Speech:
    """Sound at SAMPLE_RATE and the house's level, trimmed where the last phoneme's silence trails off."""
    import soxr

    voiced = [phone for phone in phones if phone.name]
    if not voiced:
        raise StudioError("Nothing could be spoken of this text.", "Write a sentence with letters in it.")
    end = min(voiced[-1].end + 0.08, len(samples) / rate)
    kept = samples[: round(end * rate)]
    moved = np.asarray(soxr.resample(kept, rate, SAMPLE_RATE, quality="HQ"), dtype=np.float32)
    loud = moved[np.abs(moved) > 0.01 * max(float(np.abs(moved).max()), 1e-6)]
    rms = float(np.sqrt(np.mean(np.square(loud, dtype=np.float64)))) if len(loud) else 1.0
    gain = min(10 ** (LEVEL_DBFS / 20) / rms, 0.7 / max(float(np.abs(moved).max()), 1e-6))
    cut = [Phone(p.t, min(p.end, end) - p.t, p.name) for p in phones if p.t < end - 1e-6]
    return Speech(sentence, moved * np.float32(gain), tuple(cut))


def _joined(starts: list[tuple[float, str]], end: float) -> tuple[Phone, ...]:
    """Phones from their beginnings; a silence before the first, neighbouring silences made one."""
    if not starts or starts[0][0] > 0:
        starts = [(0.0, ""), *starts]
    kept: list[tuple[float, str]] = []
    for t, name in starts:
        if kept and not name and not kept[-1][1]:
            continue
        if kept and t <= kept[-1][0]:  # a phoneme of no length: the next takes its place
            kept.pop()
        kept.append((t, name))
    ends = [*(t for t, _ in kept[1:]), end]
    return tuple(Phone(t, stop - t, name) for (t, name), stop in zip(kept, ends, strict=True) if stop > t)
