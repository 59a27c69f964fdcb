"""One spoken sentence: its sound, when each phoneme begins, and what each phoneme asks of the lips.

The sound comes from espeak-ng or from the bundled clips. Lip targets are the five VRM0 mouth shapes:
strength says how much a sound insists on its shape against its neighbours, closure how far it presses the
lips together. Source: Cohen & Massaro 1993, Modeling coarticulation in synthetic visual speech
(dominance); values by eye.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.performer import espeak, sentences
from studio.performer.sentences import Sentence
from studio.sound.sound_file import Sound

MOUTH = ("A", "I", "U", "E", "O")
VOWELS = frozenset("aɑæäɐʌəɚɝɜeɛiɪɨyoɔɒuʊɯø")


@dataclass(frozen=True)
class Target:
    """What one sound wants: weights of MOUTH (5), its dominance 0..1, and lip closure 0..1."""

    mouth: tuple[float, float, float, float, float]
    strength: float
    closure: float = 0.0


REST = Target((0.0, 0.0, 0.0, 0.0, 0.0), 0.7)

_VOWELS: dict[str, Target] = {
    "aɑä": Target((0.95, 0.0, 0.0, 0.05, 0.0), 1.0),
    "æ": Target((0.7, 0.0, 0.0, 0.35, 0.0), 1.0),
    "ʌɐ": Target((0.55, 0.0, 0.0, 0.15, 0.05), 0.8),
    "ə": Target((0.28, 0.0, 0.05, 0.18, 0.0), 0.5),
    "ɚɝɜ": Target((0.12, 0.0, 0.3, 0.25, 0.1), 0.7),
    "eɛ": Target((0.12, 0.08, 0.0, 0.75, 0.0), 0.95),
    "i": Target((0.0, 0.85, 0.0, 0.08, 0.0), 1.0),
    "ɪɨy": Target((0.0, 0.55, 0.0, 0.18, 0.0), 0.75),
    "o": Target((0.05, 0.0, 0.08, 0.0, 0.85), 1.0),
    "ɔɒø": Target((0.25, 0.0, 0.0, 0.0, 0.7), 1.0),
    "u": Target((0.0, 0.0, 0.9, 0.0, 0.05), 1.0),
    "ʊ": Target((0.0, 0.0, 0.6, 0.0, 0.15), 0.8),
    "ɯ": Target((0.0, 0.15, 0.45, 0.0, 0.0), 0.7),
}
_CONSONANTS: dict[str, Target] = {
    "mbpɸβ": Target((0.0, 0.0, 0.05, 0.0, 0.0), 0.5, closure=1.0),
    "fv": Target((0.02, 0.12, 0.0, 0.08, 0.0), 0.7, closure=0.7),
    "w": Target((0.0, 0.0, 0.75, 0.0, 0.1), 1.0, closure=0.15),
    "ɹrɻ": Target((0.02, 0.0, 0.35, 0.1, 0.05), 0.6),
    "ʃʒ": Target((0.0, 0.05, 0.4, 0.2, 0.0), 0.8),
    "szɕʑɬ": Target((0.0, 0.38, 0.0, 0.14, 0.0), 0.75),
    "tdnlɾɫɲ": Target((0.08, 0.15, 0.0, 0.18, 0.0), 0.4),
    "θð": Target((0.12, 0.05, 0.0, 0.2, 0.0), 0.55),
    "jç": Target((0.0, 0.55, 0.0, 0.1, 0.0), 0.6),
    "kɡgŋhxɣʔɦɴ": Target((0.12, 0.04, 0.0, 0.1, 0.02), 0.2),
}
_TARGETS: dict[str, Target] = {
    letter: target
    for table in (_VOWELS, _CONSONANTS)
    for letters, target in table.items()
    for letter in letters
}


def targets(name: str) -> tuple[tuple[str, Target, float], ...]:
    """The targets within one phoneme, in order, with their shares of its duration.

    A diphthong ("aɪ") or a vowel with its r ("ɑːɹ") is several; a length mark lengthens the letter before.

    Args:
        name: IPA letters; unknown marks are passed over, nothing left means silence.

    Returns:
        (letter, target, share) with shares adding up to 1.
    """
    parts: list[tuple[str, Target, float]] = []
    for letter in name:
        if letter in _TARGETS:
            parts.append((letter, _TARGETS[letter], 1.0))
        # A length mark lengthens the letter before it; 0.7 by eye.
        elif letter in "ːˑ" and parts:
            parts[-1] = (*parts[-1][:2], parts[-1][2] + 0.7)
    if not parts:
        return (("", REST, 1.0),)
    whole = sum(part[2] for part in parts)
    return tuple((letter, target, weight / whole) for letter, target, weight in parts)


def is_vowel(name: str) -> bool:
    """Whether a phoneme carries a syllable."""
    return any(letter in VOWELS for letter in name)


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
        # Three in four: the first voice people meet is Mia.
        female = bool(rng.integers(4))
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


_SCRIPTS = (("ja", "\u3040", "\u30ff"), ("ko", "\uac00", "\ud7a3"), ("cmn", "\u4e00", "\u9fff"))
"""Letters that only one language has; kana first, since Japanese uses the Chinese characters too."""


def read_aloud(text: str) -> Sound:
    """Any text, spoken by espeak-ng in the language of its letters.

    Raises:
        StudioError: espeak-ng is not installed, or there is nothing in the text to say.
    """
    if not espeak.available():
        what = "Typed sentences need espeak-ng, which is not installed."
        raise StudioError(what, "Use the microphone or a sound file, or install espeak-ng.")
    language = next((name for name, a, z in _SCRIPTS if any(a <= c <= z for c in text)), "en-us")
    reply = espeak.speak(espeak.Request(text, f"{language}+f2"))
    if reply is None:
        raise StudioError("This sentence could not be spoken.", "Try other words, or use the microphone.")
    samples = np.frombuffer(reply.pcm, dtype="<i2").astype(np.float32) / 32768.0
    return Sound(samples[:, None], reply.sample_rate)


def from_bundle(index: int, voice: SpeakerVoice, order_seed: int = 0) -> Speech:
    """Sentence number `index` of the bundled clips, in an order of the performer's own.

    Raises:
        StudioError: the clips are missing or damaged.
    """
    clips = sentences.clips()
    order = np.random.default_rng((order_seed, 203)).permutation(len(clips))
    clip = clips[int(order[index % len(clips)])]
    samples, rate = sentences.read_clip(clip)
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
    # Silence between words must not count, or sentences with pauses would come out louder.
    loud = moved[np.abs(moved) > 0.01 * max(float(np.abs(moved).max()), 1e-6)]
    rms = float(np.sqrt(np.mean(np.square(loud, dtype=np.float64)))) if len(loud) else 1.0
    # Never so loud that a peak clips.
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
        # A phoneme of no length: the next takes its place.
        if kept and t <= kept[-1][0]:
            kept.pop()
        kept.append((t, name))
    ends = [*(t for t, _ in kept[1:]), end]
    return tuple(Phone(t, stop - t, name) for (t, name), stop in zip(kept, ends, strict=True) if stop > t)
