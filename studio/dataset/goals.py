"""How much was recorded, and what is still missing: loud and quiet speech, smiles, questions and more."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Selection
from studio.dataset.prompts import EMOTIONS, TIER, kind_of
from studio.motion import lag
from studio.take.findings import measure_sound
from studio.take.motion_file import load_motion
from studio.take.take import Take

MILESTONES = (120.0, 600.0, 1200.0)
"""Seconds of voice with motion for a first look, for a good model, and for an excellent one."""
GOALS = ("loud", "quiet", "smiles", "questions", "feelings", "sounds")
"""What recordings should have, besides their length."""
_APART_DB = 6.0
_LEVEL_S, _SMILE_S = 5.0, 8.0
_QUESTIONS, _SOUNDS = 3, 2
_SMILE = 0.3
_SMILES = ("smile", "joy", "fun", "happy", "relaxed")
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
    seconds = min(stats.duration, float(motion.times[-1]))
    named = [i for i, name in enumerate(motion.shape_names) if any(w in name.casefold() for w in _SMILES)]
    smiles = None
    if named:
        # Frames may come unevenly: each counts until the next one, but for gaps.
        length = np.minimum(np.diff(motion.times, append=motion.times[-1]), 0.2)
        smiles = float(length[motion.shapes[:, named].max(axis=1) > _SMILE].sum())
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
    rate = int(lag.RATE)
    whole = len(power) // rate
    power, voice = power[: whole * rate].reshape(whole, rate), voice[: whole * rate].reshape(whole, rate)
    enough = voice.mean(axis=1) > 0.3
    mean = (power * voice).sum(axis=1)[enough] / voice.sum(axis=1)[enough]
    return np.asarray(10 * np.log10(np.maximum(mean, 1e-10)), dtype=np.float64)
