"""Where head and hands are, whether gestures fall on the beats of speech, and how varied motion is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.metrics.scores import MOVING, Figures, Pair, in_region, matrices
from studio.motion import Motion, lag, rotation
from studio.motion.skeleton import Skeleton

Array = NDArray[np.floating]

PLACES = {"head_cm": ("Head",), "wrist_cm": ("LeftHand", "RightHand")}
"""Bones whose places are compared."""
BEAT_SECONDS = 0.1
"""How near a gesture's beat has to be to one of the voice (sigma)."""
ONSET_DB = 6.0
"""Rise within RISE_SECONDS from which the voice has a beat."""
RISE_SECONDS = 0.05
APART_SECONDS = 0.1


def place_figures(pairs: Sequence[Pair]) -> Figures:
    """Errors of head and wrists in centimetres and the beat alignment; None where bones are missing."""
    return {**place_errors(pairs), "beat_alignment": beat_alignment(pairs)}


def place_errors(pairs: Sequence[Pair]) -> Figures:
    """Mean distance between predicted and captured joints by forward kinematics, centimetres.

    mean |FK(p) - FK(t)| in the avatar's own space, the hips' motion included.
    Source: Ionescu et al. 2014 (Human3.6M), mean per-joint position error.
    """
    # In the avatar's own space: where a performer stood in the room is not the model's to know.
    return _apart(pairs, joint_places, "")


def place_parts(pairs: Sequence[Pair]) -> Figures:
    """What the distance between joints in the room is made of, of pairs whose roots tell where they stand.

    Returns:
        head_room_cm, wrist_room_cm: as place_errors, the root included.
        stand_cm, heading_deg: of the root alone, which no sound tells.
        head_hips_cm, wrist_hips_cm: seen from the hips and as they are turned: of the pose alone.
    """
    roots = [(pair.predicted, pair.truth, pair.counts) for pair in pairs if pair.bones]
    found = _apart(pairs, _room_places, "_room") | _apart(pairs, _hips_places, "_hips")
    for name, errors in (
        ("stand_cm", [100 * _norm(p.root_position - t.root_position)[c] for p, t, c in roots]),
        (
            "heading_deg",
            [np.degrees(rotation.angle_between(p.root_rotation, t.root_rotation))[c] for p, t, c in roots],
        ),
    ):
        found[name] = float(np.concatenate(errors).mean()) if errors else None
    return found


def _apart(pairs: Sequence[Pair], seen: Callable[[Pair, Motion], Array], where: str) -> Figures:
    errors: dict[str, list[Array]] = {name: [] for name in PLACES}
    for pair in pairs:
        places = seen(pair, pair.predicted), seen(pair, pair.truth)
        for name, bones in PLACES.items():
            chosen = [j for j, bone in enumerate(pair.bones) if bone in bones]
            apart = _norm(places[0][:, chosen] - places[1][:, chosen])
            errors[name].append(100.0 * apart[pair.counts].ravel())
    found = {name: np.concatenate(parts) if parts else np.zeros(0) for name, parts in errors.items()}
    return {
        name.replace("_cm", where + "_cm"): float(values.mean()) if values.size else None
        for name, values in found.items()
    }


def _room_places(pair: Pair, motion: Motion) -> Array:
    places = rotation.rotate(motion.root_rotation[:, None], joint_places(pair, motion))
    return np.asarray(places + motion.root_position[:, None])


def _hips_places(pair: Pair, motion: Motion) -> Array:
    if "Hips" not in motion.bone_names:
        return joint_places(pair, motion)
    hips = motion.bone_names.index("Hips")
    positions, rotations = motion.positions.copy(), motion.rotations.copy()
    positions[:, hips], rotations[:, hips] = 0.0, rotation.IDENTITY
    return joint_places(pair, replace(motion, positions=positions, rotations=rotations))


def _norm(values: Array) -> Array:
    return np.asarray(np.linalg.norm(values, axis=-1))


def joint_places(pair: Pair, motion: Motion) -> Array:
    """Where the joints that both motions have are in one of them, metres (T, J, 3); the root left out."""
    chosen = [motion.bone_names.index(name) for name in pair.bones]
    if not chosen:
        return np.zeros((len(motion), 0, 3))
    # The same rest skeleton for both, so that only turning counts and not other proportions.
    skeleton = Skeleton.humanoid(pair.bones)
    return skeleton.forward(motion.positions[:, chosen], motion.rotations[:, chosen])[0]


def beat_alignment(pairs: Sequence[Pair]) -> float | None:
    """How near the beats of the motion are to those of the voice, 0 to 1.

    mean over the motion's beats g of exp(-min_a (g - a)^2 / (2 BEAT_SECONDS^2)), a the voice's beats. 0 where
    nothing moves, None without bones or without beats in the voice.
    Source: Li et al. 2021 (AIST++), with speech onsets as in Liu et al. 2022 (BEAT).
    """
    scores, applies = [], False
    for pair in pairs:
        if pair.voice is None or not pair.bones:
            continue
        voice = onsets(pair.voice)
        if not len(voice):
            continue
        # From here on stillness scores 0; without beats in the voice the figure would not apply at all.
        applies = True
        beats = motion_beats(pair)
        nearest = np.abs(beats[:, None] - voice[None]).min(axis=1)
        scores.append(np.exp(-(nearest**2) / (2 * BEAT_SECONDS**2)))
    if not applies:
        return None
    values = np.concatenate(scores)
    return float(values.mean()) if values.size else 0.0


def onsets(level: Array) -> Array:
    """Moments (seconds) at which the voice sets in: peaks of the rise of its loudness (K,)."""
    from scipy.signal import find_peaks

    width = round(RISE_SECONDS * lag.RATE)
    if len(level) < 2 * width + 1:
        return np.zeros(0)
    # Single periods of a low voice are as long as a value here; unsmoothed, each would be an onset.
    smooth = np.convolve(level, np.ones(width) / width, mode="same")
    # Floored, or the step from digital silence to a breath would rise more than any syllable.
    decibels = 20 * np.log10(np.maximum(smooth, 10 ** (-40 / 20)))
    rise = np.zeros(len(level))
    rise[width:] = decibels[width:] - decibels[:-width]
    peaks, _ = find_peaks(rise, height=ONSET_DB, distance=round(APART_SECONDS * lag.RATE))
    moments: Array = (peaks - width / 2) / lag.RATE
    return moments


def motion_beats(pair: Pair) -> Array:
    """Moments (seconds) at which the predicted arms (or all bones) pause: minima of their angular speed."""
    from scipy.signal import find_peaks

    chosen = [j for j, bone in enumerate(pair.bones) if in_region(bone, "arms")]
    # Gestures are of the arms; avatars without arms are judged by what they have.
    turns = pair.turns(pair.predicted)[:, chosen or slice(None)]
    if len(turns) < 4:
        return np.zeros(0)
    speed = rotation.angle_between(turns[:-1], turns[1:]).mean(axis=1)
    # A capture repeats a frame now and then, which would be a pause for one frame.
    speed = np.convolve(speed, np.ones(3) / 3, mode="same")
    # Minima of rounding noise are no beats.
    if speed.std() < 1e-5:
        return np.zeros(0)
    dips, _ = find_peaks(-speed, prominence=0.5 * speed.std())
    times = pair.predicted.times
    return times[dips][pair.counts[dips]]


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
    # Sorted, the sum over all pairs takes N log N; an hour of frames squared would fill the memory.
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
    # A column that some takes lack leaves too few whole rows for a covariance.
    truth, predicted = truth[:, _complete(truth)], predicted[:, _complete(truth)]
    deviation = np.nanstd(truth, axis=0) if truth.size else np.zeros(0)
    moving = deviation > MOVING
    if not moving.any():
        return None
    t, p = _kinetic(truth[:, moving], truth[:, moving]), _kinetic(predicted[:, moving], truth[:, moving])
    # A model that went astray gives finite numbers whose squares are not.
    if len(t) < 3 or not (np.abs(p) < _BEYOND).all():
        return None
    apart = np.square(p.mean(axis=0) - t.mean(axis=0)).sum()
    st, sp = np.cov(t, rowvar=False), np.cov(p, rowvar=False)
    # By symmetric roots: the root of S_p S_t itself need not be real in floating point.
    root = _root(st)
    # Rounding makes tiny eigenvalues of a singular covariance negative.
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
