"""How far a predicted motion is from the captured one, over time and in sum. Pure: numpy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation

MOVES = 0.005
"""A channel whose captured deviation is smaller does not count for the ratios."""
FULL_HEAT = 0.25
"""Error of a blend shape that is drawn as the hottest."""
FULL_HEAT_DEGREES = 25.0


@dataclass(frozen=True, eq=False)
class MotionComparison:
    """Predicted against captured, on the frames both have.

    Args:
        times: seconds (T,).
        heat: error of each frame, 0 to 1 (T,).
        rmse: root mean square error of the shapes; None without common shapes.
        pearson: mean correlation of the shapes that move; None where none does.
        motion_ratio: predicted over captured mean change from frame to frame.
        degrees: mean angle between the bones; None without common bones.
    """

    times: NDArray[np.float64]
    heat: NDArray[np.float64]
    rmse: float | None
    pearson: float | None
    motion_ratio: float | None
    degrees: float | None


def compare(captured: Motion, predicted: Motion) -> MotionComparison | None:
    """The comparison; None where they share no channel or no time."""
    if not len(captured) or not len(predicted):
        return None
    start = max(captured.times[0], predicted.times[0])
    end = min(captured.times[-1], predicted.times[-1])
    times = predicted.times[(predicted.times >= start) & (predicted.times <= end)]
    shapes = [name for name in captured.shape_names if name in predicted.shape_names]
    bones = [name for name in captured.bone_names if name in predicted.bone_names]
    if len(times) < 2 or not (shapes or bones):
        return None
    truth, guess = captured.at(times), predicted.at(times)
    heat = np.zeros(len(times))
    rmse = pearson = motion = degrees = None
    if shapes:
        a, b = _columns(truth, shapes), _columns(guess, shapes)
        error = np.sqrt(((a - b) ** 2).mean(axis=1))
        rmse = float(np.sqrt(((a - b) ** 2).mean()))
        heat = np.clip(error / FULL_HEAT, 0.0, 1.0)
        pearson, motion = _correlation(a, b), _ratio(a, b)
    if bones:
        angle = _angles(truth, guess, bones)
        degrees = float(angle.mean())
        heat = np.maximum(heat, np.clip(angle.mean(axis=1) / FULL_HEAT_DEGREES, 0.0, 1.0))
    return MotionComparison(np.asarray(times), heat, rmse, pearson, motion, degrees)


def _columns(motion: Motion, names: list[str]) -> NDArray[np.float64]:
    return motion.shapes[:, [motion.shape_names.index(name) for name in names]].astype(np.float64)


def _angles(a: Motion, b: Motion, bones: list[str]) -> NDArray[np.floating]:
    first = a.rotations[:, [a.bone_names.index(name) for name in bones]]
    second = b.rotations[:, [b.bone_names.index(name) for name in bones]]
    return np.degrees(rotation.angle_between(first, second))


def _correlation(a: NDArray[np.float64], b: NDArray[np.float64]) -> float | None:
    moving = a.std(axis=0) > MOVES
    if not moving.any():
        return None
    x, y = a[:, moving] - a[:, moving].mean(axis=0), b[:, moving] - b[:, moving].mean(axis=0)
    scale = np.sqrt((x**2).sum(axis=0) * (y**2).sum(axis=0))
    # A channel that stands still follows nothing: its correlation counts as 0.
    return float(np.where(scale > 1e-12, (x * y).sum(axis=0) / np.maximum(scale, 1e-12), 0.0).mean())


def _ratio(a: NDArray[np.float64], b: NDArray[np.float64]) -> float | None:
    moving = a.std(axis=0) > MOVES
    if not moving.any():
        return None
    change = np.abs(np.diff(a[:, moving], axis=0)).mean()
    return float(np.abs(np.diff(b[:, moving], axis=0)).mean() / change) if change > 0 else None
