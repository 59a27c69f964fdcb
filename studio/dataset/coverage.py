"""Which kinds of speech takes hold, and which are missing: while recording, and of what is learnt from.

Kinds are named as people say them in a sentence ("questions", "quiet speech"). Nothing is guessed of takes
without labels but what can be measured: how loud, how much silence, how much smiling.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Selection
from studio.dataset.material import TrainingMaterial
from studio.dataset.prompts import EMOTIONS, TIER, kind_of
from studio.errors import say
from studio.motion import Motion
from studio.motion.lag import RATE, speech_level
from studio.take.findings import measure_sound
from studio.take.motion_file import load_motion, without_motion
from studio.take.take import Take

QUESTIONS, SMILES = say("questions"), say("smiles")
LOUD, QUIET, SILENCE = say("loud speech"), say("quiet speech"), say("silence")
ENOUGH = {SILENCE: 0.05, LOUD: 0.03, QUIET: 0.03, SMILES: 0.03, QUESTIONS: 0.03}
"""Share of what is learnt from that a kind should have, from the one whose lack is most seen: an avatar that
never saw silence chews in it. Set by hand: a twentieth is three seconds of a minute."""
_SENTENCES = {
    "question": QUESTIONS, "exclamation": say("exclamations"), "statement": say("statements"),
    "laugh": say("laughter"), "greeting": say("greetings"), "reaction": say("reactions"),
    "goodbye": say("goodbyes"), "breath": say("breaths"),
}  # fmt: skip
_SPOKEN_SO = (*EMOTIONS, "loud", "quiet")
"""Kinds of prompts that are ways to speak."""
_SPOKEN = 0.08
"""Level, of 1 at the loudest hundredth of a take, below which nobody speaks."""
_LOUD, _QUIET = 2.0, 0.4
"""Times the usual level of speech from which, and up to which, it counts as loud or quiet."""
_SMILING = 0.3
_SMILES = ("smile", "joy", "fun", "happy", "relaxed")


def kinds_of(selection: Selection, duration: float) -> dict[str, float]:
    """Seconds by kind, as labels of sentences and emotions and the selection's own emotion say it.

    Args:
        selection: of a take.
        duration: of the take's recording, seconds.
    """
    start, end = selection.span(duration)
    found: dict[str, float] = defaultdict(float)
    for label in selection.labels:
        seconds = min(label.t + label.duration, end) - max(label.t, start)
        words = _words(label.tier, label.text)
        if seconds > 0 and words:
            found[words] += seconds
    if selection.emotion and not any(label.tier == "emotion" for label in selection.labels):
        found[_words("emotion", selection.emotion)] += selection.seconds(duration)
    return dict(found)


def coverage(materials: Sequence[TrainingMaterial]) -> dict[str, float]:
    """Share of the seconds that each kind of ENOUGH has, 0..1; a kind that nothing could show is left out.

    Args:
        materials: what is learnt from.
    """
    levels = [speech_level(one.samples, one.sample_rate) for one in materials if len(one.samples)]
    level = np.concatenate(levels) if levels else np.zeros(0)
    spoken = level[level >= _SPOKEN]
    found: dict[str, float] = {}
    if len(spoken):
        usual = float(np.median(spoken))
        found[SILENCE] = 1.0 - len(spoken) / len(level)
        found[LOUD] = float((spoken > _LOUD * usual).sum() / len(level))
        found[QUIET] = float((spoken < _QUIET * usual).sum() / len(level))
    smiles = [float(seen.mean()) for one in materials if (seen := _smiling(one.motion)) is not None]
    if smiles:
        found[SMILES] = float(np.mean(smiles))
    labels = [x for one in materials for x in one.selection.labels if x.tier in ("sentence", TIER)]
    if labels:
        asked = sum(x.duration for x in labels if _words(x.tier, x.text) == QUESTIONS)
        found[QUESTIONS] = asked / max(len(level) / RATE, 1e-9)
    return found


def missing(shares: dict[str, float]) -> tuple[str, ...]:
    """The kinds there is too little of, the one whose lack is most seen first."""
    return tuple(kind for kind, enough in ENOUGH.items() if kind in shares and shares[kind] < enough)


def _words(tier: str, text: str) -> str:
    """The kind that a label says, "" where it says none."""
    if tier == TIER:
        kind = kind_of(text)
        return QUESTIONS if kind == "question" else _speech(kind) if kind in _SPOKEN_SO else ""
    known = _SENTENCES.get(text.lower(), text.lower())
    return known if tier == "sentence" else _speech(known) if tier == "emotion" else ""


def _speech(kind: str) -> str:
    return say("{kind} speech", kind=kind)


# -- while recording -------------------------------------------------------------------------------

MILESTONES = (120.0, 600.0, 1200.0)
"""Seconds of voice with motion for a first look, for a good model, and for an excellent one."""
GOALS = ("loud", "quiet", "smiles", "questions", "feelings", "sounds")
"""What recordings should have, besides their length."""
_APART_DB = 6.0
_LEVEL_S, _SMILE_S = 5.0, 8.0
_QUESTIONS, _SOUNDS = 3, 2
WANTED_KINDS = {
    "loud": ("loud",), "quiet": ("quiet",), "smiles": ("happy",), "questions": ("question",),
    "feelings": EMOTIONS, "sounds": ("sounds",),
}  # fmt: skip
"""The kinds of prompts that fill each goal."""


@dataclass(frozen=True, eq=False)
class TakeProgress:
    """What one recording has.

    Args:
        seconds: with sound and motion.
        levels: dBFS of the voice in each of its seconds with voice, (K,).
        smiles: seconds of smiling; None where its face has no shape for that.
    """

    seconds: float
    levels: NDArray[np.float64]
    smiles: float | None


@dataclass(frozen=True)
class RecordingProgress:
    """What all recordings have together: seconds, and the goals that are not reached yet."""

    seconds: float
    missing: tuple[str, ...]

    @property
    def wanted(self) -> frozenset[str]:
        """Kinds of prompts that would fill what is missing."""
        return frozenset(kind for goal in self.missing for kind in WANTED_KINDS[goal])

    @property
    def next_milestone(self) -> float:
        """Seconds of the next milestone, or of the last."""
        return next((one for one in MILESTONES if self.seconds < one), MILESTONES[-1])


def cover_take(take: Take) -> TakeProgress:
    """Read one take; a take is never altered, so this holds as long as it is there.

    Raises:
        StudioError: its files cannot be read.
    """
    motion = load_motion(take)
    if take.audio_path is None or motion is None or len(motion) < 2:
        return TakeProgress(0.0, np.zeros(0), None)
    stats = measure_sound(take.audio_path)
    away = sum(end - start for start, end in without_motion(motion.times, stats.duration))
    seconds = max(stats.duration - away, 0.0)
    smiling = _smiling(motion)
    # Frames may come unevenly: each counts until the next one, but for gaps.
    length = np.minimum(np.diff(motion.times, append=motion.times[-1]), 0.2)
    smiles = float(length[smiling].sum()) if smiling is not None else None
    return TakeProgress(seconds, _levels(stats.power, stats.is_voice), smiles)


def progress_of(takes: Sequence[TakeProgress], selections: Iterable[Selection]) -> RecordingProgress:
    """What several takes have together, and the labels of their prompts."""
    levels = np.concatenate([np.zeros(0), *(one.levels for one in takes)])
    usual = float(np.median(levels)) if len(levels) else 0.0
    smiles = [one.smiles for one in takes if one.smiles is not None]
    kinds = [kind_of(x.text) for s in selections for x in s.labels if x.tier == TIER]
    reached = {
        "loud": (levels > usual + _APART_DB).sum() >= _LEVEL_S,
        "quiet": (levels < usual - _APART_DB).sum() >= _LEVEL_S,
        # A face without such a shape cannot smile, and nobody is asked for what it cannot do.
        "smiles": sum(smiles) >= _SMILE_S or (bool(takes) and not smiles),
        "questions": kinds.count("question") >= _QUESTIONS,
        "feelings": all(kind in kinds for kind in EMOTIONS),
        "sounds": kinds.count("sounds") >= _SOUNDS,
    }
    missing = tuple(goal for goal in GOALS if not reached[goal])
    return RecordingProgress(sum(one.seconds for one in takes), missing)


def _levels(power: NDArray[np.float64], voice: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Mean level of the voice in each second that has some, dBFS.

    A second and not a moment: within a word the level always swings by more than from quiet to loud speech.
    """
    rate = int(RATE)
    whole = len(power) // rate
    power, voice = power[: whole * rate].reshape(whole, rate), voice[: whole * rate].reshape(whole, rate)
    enough = voice.mean(axis=1) > 0.3
    mean = (power * voice).sum(axis=1)[enough] / voice.sum(axis=1)[enough]
    return np.asarray(10 * np.log10(np.maximum(mean, 1e-10)), dtype=np.float64)


def _smiling(motion: Motion) -> NDArray[np.bool_] | None:
    """Frames that smile (T,); None without a shape for it."""
    shapes = [i for i, name in enumerate(motion.shape_names) if any(w in name.casefold() for w in _SMILES)]
    return motion.shapes[:, shapes].max(axis=1) > _SMILING if shapes and len(motion) else None
