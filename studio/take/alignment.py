"""How far sound and motion of a saved take are apart: by mouth and voice, or by claps.

It only measures: an offset that is chosen is kept in `Selection.offset` and applied by `load_motion`.
A clap is where the hands meet, against where the sound jumps up.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion
from studio.motion.lag import RATE, REACH, Alignment, level_of, power, voice_offset
from studio.sound.sound_file import sound_blocks
from studio.take.motion_file import load_motion
from studio.take.take import Take

Array = NDArray[np.float64]

HANDS = (("LeftHand", "RightHand"), ("LeftLowerArm", "RightLowerArm"))
"""The bones that meet, the first pair that the motion has."""
CLOSING = 1.0
"""Metres a second that the hands come together with at least; hands folded slowly make no sound."""
NEAR = 0.45
"""Metres between the wrists at most when the palms meet."""
STOPPED = 0.5
"""Share of its speed that a closing has lost at the clap."""
BETWEEN = 0.15
"""Seconds between two claps at least."""

LISTEN_RATE = 16_000
"""Samples a second of what is listened to; a block of sound is a whole number of spans long."""

By = Literal["mouth", "clap"]
"""What sound and motion are brought together by."""


def take_offset(take: Take, by: By = "mouth") -> Alignment | None:
    """The alignment of a saved take, of any length; None where it lacks sound or motion.

    Raises:
        StudioError: a file is missing or damaged.
    """
    if take.audio_path is None or (motion := load_motion(take)) is None:
        return None
    audio_power = power_of_sound(take.audio_path)
    return clap_offset(audio_power, motion) if by == "clap" else voice_offset(level_of(audio_power), motion)


def power_of_sound(sound: Path) -> NDArray[np.float64]:
    """Mean square of a sound in each hundredth of a second (K,), in bounded memory."""
    rest = np.zeros(0, np.float32)
    parts: list[NDArray[np.float64]] = []
    for block in sound_blocks(sound, LISTEN_RATE):
        samples = np.concatenate([rest, block])
        # Whole hundredths only; the rest goes before the next block, or spans would slip at every seam.
        whole = len(samples) // (LISTEN_RATE // 100) * (LISTEN_RATE // 100)
        rest = samples[whole:]
        parts.append(power(samples[:whole], LISTEN_RATE))
    return np.concatenate(parts) if parts else np.zeros(0)


def clap_offset(audio_power: Array, motion: Motion) -> Alignment:
    """The offset at which the hands meet when the clap is heard.

    Args:
        audio_power: mean square of the sound, RATE values a second (K,); see lag.power.
        motion: of the take.

    Returns:
        Its curve is how hard the sound jumps up on average around the claps, 0..1. Confidence 0 and offset
        0 where nobody claps, or nothing is heard.
    """
    lags = int(REACH * RATE)
    offsets = np.arange(-lags, lags + 1) / RATE
    jumps, moments = loud_jumps(audio_power), claps(motion)
    moments = moments[(moments > 0) & (moments < len(audio_power) / RATE)]
    nothing = Alignment(0.0, 0.0, offsets, np.zeros(len(offsets)), 0.0)
    if not len(moments) or jumps.max(initial=0.0) <= 0:
        return nothing
    around = moments[:, None] + offsets
    curve = np.interp(around, np.arange(len(jumps)) / RATE, jumps, left=0.0, right=0.0).mean(axis=0)
    best = int(np.argmax(curve))
    return Alignment(_top(offsets, curve, best), _confidence(curve, best), offsets, curve, float(curve[best]))


def claps(motion: Motion) -> Array:
    """Moments at which the hands meet after coming together fast, seconds (N,)."""
    distance = hand_distance(motion)
    if distance is None or len(motion) < 8 or motion.times[-1] - motion.times[0] < 0.5:
        return np.zeros(0)
    fps = float(np.clip(motion.fps, 20.0, 240.0))
    times = np.arange(motion.times[0], motion.times[-1], 1 / fps)
    # On even times: a dropped frame would look like hands that stopped.
    distance = np.interp(times, motion.times, distance)
    speed = -np.gradient(distance) * fps
    span = max(round(0.04 * fps), 1)
    found: list[float] = []
    nearest = (distance[1:-1] <= distance[:-2]) & (distance[1:-1] < distance[2:]) & (distance[1:-1] < NEAR)
    for i in (np.flatnonzero(nearest) + 1).tolist():
        before = float(speed[max(i - 2 * span, 0) : i + 1].max())
        after = float(speed[min(i + span, len(speed) - 1)])
        fast = before > CLOSING and after < (1 - STOPPED) * before
        if fast and (not found or times[i] - found[-1] > BETWEEN):
            found.append(float(times[i]))
    return np.asarray(found)


def hand_distance(motion: Motion) -> Array | None:
    """Metres between the hands in each frame (T,); None where the motion has no arms."""
    names = motion.bone_names
    pair = next((pair for pair in HANDS if set(pair) <= set(names)), None)
    if pair is None or not len(motion):
        return None
    world, _ = motion.skeleton.forward(motion.positions, motion.rotations)
    left, right = (world[:, names.index(name)] for name in pair)
    distance: Array = np.linalg.norm(left - right, axis=1)
    return distance


def loud_jumps(power: Array) -> Array:
    """How hard the sound jumps up at each moment, 1 at its hardest (K,)."""
    level = np.sqrt(power)
    jump = np.clip(level - np.concatenate([level[:1], level[:-1]]), 0.0, None)
    top = float(jump.max(initial=0.0))
    return jump / top if top > 1e-4 else np.zeros(len(jump))


def _top(offsets: Array, curve: Array, best: int) -> float:
    """The offset of the peak, between points by its centre of mass; a jump lies in one point or two."""
    near = slice(max(best - 1, 0), best + 2)
    weight = curve[near]
    return float((offsets[near] * weight).sum() / weight.sum())


def _confidence(curve: Array, best: int) -> float:
    """High where the jump at the claps is hard, and nowhere else around them is one as hard."""
    others = np.concatenate([curve[: max(best - 8, 0)], curve[best + 9 :]])
    stands_out = 1 - float(others.max(initial=0.0)) / float(curve[best])
    return float(np.clip(curve[best] / 0.4, 0, 1) * np.clip(stands_out / 0.5, 0, 1))
