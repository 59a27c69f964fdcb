"""Where the figure is seen from: an orbit around the body, and what of it fits the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FIELD_OF_VIEW = 28.0
"""Vertical opening in degrees; narrow, so that near limbs do not look large."""
BODY_HEIGHT = 1.92
"""Metres of the built-in body with a little air, at scale 1."""
ARM_SPAN = 1.7
VIEWS = {"front": (0.0, 4.0), "three_quarter": (-32.0, 9.0), "side": (-90.0, 4.0)}
"""Azimuth and elevation in degrees by name."""
FACE_HEIGHT = 1.44
"""Metres from the ground to what is looked at from close by, at scale 1: the built-in figure's chin."""
CLOSEST, FARTHEST = 0.25, 3.0
FRAMINGS = {"face": CLOSEST, "bust": 0.5, "body": 1.0}
"""How near the camera is, by what it frames."""
NOWHERE: NDArray[np.float64] = np.zeros(3)


@dataclass(frozen=True)
class Orbit:
    """A camera on a sphere around the body, in picture space (right-handed, Y up, metres).

    Args:
        azimuth: degrees around the body, 0 from the front, positive to the picture's right.
        elevation: degrees above the level.
        zoom: 1 shows the whole body; less is closer, rising to the face.
    """

    azimuth: float = VIEWS["three_quarter"][0]
    elevation: float = VIEWS["three_quarter"][1]
    zoom: float = 1.0

    @classmethod
    def preset(cls, name: str, zoom: float = 1.0) -> Orbit:
        """One of VIEWS."""
        azimuth, elevation = VIEWS[name]
        return cls(azimuth, elevation, zoom)

    def turned(self, degrees: float, up: float) -> Orbit:
        """The camera moved around the body."""
        # Kept within a turn, so that a film of hours does not lose precision.
        azimuth = (self.azimuth + degrees + 180.0) % 360.0 - 180.0
        # From below the floor hides the body, and straight from above the camera has no up.
        return replace(self, azimuth=azimuth, elevation=min(max(self.elevation + up, -15.0), 80.0))

    def zoomed(self, factor: float) -> Orbit:
        """The camera moved closer (factor < 1) or away."""
        return replace(self, zoom=min(max(self.zoom * factor, CLOSEST), FARTHEST))

    @property
    def framing(self) -> str:
        """One of FRAMINGS where the camera is as near as that has it, else ""."""
        return next((name for name, zoom in FRAMINGS.items() if abs(zoom - self.zoom) < 0.01), "")

    def framed(self, name: str) -> Orbit:
        """As near as one of FRAMINGS asks for, from the same side."""
        return replace(self, zoom=FRAMINGS[name])

    def target(
        self, scale: float, face: float = FACE_HEIGHT, away: NDArray[np.float64] = NOWHERE
    ) -> NDArray[np.float64]:
        """The point looked at: the body's middle, the face when close.

        Args:
            scale: the body's size.
            face: metres from the ground to its face, at scale 1.
            away: metres from there to where the head is now (3,); counts when close.
        """
        close = min(max((1.0 - self.zoom) / (1.0 - CLOSEST), 0.0), 1.0)
        return np.array([0.0, (0.84 + (face - 0.84) * close) * scale, 0.0]) + away * close

    def distance(self, aspect: float, scale: float) -> float:
        """Metres from the target at which the body fits a picture of this width by height."""
        half = math.tan(math.radians(FIELD_OF_VIEW / 2))
        fits = max(BODY_HEIGHT / 2 / half, ARM_SPAN / 2 / (half * max(aspect, 0.1)) * 0.86)
        return fits * self.zoom * scale

    def position(
        self,
        aspect: float,
        scale: float,
        face: float = FACE_HEIGHT,
        away: NDArray[np.float64] = NOWHERE,
    ) -> NDArray[np.float64]:
        """Where the camera stands; scale, face and away as for `target`."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        direction = np.array([math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)])
        return self.target(scale, face, away) + direction * self.distance(aspect, scale)


def to_picture(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Unity's left-handed points (..., 3) in picture space: x is turned over."""
    return np.asarray(points, dtype=np.float64) * np.array([-1.0, 1.0, 1.0])


def project(
    points: NDArray[np.float64],
    orbit: Orbit,
    width: int,
    height: int,
    scale: float,
    face: float = FACE_HEIGHT,
    away: NDArray[np.float64] = NOWHERE,
) -> NDArray[np.float64]:
    """Picture-space points (P, 3) as pixels and depth (P, 3); scale, face and away as for `Orbit.target`."""
    aspect = width / max(height, 1)
    eye = orbit.position(aspect, scale, face, away)
    forward = orbit.target(scale, face, away) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    local = (points - eye) @ np.stack([right, up, forward], axis=1)
    depth = np.maximum(local[:, 2], 0.05)
    focal = height / 2 / math.tan(math.radians(FIELD_OF_VIEW / 2))
    x = width / 2 + local[:, 0] / depth * focal
    y = height / 2 - local[:, 1] / depth * focal
    return np.stack([x, y, depth], axis=1)
