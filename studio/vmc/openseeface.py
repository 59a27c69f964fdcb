"""OpenSeeFace's packets: what its face tracker sends to UDP 11573. Pure.

Source: OpenSeeFace's facetracker.py, which packs a block of 1785 bytes a face, little-endian, and its Unity
example, which turns the raw quaternion into Unity's axes with a face that looks into the camera half a turn
about y away from rest. That this leaves the head's own turn was worked out from the tracker's model of a
face, its camera and OpenCV's solvePnP, in whose solution the face lies behind the camera.
"""

from __future__ import annotations

import math
import struct

from studio.vmc.osc import MalformedError

OPENSEEFACE, OPENSEEFACE_PORT = "OpenSeeFace", 11573
_BLOCK = 1785
_MOST_FACES = 36
# Time, number, width, height, how open the right and the left eye are, whether the pose was found, its error.
_HEAD = struct.Struct("<diffffBf")
_TURN = struct.Struct("<4f")
# Behind them euler angles, a place, 68 confidences, 68 points and 70 points in space.
_FEATURES_AT = _HEAD.size + _TURN.size + 4 * (3 + 3 + 68 + 2 * 68 + 3 * 70)
_FEATURES = struct.Struct("<14f")
_MOUTH_OPEN, _MOUTH_WIDE = 12, 13
assert _FEATURES_AT + _FEATURES.size == _BLOCK

Quaternion = tuple[float, float, float, float]


def recognises(datagram: bytes) -> bool:
    """Whether a datagram is OpenSeeFace's: whole blocks that speak of a picture of some size."""
    # Their first bytes are a time and may look like anything; a bundle of VMC may be as long.
    faces, rest = divmod(len(datagram), _BLOCK)
    if rest or not 1 <= faces <= _MOST_FACES or datagram.startswith(b"#bundle"):
        return False
    t, _, width, height, *_, found, _ = _HEAD.unpack_from(datagram)
    return math.isfinite(t) and 16 <= width <= 16384 and 16 <= height <= 16384 and found in (0, 1)


def read(datagram: bytes) -> tuple[dict[str, float], Quaternion | None]:
    """The first face of a datagram that `recognises` knows.

    Returns:
        Weights of shapes, and the head's turn; None where its pose was not found.

    Raises:
        MalformedError: a number is none.
    """
    _, _, _, _, right, left, found, _ = _HEAD.unpack_from(datagram)
    a, b, c, d = _TURN.unpack_from(datagram, _HEAD.size)
    features = _FEATURES.unpack_from(datagram, _FEATURES_AT)
    opened, wide = features[_MOUTH_OPEN], features[_MOUTH_WIDE]
    length = math.sqrt(sum(part * part for part in (a, b, c, d)))
    if not math.isfinite(sum((right, left, opened, wide, length))):
        raise MalformedError("a number is none")
    blinks = tuple(1.0 - min(max(one, 0.0), 1.0) for one in (left, right))
    jaw = min(max(opened, 0.0), 1.0)
    stretch, pucker = min(max(wide, 0.0), 1.0), min(max(-wide, 0.0), 1.0)
    shapes = {
        "JawOpen": jaw, "MouthStretchLeft": stretch, "MouthStretchRight": stretch, "MouthPucker": pucker,
        "EyeBlinkLeft": blinks[0], "EyeBlinkRight": blinks[1],
        "A": jaw, "Blink": min(blinks), "Blink_L": blinks[0], "Blink_R": blinks[1],
    }  # fmt: skip
    if not found or length < 1e-3:
        return shapes, None
    s = math.sqrt(0.5) / length
    return shapes, (s * (c - d), -s * (c + d), s * (b - a), -s * (a + b))
