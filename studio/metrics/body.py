"""Where head and hands are, and whether gestures fall on the beats of speech."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.metrics.scores import Figures, Pair, in_region
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
    errors: dict[str, list[Array]] = {name: [] for name in PLACES}
    for pair in pairs:
        places = joint_places(pair, pair.predicted), joint_places(pair, pair.truth)
        for name, bones in PLACES.items():
            chosen = [j for j, bone in enumerate(pair.bones) if bone in bones]
            apart = np.linalg.norm(places[0][:, chosen] - places[1][:, chosen], axis=-1)
            errors[name].append(100.0 * apart[pair.counts].ravel())
    found = {name: np.concatenate(parts) if parts else np.zeros(0) for name, parts in errors.items()}
    return {name: float(values.mean()) if values.size else None for name, values in found.items()}


def joint_places(pair: Pair, motion: Motion) -> Array:
    """Where the joints that both motions have are in one of them, metres (T, J, 3); the root left out."""
    chosen = [motion.bone_names.index(name) for name in pair.bones]
    if not chosen:
        return np.zeros((len(motion), 0, 3))
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
    smooth = np.convolve(level, np.ones(width) / width, mode="same")
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
    turns = pair.turns(pair.predicted)[:, chosen or slice(None)]
    if len(turns) < 4:
        return np.zeros(0)
    speed = rotation.angle_between(turns[:-1], turns[1:]).mean(axis=1)
    speed = np.convolve(speed, np.ones(3) / 3, mode="same")
    if speed.std() < 1e-5:
        return np.zeros(0)
    dips, _ = find_peaks(-speed, prominence=0.5 * speed.std())
    times = pair.predicted.times
    return times[dips][pair.counts[dips]]
