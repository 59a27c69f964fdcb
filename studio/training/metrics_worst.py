"""How far a prediction is from what was captured, frame by frame: to find takes whose capture went wrong."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from studio.training.metrics import MOVING, Array, Pair


def frame_errors(pairs: Mapping[str, Pair]) -> dict[str, tuple[Array, Array]]:
    """Error of each frame of some takes, on one scale for all of them.

    Columns are divided by their captured deviation over all takes, so that a quiet brow counts like a wide
    arm; those that hardly move are left out.

    Args:
        pairs: one a take.

    Returns:
        (seconds from the in point (T,), root mean square over the columns (T,)) by take; NaN on frames that
        do not count.
    """
    truth = {name: pair.columns(pair.truth) for name, pair in pairs.items()}
    scale = _deviations(list(truth.values()))
    found: dict[str, tuple[Array, Array]] = {}
    for name, pair in pairs.items():
        predicted = pair.columns(pair.predicted)
        squares = [
            np.square((predicted[column] - values) / scale[column])
            for column, values in truth[name].items()
            if scale[column] > MOVING
        ]
        frames = len(pair.truth)
        error = np.sqrt(np.mean(squares, axis=0)) if squares else np.full(frames, np.nan)
        found[name] = (pair.truth.times, error)
    return found


def _deviations(takes: list[dict[str, Array]]) -> dict[str, float]:
    parts: dict[str, list[Array]] = {}
    for columns in takes:
        for name, values in columns.items():
            parts.setdefault(name, []).append(values[np.isfinite(values)])
    pooled = {name: np.concatenate(values) for name, values in parts.items()}
    return {name: float(values.std()) if values.size else 0.0 for name, values in pooled.items()}
