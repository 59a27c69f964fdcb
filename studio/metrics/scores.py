"""How near and how alive predicted motion is, each figure with its formula and source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation
from studio.motion.channels import is_mouth_shape

Array = NDArray[np.floating]
Figures = dict[str, float | None]

# Below this a ratio would divide the trembling of a tracker by itself.
MOVING = 0.005
"""A column counts as moving when its captured standard deviation exceeds this."""

STILL_RATIO = 0.3
"""Below this share of the captured motion a model is called still."""

JAW_SHAPES = frozenset({"jawopen", "jaw_open", "a", "aa", "mouth_stretch_c"})
"""Lower-case names of the shape that opens the jaw: ARKit, VRM 0 and 1, FACEGOOD."""

REGIONS: Mapping[str, tuple[str, ...]] = {
    "head": ("Head", "Neck"),
    "torso": ("Hips", "Spine", "Chest", "UpperChest"),
    "arms": ("Shoulder", "UpperArm", "LowerArm", "Hand"),
}
"""Bones of the body regions whose motion is watched, by how their names end."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Predicted and captured motion on the same frames.

    Args:
        truth, predicted: T frames each; channels only one of them has are not compared.
        valid: 1 for frames that count, (T,); all where None.
        voice: loudness of what was spoken (K,), motion.lag.RATE values a second from the first frame's moment
            on; figures that need it are None without.
    """

    truth: Motion
    predicted: Motion
    # None instead of ones, so that whole takes (most of them) are neither copied nor masked.
    valid: Array | None = None
    voice: Array | None = None

    @cached_property
    def counts(self) -> NDArray[np.bool_]:
        """Frames that count, (T,)."""
        return np.ones(len(self.truth), dtype=bool) if self.valid is None else self.valid > 0

    @cached_property
    def shapes(self) -> tuple[str, ...]:
        """Blend shapes both have."""
        return tuple(n for n in self.truth.shape_names if n in self.predicted.shape_names)

    @cached_property
    def bones(self) -> tuple[str, ...]:
        """Bones both have."""
        return tuple(n for n in self.truth.bone_names if n in self.predicted.bone_names)

    def turns(self, motion: Motion) -> Array:
        """The shared bones' rotations of one of the two, (T, J, 4)."""
        return motion.rotations[:, [motion.bone_names.index(n) for n in self.bones]]

    def faces(self, motion: Motion) -> Array:
        """The shared shapes of one of the two, (T, S)."""
        return motion.shapes[:, [motion.shape_names.index(n) for n in self.shapes]]

    def counted(self, values: Array) -> Array:
        """Values (T, C) in float64 with frames that do not count as NaN."""
        return np.where(self.counts[:, None], values.astype(np.float64), np.nan)

    def columns(self, motion: Motion) -> dict[str, Array]:
        """Shape and 6D columns of one of the two by name, (T,) each, frames that do not count as NaN."""
        found = {n: motion.shapes[:, motion.shape_names.index(n)] for n in self.shapes}
        if self.bones:
            six = rotation.to_6d(self.turns(motion))
            found |= {f"{b}.{i}": six[:, j, i] for j, b in enumerate(self.bones) for i in range(6)}
        if self.valid is None:
            return found
        # NaN and not removal: differences must not reach over a gap as if its sides were neighbours.
        return {name: np.where(self.valid > 0, values, np.nan) for name, values in found.items()}


def score(pairs: Sequence[Pair]) -> Figures:
    """All figures over some takes, frames pooled; a figure that does not apply is None.

    Args:
        pairs: one a take.
    """
    names = _names(pairs)
    truth, predicted = matrices(pairs)
    faces = np.array(["." not in n or n in _all_shapes(pairs) for n in names], dtype=bool)
    whole, face, body = (
        part_figures(predicted[:, part], truth[:, part]) for part in (faces | True, faces, ~faces)
    )
    moving = _deviation(truth) > MOVING
    # Only what moved in the capture has a correlation; a still channel would count as 0 and hide the others.
    mouth = moving & faces & np.array([is_mouth_shape(n) for n in names], dtype=bool)
    jaw = moving & faces & np.array([n.lower() in JAW_SHAPES for n in names], dtype=bool)
    figures: Figures = {
        "rmse": whole["rmse"],
        "mae": mae(predicted, truth),
        "nrmse": nrmse(predicted, truth, _ranges(truth)),
        "rmse_face": face["rmse"],
        "rmse_body": body["rmse"],
        "pearson": whole["pearson"],
        "pearson_face": face["pearson"],
        "pearson_mouth": pearson(predicted[:, mouth], truth[:, mouth]),
        "pearson_jaw": pearson(predicted[:, jaw], truth[:, jaw]),
        "std_ratio": std_ratio(predicted[:, moving], truth[:, moving]),
        "motion_ratio": whole["motion_ratio"],
    }
    if (moving & faces).any() and (moving & ~faces).any():  # of one part alone the whole says it already
        figures |= {"motion_ratio_face": face["motion_ratio"], "motion_ratio_body": body["motion_ratio"]}
    figures["jerk_ratio"] = jerk_ratio(predicted[:, moving], truth[:, moving])
    return figures | body_figures(pairs)


def part_figures(p: Array, t: Array) -> Figures:
    """RMSE, correlation and liveliness of the columns (T, C) of one part, the face or the body."""
    moving = _deviation(t) > MOVING
    return {
        "rmse": rmse(p, t),
        "pearson": pearson(p[:, moving], t[:, moving]),
        "motion_ratio": motion_ratio(p[:, moving], t[:, moving]),
    }


def rmse(p: Array, t: Array) -> float | None:
    """Root mean square error, sqrt(mean (p - t)^2), over all frames and columns (T, C) it is given.

    Review gives it the face alone. Source: Tian et al. 2019, eq. 9.
    """
    return _root(np.square(p - t))


def nrmse(p: Array, t: Array, ranges: Array) -> float | None:
    """RMSE of values scaled by each column's range in the captured frames; what hardly moves is left out.

    Source: the SAIA reports, which give RMSE on values scaled like this.
    """
    # A range is about twice a deviation for a channel that swings, hence the same limit doubled.
    wide = ranges > 2 * MOVING
    return _root(np.square((p - t)[:, wide] / ranges[wide]))


def mae(p: Array, t: Array) -> float | None:
    """Mean absolute error, mean |p - t|.

    Source: Willmott and Matsuura 2005, for what it says that RMSE does not.
    """
    return _average(np.abs(p - t))


def pearson(p: Array, t: Array) -> float | None:
    """Mean over columns of cov(p, t) / (sd(p) sd(t)); 0 for a column that is predicted constant.

    Source: Pearson 1895.
    """
    values = correlations(p, t)
    return float(values.mean()) if len(values) else None


def correlations(p: Array, t: Array) -> Array:
    """Pearson's r of each column (T, C) -> (C,)."""
    if not p.size:
        return np.zeros(0)
    dp, dt = p - np.nanmean(p, axis=0), t - np.nanmean(t, axis=0)
    below = np.sqrt(np.nanmean(dp**2, axis=0) * np.nanmean(dt**2, axis=0))
    # A channel that stands still follows nothing: its correlation counts as 0, not as unknown.
    return np.where(below > 1e-10, np.nanmean(dp * dt, axis=0) / np.maximum(below, 1e-10), 0.0)


def motion_ratio(p: Array, t: Array) -> float | None:
    """mean |p_i - p_{i-1}| / mean |t_i - t_{i-1}|: 1 is as lively as captured, 0 stands still.

    Source: our own, since the SAIA reports' RMSE could not tell a model that stood still.
    """
    return _ratio(np.abs(np.diff(p, axis=0)), np.abs(np.diff(t, axis=0)))


def is_still(ratio: float | None) -> bool:
    """Whether a model, by its motion ratio, moves so little that a person should know."""
    return ratio is not None and ratio < STILL_RATIO


def jerk_ratio(p: Array, t: Array) -> float | None:
    """mean |third difference of p| / that of t: well above 1 is jitter.

    Source: Flash and Hogan 1985, for jerk as the measure of smoothness.
    """
    return _ratio(np.abs(np.diff(p, n=3, axis=0)), np.abs(np.diff(t, n=3, axis=0)))


def std_ratio(p: Array, t: Array) -> float | None:
    """Mean over columns of sd(p) / sd(t): below 1 the poses are less wide than captured.

    Source: our own; that a mean of many answers is narrow is Bishop 1994, Mixture Density Networks.
    """
    if not p.size:
        return None
    return float(np.mean(_deviation(p) / np.maximum(_deviation(t), 1e-10)))


def body_figures(pairs: Sequence[Pair]) -> Figures:
    """Geodesic error in degrees over all bones, and how lively head, torso and arms turn.

    Geodesic error: mean 2 atan2(|v|, |w|) of p^-1 t = (v, w). Region ratio: mean angle turned from frame to
    frame, predicted over captured. Source: Huynh 2009, Metrics for 3D Rotations.
    """
    # Regions are only said where there are bones at all; a face-only run keeps a short table.
    figures: Figures = {"geodesic_deg": None}
    errors = geodesic_by_bone(pairs)
    if errors:
        figures["geodesic_deg"] = float(np.mean(list(errors.values())))
        for region in REGIONS:
            figures[f"motion_ratio_{region}"] = _region_ratio(pairs, region)
    return figures


def geodesic_by_bone(pairs: Sequence[Pair]) -> dict[str, float]:
    """Mean geodesic error of each bone in degrees; empty without bones."""
    found: dict[str, list[Array]] = {}
    for pair in pairs:
        angles = geodesic_errors(pair)[pair.counts]
        for j, bone in enumerate(pair.bones):
            found.setdefault(bone, []).append(angles[:, j])
    means = {bone: np.concatenate(parts) for bone, parts in found.items()}
    # A bone whose every frame is left out has no mean; numpy would warn and give NaN.
    return {bone: float(values.mean()) for bone, values in means.items() if len(values)}


def geodesic_errors(pair: Pair) -> Array:
    """Angle between predicted and captured bones on every frame, degrees (T, J)."""
    return np.degrees(rotation.angle_between(pair.turns(pair.predicted), pair.turns(pair.truth)))


def _region_ratio(pairs: Sequence[Pair], region: str) -> float | None:
    sums = np.zeros(2)
    for pair in pairs:
        chosen = [j for j, bone in enumerate(pair.bones) if in_region(bone, region)]
        if not chosen or len(pair.truth) < 2:
            continue
        valid = np.ones(len(pair.truth)) if pair.valid is None else pair.valid
        # A change counts only where both of its frames do.
        both = (valid[1:] * valid[:-1]) > 0
        for i, motion in enumerate((pair.predicted, pair.truth)):
            turns = pair.turns(motion)[:, chosen]
            sums[i] += float(rotation.angle_between(turns[:-1], turns[1:])[both].sum())
    # Sums and not a mean of ratios: a take in which the arms rest would otherwise decide with noise.
    return float(sums[0] / sums[1]) if sums[1] > 1e-6 else None


def in_region(bone: str, region: str) -> bool:
    """Whether a bone belongs to a body region."""
    return bone.removeprefix("Left").removeprefix("Right") in REGIONS[region]


def matrices(pairs: Sequence[Pair]) -> tuple[Array, Array]:
    """Captured and predicted columns of all takes under one another, (T, C) each; NaN where none counts."""
    names = _names(pairs)
    return _matrix(pairs, names, truth=True), _matrix(pairs, names, truth=False)


def _names(pairs: Sequence[Pair]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(n for pair in pairs for n in (*pair.shapes, *_six_names(pair.bones))))


def _six_names(bones: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{bone}.{i}" for bone in bones for i in range(6))


def _all_shapes(pairs: Sequence[Pair]) -> frozenset[str]:
    return frozenset(name for pair in pairs for name in pair.shapes)


def _matrix(pairs: Sequence[Pair], names: tuple[str, ...], *, truth: bool) -> Array:
    """All takes under one another (T, C); NaN where a take lacks a column, and a row of NaN between takes."""
    parts = []
    for pair in pairs:
        motion = pair.truth if truth else pair.predicted
        columns, gap = pair.columns(motion), np.full(len(motion), np.nan)
        part = np.stack([columns.get(n, gap) for n in names], axis=1) if names else np.zeros((len(motion), 0))
        # Three rows, so that no difference, not even the third, reaches over a join.
        parts += [part.astype(np.float64), np.full((3, len(names)), np.nan)]
    return np.concatenate(parts[:-1]) if parts else np.zeros((0, 0))


def _ranges(truth: Array) -> Array:
    if not truth.size:
        return np.zeros(truth.shape[1:])
    return np.nan_to_num(np.nanmax(_some(truth), axis=0) - np.nanmin(_some(truth), axis=0))


def _some(values: Array) -> Array:
    """Values whose all-NaN columns are zeros, so that numpy has something to reduce."""
    return np.where(np.isnan(values).all(axis=0), 0.0, values)


def _deviation(values: Array) -> Array:
    return np.nanstd(_some(values), axis=0) if values.size else np.zeros(values.shape[1:])


def _average(values: Array) -> float | None:
    # Everything that does not count arrives here as NaN.
    good = values[np.isfinite(values)]
    return float(good.mean()) if good.size else None


def _root(squares: Array) -> float | None:
    mean = _average(squares)
    return None if mean is None else float(np.sqrt(mean))


def _ratio(p: Array, t: Array) -> float | None:
    above, below = _average(p), _average(t)
    return above / below if above is not None and below is not None and below > 1e-9 else None


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
    # One scale for all takes: with its own, a calm take would seem as wrong as a lively one.
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
