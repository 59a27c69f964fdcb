"""What happens when, and how a performer moves: lines one after another, each with its plan of movement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from studio.errors import StudioError
from studio.performer import espeak, prosody, speech
from studio.performer.prosody import Prosody
from studio.performer.sentences import Sentence, sentence
from studio.performer.speech import SAMPLE_RATE, Phone, Samples, SpeakerVoice, Speech


@dataclass(frozen=True)
class Style:
    """A performer's own way; made from a number, so the same number is the same person.

    Args:
        seed: the number.
        mouth_gain: how far each of A, I, U, E, O opens, against the average (5).
        coarticulation: seconds over which a sound colours its neighbours.
        lag: seconds by which the face follows the sound; below zero, since lips take up a vowel before it is
            at its loudest. With these, mouth and voice of a take measure as aligned (motion.lag, to 15 ms).
        nod, tilt, turn: how much the head follows beats, melody and glances.
        beat: how much the arms follow beats.
        hands: chances of gesturing with none, the left, the right, or both in a sentence (4).
        sway: how much the body shifts when idle.
        lean: degrees the upper body leans forward.
        blink_interval: median seconds between blinks.
        blink_skew: seconds by which the left lid is later.
        expressiveness: how strongly moods show.
        head_roll: degrees the head is usually tilted.
    """

    seed: int
    mouth_gain: tuple[float, float, float, float, float]
    coarticulation: float
    lag: float
    nod: float
    tilt: float
    turn: float
    beat: float
    hands: tuple[float, float, float, float]
    sway: float
    lean: float
    blink_interval: float
    blink_skew: float
    expressiveness: float
    head_roll: float

    @classmethod
    def of(cls, performer: int) -> Style:
        """The style of a performer, by number."""
        rng = np.random.default_rng((performer, 301))
        gain = rng.uniform(0.85, 1.12, 5)
        # Most people gesture more with one hand.
        handed = rng.uniform(0.55, 0.85)
        one = 0.5 * rng.uniform(0.8, 1.1)
        none = 0.12 * rng.uniform(0.5, 1.5)
        return cls(
            seed=performer,
            mouth_gain=(float(gain[0]), float(gain[1]), float(gain[2]), float(gain[3]), float(gain[4])),
            coarticulation=float(rng.uniform(0.038, 0.055)),
            lag=float(rng.uniform(-0.02, -0.01)),
            nod=float(rng.uniform(0.8, 1.3)),
            tilt=float(rng.uniform(0.7, 1.3)),
            turn=float(rng.uniform(0.7, 1.3)),
            beat=float(rng.uniform(0.8, 1.25)),
            hands=(none, one * (1 - handed), one * handed, 1 - none - one),
            sway=float(rng.uniform(0.8, 1.3)),
            lean=float(rng.uniform(0.0, 2.5)),
            blink_interval=float(rng.uniform(2.2, 3.2)),
            blink_skew=float(rng.uniform(-0.012, 0.012)),
            expressiveness=float(rng.uniform(0.8, 1.15)),
            head_roll=float(rng.uniform(-2.5, 2.5)),
        )


REACH = 1.6
"""Seconds before and after itself beyond which nothing in a line moves anything."""
_LEAD = (0.35, 0.6)
PAUSE = (0.45, 1.1)
LINES_APART = 6
"""How many sentences further on each script of a performer begins."""


@dataclass(frozen=True)
class Blink:
    """One closing of the lids: when (seconds), how far, and which eyes ("both", "left", "right")."""

    t: float
    amount: float
    eyes: str = "both"


@dataclass(frozen=True, eq=False)
class Line:
    """A sentence in its place.

    Args:
        index: its number in the script.
        start: seconds where its slot begins, a whole number of samples.
        lead: seconds of breath before the voice.
        duration: seconds of the slot: breath, voice and pause.
        speech, prosody: what is heard.
        hands: which gesture: "none", "left", "right" or "both".
        blinks: in this slot, absolute seconds.
        mood_level: how strongly the sentence's mood shows, 0..1.
        seed: for the small differences within it.
    """

    index: int
    start: float
    lead: float
    duration: float
    speech: Speech
    prosody: Prosody
    hands: str
    blinks: tuple[Blink, ...]
    mood_level: float
    seed: tuple[int, ...]

    @property
    def end(self) -> float:
        """Seconds where the next line's slot begins."""
        return self.start + self.duration

    @property
    def voice_start(self) -> float:
        """Seconds where the voice begins."""
        return self.start + self.lead

    @property
    def voice_end(self) -> float:
        """Seconds where the voice ends."""
        return self.voice_start + self.speech.duration

    @property
    def text(self) -> str:
        """The sentence of this line."""
        return self.speech.sentence.text

    def phones(self) -> tuple[Phone, ...]:
        """The phonemes in absolute time."""
        return tuple(Phone(p.t + self.voice_start, p.duration, p.name) for p in self.speech.phones)

    def samples(self) -> Samples:
        """The sound of the slot, float32 (N,) at SAMPLE_RATE, with the quiet noise of a room."""
        count = round(self.duration * SAMPLE_RATE)
        rng = np.random.default_rng((*self.seed, 401))
        # A microphone never gives digital silence; features and meters should meet what they meet in life.
        sound = rng.standard_normal(count, dtype=np.float32) * np.float32(10 ** (-68 / 20))
        first = round(self.lead * SAMPLE_RATE)
        sound[first : first + len(self.speech.samples)] += self.speech.samples
        return sound


class Script:
    """The lines of one performance, made as they are asked for, in order.

    Args:
        performer: who: sets voice and style.
        script: which performance of theirs: sets the order of sentences and every small accident.
        texts: what to say instead of the script of its own, over and over.
        voice_source: "auto" (espeak-ng, else the bundled clips), "espeak" or "bundled".
        language: whose sounds all sentences are said with ("de"), "" for each sentence's own.
        pause: seconds between a sentence and the next, shortest and longest.

    Raises:
        StudioError: espeak-ng is asked for, or needed for texts, and is not there.
    """

    def __init__(
        self,
        performer: int = 0,
        script: int = 0,
        texts: Sequence[str] = (),
        voice_source: str = "auto",
        language: str = "",
        pause: tuple[float, float] = PAUSE,
    ) -> None:
        self.style, self.voice = Style.of(performer), SpeakerVoice.of(performer)
        self._seed = (performer, script)
        self._texts = tuple(texts)
        self._language, self._pause = language, pause
        self.bundled = voice_source == "bundled" or not espeak.available()
        if self.bundled and (self._texts or voice_source == "espeak"):
            what = "The practice performer cannot speak new text: espeak-ng is not installed."
            raise StudioError(what, "Install it (on Debian: apt install espeak-ng), or leave the text out.")
        # In samples, so that slots add up without a rounding error however long it performs.
        self._next_start = 0
        self._index = 0

    def next_line(self) -> Line:
        """Speak the next line: about 60 ms with espeak-ng, less with the bundled clips."""
        seed = (*self._seed, self._index)
        rng = np.random.default_rng((*seed, 402))
        spoken = self._speak(seed)
        lead = round(float(rng.uniform(*_LEAD)) * SAMPLE_RATE)
        pause = round(float(rng.uniform(*self._pause)) * SAMPLE_RATE)
        count = lead + len(spoken.samples) + pause
        start, duration = self._next_start / SAMPLE_RATE, count / SAMPLE_RATE
        voice_end = start + (count - pause) / SAMPLE_RATE
        line = Line(
            index=self._index,
            start=start,
            lead=lead / SAMPLE_RATE,
            duration=duration,
            speech=spoken,
            prosody=prosody.measure(spoken),
            hands=("none", "left", "right", "both")[int(rng.choice(4, p=self.style.hands))],
            blinks=_blinks(rng, start, start + duration, voice_end, self.style, spoken.sentence.mood),
            mood_level=float(rng.uniform(0.25, 0.55)) * self.style.expressiveness,
            seed=seed,
        )
        self._next_start += count
        self._index += 1
        return line

    def _speak(self, seed: tuple[int, ...]) -> Speech:
        # Scripts of one performer go on where the one before left off, so that takes share no sentence.
        number = self._index + LINES_APART * self._seed[1]
        if self._texts:
            chosen = Sentence(self._texts[self._index % len(self._texts)])
        else:
            chosen = sentence(number, self._seed[0])
        if self._language:
            chosen = replace(chosen, language=self._language)
        spoken = None if self.bundled else speech.from_text(chosen, self.voice, seed)
        if spoken is not None:
            return spoken
        if self._texts:
            raise StudioError("espeak-ng could not speak.", "Check that `espeak-ng hello` can be heard.")
        return speech.from_bundle(number, self.voice, self._seed[0])


def _blinks(
    rng: np.random.Generator, start: float, end: float, voice_end: float, style: Style, mood: str
) -> tuple[Blink, ...]:
    """Blinks of one slot: log-normal intervals, some double, one likely where the sentence ends.

    Source: Bentivoglio et al. 1997: 17 a minute at rest, 26 in conversation.
    """
    found: list[Blink] = []
    t = start + float(rng.uniform(0.15, 0.9)) * style.blink_interval
    while t < end - 0.3:
        found.append(Blink(t, float(rng.uniform(0.9, 1.0))))
        double = rng.random() < 0.06
        t += (
            float(rng.uniform(0.38, 0.5))
            if double
            else 0.5 + style.blink_interval * float(rng.lognormal(-0.2, 0.5))
        )
    if rng.random() < 0.45:
        at = voice_end + float(rng.uniform(-0.1, 0.1))
        found = [blink for blink in found if abs(blink.t - at) > 0.7]
        found.append(Blink(at, float(rng.uniform(0.92, 1.0))))
    if mood == "Fun" and rng.random() < 0.25:
        at = voice_end - float(rng.uniform(0.2, 0.5))
        found = [blink for blink in found if abs(blink.t - at) > 0.9]
        found.append(Blink(at, 0.95, "left" if rng.random() < 0.5 else "right"))
    return tuple(sorted(found, key=lambda blink: blink.t))
