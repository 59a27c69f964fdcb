"""What of a sound says how a body moves: the numbers by which captured moments are found again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.model._network import CapturedStretch

LEAST_SECONDS, MOST_SECONDS = 30.0, 1200.0
"""Of captured body: with less it would soon repeat itself, with more the file would grow for nothing."""
PIECE_SECONDS = 10.0
EVEN = 0.5
"""Columns of a pose are compared over their deviation to this power: a torso leans less than arms swing."""
BANDS, KEYS, DIRECTIONS = 8, 12, 24
"""Numbers a frame of sound is described by, numbers that are compared, and directions of the body."""
LOW_SECONDS = (0.1, 0.4, 1.5)
_RIDGE = 0.02
HEARD, ONSET = 2.0, 1.0
"""Weights of what is heard and of its loudness beside it."""


def shares(fps: float) -> NDArray[np.float64]:
    """How much of what is new goes into what was heard slowly, in a frame (L,)."""
    return 1 - np.exp(-1 / (np.array(LOW_SECONDS) * fps))


def contexts_of(sounds: NDArray[np.float64], fps: float) -> NDArray[np.float64]:
    """Each frame of sound (n, P) with what was heard before it, and 1."""
    follow, low = shares(fps), np.tile(sounds[0], (len(LOW_SECONDS), 1))
    rows = []
    for sound in sounds:
        low = low + follow[:, None] * (sound - low)
        rows.append(np.concatenate([sound, *low, np.ones(1)]))
    return np.array(rows)


def widest(values: NDArray[np.float64], count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The widest directions (C, count), widest first, and how wide."""
    variances, vectors = np.linalg.eigh(np.atleast_2d(np.cov(values.T)))
    return vectors[:, ::-1][:, :count], np.sqrt(np.clip(variances[::-1][:count], 0, None))


def pose_directions(bodies: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions in which bodies are compared (B, R), columns made more even."""
    deviation = bodies.std(axis=0)
    even = np.maximum(deviation + 0.1 * deviation.mean(), 1e-9) ** -EVEN
    directions, _ = widest(bodies * even, DIRECTIONS)
    found: NDArray[np.float64] = even[:, None] * directions
    return found


def key_of(contexts: NDArray[np.float64], bodies: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """From contexts to what is compared (D, A): what of the sound says most of the body, and the loudness.

    Source: reduced-rank regression, Izenman 1975.
    """
    speeds = [np.gradient(body, axis=0) if len(body) > 1 else 0 * body for body in bodies]
    targets = np.concatenate(
        [np.concatenate([b, s, np.abs(s)], axis=1) for b, s in zip(bodies, speeds, strict=True)]
    )
    targets = (targets - targets.mean(axis=0)) / np.maximum(targets.std(axis=0), 1e-9)
    mean, width = contexts[:, :-1].mean(axis=0), np.maximum(contexts[:, :-1].std(axis=0), 1e-6)
    x = (contexts[:, :-1] - mean) / width
    weights = np.linalg.solve(x.T @ x + _RIDGE * len(x) * np.eye(x.shape[1]), x.T @ targets)
    directions, wide = widest(x @ weights, KEYS)
    # Together as wide as 1: what is heard then weighs the same for everyone.
    heard = np.sqrt(HEARD) * weights @ directions / max(float(np.sqrt(np.square(wide).sum())), 1e-9)
    loud = np.zeros((x.shape[1], 2))
    # The widest band of speech is its loudness; over a tenth of a second it says where a syllable began.
    loud[0, 0], loud[0, 1], loud[BANDS, 1] = 1.0, width[0], -width[BANDS]
    loud /= np.maximum((x @ loud).std(axis=0), 1e-9) / np.sqrt(ONSET / 2)
    both = np.concatenate([heard, loud], axis=1) / width[:, None]
    return np.concatenate([both, -(mean @ both)[None]])


def spread(stretches: Sequence[CapturedStretch], fps: float) -> list[CapturedStretch]:
    """All stretches, or pieces spread over them where they are too long."""
    most, size = int(MOST_SECONDS * fps), int(PIECE_SECONDS * fps)
    stretches = [one for one in stretches if len(one.poses) > fps]
    if sum(len(one.poses) for one in stretches) <= most:
        return list(stretches)
    pieces = [
        replace(one, rows=one.rows[a : a + size], poses=one.poses[a : a + size])
        for one in stretches
        for a in range(0, len(one.poses) - size + 1, size)
    ]
    chosen = np.unique(np.linspace(0, len(pieces) - 1, most // size).round().astype(int))
    return [pieces[i] for i in chosen]
