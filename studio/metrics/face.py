"""What a viewer sees first: lips that close, motion that fits its own sound, eyes that blink."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.metrics.scores import MOVING, Figures, Pair
from studio.motion import Motion, lag, rotation
from studio.motion.channels import is_blink_shape, is_mouth_shape

Array = NDArray[np.floating]

JAW_OPENS = ("jawopen", "jaw_open", "mouth_stretch_c")
"""Lower-case names of the shape that opens the jaw: ARKit, FACEGOOD."""
JAW_SEALED = "mouthclose"
"""ARKit's shape that keeps the lips together while the jaw is open."""
VOWELS = frozenset({"a", "i", "u", "e", "o", "aa", "ih", "ou", "ee", "oh"})

CLOSED_SHARE, REOPENED_SHARE = 0.15, 0.3
"""The mouth counts as closed within this share of the captured opening's range from its low end, and as
opened again above the other."""
CLOSES_BESIDE = 0.1
"""Seconds before and after a captured closure in which a predicted one is that one."""
LEAST_OPENING = 0.02
"""A mouth that opens less than this all the while has no closures to find."""
SPEAKING_DB = 30.0
"""Sound counts as speech down to this far below the loudest hundredth of a take."""
LONGEST_STOP = 0.2
"""Seconds of quiet that still count as speaking: the sound of p, b and m stops while the lips are shut."""
BLINK_SHUT, BLINK_OPEN = 0.5, 0.3
"""A blink begins above the first and is over below the second."""
PIECE = 2.0
"""Seconds of the pieces of the mismatch test: a few words."""
LEAST_CONFIDENCE = 0.1
"""A mouth's delay is given from this confidence on (see motion.lag)."""


def face_figures(pairs: Sequence[Pair]) -> Figures:
    """Closures, lag, blinks and the mismatch test over some takes, each None where it does not apply."""
    recall, precision = closures(pairs)
    return {
        "closure_recall": recall,
        "closure_precision": precision,
        "sync_match": sync_match(pairs),
        "mouth_lag_ms": mouth_lag_ms(pairs),
        "blinks_per_minute": blinks_per_minute(pairs),
    }


def closures(pairs: Sequence[Pair]) -> tuple[float | None, float | None]:
    """Recall and precision of the closed mouth while speaking.

    recall = frames where both are closed / frames where the captured mouth is; precision = the same / frames
    where the predicted mouth is. Closed: opening <= low + CLOSED_SHARE (high - low), with the captured
    opening's 5th and 95th percentile; the same threshold for both. A mouth that never opens has recall 1,
    so read both.
    Source: van Rijsbergen 1979, precision and recall.
    """
    both = true = found = 0
    for pair in pairs:
        captured, predicted = opening(pair.truth), opening(pair.predicted)
        if pair.voice is None or captured is None or predicted is None or not len(captured):
            continue
        span = _span(captured)
        if span is None:
            continue
        # From the capture for both: with its own range a model that barely moves would close perfectly.
        limit = span[0] + CLOSED_SHARE * (span[1] - span[0])
        counts = speaking(pair) & pair.counts
        true += int((counts & (captured <= limit)).sum())
        found += int((counts & (predicted <= limit)).sum())
        both += int((counts & (captured <= limit) & (predicted <= limit)).sum())
    return (both / true if true else None), (both / found if found else None)


def closings(pair: Pair) -> tuple[int, int, int] | None:
    """How often the captured mouth closes, and how well the predicted one does beside it.

    Returns:
        In how many of the captured closures the predicted mouth closes, how many there are, and how often the
        predicted one closes elsewhere, in frames that count; None where no shape says so, or the captured
        mouth never opens.
    """
    captured, predicted = opening(pair.truth), opening(pair.predicted)
    span = _span(captured[pair.counts]) if captured is not None and pair.counts.any() else None
    if captured is None or predicted is None or span is None:
        return None
    closed, opened = (span[0] + share * (span[1] - span[0]) for share in (CLOSED_SHARE, REOPENED_SHARE))
    beside = round(CLOSES_BESIDE * pair.truth.fps)

    def times(course: Array) -> list[tuple[int, int]]:
        # What is left out ends a closure: the mouth may have opened in it.
        rows = np.flatnonzero(~pair.counts | (course <= closed) | (course >= opened))
        shut = np.concatenate([[False], (pair.counts & (course <= closed))[rows], [False]])
        # A mouth that trembles at the limit closes once.
        changes = np.flatnonzero(np.diff(shut.astype(int)))
        return [(int(rows[a]), int(rows[b - 1])) for a, b in zip(changes[::2], changes[1::2], strict=True)]

    def closes_in(course: Array, a: int, b: int) -> bool:
        shut = pair.counts & (course <= closed)
        return bool(shut[max(a - beside, 0) : b + beside + 1].any())

    found = [closes_in(predicted, a, b) for a, b in times(captured)]
    return sum(found), len(found), sum(not closes_in(captured, a, b) for a, b in times(predicted))


def _span(captured: Array) -> tuple[float, float] | None:
    """The range of a captured opening (T,); None of a mouth that never opens: it has no closures to find."""
    if not len(captured):
        return None
    # Percentiles, since one yawn would move the threshold for the whole take.
    low, high = np.percentile(captured, [5, 95])
    return (float(low), float(high)) if high - low >= LEAST_OPENING else None


def opening(motion: Motion) -> Array | None:
    """How far the mouth is open (T,): the jaw less ARKit's sealed lips, or all vowels of a VRM face.

    None where no shape says so.
    """
    weights = opening_weights(motion.shape_names)
    if not weights:
        return None
    columns = [motion.shape_names.index(name) for name in weights]
    return np.clip(motion.shapes[:, columns] @ np.array(list(weights.values())), 0.0, None)


def opening_weights(shape_names: Sequence[str]) -> dict[str, float]:
    """What each shape adds to the mouth's opening; empty where none says so."""
    named = {name.lower(): name for name in shape_names}
    jaw = next((named[name] for name in JAW_OPENS if name in named), None)
    if jaw is not None:
        sealed = {named[JAW_SEALED]: -1.0} if JAW_SEALED in named else {}
        return {jaw: 1.0} | sealed
    # VRM faces have no jaw shape; their vowels open the mouth, one or several at a time.
    return {name: 1.0 for low, name in named.items() if low in VOWELS}


def speaking(pair: Pair) -> NDArray[np.bool_]:
    """Frames (T,) in which there is speech, stops inside of words included."""
    times = pair.truth.times
    if pair.voice is None:
        return np.zeros(len(times), dtype=bool)
    level = pair.voice
    if not len(level):
        return np.zeros(len(times), dtype=bool)
    # Relative to the take's own loud moments: distances to the microphone differ.
    loud = level > 10 ** (-SPEAKING_DB / 20)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], loud, [True]]).astype(int)))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        # Quiet at the take's ends is before and after speech, never a stop within a word.
        inside = start > 0 and end < len(loud)
        if inside and end - start <= LONGEST_STOP * lag.RATE:
            loud[start:end] = True
    return loud[np.clip(np.round(times * lag.RATE).astype(int), 0, len(loud) - 1)]


def sync_match(pairs: Sequence[Pair]) -> float | None:
    """How often motion made for a sound fits the motion captured with it better than motion made for another.

    Pieces of PIECE seconds are held against each other: the share of all (i, j) of a take, i not j, for which
    captured piece i correlates better with predicted piece i than with piece j; .5 is chance. Of the
    mouth's shapes, or of how fast the bones turn where there is none. RMSE cannot tell a motion that follows
    its sound from one that is merely likely. Source: Chung and Zisserman 2016 (SyncNet), for the question.
    """
    won, tried = 0.0, 0
    for pair in pairs:
        if len(pair.truth) < 2 or not (pair.shapes or pair.bones):
            continue
        captured, predicted = (_pieces(_curves(pair, one), pair) for one in (pair.truth, pair.predicted))
        # In silence there is nothing to be told by, and noise must not be blown up to it.
        moving = captured.std(axis=1).max(axis=1, initial=0.0) > MOVING
        captured, predicted = _standardised(captured[moving]), _standardised(predicted[moving])
        # Channels weigh alike, whatever each is worth: (n, n), captured by predicted pieces.
        n = len(captured)
        fits = captured.reshape(n, -1) @ predicted.reshape(n, -1).T if n else np.zeros((0, 0))
        own = fits.diagonal()[:, None]
        # A tie is half a win, so that the mean pose is at chance; each piece ties with itself.
        won += float((own > fits).sum()) + ((own == fits).sum() - n) / 2
        tried += n * (n - 1)
    return won / tried if tried else None


def _curves(pair: Pair, motion: Motion) -> Array:
    """Mouth shapes (T, C) of one of the two that move in the capture, or each bone's speed."""
    mouth = [i for i, name in enumerate(pair.shapes) if is_mouth_shape(name)]
    if mouth and (pair.faces(pair.truth)[:, mouth].std(axis=0) > MOVING).any():
        moving = pair.faces(pair.truth)[:, mouth].std(axis=0) > MOVING
        return pair.faces(motion)[:, mouth][:, moving]
    turns = pair.turns(motion)
    speeds = rotation.angle_between(turns[1:], turns[:-1])
    return np.concatenate([speeds[:1], speeds]) if len(speeds) else np.zeros((len(turns), 0))


def _pieces(curves: Array, pair: Pair) -> Array:
    """Whole pieces (n, t, C) of curves that count throughout."""
    length = max(2, round(PIECE * pair.truth.fps))
    n = len(curves) // length
    whole = pair.counts[: n * length].reshape(n, length).all(axis=1)
    return curves[: n * length].reshape(n, length, curves.shape[1])[whole]


def _standardised(pieces: Array) -> Array:
    """Each piece's curves with mean 0 and length 1 over time; still ones stay 0."""
    apart = pieces - pieces.mean(axis=1, keepdims=True)
    return apart / np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-9)


def mouth_lag_ms(pairs: Sequence[Pair]) -> float | None:
    """How much later the mouth moves than the voice sounds, milliseconds; negative where it is early.

    The delay at which the mouth's opening correlates best with the voice's loudness, mean over takes by
    their length. Source: motion.lag; Chung and Zisserman 2016 (SyncNet) for the idea of an audio-video
    offset.
    """
    delays, weights = [], []
    for pair in pairs:
        if pair.voice is None or len(pair.predicted) < 2:
            continue
        found = lag.voice_offset(pair.voice.astype(np.float64), pair.predicted)
        # A flat correlation curve has its top anywhere; such a delay would be noise in the mean.
        if found.confidence >= LEAST_CONFIDENCE:
            # The offset moves motion onto the sound; the delay is how late it is, hence the sign.
            delays.append(-1000.0 * found.offset)
            weights.append(pair.predicted.duration)
    return float(np.average(delays, weights=weights)) if delays else None


def blinks_per_minute(pairs: Sequence[Pair]) -> float | None:
    """Blinks a minute in the predicted motion: how often an eye goes above BLINK_SHUT after BLINK_OPEN.

    None where the face has no blink shape. People: 17 at rest, 26 in talk. Source: Bentivoglio et al. 1997.
    """
    blinks, minutes = 0, 0.0
    for pair in pairs:
        eyes = [i for i, name in enumerate(pair.predicted.shape_names) if is_blink_shape(name)]
        if not eyes or len(pair.predicted) < 2:
            continue
        # The eye that is shut further: a wink is a blink as well, and one eye alone may be tracked.
        shut = np.where(pair.counts, pair.predicted.shapes[:, eyes].max(axis=1), 0.0)
        blinks += count_blinks(shut)
        # Frames that count and not the take's length: gaps hold no blinks.
        minutes += float(pair.counts.sum()) / pair.predicted.fps / 60
    return blinks / minutes if minutes else None


def count_blinks(shut: Array) -> int:
    """How many blinks are in a curve (T,) of how far the eyes are shut."""
    state = np.where(shut > BLINK_SHUT, 1, np.where(shut < BLINK_OPEN, 0, -1))
    state = state[state >= 0]  # between the two it stays what it was
    return int((np.diff(np.concatenate([[0], state])) == 1).sum())
