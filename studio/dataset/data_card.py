"""What a dataset holds, counted: minutes by performer, emotion, label and split, channels that move, grades.

Seconds are those used: from in to out without what is excluded. Nothing is guessed: a take nobody named is
counted as not said.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Dataset, Selection, overlap
from studio.errors import StudioError
from studio.motion import Motion, rotation
from studio.take.motion_file import load_motion
from studio.take.take import Take

if TYPE_CHECKING:
    from studio.take.check import Report

NOT_SAID = ""
"""The key of what nobody named."""
SHAPE_MOVES, BONE_MOVES = 0.005, 0.25
"""Deviation from which a channel counts as moving: of a weight, and of a bone's turn in degrees."""

Seconds = dict[str, float]
Count = TypeVar("Count", int, float)


@dataclass(frozen=True)
class ChannelActivity:
    """How much one channel moves over all takes that have it.

    Args:
        name: of the shape or bone.
        is_bone: a bone's turn in degrees; else a weight 0..1.
        spread: standard deviation; of a bone, the root mean square angle from its mean pose in each take.
        takes: how many takes have it.
    """

    name: str
    is_bone: bool
    spread: float
    takes: int

    @property
    def moves(self) -> bool:
        """Whether there is anything to learn from it."""
        return self.spread > (BONE_MOVES if self.is_bone else SHAPE_MOVES)


@dataclass(frozen=True)
class CardFacts:
    """Everything a data card says.

    Args:
        name: of the project.
        takes, selections, missing, unused: counts; unused are selections not used for anything.
        seconds: used, all together.
        by_split, by_performer, by_emotion: seconds.
        by_label: seconds and count by (tier, text), used spans only.
        channels: shapes, then bones, the liveliest first.
        motion_rates, sound_rates: seconds by rounded frames a second, and by Hz; 0 where there is none.
        grades: takes by "A" to "D"; those not checked are not in it.
        reasons: how often each kind of finding above a note was made.
        unread: sentences for motion that could not be read.
    """

    name: str
    takes: int = 0
    selections: int = 0
    missing: int = 0
    unused: int = 0
    seconds: float = 0.0
    by_split: tuple[tuple[str, float], ...] = ()
    by_performer: tuple[tuple[str, float], ...] = ()
    by_emotion: tuple[tuple[str, float], ...] = ()
    by_label: tuple[tuple[str, str, int, float], ...] = ()
    channels: tuple[ChannelActivity, ...] = ()
    motion_rates: tuple[tuple[int, float], ...] = ()
    sound_rates: tuple[tuple[int, float], ...] = ()
    grades: tuple[tuple[str, int], ...] = ()
    reasons: tuple[tuple[str, int], ...] = ()
    unread: tuple[str, ...] = ()


def card_facts(
    name: str,
    dataset: Dataset,
    takes: Mapping[str, Take],
    reports: Mapping[str, Report],
    on_progress: Callable[[float], None] = lambda fraction: None,
) -> CardFacts:
    """Count what is used; reads the motion of every take used, one after another.

    Args:
        name: of the project.
        dataset: the choices.
        takes: by id; a selection whose take is not there counts as missing.
        reports: checks by take id, those that were made.
        on_progress: told which fraction of the takes was read.
    """
    used = [(s, takes[s.take]) for s in dataset.selections if s.split and s.take in takes]
    facts = _counted(CardFacts(name), used)
    chosen = {take.id: take for _, take in used}
    channels, unread = _channels(tuple(chosen.values()), on_progress)
    graded = [reports[take_id] for take_id in chosen if take_id in reports]
    reasons: dict[str, int] = defaultdict(int)
    for report in graded:
        for kind in {finding.kind for finding in report.findings if finding.severity != "note"}:
            reasons[kind] += 1
    return replace(
        facts,
        takes=len(chosen),
        selections=len(used),
        missing=sum(s.take not in takes for s in dataset.selections),
        unused=sum(not s.split for s in dataset.selections),
        channels=channels,
        grades=tuple((g, sum(r.grade == g for r in graded)) for g in "ABCD") if graded else (),
        reasons=_largest(reasons),
        unread=unread,
    )


def _counted(facts: CardFacts, used: Sequence[tuple[Selection, Take]]) -> CardFacts:
    split: Seconds = dict.fromkeys(("train", "val", "test"), 0.0)
    performer, emotion = defaultdict[str, float](float), defaultdict[str, float](float)
    motion, sound = defaultdict[int, float](float), defaultdict[int, float](float)
    labels: dict[tuple[str, str], tuple[int, float]] = {}
    for selection, take in used:
        seconds = selection.seconds(take.info.duration)
        split[selection.split] += seconds
        performer[selection.performer] += seconds
        motion[round(take.info.fps) if take.info.motion_file else 0] += seconds
        sound[take.info.sample_rate if take.info.audio_file else 0] += seconds
        for text, part in _emotions(selection, take.info.duration, seconds).items():
            emotion[text] += part
        for label, part in _labels(selection, take.info.duration):
            count, before = labels.get(label, (0, 0.0))
            labels[label] = (count + 1, before + part)
    return replace(
        facts,
        seconds=sum(split.values()),
        by_split=tuple(split.items()),
        by_performer=_largest(performer),
        by_emotion=_largest(emotion),
        by_label=tuple(
            (*key, *labels[key]) for key in sorted(labels, key=lambda k: (k[0], -labels[k][1], k))
        ),
        motion_rates=tuple(sorted(motion.items())),
        sound_rates=tuple(sorted(sound.items())),
    )


def _labels(selection: Selection, duration: float) -> list[tuple[tuple[str, str], float]]:
    """((tier, text), seconds of it that are used) for each label that lies in what is used."""
    start, end = selection.span(duration)
    found = []
    for label in selection.labels:
        first, last = max(label.t, start), min(label.t + label.duration, end)
        part = last - first - overlap(selection.excluded, first, last)
        is_moment = label.duration == 0 and start <= label.t <= end
        left_out = any(a <= label.t < b for a, b in selection.excluded)
        if part > 1e-6 or (is_moment and not left_out):
            found.append(((label.tier, label.text), max(part, 0.0)))
    return found


def _emotions(selection: Selection, duration: float, seconds: float) -> Seconds:
    """Seconds by emotion: what its labels say, and for the rest what is said of the whole."""
    found: Seconds = defaultdict(float)
    for (tier, text), part in _labels(selection, duration):
        if tier == "emotion":
            found[text] += part
    rest = seconds - sum(found.values())
    if rest > 1e-6:
        found[selection.emotion or NOT_SAID] += rest
    return found


def _channels(
    takes: Sequence[Take], on_progress: Callable[[float], None]
) -> tuple[tuple[ChannelActivity, ...], tuple[str, ...]]:
    sums: dict[tuple[str, bool], tuple[float, float, int]] = {}
    unread: list[str] = []
    for count, take in enumerate(takes, 1):
        try:
            motion = load_motion(take)
        except StudioError as error:
            unread.append(error.what)
            motion = None
        for key, (total, frames) in _movement(motion).items() if motion is not None else ():
            before = sums.get(key, (0.0, 0.0, 0))
            sums[key] = (before[0] + total, before[1] + frames, before[2] + 1)
        on_progress(count / len(takes))
    found = [
        ChannelActivity(name, is_bone, float(np.sqrt(total / max(frames, 1.0))), takes_)
        for (name, is_bone), (total, frames, takes_) in sums.items()
    ]
    return tuple(sorted(found, key=lambda c: (c.is_bone, -c.spread, c.name))), tuple(unread)


def _movement(motion: Motion) -> dict[tuple[str, bool], tuple[float, int]]:
    """(sum of squares, frames) by (name, whether it is a bone)."""
    found: dict[tuple[str, bool], tuple[float, int]] = {}
    for i, name in enumerate(motion.shape_names):
        found[name, False] = _squares(motion.shapes[:, i].astype(np.float64))
    for j, name in enumerate(motion.bone_names):
        q = motion.rotations[:, j].astype(np.float64)
        found[name, True] = (float(np.sum(_from_mean(q) ** 2)), len(q))
    return found


def _squares(values: NDArray[np.float64]) -> tuple[float, int]:
    return (float(np.sum((values - values.mean()) ** 2)) if len(values) else 0.0), len(values)


def _from_mean(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees of each rotation (T, 4) from their mean pose, (T,)."""
    if not len(q):
        return np.zeros(0)
    even = rotation.sign_continuous(q)
    mean = even.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if length < 1e-9:
        return np.full(len(q), 180.0)
    angles: NDArray[np.float64] = np.degrees(rotation.angle_between(even, mean / length))
    return angles


def _largest(counts: Mapping[str, Count]) -> tuple[tuple[str, Count], ...]:
    return tuple(sorted(counts.items(), key=lambda item: (item[0] == NOT_SAID, -item[1], item[0])))
