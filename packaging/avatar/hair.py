"""The avatar's hair: a cap over the skull, and locks that hang from it; the long ones swing on bones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from face import HEAD, Look, front
from face import _BACK as BACK
from face import _FRONT as FRONT
from face import _WIDTH as WIDTH
from shape import Array, Part, curve, rigid, smooth, strip, tube


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


def _bangs() -> list[Lock]:
    made = []
    # From the parting to the temples; the middle ones shorter, so that brows and eyes are seen.
    for x, end_x, end_y, wide in (
        (0.012, 0.004, 0.022, 0.017), (0.030, 0.029, 0.014, 0.018), (0.046, 0.052, 0.008, 0.017),
        (0.060, 0.070, -0.010, 0.015), (-0.004, -0.020, 0.018, 0.018), (-0.026, -0.042, 0.012, 0.018),
        (-0.046, -0.060, 0.004, 0.016), (-0.060, -0.073, -0.012, 0.014),
    ):  # fmt: skip
        root = (x * 0.55, 0.106, 0.045)
        middle = (x * 1.02, 0.070, _skin(x * 1.02, 0.070) + 0.012)
        low = (0.5 * (x + end_x), 0.5 * (0.070 + end_y) + 0.006, _skin(0.5 * (x + end_x), 0.04) + 0.013)
        end = (end_x, end_y, _skin(end_x, end_y) + 0.008)
        made.append(Lock("", (root, middle, low, end), wide, 0.008, (x * 6, 0.1, 1.0)))
    return made


def _skin(x: float, y: float) -> float:
    return float(front(np.array([x]), np.array([y]), Look())[0])


def _sides() -> list[Lock]:
    made = []
    for side, name in ((1.0, "L"), (-1.0, "R")):
        knots = ((0.060, 0.085, 0.030), (0.085, 0.040, 0.048), (0.091, -0.020, 0.048), (0.088, -0.080, 0.040),
                 (0.080, -0.130, 0.042))  # fmt: skip
        made.append(Lock(f"hairSide{name}", tuple((side * x, y, z) for x, y, z in knots), 0.017, 0.011, (side, 0.0, 0.4)))
        knots = ((0.062, 0.080, 0.010), (0.093, 0.030, 0.016), (0.098, -0.030, 0.010), (0.092, -0.085, 0.006),
                 (0.086, -0.120, 0.008))  # fmt: skip
        made.append(Lock(f"hairEar{name}", tuple((side * x, y, z) for x, y, z in knots), 0.024, 0.012, (side, 0.0, 0.1)))
    return made


def _backs() -> list[Lock]:
    made = []
    for k, angle in enumerate(np.radians([-78, -52, -26, 0, 26, 52, 78])):
        s, c = float(np.sin(angle)), float(np.cos(angle))
        length = -0.155 + 0.022 * abs(s)
        knots = (
            (0.05 * s, 0.085, -0.045 * c), (0.094 * s, 0.030, -0.098 * c), (0.100 * s, -0.035, -0.104 * c),
            (0.090 * s, -0.100, -0.088 * c), (0.094 * s, length, -0.094 * c),
        )  # fmt: skip
        made.append(Lock(f"hairBack{k}", knots, 0.032, 0.017, (s, 0.0, -c)))
    return made


def _tuft() -> list[Lock]:
    knots = ((0.002, 0.112, 0.0), (0.006, 0.142, 0.004), (0.022, 0.158, 0.016), (0.042, 0.152, 0.022))
    return [Lock("hairTuft", knots, 0.0085, 0.0055, (0.0, 0.3, 1.0))]


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


def _built(lock: Lock) -> Part:
    rows = 9
    at = np.linspace(0.0, 1.0, rows)
    line = _line(lock, at)
    # Round at the root, widest in the first half, a point at the end.
    share = (0.55 + 0.45 * smooth(at / 0.35)) * (1.0 - at**2.6) ** 0.75
    share[-1] = 0.02
    side = np.cross(np.array(lock.out), np.array([0.0, 1.0, 0.0]))
    points, triangles = tube(line, lock.wide * share, lock.thick * share, 8, side, (True, True))
    row = np.concatenate([np.repeat(at, 8), [0.0, 1.0]])
    if not lock.name:
        return Part("hair", points, triangles, rigid("head", len(points)))
    first = smooth((row - 0.15) / 0.2)
    second = smooth((row - 0.5) / 0.2)
    weights = {"head": 1.0 - first, f"{lock.name}1": first - second, f"{lock.name}2": second}
    return Part("hair", points, triangles, weights)


def _cap() -> Part:
    """What covers the skull: a little outside it, open where the face is."""
    rows, sides = 15, 32
    y = np.linspace(-0.075, 0.117, rows)
    t = np.linspace(0.5 - 0.28, 1.5 + 0.28, sides) * np.pi
    yy, a = np.meshgrid(y, t, indexing="ij")
    # In front it begins higher: over the forehead.
    before = smooth(np.cos(a) / 0.6)
    yy = yy + before * (0.112 - yy) * 0.86 * smooth((0.117 - yy) / 0.02)
    grow = 0.010
    wide = curve(WIDTH, np.minimum(yy, 0.112).ravel()).reshape(yy.shape) + grow
    deep = np.where(np.cos(a) < 0, curve(BACK, np.minimum(yy, 0.112).ravel()).reshape(yy.shape) + grow,
                    curve(FRONT, np.minimum(yy, 0.112).ravel()).reshape(yy.shape) + 0.4 * grow)  # fmt: skip
    # Below the ears the skull ends; hair does not.
    deep = np.where((np.cos(a) < 0) & (yy < -0.03), np.maximum(deep, 0.078), deep)
    wide = np.where(yy < -0.02, np.maximum(wide, 0.078), wide)
    x = wide * np.sign(np.sin(a)) * np.abs(np.sin(a)) ** 0.85
    z = deep * np.sign(np.cos(a)) * np.abs(np.cos(a)) ** 0.91
    points = HEAD + np.stack([x, yy + np.where(yy > 0.1, 0.008, 0.0), z], axis=-1).reshape(-1, 3)
    triangles = strip(rows, sides, closed=False)
    # The crown.
    top = np.concatenate([points, HEAD[None] + [[0.0, 0.131, 0.0]]])
    ring = (rows - 1) * sides + np.arange(sides)
    crown = np.stack([ring, np.roll(ring, -1), np.full(sides, len(points))], 1)
    return Part("hair", top, np.concatenate([triangles, crown]), rigid("head", len(top)))


def build() -> list[Part]:
    """The cap and all locks."""
    return [_cap(), *(_built(lock) for lock in LOCKS)]
