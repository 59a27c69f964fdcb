"""The 18 VRM0 shapes: lips that follow the phonemes, lids, moods, and where the eyes look."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.motion.channels import VRM0_SHAPES
from studio.performer.curves import Curve, chance, plateau, ramp, smoothed, wander, window
from studio.performer.script import Line, Style
from studio.performer.sentences import MOODS
from studio.performer.speech import MOUTH, targets

_REACH = 0.4
_REST_DOMINANCE = 0.02
_CLOSING, _LIDS_SHUT, _OPENING = 0.08, 0.03, 0.17
_LOOK_FULL_DEG = 30.0

# Seconds in which lips meet and part.
_CLOSURE_FLANK = 0.055
_CLOSURE_HOLD = 0.05
_STOPS = frozenset("pb")


def shapes(times: Curve, lines: Sequence[Line], style: Style, gaze: tuple[Curve, Curve]) -> dict[str, Curve]:
    """All shapes on a grid of times.

    Args:
        times: grid, absolute seconds (n,).
        lines: every line that may be felt there.
        style: whose face.
        gaze: yaw (right is positive) and pitch (down is positive) of the eyes in the head, degrees.

    Returns:
        VRM0 name -> weights 0..1 (n,).
    """
    found = dict(zip(MOUTH, mouth(times, lines, style).T, strict=True))
    found |= lids(times, lines, style)
    found |= _moods(times, lines, style)
    yaw, pitch = gaze
    found["LookRight"], found["LookLeft"] = np.maximum(yaw, 0), np.maximum(-yaw, 0)
    found["LookDown"], found["LookUp"] = np.maximum(pitch, 0), np.maximum(-pitch, 0)
    for name in ("LookRight", "LookLeft", "LookDown", "LookUp"):
        found[name] = found[name] / _LOOK_FULL_DEG
    return {name: np.clip(found[name], 0.0, 1.0) for name in VRM0_SHAPES}


def mouth(times: Curve, lines: Sequence[Line], style: Style) -> NDArray[np.float64]:
    """Weights (n, 5) of A, I, U, E, O: targets blended by dominance, then shut where the lips must meet."""
    blended = np.zeros((len(times), 5))
    weight = np.full(len(times), _REST_DOMINANCE)
    closure = np.zeros(len(times))
    for line in lines:
        _add_line(times, line, style, blended, weight, closure)
    open_ = blended / weight[:, None] * np.array(style.mouth_gain)
    effort = 1.0 + 0.12 * wander(times, style.seed, "effort", 2.3)
    open_ *= (effort * _loudness_effort(times, lines, style))[:, None]
    open_[:, 0] += 0.02 * (1 + wander(times, style.seed, "ajar", 1.7))
    return np.clip(open_, 0.0, 1.0) * (1.0 - closure[:, None])


def _add_line(
    times: Curve, line: Line, style: Style, blended: NDArray[np.float64], weight: Curve, closure: Curve
) -> None:
    # By the line, so that any stretch of a performance can be made alone and is the same.
    rng = np.random.default_rng((*line.seed, 501))
    for phone in line.phones():
        start = phone.t + style.lag + float(rng.normal(0, 0.006))
        # Nobody says a sound twice alike.
        accident = rng.normal(1.0, 0.1, 5)
        for letter, target, share in targets(phone.name):
            length = share * phone.duration
            part = window(times, start - _REACH, start + length + _REACH)
            away = np.maximum(np.abs(times[part] - start - length / 2) - 0.3 * length, 0.0)
            dominance = target.strength * np.exp(-away / style.coarticulation)
            blended[part] += dominance[:, None] * np.array(target.mouth) * accident
            weight[part] += dominance
            if target.closure:
                shut = _closure(times[part], start, length, letter in _STOPS)
                closure[part] = np.maximum(closure[part], target.closure * shut)
            start += length


def _closure(times: Curve, start: float, length: float, stop: bool) -> Curve:
    """How far the lips are pressed together: shut before the burst of a stop, through the hum of an m."""
    first = start - 0.03 if stop else start
    last = max(start + min(length, 0.09 if stop else 0.2) - 0.01, first + _CLOSURE_HOLD)
    return plateau(times, first, last, _CLOSURE_FLANK, _CLOSURE_FLANK)


def _loudness_effort(times: Curve, lines: Sequence[Line], style: Style) -> Curve:
    """Louder is wider: 0.7 in a murmur to 1.15 at full voice."""
    loud = np.zeros(len(times))
    for line in lines:
        loud += line.prosody.loudness_at(times - line.voice_start - style.lag)
    return 0.7 + 0.5 * smoothed(loud, 0.06)


def lids(times: Curve, lines: Sequence[Line], style: Style) -> dict[str, Curve]:
    """Blink shuts both; Blink_L and Blink_R add what one lid does beyond the other."""
    left, right = np.zeros(len(times)), np.zeros(len(times))
    for line in lines:
        for blink in line.blinks:
            slow = 1.6 if blink.eyes != "both" else 1.0
            if blink.eyes != "right":
                np.maximum(left, _lid(times, blink.t + style.blink_skew, blink.amount, slow), out=left)
            if blink.eyes != "left":
                np.maximum(right, _lid(times, blink.t, blink.amount, slow), out=right)
    both = np.minimum(left, right)
    return {"Blink": both, "Blink_L": left - both, "Blink_R": right - both}


def _lid(times: Curve, t: float, amount: float, slow: float) -> Curve:
    """One lid's closing and slower opening about a moment."""
    shut = _LIDS_SHUT * slow
    down = ramp((times - t + _CLOSING * slow) / (_CLOSING * slow))
    up = 1.0 - ramp((times - t - shut) / (_OPENING * slow))
    return amount * down * up


def _moods(times: Curve, lines: Sequence[Line], style: Style) -> dict[str, Curve]:
    """Each line's mood, rising before its voice and fading after; Neutral is what they leave."""
    found = {mood: np.zeros(len(times)) for mood in MOODS[1:]}
    for line in lines:
        mood = line.speech.sentence.mood
        if mood in found:
            bump = plateau(times, line.voice_start, line.voice_end, 0.35, 0.7) * line.mood_level
            found[mood] = np.maximum(found[mood], bump)
    smile = 0.05 * (1 + wander(times, style.seed, "smile", 5.0)) * style.expressiveness
    found["Fun"] = np.maximum(found["Fun"], smile)
    breathing = 1.0 + 0.1 * wander(times, style.seed, "mood", 1.1)
    found = {mood: smoothed(values, 0.08) * breathing for mood, values in found.items()}
    found["Neutral"] = 1.0 - np.minimum(sum(found.values(), np.zeros(len(times))), 1.0)
    return found


def gaze(times: Curve, lines: Sequence[Line], style: Style) -> tuple[Curve, Curve]:
    """Where the performer looks: yaw and pitch in degrees against straight ahead, in quick saccades.

    Mostly at the camera; now and then aside, oftener between sentences, as speakers do when they think.
    """
    cell = 1.3
    index = np.floor(times / cell).astype(np.int64)
    yaw, pitch = np.zeros(len(times)), np.zeros(len(times))
    # The glance of this cell, and the one it came from.
    for back in (0, 1):
        k = index - back
        begins = (k + 0.15 + 0.6 * chance(style.seed, "saccade", k)) * cell
        aside = chance(style.seed, "aside", k) < 0.3
        size = np.where(aside, 1.0, 0.16)
        to_yaw = size * 13.0 * (2 * chance(style.seed, "gaze yaw", k) - 1)
        to_pitch = size * (14.0 * chance(style.seed, "gaze pitch", k) - 6.0)
        if back == 0:
            now = ramp((times - begins) / 0.045)
            yaw, pitch = now * to_yaw, now * to_pitch
        else:
            yaw, pitch = yaw + (1 - now) * to_yaw, pitch + (1 - now) * to_pitch
    return yaw, pitch
