"""All 54 bones: head and torso follow melody, beats and breath; arms beat; legs keep both feet flat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.channels import BONES
from studio.motion.skeleton import REST_OFFSETS
from studio.performer.curves import Curve, plateau, smoothed, wander
from studio.performer.script import Line, Style

Rotations = dict[str, NDArray[np.floating]]

FINGERS = ("Index", "Middle", "Ring", "Little")
_CURL = {"Index": 0.75, "Middle": 0.95, "Ring": 1.05, "Little": 1.1}
_FAN = {"Index": -1.0, "Middle": -0.2, "Ring": 0.5, "Little": 1.2}


@dataclass(frozen=True)
class ArmPose:
    """Degrees: upper arm forward, away from the body, turned inward; elbow bent; forearm turned palm down
    (+) or up (-) ; wrist bent to the palm; fingers curled; shoulder lifted and brought forward."""

    flex: float
    abduct: float
    inward: float
    elbow: float
    pronate: float
    wrist: float
    curl: float
    lift: float

    def values(self) -> NDArray[np.float64]:
        """The fields in order as an array (8,)."""
        return np.array(
            [self.flex, self.abduct, self.inward, self.elbow, self.pronate, self.wrist, self.curl, self.lift]
        )


HANGING = ArmPose(flex=1.0, abduct=9.0, inward=18.0, elbow=17.0, pronate=14.0, wrist=4.0, curl=26.0, lift=0.0)
RAISED = ArmPose(
    flex=20.0, abduct=13.0, inward=14.0, elbow=82.0, pronate=-8.0, wrist=-6.0, curl=17.0, lift=2.0
)
SPREAD = ArmPose(flex=11.0, abduct=5.0, inward=20.0, elbow=18.0, pronate=26.0, wrist=9.0, curl=8.0, lift=1.2)
"""How far one stroke's place differs from another's, +- about RAISED."""
_RAISE, _LOWER = 0.55, 0.75
_NAMES = ("flex", "abduct", "inward", "elbow", "pronate", "wrist", "curl", "lift")


def beats(times: Curve, lines: Sequence[Line], lag: float) -> Curve:
    """The pulse of the speech (n,): a small lift before each beat, a strike just after it, and back."""
    pulse = np.zeros(len(times))
    for line in lines:
        for beat in line.prosody.beats:
            away = times - line.voice_start - beat.t - lag
            strike = np.exp(-(((away - 0.04) / 0.085) ** 2))
            lift = np.exp(-(((away + 0.15) / 0.1) ** 2))
            pulse += beat.strength * (strike - 0.55 * lift)
    return pulse


def arm(
    times: Curve, lines: Sequence[Line], style: Style, side: str, pulse: Curve, breath: Curve
) -> Rotations:
    """Local rotations (n, 4) of one arm's bones and fingers.

    Args:
        side: "Left" or "Right".
        pulse: the beats (n,).
        breath: -1..1 (n,).
    """
    a = _angles(times, lines, style, side, pulse)
    a["lift"] = a["lift"] + 0.7 * breath
    down = 90.0 - a["abduct"]
    found = {
        "Shoulder": _euler(y=0.06 * a["flex"], z=-a["lift"]),
        "UpperArm": rotation.multiply(
            _euler(x=-a["flex"]), rotation.multiply(_euler(z=down), _euler(x=a["inward"]))
        ),
        # The forearm's turn is shared with the wrist, as radius and ulna share it.
        "LowerArm": rotation.multiply(_euler(y=a["elbow"]), _euler(x=0.5 * a["pronate"])),
        "Hand": rotation.multiply(_euler(x=0.5 * a["pronate"]), _euler(y=0.25 * a["wrist"], z=a["wrist"])),
    }
    found |= _fingers(times, style, side, a["curl"])
    turned = found if side == "Left" else {name: mirrored(q) for name, q in found.items()}
    return {side + name: q for name, q in turned.items()}


def mirrored(q: NDArray[np.floating]) -> NDArray[np.float64]:
    """A rotation as it is on the other side of the body (reflected in the plane x = 0)."""
    return np.asarray(q, dtype=np.float64) * np.array([1.0, -1.0, -1.0, 1.0])


def _angles(times: Curve, lines: Sequence[Line], style: Style, side: str, pulse: Curve) -> dict[str, Curve]:
    raised, place = np.zeros(len(times)), np.zeros((len(times), len(_NAMES)))
    for line in lines:
        if line.hands in ("both", side.lower()) and line.prosody.beats:
            _add_gesture(times, line, side, raised, place)
    hanging, up = HANGING.values(), RAISED.values()
    base = hanging + raised[:, None] * (up - hanging) + place
    sway = [wander(times, style.seed, f"{side} {name}", 3.1 + 0.4 * i) for i, name in enumerate(_NAMES)]
    base = base + np.stack(sway, axis=1) * (0.5 + raised[:, None]) * np.array(
        [1, 0.7, 2, 1.5, 2, 1.5, 2, 0.3]
    )
    a = {name: base[:, i].copy() for i, name in enumerate(_NAMES)}
    strength = style.beat * (0.12 + 0.88 * raised) * pulse
    a["elbow"] -= 13.0 * strength
    a["flex"] -= 2.5 * strength
    a["wrist"] += 9.0 * strength
    a["curl"] -= 4.0 * strength
    a["elbow"] = np.clip(a["elbow"], 4.0, 130.0)
    return a


def _add_gesture(times: Curve, line: Line, side: str, raised: Curve, place: NDArray[np.float64]) -> None:
    """Raise an arm for a line, and move it to a new place for every stroke."""
    rng = np.random.default_rng((*line.seed, 601 if side == "Left" else 602))
    moments = [line.voice_start + beat.t for beat in line.prosody.beats]
    up = plateau(times, moments[0] - 0.1, line.voice_end - 0.05, _RAISE, _LOWER)
    # Two hands never do quite the same: one leads in height.
    up = up * float(rng.uniform(0.75, 1.0))
    np.maximum(raised, up, out=raised)
    steps = np.zeros_like(place)
    edges = [-np.inf, *(m - 0.2 for m in moments[1:]), np.inf]
    for start, end in pairwise(edges):
        inside = (times >= start) & (times < end)
        steps[inside] = SPREAD.values() * rng.uniform(-1, 1, len(_NAMES))
    for i in range(len(_NAMES)):
        place[:, i] += up * smoothed(steps[:, i], 0.11)


def _fingers(times: Curve, style: Style, side: str, curl: Curve) -> Rotations:
    found: Rotations = {}
    for finger in FINGERS:
        bend = np.clip(curl * _CURL[finger] + 4.0 * wander(times, style.seed, side + finger, 2.7), 2.0, 70.0)
        fan = -_FAN[finger] * np.clip(6.0 - 0.15 * bend, 0.0, 6.0)
        found[finger + "Proximal"] = _euler(y=fan, z=bend)
        found[finger + "Intermediate"] = _euler(z=1.15 * bend)
        found[finger + "Distal"] = _euler(z=0.7 * bend)
    thumb = np.clip(0.45 * curl + 3.0 * wander(times, style.seed, side + "Thumb", 3.3), 0.0, 30.0)
    found["ThumbProximal"] = _euler(y=-6.0 - 0.5 * thumb, z=10.0 + 0.8 * thumb)
    found["ThumbIntermediate"] = _euler(y=-0.9 * thumb, z=0.3 * thumb)
    found["ThumbDistal"] = _euler(y=-1.1 * thumb, z=0.3 * thumb)
    return found


def _euler(y: Curve | float = 0.0, x: Curve | float = 0.0, z: Curve | float = 0.0) -> NDArray[np.floating]:
    angles = np.broadcast_arrays(np.radians(y), np.radians(x), np.radians(z))
    return rotation.from_euler_yxz(*angles)


Array = NDArray[np.floating]

STANCE = 0.115
"""Metres from the middle to each ankle."""
TOES_OUT_DEG = 8.0
# How straight the straighter leg is: knees never lock.
_SOFT_KNEES = 0.9992


def hip_height(hips: Array, turn: Array) -> Array:
    """The height (n,) at which the straighter leg is almost straight.

    Args:
        hips: where the hips are over the floor, (n, 3); its height is not used.
        turn: their rotation, (n, 4).
    """
    heights = []
    for side in ("Left", "Right"):
        joint = rotation.rotate(turn, np.array(REST_OFFSETS[side + "UpperLeg"]))
        across = hips[:, [0, 2]] + joint[:, [0, 2]] - _ankle(side)[[0, 2]]
        reach = _SOFT_KNEES * (_length(_thigh(side)) + _length(_shin(side)))
        heights.append(np.sqrt(reach**2 - (across**2).sum(axis=1)) + _ankle(side)[1] - joint[:, 1])
    return np.minimum(*heights)


def leg(hips: Array, turn: Array, side: str) -> dict[str, Array]:
    """Local rotations (n, 4) of one leg for hips at (n, 3) with rotation (n, 4)."""
    joint = hips + rotation.rotate(turn, np.array(REST_OFFSETS[side + "UpperLeg"]))
    wanted = rotation.rotate(rotation.inverse(turn), _ankle(side) - joint)
    knee = _knee(_thigh(side), _shin(side), np.linalg.norm(wanted, axis=1))
    bend = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), knee)
    bent = _thigh(side) + rotation.rotate(bend, _shin(side))
    foot = rotation.from_euler_yxz(np.radians(-TOES_OUT_DEG if side == "Left" else TOES_OUT_DEG), 0.0, 0.0)
    # Turning the thigh outward about the leg itself lets the knee point where the toes do.
    outward = rotation.from_euler_yxz(np.radians(-5.0 if side == "Left" else 5.0), 0.0, 0.0)
    along = rotation.rotate(outward, bent)
    upper = rotation.multiply(_between(along, wanted), outward)
    shank = rotation.multiply(turn, rotation.multiply(upper, bend))
    return {
        side + "UpperLeg": upper,
        side + "LowerLeg": bend,
        side + "Foot": rotation.multiply(rotation.inverse(shank), np.broadcast_to(foot, shank.shape)),
        side + "Toes": np.tile(rotation.IDENTITY, (len(hips), 1)),
    }


def _knee(thigh: Array, shin: Array, reach: Array) -> Array:
    """The knee's angle (n,) at which hip and ankle are `reach` apart."""
    a, b = _length(thigh), _length(shin)
    cosine = np.clip((reach**2 - a * a - b * b) / (2 * a * b), -1.0, 1.0)
    # The resting shin slants back a little: that much of the bend is built in.
    built_in = np.arctan2(-shin[2], -shin[1]) - np.arctan2(-thigh[2], -thigh[1])
    return np.maximum(np.arccos(cosine) - built_in, 0.0)


def _between(a: Array, b: Array) -> Array:
    """The shortest rotation from directions a to directions b, (n, 4)."""
    a = a / np.linalg.norm(a, axis=-1, keepdims=True)
    b = b / np.linalg.norm(b, axis=-1, keepdims=True)
    return rotation.normalised(np.concatenate([np.cross(a, b), 1 + (a * b).sum(-1, keepdims=True)], axis=-1))


def _thigh(side: str) -> Array:
    return np.array(REST_OFFSETS[side + "LowerLeg"])


def _shin(side: str) -> Array:
    return np.array(REST_OFFSETS[side + "Foot"])


def _length(v: Array) -> float:
    return float(np.linalg.norm(v))


def _ankle(side: str) -> Array:
    """Where the ankle stands: as high and as far back as at rest."""
    chain = ("Hips", side + "UpperLeg", side + "LowerLeg", side + "Foot")
    height = sum(REST_OFFSETS[name][1] for name in chain)
    depth = sum(REST_OFFSETS[name][2] for name in chain)
    return np.array([-STANCE if side == "Left" else STANCE, height, depth])


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
    # Arms, head and trunk follow the same beats, each with a lag of its own: together they would look like a
    # puppet.
    pulse = beats(times, lines, _ARM_LAG)
    for side in ("Left", "Right"):
        found |= arm(times, lines, style, side, pulse, breath)
        found |= leg(hips, turn, side)
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
    pulse = beats(times, lines, _TORSO_LAG)
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
    pulse = beats(times, lines, _HEAD_LAG)
    look_yaw, look_pitch = (smoothed(angle, 0.14) for angle in gaze)
    nod = 1.5 + 4.4 * style.nod * pulse - 0.8 * style.tilt * smoothed(pitch, 0.06)
    nod = nod + 2.0 * smoothed(loud, 0.2) + 1.6 * wander(times, style.seed, "nod", 2.1) + 0.35 * look_pitch
    yaw = 0.45 * style.turn * look_yaw + 3.8 * wander(times, style.seed, "shake", 2.9)
    roll = style.head_roll + _tilts(times, lines, style) + 1.5 * wander(times, style.seed, "roll", 3.7)
    for name, share in _NECK:
        # A neck rises forward; the face stays upright.
        lean = 5.0 if name == "Neck" else -5.0
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
    # Smoothed, since the leg that carries changes at once, and a body does not.
    hips[:, 1] = smoothed(hip_height(hips, turn).astype(np.float64), 0.05)
    return hips, turn
