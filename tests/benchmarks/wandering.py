"""A speaker who does not stay put, as captures of real people are: a BVH with its sound, made on the spot.

The practice performer's voice and upper body on legs that walk: somewhere in the room, turned to the side,
from where they stray by half a metre, turn, step after themselves and shift their weight.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation
from studio.motion.channels import BONES
from studio.motion.skeleton import REST_OFFSETS
from studio.performer import body
from studio.performer.curves import wander
from studio.performer.performance import perform_script
from studio.performer.script import Script

Array = NDArray[np.floating]

START, HEADING_DEG = (1.4, -0.8), 55.0
STRAY, TURN_DEG, SHIFT = 0.28, 22.0, 0.035
"""Metres and degrees to either side that they stray and turn, and metres by which they shift their weight."""
STEP_SECONDS, LIFT = 0.45, 0.05
FAR, TURNED = 0.11, np.radians(14.0)
"""How far a foot may be from where it belongs before it steps after."""
FPS = 60.0


def write_speaker(folder: Path, performer: int, spans: dict[str, tuple[float, float]]) -> list[Path]:
    """BVH files with their sounds beside them, each a span (seconds) of one performance."""
    import soundfile

    from studio.formats import bvh

    end = max(last for _, last in spans.values())
    made = perform_script(Script(performer, 50), end, FPS)
    motion, paths = walking(made.motion, performer), []
    for name, (first, last) in spans.items():
        part = motion.cut(first, last)
        sound = made.samples[round(first * made.sample_rate) : round(last * made.sample_rate)]
        soundfile.write(folder / f"{name}.wav", sound, made.sample_rate, "PCM_16")
        paths += bvh.write(folder / f"{name}.bvh", part)
    return paths


def walking(motion: Motion, seed: int) -> Motion:
    """A standing performer's motion on legs that walk."""
    t, where = motion.times, {name: i for i, name in enumerate(BONES)}
    heading = np.radians(HEADING_DEG + TURN_DEG * wander(t, seed, "heading", 9.0))
    goal = np.array(START) + STRAY * np.stack(
        [wander(t, seed, "stray x", 11.0), wander(t, seed, "stray z", 13.0)], axis=1
    )
    feet, yaws = _steps(goal, heading)
    mid = _slow(feet[..., [0, 2]].mean(axis=1), 0.3)
    ahead = _slow(np.unwrap(yaws, axis=0).mean(axis=1)[:, None], 0.3)[:, 0]
    aside = SHIFT * np.tanh(1.5 * wander(t, seed, "shift", 5.0))
    turn = _yaw(ahead)
    hips = np.zeros((len(t), 3))
    hips[:, [0, 2]] = mid
    sway = motion.positions[:, where["Hips"]] * np.array([1.0, 0.0, 1.0])
    hips += rotation.rotate(turn, sway + np.stack([aside, 0 * aside, 0 * aside], axis=1))
    turned = rotation.multiply(turn, motion.rotations[:, where["Hips"]])
    hips[:, 1] = _slow(np.min([_height(hips, turned, feet, yaws, i) for i in (0, 1)], axis=0)[:, None], 0.08)[
        :, 0
    ]
    rotations, positions = motion.rotations.astype(np.float64), motion.positions.astype(np.float64)
    rotations[:, where["Hips"]], positions[:, where["Hips"]] = turned, hips
    for i, side in enumerate(("Left", "Right")):
        at, faced = _seen_from(hips, turned, feet[:, i], yaws[:, i], side)
        for name, q in body.leg(at, faced, side).items():
            rotations[:, where[name]] = q
    return Motion.build(t, (), None, motion.bone_names, positions, rotations)


def _steps(goal: Array, heading: Array) -> tuple[Array, Array]:
    """Where both feet stand (T, 2, 3), lifted while they step, and how they are turned (T, 2)."""
    count, size = len(goal), round(STEP_SECONDS * FPS)
    aside = np.array([-body.STANCE, body.STANCE])
    feet, yaws = np.zeros((count, 2, 3)), np.zeros((count, 2))

    def home(i: int, foot: int) -> Array:
        place: Array = goal[i] + aside[foot] * np.array([np.cos(heading[i]), -np.sin(heading[i])])
        return place

    for foot in (0, 1):
        feet[:, foot, [0, 2]], yaws[:, foot] = home(0, foot), heading[0]
    i, last = 0, 1
    while i < count - size:
        away = [np.linalg.norm(home(i, f) - feet[i, f, [0, 2]]) for f in (0, 1)]
        other = 1 - last
        if max(away) > FAR or abs(heading[i] - yaws[i, other]) > TURNED:
            x = np.linspace(0, 1, size)
            share, end = 3 * x**2 - 2 * x**3, i + size
            start = feet[i, other, [0, 2]].copy()
            feet[i:end, other, 0] = start[0] + share * (home(end, other)[0] - start[0])
            feet[i:end, other, 2] = start[1] + share * (home(end, other)[1] - start[1])
            feet[i:end, other, 1] = LIFT * np.sin(np.pi * x) ** 2
            yaws[i:end, other] += share * (heading[end] - yaws[i, other])
            feet[end:, other, 0], feet[end:, other, 2] = home(end, other)
            yaws[end:, other] = heading[end]
            last, i = other, end
        else:
            i += 3
    return feet, yaws


def _seen_from(hips: Array, turned: Array, foot: Array, yaw: Array, side: str) -> tuple[Array, Array]:
    """Hips as they are over a foot that stands where the performer's own stands."""
    back = _yaw(-yaw)
    own = np.array([-body.STANCE if side == "Left" else body.STANCE, 0.0, 0.0])
    return np.asarray(rotation.rotate(back, hips - foot) + own), np.asarray(rotation.multiply(back, turned))


def _height(hips: Array, turned: Array, feet: Array, yaws: Array, i: int) -> Array:
    """How high the hips may be for one leg to reach its foot (T,)."""
    side = ("Left", "Right")[i]
    at, faced = _seen_from(hips, turned, feet[:, i], yaws[:, i], side)
    joint = rotation.rotate(faced, np.array(REST_OFFSETS[side + "UpperLeg"]))
    thigh, shin = (np.array(REST_OFFSETS[side + part]) for part in ("LowerLeg", "Foot"))
    reach = 0.998 * (np.linalg.norm(thigh) + np.linalg.norm(shin))
    ankle = sum(
        np.array(REST_OFFSETS[name]) for name in ("Hips", side + "UpperLeg", side + "LowerLeg", side + "Foot")
    )
    ankle[0] = -body.STANCE if side == "Left" else body.STANCE
    across = (at + joint)[:, [0, 2]] - ankle[[0, 2]]
    found: Array = np.sqrt(reach**2 - (across**2).sum(axis=1)) + ankle[1] - joint[:, 1] + feet[:, i, 1]
    return found


def _yaw(angles: Array) -> Array:
    return np.asarray(rotation.from_euler_yxz(angles, 0 * angles, 0 * angles))


def _slow(values: Array, sigma: float) -> Array:
    from scipy.ndimage import gaussian_filter1d

    found: Array = gaussian_filter1d(values, sigma * FPS, axis=0, mode="nearest")
    return found
