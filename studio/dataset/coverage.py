"""Which kinds of speech takes hold: what labels say of them, and what is heard and seen in them.

Kinds are named as people say them in a sentence ("questions", "quiet speech"). Nothing is guessed of takes
without labels but what can be measured: how loud, how much silence, how much smiling.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from studio.dataset.dataset import Selection
from studio.dataset.material import TrainingMaterial
from studio.motion import Motion
from studio.motion.lag import RATE, speech_level

QUESTIONS, SMILES = "questions", "smiles"
LOUD, QUIET, SILENCE = "loud speech", "quiet speech", "silence"
ENOUGH = {SILENCE: 0.05, LOUD: 0.03, QUIET: 0.03, SMILES: 0.03, QUESTIONS: 0.03}
"""Share of what is learnt from that a kind should have, from the one whose lack is most seen: an avatar that
never saw silence chews in it. Set by hand: a twentieth is three seconds of a minute."""
_SENTENCES = {
    "question": QUESTIONS, "exclamation": "exclamations", "statement": "statements", "laugh": "laughter",
    "greeting": "greetings", "reaction": "reactions", "goodbye": "goodbyes", "breath": "breaths",
}  # fmt: skip
_SPOKEN = 0.08
"""Level, of 1 at the loudest hundredth of a take, below which nobody speaks."""
_LOUD, _QUIET = 2.0, 0.4
"""Times the usual level of speech from which, and up to which, it counts as loud or quiet."""
_SMILING = 0.3


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
        if seconds > 0 and label.tier in ("sentence", "emotion"):
            found[_words(label.tier, label.text)] += seconds
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
    smiles = [share for one in materials if (share := _smiling(one.motion)) is not None]
    if smiles:
        found[SMILES] = float(np.mean(smiles))
    sentences = [
        one.selection for one in materials if any(x.tier == "sentence" for x in one.selection.labels)
    ]
    if sentences:
        asked = sum(x.duration for s in sentences for x in s.labels if x.text.lower() == "question")
        found[QUESTIONS] = asked / max(len(level) / RATE, 1e-9)
    return found


def missing(shares: dict[str, float]) -> tuple[str, ...]:
    """The kinds there is too little of, the one whose lack is most seen first."""
    return tuple(kind for kind, enough in ENOUGH.items() if kind in shares and shares[kind] < enough)


def _words(tier: str, text: str) -> str:
    known = _SENTENCES.get(text.lower(), text.lower())
    return known if tier == "sentence" else f"{known} speech"


def _smiling(motion: Motion) -> float | None:
    """Share of the frames that smile; None without a shape for it."""
    low = [name.lower() for name in motion.shape_names]
    shapes = [i for i, n in enumerate(low) if n in ("joy", "fun", "happy", "relaxed") or "smile" in n]
    if not shapes or not len(motion):
        return None
    return float((motion.shapes[:, shapes].max(axis=1) > _SMILING).mean())
