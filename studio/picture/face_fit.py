"""An avatar's face for blend shapes that its file has no names for, such as ARKit's on a plain VRM."""

from __future__ import annotations

from collections.abc import Mapping

from studio.motion.avatar import Avatar, key
from studio.motion.channels import is_blink_shape, is_mouth_shape
from studio.picture.face_shape import face_shape


def fitted(avatar: Avatar, shapes: Mapping[str, float]) -> Mapping[str, float]:
    """Shapes with what moves the avatar's mouth and eyes added, where none of theirs does.

    Near enough to look at, never exact: jaw and lips become vowels, lids become blinks.
    """
    if not shapes or not avatar.by_key:
        return shapes
    known = [name for name in shapes if key(name) in avatar.by_key]
    mouth = any(is_mouth_shape(name) for name in known)
    eyes = any(is_blink_shape(name) for name in known)
    if mouth and eyes:
        return shapes
    face, more = face_shape(shapes), dict(shapes)
    if not mouth:
        spread = max(1.0 - face.round - face.wide, 0.0)
        more |= {
            "A": face.open * spread,
            "I": face.wide * (1.0 - 0.5 * face.open),
            "O": face.round * face.open,
            "U": face.round * (1.0 - face.open),
            "Joy": max(face.smile, 0.0) * 0.6,
        }
    if not eyes:
        more |= {"Blink_L": face.blink_left, "Blink_R": face.blink_right}
    return more
