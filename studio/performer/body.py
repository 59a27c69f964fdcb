"""Head, torso, eyes and stance: what follows the melody, the beats, the breath, and idle sway."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.channels import BONES
from studio.performer import limbs
from studio.performer import limbs as legs
from studio.performer.curves import Curve, plateau, smoothed, wander
from studio.performer.script import Line
from studio.performer.style import Style

_HEAD_LAG, _ARM_LAG, _TORSO_LAG = 0.05, 0.04, 0.09
_EYE_LIMIT_DEG = 22.0
_BREATH_SECONDS = 3.9
# How the spine shares a bend, from the hips up.
_SPINE = (("Spine", 0.35), ("Chest", 0.35), ("UpperChest", 0.3))
_NECK = (("Neck", 0.4), ("Head", 0.6))


def bones(
    times: Curve, lines: Sequence[Line], style: Style, gaze: tuple[Curve, Curve]
) -> tuple[NDArray[np.float64], NDArray[np.floating], tuple[Curve, Curve]]:
    """All 54 bones on a grid of times.

    Args:
        times: grid, absolute seconds (n,).
        lines: every line that may be felt there.
        style: whose body.
        gaze: where to look: yaw and pitch in degrees against straight ahead.

    Returns:
        Hips' positions (n, 3), local rotations (n, 54, 4) in the order of BONES, and the eyes' yaw and pitch
        in the head, degrees.
    """
    breath = breathing(times, lines, style)
    found = _torso(times, lines, style, breath)
    head_yaw, head_pitch = _head(times, lines, style, gaze, found)
    eyes = _eyes(times, gaze, head_yaw, head_pitch, style, found)
    hips, turn = _hips(times, style)
    found["Hips"] = turn
    pulse = limbs.beats(times, lines, _ARM_LAG)
    for side in ("Left", "Right"):
        found |= limbs.arm(times, lines, style, side, pulse, breath)
        found |= legs.leg(hips, turn, side)
    return hips, np.stack([found[name] for name in BONES], axis=1), eyes


def breathing(times: Curve, lines: Sequence[Line], style: Style) -> Curve:
    """How full the chest is, about -1..1 (n,): in before a sentence, out along it, slow in silence."""
    phase = 2 * np.pi * times / _BREATH_SECONDS + 0.8 * wander(times, style.seed, "breath", 5.0)
    idle = np.sin(phase)
    speaking, spoken = np.zeros(len(times)), np.zeros(len(times))
    for line in lines:
        share = plateau(times, line.start + 0.1, line.voice_end, 0.4, 0.4)
        taken = np.clip((times - line.start) / line.lead, 0, 1)
        used = np.clip((times - line.voice_start) / line.speech.duration, 0, 1)
        speaking = np.maximum(speaking, share)
        spoken += share * (1.6 * taken - 1.9 * used)
    return smoothed((1 - speaking) * 0.6 * idle + spoken - 0.2 * speaking, 0.12)


def _melody(times: Curve, lines: Sequence[Line], lag: float) -> tuple[Curve, Curve]:
    """Pitch (semitones) and loudness (0..1) as felt `lag` seconds later, (n,) each."""
    pitch, loud = np.zeros(len(times)), np.zeros(len(times))
    for line in lines:
        t = times - line.voice_start - lag
        pitch += line.prosody.pitch_at(t)
        loud += line.prosody.loudness_at(t)
    return pitch, loud


def _torso(
    times: Curve, lines: Sequence[Line], style: Style, breath: Curve
) -> dict[str, NDArray[np.floating]]:
    pitch, loud = _melody(times, lines, _TORSO_LAG)
    energy, melody = smoothed(loud, 0.25), smoothed(pitch, 0.15)
    pulse = limbs.beats(times, lines, _TORSO_LAG)
    forward = style.lean - 1.0 * breath + 2.2 * energy - 0.25 * style.tilt * melody + 0.9 * style.beat * pulse
    forward = forward + style.sway * 1.2 * wander(times, style.seed, "lean", 4.3)
    turn = style.sway * 3.5 * wander(times, style.seed, "turn", 5.7) + _towards(times, lines)
    # Against the hips' own tilt, so that the shoulders stay nearly level.
    side = -0.8 * _hip_roll(times, style) + style.sway * 1.2 * wander(times, style.seed, "side", 4.9)
    return {name: _euler(y=turn * share, x=forward * share, z=side * share) for name, share in _SPINE}


def _towards(times: Curve, lines: Sequence[Line]) -> Curve:
    """The trunk opens a little to the side of the hand that speaks: degrees (n,)."""
    turned = np.zeros(len(times))
    for line in lines:
        side = {"left": -1.0, "right": 1.0}.get(line.hands, 0.0)
        turned += -3.0 * side * plateau(times, line.voice_start, line.voice_end, 0.7, 0.7)
    return turned


def _head(
    times: Curve,
    lines: Sequence[Line],
    style: Style,
    gaze: tuple[Curve, Curve],
    found: dict[str, NDArray[np.floating]],
) -> tuple[Curve, Curve]:
    """Neck and head into `found`; gives the head's yaw and pitch in degrees (the trunk left out)."""
    pitch, loud = _melody(times, lines, _HEAD_LAG)
    pulse = limbs.beats(times, lines, _HEAD_LAG)
    look_yaw, look_pitch = (smoothed(angle, 0.14) for angle in gaze)
    nod = 1.5 + 4.4 * style.nod * pulse - 0.8 * style.tilt * smoothed(pitch, 0.06)
    nod = nod + 2.0 * smoothed(loud, 0.2) + 1.6 * wander(times, style.seed, "nod", 2.1) + 0.35 * look_pitch
    yaw = 0.45 * style.turn * look_yaw + 3.8 * wander(times, style.seed, "shake", 2.9)
    roll = style.head_roll + _tilts(times, lines, style) + 1.5 * wander(times, style.seed, "roll", 3.7)
    for name, share in _NECK:
        lean = 5.0 if name == "Neck" else -5.0  # a neck rises forward; the face stays upright
        found[name] = _euler(y=yaw * share, x=nod * share + lean, z=roll * share)
    return yaw, nod


def _tilts(times: Curve, lines: Sequence[Line], style: Style) -> Curve:
    """Each sentence has a tilt of the head of its own: degrees (n,)."""
    tilt = np.zeros(len(times))
    for line in lines:
        rng = np.random.default_rng((*line.seed, 701))
        size = float(rng.normal(0.0, 3.6)) * style.turn
        tilt += np.clip(size, -7, 7) * plateau(times, line.voice_start + 0.1, line.voice_end, 0.5, 0.6)
    return tilt


def _eyes(
    times: Curve,
    gaze: tuple[Curve, Curve],
    head_yaw: Curve,
    head_pitch: Curve,
    style: Style,
    found: dict[str, NDArray[np.floating]],
) -> tuple[Curve, Curve]:
    """Eyes into `found`: they make up for what the head does, and tremble a little."""
    drift = 0.25 * wander(times, style.seed, "drift", 0.3)
    yaw = np.clip(gaze[0] - head_yaw + drift, -_EYE_LIMIT_DEG, _EYE_LIMIT_DEG)
    pitch = np.clip(gaze[1] - 0.8 * head_pitch + 0.6 * drift, -_EYE_LIMIT_DEG, _EYE_LIMIT_DEG)
    for side in ("Left", "Right"):
        found[side + "Eye"] = _euler(y=yaw, x=pitch)
    return yaw, pitch


def _hip_roll(times: Curve, style: Style) -> Curve:
    return 1.6 * style.sway * _shift(times, style)


def _shift(times: Curve, style: Style) -> Curve:
    """Where the weight is: -1 on the left leg .. 1 on the right."""
    return np.tanh(1.3 * wander(times, style.seed, "weight", 6.3))


def _hips(times: Curve, style: Style) -> tuple[NDArray[np.float64], NDArray[np.floating]]:
    """Positions (n, 3) and rotations (n, 4) of the hips, as high as the legs allow."""
    shift = _shift(times, style)
    hips = np.zeros((len(times), 3))
    hips[:, 0] = 0.018 * style.sway * shift
    hips[:, 2] = 0.006 * style.sway * wander(times, style.seed, "forth", 3.9)
    turn = _euler(y=2.2 * style.sway * wander(times, style.seed, "hips", 6.9), z=_hip_roll(times, style))
    hips[:, 1] = smoothed(legs.hip_height(hips, turn).astype(np.float64), 0.05)
    return hips, turn


def _euler(y: Curve | float = 0.0, x: Curve | float = 0.0, z: Curve | float = 0.0) -> NDArray[np.floating]:
    angles = np.broadcast_arrays(np.radians(y), np.radians(x), np.radians(z))
    return rotation.from_euler_yxz(*angles)
