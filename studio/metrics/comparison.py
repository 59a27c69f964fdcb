"""Predicted against captured motion on the same frames: every figure, and what Review shows of a take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.metrics.body import place_figures, spread_figures
from studio.metrics.face import closings, face_figures
from studio.metrics.scores import Array, Figures, Pair, geodesic_errors, part_figures, score
from studio.motion import Motion
from studio.motion.grid import learnt_rate, on_grid
from studio.motion.standing import standing

MOST_FPS = 30.0
"""Figures are measured on no more frames a second than this."""
FULL_HEAT = 0.25
"""Error of a blend shape that is drawn as the hottest."""
FULL_HEAT_DEGREES = 25.0


@dataclass(frozen=True, eq=False)
class MotionComparison:
    """Predicted against captured, on the frames both have.

    Args:
        times: seconds (T,).
        heat: error of each frame, 0 to 1 (T,); 0 on frames that do not count.
        rmse: root mean square error of the shapes, an evaluation's rmse_face; None without common shapes.
        pearson: mean correlation of the shapes that move, pearson_face; None where none does.
        motion_ratio: predicted over captured mean change of those from frame to frame, motion_ratio_face.
        degrees: mean angle between the bones, geodesic_deg; None without common bones.
        closings: in how many of the captured mouth's closures the predicted one closes, how many these are,
            and how often it closes elsewhere; None where the captured one never opens.
    """

    times: NDArray[np.float64]
    heat: Array
    rmse: float | None
    pearson: float | None
    motion_ratio: float | None
    degrees: float | None
    closings: tuple[int, int, int] | None


def pair_on_frames(
    predicted: Motion,
    captured: Motion,
    duration: float,
    excluded: Sequence[tuple[float, float]] = (),
    voice: Array | None = None,
) -> Pair:
    """Both motions on even frames at the captured rate, or a whole fraction of it not above MOST_FPS.

    Each stands where its own feet do, what it strays through the room in its root.

    Args:
        predicted, captured: times from the in point, seconds.
        duration: of the sound, seconds.
        excluded: spans left out, seconds from the in point.
        voice: loudness of the sound, motion.lag.RATE values a second.
    """
    # Runs learnt at different rates are compared alike, and jerk is not that of interpolation.
    grid = on_grid(captured, duration, learnt_rate(captured.fps, MOST_FPS), excluded, feet_stay=False)
    return Pair(grid.motion, standing(predicted.at(grid.motion.times)), grid.valid, voice)


def all_figures(pairs: Sequence[Pair]) -> Figures:
    """Every figure there is over some takes; None where one does not apply."""
    return score(pairs) | face_figures(pairs) | place_figures(pairs) | spread_figures(pairs)


def compare(
    captured: Motion,
    predicted: Motion,
    start: float,
    end: float | None,
    excluded: Sequence[tuple[float, float]],
) -> MotionComparison | None:
    """The comparison of one take as Review shows it; None where they share no channel or no time.

    Args:
        captured, predicted: on the take's clock, seconds.
        start, end: in and out point; an evaluation measures nothing outside of them, and so does this.
        excluded: spans left out.
    """
    if not len(captured) or not len(predicted):
        return None
    # An evaluation cuts at the points first and compares then; in this order both see the same frames.
    used = captured.cut(start, np.inf if end is None else end)
    last = float(predicted.times[-1]) - start
    if not len(used) or last < 0:
        return None
    spans = [(a - start, b - start) for a, b in excluded]
    pair = pair_on_frames(predicted.shifted(-start), used, last, spans)
    # Only a prediction that begins or ends within the take has frames without one.
    times = pair.truth.times
    both = np.flatnonzero((times >= float(predicted.times[0]) - start) & (times <= last + 1e-9))
    # One frame has no change and no correlation.
    if len(both) < 2 or not (pair.shapes or pair.bones):
        return None
    valid = None if pair.valid is None else pair.valid[both]
    pair = Pair(pair.truth.at_rows(both), pair.predicted.at_rows(both), valid)
    heat = np.zeros(len(both))
    figures: Figures = {}
    if pair.shapes:
        guess, truth = pair.faces(pair.predicted), pair.faces(pair.truth)
        figures = part_figures(pair.counted(guess), pair.counted(truth))
        heat = np.clip(np.sqrt(np.square(guess - truth).mean(axis=1)) / FULL_HEAT, 0.0, 1.0)
    degrees = None
    if pair.bones:
        angles = geodesic_errors(pair)
        degrees = float(angles[pair.counts].mean()) if pair.counts.any() else None
        # The worse of face and body colours the moment: each is a fault of its own.
        heat = np.maximum(heat, np.clip(angles.mean(axis=1) / FULL_HEAT_DEGREES, 0.0, 1.0))
    return MotionComparison(
        times[both] + start,
        np.where(pair.counts, heat, 0.0),
        figures.get("rmse"),
        figures.get("pearson"),
        figures.get("motion_ratio"),
        degrees,
        closings(pair),
    )
