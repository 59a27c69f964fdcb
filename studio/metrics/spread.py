"""Whether predicted motion as a whole is as varied as captured motion, frame by frame likeness aside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.metrics.body import joint_places
from studio.metrics.scores import MOVING, Figures, Pair, matrices

Array = NDArray[np.floating]

_BEYOND = 1e30
"""Deviations away from what was captured: of motion so far out no covariance can be computed."""


def spread_figures(pairs: Sequence[Pair]) -> Figures:
    """Diversity of face and body, and the distance between the two distributions of motion."""
    return {
        "diversity_face": l1_diversity([pair.faces(pair.predicted)[pair.counts] for pair in pairs]),
        "diversity_body_cm": l1_diversity([_places(pair)[pair.counts] for pair in pairs]),
        "frechet": frechet(pairs),
    }


def l1_diversity(parts: Sequence[Array]) -> float | None:
    """L1Div = 1 / (2 N (N - 1)) sum_i sum_j |x_i - x_j|_1 over all pairs of the N poses of some takes.

    The sum over pairs follows from the sorted values, sum_k (2 k - N + 1) x_(k) for each column.
    Source: Li et al. 2021 (Audio2Gestures); as used by Liu et al. 2022 (BEAT).

    Args:
        parts: poses (T, D) of each take; takes that lack channels others have are left out.
    """
    width = max((part.shape[1] for part in parts), default=0)
    poses = [part for part in parts if part.shape[1] == width and width]
    x = np.sort(np.concatenate(poses), axis=0) if poses else np.zeros((0, 0))
    count = len(x)
    if count < 2:
        return None
    pairs_sum = float(((2 * np.arange(count) - count + 1)[:, None] * x).sum())  # each pair once
    return pairs_sum / (count * (count - 1))


def frechet(pairs: Sequence[Pair]) -> float | None:
    """Frechet distance of predicted and captured motion features, over the number of features D.

    (|m_p - m_t|^2 + tr(S_p + S_t - 2 (S_p S_t)^(1/2))) / D on the values and the changes from frame to frame
    of all moving columns, each over its captured deviation. 0: the same distribution; 1: as far as a face
    that keeps the mean pose.
    Source: Heusel et al. 2017 (FID); kinetic features as Li et al. 2021 (AIST++), without a learnt encoder.
    """
    truth, predicted = matrices(pairs)
    if truth.size == 0:
        return None
    truth, predicted = truth[:, _complete(truth)], predicted[:, _complete(truth)]
    deviation = np.nanstd(truth, axis=0) if truth.size else np.zeros(0)
    moving = deviation > MOVING
    if not moving.any():
        return None
    t, p = _kinetic(truth[:, moving], truth[:, moving]), _kinetic(predicted[:, moving], truth[:, moving])
    if len(t) < 3 or not (np.abs(p) < _BEYOND).all():
        return None
    apart = np.square(p.mean(axis=0) - t.mean(axis=0)).sum()
    st, sp = np.cov(t, rowvar=False), np.cov(p, rowvar=False)
    root = _root(st)
    common = np.sqrt(np.clip(np.linalg.eigvalsh(root @ sp @ root), 0.0, None)).sum()
    return float(max(apart + np.trace(st) + np.trace(sp) - 2 * common, 0.0) / t.shape[1])


def _kinetic(values: Array, truth: Array) -> Array:
    """Values and changes (T - 1, 2 C) over the captured ones' deviations; rows with gaps left out."""

    def both(x: Array) -> Array:
        return np.concatenate([x[1:], np.diff(x, axis=0)], axis=1)

    reference = both(truth)
    whole = np.isfinite(reference).all(axis=1)
    found: Array = both(values)[whole] / np.maximum(reference[whole].std(axis=0), 1e-6)
    return found


def _complete(truth: Array) -> NDArray[np.bool_]:
    """Columns all takes have: those with as many numbers as the fullest."""
    numbers = np.isfinite(truth).sum(axis=0)
    return numbers == numbers.max(initial=0)


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(np.atleast_2d(covariance))
    root: Array = (vectors * np.sqrt(np.clip(values, 0.0, None))) @ vectors.T
    return root


def _places(pair: Pair) -> Array:
    """Joint places in centimetres, (T, 3 J)."""
    return 100.0 * joint_places(pair, pair.predicted).reshape(len(pair.predicted), 3 * len(pair.bones))
