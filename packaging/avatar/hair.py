"""The avatar's hair: a cap over the skull, and locks that hang from it; the long ones swing on bones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from face import HEAD, Look, front
from shape import Array, Part, curve, rigid, smooth, strip, tube

MIDDLE, RADII = np.array([0.0, 0.028, -0.006]), np.array([0.0945, 0.101, 0.1015])
"""The round that the cap lies on, from HEAD."""


@dataclass(frozen=True)
class Lock:
    """One lock of hair, bound at its root.

    Args:
        name: for its bones; "" where it does not swing.
        knots: the line it follows, metres from HEAD.
        wide, thick: its half axes at the root.
        out: where its flat side looks.
    """

    name: str
    knots: tuple[tuple[float, float, float], ...]
    wide: float
    thick: float
    out: tuple[float, float, float]


def _round(azimuth: float, down: float, above: float = 0.0) -> tuple[float, float, float]:
    """A place on the cap, degrees around from the front to its left, and down from the crown."""
    a, d = np.radians([azimuth, down])
    way = np.array([np.sin(a) * np.sin(d), np.cos(d), np.cos(a) * np.sin(d)])
    x, y, z = MIDDLE + way * (RADII + above)
    return float(x), float(y), float(z)


def _skin(x: float, y: float) -> float:
    return float(front(np.array([x]), np.array([y]), Look())[0])


def _bangs() -> list[Lock]:
    made = []
    # From the parting to the temples; the middle ones shorter, so that brows and eyes are seen.
    for azimuth, end_x, end_y, wide in (
        (12, 0.000, 0.027, 0.017), (28, 0.026, 0.020, 0.018), (44, 0.049, 0.014, 0.0175), (60, 0.068, -0.004, 0.017),
        (-6, -0.017, 0.024, 0.017), (-22, -0.037, 0.020, 0.018), (-38, -0.056, 0.010, 0.017),
        (-54, -0.071, -0.006, 0.0165),
    ):  # fmt: skip
        root, high, low = _round(6, 14), _round(azimuth, 42, 0.005), _round(azimuth, 68, 0.007)
        end = (end_x, end_y, _skin(end_x, end_y) + 0.009)
        a = np.radians(azimuth)
        made.append(Lock("", (root, high, low, end), wide, 0.0075, (float(np.sin(a)), 0.0, float(np.cos(a)))))
    return made


def _sides() -> list[Lock]:
    made = []
    for side, name in ((1.0, "L"), (-1.0, "R")):
        line = (_round(72 * side, 30, 0.001), _round(74 * side, 72, 0.005), (side * 0.0900, -0.018, 0.036),
                (side * 0.0880, -0.076, 0.036), (side * 0.0790, -0.126, 0.040))  # fmt: skip
        made.append(Lock(f"hairSide{name}", line, 0.0185, 0.011, (side, 0.0, 0.4)))
        line = (_round(92 * side, 30, 0.001), _round(94 * side, 76, 0.006), (side * 0.0985, -0.030, 0.000),
                (side * 0.0930, -0.085, 0.000), (side * 0.0850, -0.118, 0.004))  # fmt: skip
        made.append(Lock(f"hairEar{name}", line, 0.026, 0.012, (side, 0.0, 0.1)))
    return made


def _backs() -> list[Lock]:
    made = []
    for k, angle in enumerate((-78, -52, -26, 0, 26, 52, 78)):
        s, c = float(np.sin(np.radians(angle))), float(np.cos(np.radians(angle)))
        length = -0.150 + 0.022 * abs(s)
        line = (_round(180 - angle, 48, -0.004), _round(180 - angle, 84, 0.003), (0.100 * s, -0.040, -0.104 * c),
                (0.091 * s, -0.098, -0.090 * c), (0.096 * s, length, -0.097 * c))  # fmt: skip
        made.append(Lock(f"hairBack{k}", line, 0.033, 0.017, (s, 0.0, -c)))
    return made


def _tuft() -> list[Lock]:
    line = ((0.002, 0.120, 0.0), (0.004, 0.146, 0.004), (0.019, 0.163, 0.014), (0.040, 0.158, 0.020))
    return [Lock("hairTuft", line, 0.0085, 0.0050, (0.0, 0.3, 1.0))]


LOCKS = (*_bangs(), *_sides(), *_backs(), *_tuft())


def bones() -> dict[str, tuple[str, Array]]:
    """Bones of the locks that swing, three in a row each: parent and place."""
    found: dict[str, tuple[str, Array]] = {}
    for lock in LOCKS:
        if not lock.name:
            continue
        line = _line(lock, np.array([0.25, 0.6, 1.0]))
        parent = "head"
        for number, at in enumerate(line, 1):
            name = f"{lock.name}{number}"
            found[name] = parent, at
            parent = name
    return found


def _line(lock: Lock, at: Array) -> Array:
    knots = np.array(lock.knots)
    step = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    table = [(t, *point) for t, point in zip(step / step[-1], knots.tolist(), strict=True)]
    return HEAD + curve(table, at)


def _uv(points: Array) -> Array:
    """Where the picture of the hair lies: around the head, and down from the crown."""
    x, y, z = (points - HEAD).T
    return np.stack([0.5 + np.arctan2(x, z) / (2 * np.pi), np.clip((0.135 - y) / 0.30, 0.0, 1.0)], axis=1)


def _built(lock: Lock) -> Part:
    rows, sides = 8, 6
    at = np.linspace(0.0, 1.0, rows)
    line = _line(lock, at)
    # Round at the root, widest in the first half, a point at the end.
    share = (0.45 + 0.55 * smooth(at / 0.5)) * (1.0 - at**3.4) ** 0.8
    share[-1] = 0.02
    side = np.cross(np.array(lock.out), np.array([0.0, 1.0, 0.0]))
    points, triangles = tube(line, lock.wide * share, lock.thick * share, sides, side, (False, True))
    row = np.concatenate([np.repeat(at, sides), [1.0]])
    if not lock.name:
        return Part("hair", points, triangles, rigid("head", len(points)), _uv(points))
    first = smooth((row - 0.15) / 0.2)
    second = smooth((row - 0.5) / 0.2)
    weights = {"head": 1.0 - first, f"{lock.name}1": first - second, f"{lock.name}2": second}
    return Part("hair", points, triangles, weights, _uv(points))


def _cap() -> Part:
    """What covers the skull: over the forehead in front, down to the neck behind."""
    rows, sides = 12, 33
    share, turn = np.linspace(0.0, 1.0, rows), np.linspace(-np.pi, np.pi, sides)
    s, a = np.meshgrid(share, turn, indexing="ij")
    reach = np.radians(66.0) + np.radians(44.0) * smooth((np.abs(a) - 0.9) / 0.7)
    d = np.maximum(s * reach, 1e-3)
    way = np.stack([np.sin(a) * np.sin(d), np.cos(d), np.cos(a) * np.sin(d)], -1)
    points = MIDDLE + way * RADII
    # Behind, it goes on down as a curtain before the neck.
    down = smooth((np.abs(a) - 1.35) / 0.5) * smooth((s - 0.78) / 0.22)
    points[..., 1] -= 0.035 * down
    points = HEAD + points.reshape(-1, 3)
    return Part(
        "hair", points, strip(rows, sides, closed=False)[:, ::-1], rigid("head", len(points)), _uv(points)
    )


def build() -> list[Part]:
    """The cap and all locks."""
    return [_cap(), *(_built(lock) for lock in LOCKS)]
