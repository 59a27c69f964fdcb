"""The avatar's head: skull, eyes with lids, mouth with lips, teeth and tongue, brows; all blend shapes of ARKit.

Lids and lips are rings around openings of the skull, laid on its surface. Each blend shape is the same face with
one number changed, so that nothing tears and every shape goes with every other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from shape import Array, Part, Whole, curve, rigid, smooth, strip

HEAD = np.array([0.0, 1.30, 0.0])
"""The middle between the eyes' height and the ears."""
MOUTH_Y, EYE_X, EYE_Y = -0.060, 0.036, -0.014
JAW_DROP, LIP_DROP = 0.019, 0.0245
EYE_W, EYE_UP, EYE_LOW = 0.0200, 0.0185, 0.0165
IRIS, MOUTH_WIDE = 0.0150, 0.0185

_WIDTH = [(-0.106, 0.006), (-0.1, 0.025), (-0.085, 0.0445), (-0.06, 0.0635), (-0.03, 0.0765), (0.0, 0.082),
          (0.04, 0.084), (0.08, 0.071), (0.105, 0.045), (0.118, 0.004)]  # fmt: skip
_FRONT = [(-0.106, 0.056), (-0.1, 0.067), (-0.085, 0.077), (-0.06, 0.083), (-0.03, 0.086), (0.0, 0.087),
          (0.04, 0.086), (0.08, 0.07), (0.105, 0.044), (0.118, 0.004)]  # fmt: skip
_BACK = [(-0.106, -0.03), (-0.1, -0.012), (-0.085, 0.022), (-0.06, 0.053), (-0.03, 0.072), (0.0, 0.083),
         (0.04, 0.087), (0.08, 0.073), (0.105, 0.046), (0.118, 0.004)]  # fmt: skip
_POWER = 2.75


@dataclass(frozen=True)
class Look:
    """A face in numbers; pairs are left and right, 0 is at rest."""

    jaw: float = 0.0
    jaw_x: float = 0.0
    jaw_z: float = 0.0
    close: float = 0.0
    pucker: float = 0.0
    funnel: float = 0.0
    shift: float = 0.0
    smile: tuple[float, float] = (0.0, 0.0)
    frown: tuple[float, float] = (0.0, 0.0)
    dimple: tuple[float, float] = (0.0, 0.0)
    stretch: tuple[float, float] = (0.0, 0.0)
    press: tuple[float, float] = (0.0, 0.0)
    down: tuple[float, float] = (0.0, 0.0)
    up: tuple[float, float] = (0.0, 0.0)
    roll_low: float = 0.0
    roll_up: float = 0.0
    shrug_low: float = 0.0
    shrug_up: float = 0.0
    puff: float = 0.0
    squint_cheek: tuple[float, float] = (0.0, 0.0)
    sneer: tuple[float, float] = (0.0, 0.0)
    tongue: float = 0.0
    blink: tuple[float, float] = (0.0, 0.0)
    wide: tuple[float, float] = (0.0, 0.0)
    squint: tuple[float, float] = (0.0, 0.0)
    look_x: tuple[float, float] = (0.0, 0.0)
    look_y: tuple[float, float] = (0.0, 0.0)
    brow_down: tuple[float, float] = (0.0, 0.0)
    brow_in: float = 0.0
    brow_out: tuple[float, float] = (0.0, 0.0)


def _pair(name: str, field: str, value: float = 1.0) -> dict[str, Look]:
    return {
        f"{name}Left": Look(**{field: (value, 0.0)}),  # type: ignore[arg-type]
        f"{name}Right": Look(**{field: (0.0, value)}),  # type: ignore[arg-type]
    }


# How ARKit's shapes look on this face; its closed mouth is measured with the jaw open.
SHAPES: dict[str, Look] = {
    **_pair("eyeBlink", "blink"), **_pair("eyeWide", "wide"), **_pair("eyeSquint", "squint"),
    **_pair("eyeLookUp", "look_y"), **_pair("eyeLookDown", "look_y", -1.0),
    "eyeLookOutLeft": Look(look_x=(1.0, 0.0)), "eyeLookInLeft": Look(look_x=(-1.0, 0.0)),
    "eyeLookOutRight": Look(look_x=(0.0, -1.0)), "eyeLookInRight": Look(look_x=(0.0, 1.0)),
    "jawOpen": Look(jaw=1.0), "jawForward": Look(jaw_z=1.0), "jawLeft": Look(jaw_x=1.0),
    "jawRight": Look(jaw_x=-1.0), "mouthClose": Look(close=1.0), "mouthFunnel": Look(funnel=1.0),
    "mouthPucker": Look(pucker=1.0), "mouthLeft": Look(shift=1.0), "mouthRight": Look(shift=-1.0),
    **_pair("mouthSmile", "smile"), **_pair("mouthFrown", "frown"), **_pair("mouthDimple", "dimple"),
    **_pair("mouthStretch", "stretch"), **_pair("mouthPress", "press"), **_pair("mouthLowerDown", "down"),
    **_pair("mouthUpperUp", "up"), "mouthRollLower": Look(roll_low=1.0), "mouthRollUpper": Look(roll_up=1.0),
    "mouthShrugLower": Look(shrug_low=1.0), "mouthShrugUpper": Look(shrug_up=1.0),
    **_pair("browDown", "brow_down"), "browInnerUp": Look(brow_in=1.0), **_pair("browOuterUp", "brow_out"),
    "cheekPuff": Look(puff=1.0), **_pair("cheekSquint", "squint_cheek"), **_pair("noseSneer", "sneer"),
    "tongueOut": Look(tongue=1.0),
}  # fmt: skip


def front(x: Array, y: Array, look: Look) -> Array:
    """How far before HEAD the skin lies at some place of the face."""
    y = _undropped(y, look)
    wide = np.maximum(curve(_WIDTH, y), 1e-4)
    share = np.clip(1.0 - np.abs(x / wide) ** _POWER, 0.0, 1.0) ** (1.0 / _POWER)
    z = curve(_FRONT, y) * share
    nose = np.exp(-((x / 0.0075) ** 2) - ((y + 0.036) / 0.0085) ** 2) * 0.0125
    bridge = np.exp(-((x / 0.007) ** 2) - ((y + 0.018) / 0.018) ** 2) * 0.004
    lips = np.exp(-((x / 0.022) ** 2) - ((y - MOUTH_Y) / 0.014) ** 2) * 0.003
    sockets = np.exp(-(((np.abs(x) - EYE_X) / 0.02) ** 2) - ((y - EYE_Y) / 0.02) ** 2) * -0.002
    z = z + nose + bridge + lips + sockets
    cheeks = np.exp(-(((np.abs(x) - 0.042) / 0.02) ** 2) - ((y + 0.052) / 0.02) ** 2)
    z = z + 0.019 * look.puff * cheeks
    low = smooth((MOUTH_Y + 0.012 - y) / 0.03)
    return z + 0.008 * look.jaw_z * low


def _drop(y: Array, look: Look) -> Array:
    """How far the open jaw moves a place of the face down."""
    return JAW_DROP * look.jaw * smooth((MOUTH_Y - y) / 0.017)


def _undropped(y: Array, look: Look) -> Array:
    """Where a place was before the jaw dropped."""
    before = np.linspace(0.12, -0.12, 481)
    return np.interp(-y, -(before - _drop(before, look)), before)


def _on_skin(x: Array, y: Array, above: Array | float, look: Look) -> Array:
    """Points over the skin (N, 3), moved outwards by `above`."""
    step = 5e-4
    z = front(x, y, look)
    dx = (front(x + step, y, look) - front(x - step, y, look)) / (2 * step)
    dy = (front(x, y + step, look) - front(x, y - step, look)) / (2 * step)
    out = np.stack([-np.clip(dx, -2, 2), -np.clip(dy, -2, 2), np.ones_like(x)], axis=-1)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    return HEAD + np.stack([x, y, z], axis=-1) + out * np.asarray(above)[..., None]


def skull(look: Look) -> tuple[Array, Array]:
    """The head's skin as a grid of rings; gives its points (N, 3) and the same at rest, flat."""
    rows = np.concatenate([np.linspace(-0.106, -0.09, 4)[:-1], np.linspace(-0.09, 0.04, 27)[:-1],
                           np.linspace(0.04, 0.118, 9)])  # fmt: skip
    # Finer in front, where the face is.
    t = np.concatenate([np.linspace(-1.0, 1.0, 37) * 0.5 * np.pi, np.linspace(0.5, 1.5, 13)[1:-1] * np.pi])
    y, a = np.meshgrid(rows, t, indexing="ij")
    before = np.cos(a) >= -1e-9
    x = curve(_WIDTH, y.ravel()).reshape(y.shape) * np.sign(np.sin(a)) * np.abs(np.sin(a)) ** (2 / _POWER)
    back = -curve(_BACK, y.ravel()).reshape(y.shape) * np.abs(np.cos(a)) ** (2 / 2.2)
    rest = np.stack([x, y], axis=-1).reshape(-1, 2)
    low = smooth((MOUTH_Y - y) / 0.02)
    dropped = y - _drop(y, look)
    z = np.where(before, front(x.ravel(), dropped.ravel(), look).reshape(y.shape), back)
    x = x + np.sign(x) * 0.008 * look.puff * np.exp(-(((y + 0.062) / 0.022) ** 2))
    sideways = 0.007 * look.jaw_x * low * np.where(before, 1.0, 0.0)
    for side, sign in ((0, 1.0), (1, -1.0)):
        cheek = np.exp(-((sign * x - 0.042) ** 2) / 0.018**2 - (y + 0.04) ** 2 / 0.016**2) * before
        dropped = dropped + 0.004 * cheek * (look.squint_cheek[side] + 0.5 * look.smile[side])
        z = z + 0.003 * cheek * (look.squint_cheek[side] + 0.6 * look.smile[side])
        wing = np.exp(-((sign * x - 0.009) ** 2) / 0.007**2 - (y + 0.038) ** 2 / 0.008**2) * before
        dropped = dropped + 0.009 * wing * look.sneer[side]
        z = z + 0.003 * wing * look.sneer[side]
    return HEAD + np.stack([x + sideways, dropped, z], axis=-1).reshape(-1, 3), rest


SKULL_ROWS, SKULL_SIDES = 37, 48


def _uv(points: Array) -> Array:
    """Where the picture of the face lies on points at rest."""
    x, y, _ = (points - HEAD).T
    return np.stack([0.5 + x / 0.2, 0.5 - (y + 0.01) / 0.25], axis=1)


def _head_part() -> Part:
    points, rest = skull(Look())
    triangles = strip(SKULL_ROWS, SKULL_SIDES, closed=True)
    middle = rest[triangles].mean(axis=1)
    in_front = points[triangles][:, :, 2].mean(axis=1) > 0.0
    eye = ((np.abs(middle[:, 0]) - EYE_X) / (EYE_W * 1.12)) ** 2 + ((middle[:, 1] - EYE_Y) / 0.02) ** 2 < 1.0
    mouth = (middle[:, 0] / 0.029) ** 2 + ((middle[:, 1] - MOUTH_Y) / 0.013) ** 2 < 1.0
    covered = (middle[:, 1] > 0.088) | (
        (middle[:, 1] > -0.05) & (points[triangles][:, :, 2].mean(axis=1) < -0.03)
    )
    kept = triangles[~((in_front & (eye | mouth)) | covered)]
    uv = _uv(points)
    uv[points[:, 2] < 0.0] = (0.02, 0.02)
    return Part("face", points, kept, rigid("head", len(points)), uv)


# -- eyes ------------------------------------------------------------------------------------------

_EYE_POINTS = 36


def _opening(side: int, look: Look) -> tuple[Array, Array]:
    """The edge of an eye's lids, counter-clockwise from its outer corner: x and y on the face."""
    t = np.arange(_EYE_POINTS) * 2 * np.pi / _EYE_POINTS
    s, h = np.cos(t), np.sin(t)
    upper = h >= 0
    blink, wide, squint = look.blink[side], look.wide[side], look.squint[side]
    cheek = look.squint_cheek[side]
    # Shut, both lids lie on one line that hangs a little.
    line = -0.0085 * (1 - s**2) - 0.001
    top = EYE_UP * np.abs(h) ** 0.68 * (1 + 0.16 * wide - 0.22 * squint) - 0.004 * np.maximum(
        -look.look_y[side], 0
    ) * np.abs(h)
    low = -EYE_LOW * np.abs(h) ** 0.72 * (1 + 0.07 * wide) + (0.0075 * squint + 0.005 * cheek) * np.abs(h)
    y = np.where(upper, top, low)
    y = y + (line - y) * blink
    # The outer corner a little higher.
    y = y + 0.0025 * s * (1 - 0.5 * blink)
    sign = 1.0 if side == 0 else -1.0
    return sign * (EYE_X + EYE_W * s), EYE_Y + y


def _lid_ring(side: int, look: Look, rings: tuple[tuple[float, float], ...]) -> Array:
    """Rings around an eye's opening: (how far outwards, how far above the skin) each."""
    x, y = _opening(side, look)
    t = np.arange(_EYE_POINTS) * 2 * np.pi / _EYE_POINTS
    sign = 1.0 if side == 0 else -1.0
    found = []
    for out, above in rings:
        rest_x, rest_y = _opening(side, Look())
        # The outermost lies still: it is where the lid ends and the face begins.
        still = smooth(np.array(out / 0.011))
        ex = x + (rest_x - x) * still + sign * np.cos(t) * out
        ey = y + (rest_y - y) * still + np.sin(t) * out * 1.05
        found.append(_on_skin(ex, ey, above, look))
    return np.concatenate(found)


def _lash(side: int, look: Look) -> Array:
    """The upper lid's dark edge: a crescent, thick in the middle and outwards."""
    x, y = _opening(side, look)
    half = np.arange(_EYE_POINTS // 2 + 1)
    s = np.linspace(1.0, -1.0, len(half))
    thick = 0.0040 * (1 - np.abs(s) ** 4) + 0.0024 * smooth((s + 0.1) / 1.1)
    sign = 1.0 if side == 0 else -1.0
    wing = 0.004 * smooth((s - 0.75) / 0.25)
    inner = _on_skin(x[half] + sign * wing, y[half] - 0.0006 + 0.6 * wing, 0.0030, look)
    outer = _on_skin(x[half] + sign * (wing + 0.0012 * s), y[half] + thick + 0.6 * wing, 0.0036, look)
    return np.concatenate([inner, outer])


def _low_lash(side: int, look: Look) -> Array:
    x, y = _opening(side, look)
    half = np.concatenate([np.arange(_EYE_POINTS // 2 + 2, _EYE_POINTS), [0]])
    s = np.linspace(-1.0, 1.0, len(half))
    thick = 0.0011 * smooth((s + 0.8) / 1.2)
    inner = _on_skin(x[half], y[half] + 0.0002, 0.0028, look)
    outer = _on_skin(x[half], y[half] - thick, 0.0030, look)
    return np.concatenate([outer, inner])


def _disc(x: float, y: float, wide: float, high: float, above: float, look: Look, rings: int = 3) -> Array:
    """A round plate on the face, its middle first."""
    t = np.arange(24) * 2 * np.pi / 24
    px = np.concatenate([[x], *(x + wide * k / rings * np.cos(t) for k in range(1, rings + 1))])
    py = np.concatenate([[y], *(y + high * k / rings * np.sin(t) for k in range(1, rings + 1))])
    return _on_skin(px, py, above, look)


def _disc_triangles(rings: int = 3) -> Whole:
    ring = np.arange(24)
    fan = np.stack([np.zeros(24, dtype=np.int64), 1 + ring, 1 + (ring + 1) % 24], 1)
    outer = strip(rings, 24, closed=True) + 1
    return np.concatenate([fan, outer[:, ::-1]])


def _disc_uv(rings: int = 3) -> Array:
    t = np.arange(24) * 2 * np.pi / 24
    ring = [np.stack([0.5 + 0.5 * k / rings * np.cos(t), 0.5 - 0.5 * k / rings * np.sin(t)], 1)
            for k in range(1, rings + 1)]  # fmt: skip
    return np.concatenate([[[0.5, 0.5]], *ring])


def _gaze(side: int, look: Look) -> tuple[float, float]:
    return 0.0062 * look.look_x[side], 0.0062 * look.look_y[side] - 0.0005


LIDS = ((0.0, 0.0016), (0.0022, 0.0024), (0.0065, 0.0010), (0.0120, -0.0010))


def _eye(side: int, look: Look) -> dict[str, Array]:
    sign = 1.0 if side == 0 else -1.0
    x, y = sign * EYE_X, EYE_Y
    gx, gy = _gaze(side, look)
    white = _disc(x, y + 0.001, EYE_W * 1.5, EYE_UP * 1.5, -0.0028, replace(look, puff=0.0))
    iris = _disc(x + gx - sign * 0.001, y + gy + 0.001, IRIS, IRIS * 1.2, -0.0016, look)
    glints = np.concatenate([
        _disc(x + 0.6 * gx + dx, y + 0.6 * gy + dy, r, r * 1.1, -0.0008, look, 1)
        for dx, dy, r in ((-0.0045, 0.0065, 0.0036), (0.0048, -0.0065, 0.0018))
    ])  # fmt: skip
    lids = _lid_ring(side, look, LIDS)
    return {"white": white, "iris": iris, "glint": glints, "lids": lids,
            "lash": np.concatenate([_lash(side, look), _low_lash(side, look)]), "brow": _brow(side, look)}  # fmt: skip


def _brow(side: int, look: Look) -> Array:
    """A tapered arc over the eye."""
    sign = 1.0 if side == 0 else -1.0
    s = np.linspace(-1.0, 1.0, 13)  # from the nose outwards
    inner, outer = smooth((0.3 - s) / 1.2), smooth((s + 0.3) / 1.2)
    y = 0.0262 + 0.0040 * (1 - s**2) - 0.0020 * s
    y = y + look.brow_in * 0.0095 * inner + look.brow_out[side] * 0.0085 * outer
    y = y - look.brow_down[side] * (0.0105 * inner + 0.003 * outer)
    x = sign * (EYE_X + 0.0010 + 0.0195 * s - 0.003 * look.brow_down[side] * inner)
    thick = 0.0019 * (1 - 0.75 * smooth((s + 0.2) / 1.2)) * smooth((s + 1.25) / 0.4)
    low = _on_skin(x, EYE_Y + y - thick, 0.0022, look)
    high = _on_skin(x, EYE_Y + y + thick, 0.0026, look)
    return np.concatenate([low, high])


# -- the mouth -------------------------------------------------------------------------------------

_MOUTH_POINTS = 44


def _lips(look: Look) -> tuple[Array, Array, Array]:
    """The edge of the opening, counter-clockwise from its left corner: x, y, and how far lips stand out."""
    t = np.arange(_MOUTH_POINTS) * 2 * np.pi / _MOUTH_POINTS
    s, h = np.cos(t), np.sin(t)
    upper = h >= 0
    left, right = smooth((s + 0.35) / 0.7), smooth((0.35 - s) / 0.7)

    def both(pair: tuple[float, float]) -> Array:
        return pair[0] * left + pair[1] * right

    corner = np.abs(s) ** 2.0
    wide = MOUTH_WIDE * (1 - 0.44 * look.pucker - 0.36 * look.funnel - 0.13 * look.jaw)
    x = wide * s * (1 + 0.30 * both(look.smile) + 0.34 * both(look.stretch) + 0.14 * both(look.dimple)
                    - 0.03 * both(look.frown))  # fmt: skip
    middle = 1 - np.abs(s) ** 2.2
    y = 0.0024 * corner - 0.0010 * middle
    y = y + corner * (0.0088 * both(look.smile) - 0.0085 * both(look.frown) + 0.002 * both(look.dimple)
                      - 0.0025 * both(look.stretch))  # fmt: skip
    top = 0.0045 * look.jaw + 0.0065 * look.funnel + 0.0018 * look.pucker
    low = LIP_DROP * look.jaw + 0.0075 * look.funnel + 0.0018 * look.pucker
    arch = np.abs(h) ** 0.85
    rise = top * arch + 0.0060 * both(look.up) * middle
    fall = low * arch + 0.0065 * both(look.down) * middle
    # ARKit's closed mouth takes back just what the open jaw parted: lips meet half way down.
    rise = rise - look.close * (0.0045 + 0.0060) * arch
    fall = fall - look.close * (LIP_DROP - 0.0060) * arch
    y = y + np.where(upper, rise, -fall)
    y = y - 0.0035 * look.jaw * corner
    y = y + look.shrug_low * np.where(upper, 0.002, 0.0042) * middle + look.shrug_up * 0.0035 * middle
    y = y + look.sneer[0] * 0.0012 * left * upper + look.sneer[1] * 0.0012 * right * upper
    x = x + 0.0085 * look.shift + 0.006 * look.jaw_x * np.where(upper, 0.35, 1.0)
    out = 0.006 * look.pucker + 0.0055 * look.funnel + 0.004 * look.jaw_z * ~upper
    out = out + 0.0022 * look.puff - 0.0012 * look.roll_low * ~upper - 0.0012 * look.roll_up * upper
    return x, MOUTH_Y + y, out


def _mouth_ring(look: Look, rings: tuple[tuple[float, float], ...]) -> Array:
    """Rings around the mouth's opening: (how far outwards, how far above the skin) each."""
    x, y, stands = _lips(look)
    rest_x, rest_y, _ = _lips(Look())
    t = np.arange(_MOUTH_POINTS) * 2 * np.pi / _MOUTH_POINTS
    h = np.sin(t)
    upper = h >= 0
    s = np.cos(t)
    left, right = smooth((s + 0.35) / 0.7), smooth((0.35 - s) / 0.7)
    press = look.press[0] * left + look.press[1] * right
    thin = 1 - 0.55 * press - 0.8 * np.where(upper, look.roll_up, look.roll_low)
    thin = thin + 0.25 * look.pucker + 0.1 * look.funnel
    found = []
    for out, above in rings:
        # Skin beyond the lips goes along less and less.
        still = smooth(np.array((out - 0.004) / 0.015))
        body = thin if out <= 0.0034 else 1.0 + (thin - 1.0) * max(0.0, 1.0 - (out - 0.0034) / 0.006)
        away_x, away_y = np.cos(t) * out * 0.85, h * np.where(upper, 0.85, 1.15) * out * body
        base_y = rest_y - np.where(upper, 0.0, _drop(rest_y + away_y, look))
        ex = x + (rest_x - x) * still + away_x
        ey = y + (base_y - y) * still + away_y
        lift = above * np.where(out <= 0.0034, np.clip(thin, 0.15, 1.4), 1.0) + stands * (1 - still)
        found.append(_on_skin(ex, ey, lift, look))
    return np.concatenate(found)


LIPS = ((-0.0006, -0.0010), (0.0008, 0.0024), (0.0021, 0.0024), (0.0034, 0.0008))
AROUND = (
    (0.0034, 0.0008),
    (0.0060, 0.0005),
    (0.0090, 0.0004),
    (0.0125, 0.0004),
    (0.0165, 0.0002),
    (0.0215, -0.0012),
)


def _line(look: Look) -> Array:
    """The dark line where the lips meet: the upper one's lower edge, tapered to the corners."""
    x, y, stands = (values[: _MOUTH_POINTS // 2 + 1] for values in _lips(look))
    s = np.cos(np.arange(len(x)) * 2 * np.pi / _MOUTH_POINTS)
    thick = 0.0008 * (1 - 0.7 * np.abs(s) ** 2)
    past = 1.0 + 0.05 * np.abs(s)
    low = _on_skin(x * past, y - thick, 0.0027 + stands, look)
    return np.concatenate([_on_skin(x * past, y + 0.3 * thick, 0.0027 + stands, look), low])


def _plate(look: Look, scale: float, above: float) -> Array:
    """The dark inside of the mouth: a bowl within the lips' ridge."""
    x, y, stands = _lips(look)
    t = np.arange(_MOUTH_POINTS) * 2 * np.pi / _MOUTH_POINTS
    ex, ey = x * scale + np.cos(t) * 0.001, y + np.sin(t) * 0.0022
    edge = _on_skin(ex, ey, above + 0.9 * stands, look)
    middle = edge.mean(axis=0, keepdims=True)
    deep = [0.0, 0.0, 0.022]
    return np.concatenate([middle - deep, middle + (edge - middle) * [0.8, 0.8, 0.3] - deep, edge])


def _teeth(look: Look) -> Array:
    """Two rows on an arc behind the lips; the lower one goes with the jaw."""
    s = np.linspace(-1.0, 1.0, 15)
    rows = []
    for drop, (high, low), shift in (
        (0.0, (0.0045, -0.0028), 0.0), (-1.0 * LIP_DROP * look.jaw, (-0.0048, -0.0085), 0.006 * look.jaw_x)
    ):  # fmt: skip
        for y in (high, low):
            x = 0.0165 * s + shift
            arc = MOUTH_Y + y + drop + 0.0012 * s**2
            rows.append(_on_skin(x, arc, -0.0050 - 0.002 * s**2, replace(look, puff=0.0)))
    return np.concatenate(rows)


def _tongue(look: Look) -> Array:
    """A tongue that lies behind the lower teeth, and comes out."""
    n, m = 7, 9
    u = np.linspace(0.0, 1.0, n)[:, None]
    v = np.linspace(-1.0, 1.0, m)[None, :]
    wide = 0.0105 * np.sqrt(np.clip(1 - (2 * u - 1.0).clip(0) ** 2 * 0.96, 0.0, 1.0))
    drop = -0.94 * LIP_DROP * look.jaw
    out = look.tongue
    x = wide * v + 0.0 * u + 0.006 * look.jaw_x
    # Out, it first comes over the lower lip, and hangs from there.
    y = (
        MOUTH_Y
        + drop
        - 0.0045
        - 0.001 * v**2
        + 0.010 * look.jaw * (1 - u) * (1 - 0.3 * v**2)
        + out * (0.0035 * smooth(u / 0.4) - 0.021 * smooth((u - 0.45) / 0.6))
    )
    back = front(np.zeros(1), np.array([MOUTH_Y]), Look())[0]
    z = (
        back
        - 0.020
        + u * 0.0135
        + 0.0025 * (1 - v**2) * (1 + out)
        + out * (0.026 * smooth(u / 0.7) - 0.004 * u)
    )
    return HEAD + np.stack(np.broadcast_arrays(x, y, z), axis=-1).reshape(-1, 3)


def parts(look: Look) -> dict[str, Array]:
    """Points of every part of the face, by its name."""
    found = {"face": skull(look)[0], "lips": _mouth_ring(look, LIPS), "around": _mouth_ring(look, AROUND), "line": _line(look),
             "inside": _plate(look, 0.99, -0.0042), "teeth": _teeth(look), "tongue": _tongue(look)}  # fmt: skip
    for side, name in ((0, "L"), (1, "R")):
        found |= {f"{part}{name}": points for part, points in _eye(side, look).items()}
    return found


def build() -> list[Part]:
    """All parts of the face, each with its blend shapes."""
    rest = parts(Look())
    moved = {name: parts(look) for name, look in SHAPES.items()}
    # Closing takes back what the jaw parts, so it is measured with the jaw open.
    open_, shut = parts(Look(jaw=1.0)), parts(Look(jaw=1.0, close=1.0))
    moved["mouthClose"] = {part: rest[part] + shut[part] - open_[part] for part in rest}
    moved["tongueOut"] = parts(Look(tongue=1.0, jaw=0.4))
    triangles, uv, materials = _topology()
    head = _head_part()
    made = []
    for part, points in rest.items():
        one = Part(materials[part], points, triangles.get(part, head.triangles), rigid("head", len(points)),
                   head.uv if part == "face" else uv.get(part))  # fmt: skip
        for name, other in moved.items():
            if np.abs(other[part] - points).max() > 2e-5:
                one.moved[name] = other[part]
        made.append(one)
    return made


def _topology() -> tuple[dict[str, Whole], dict[str, Array], dict[str, str]]:
    lids = strip(len(LIDS), _EYE_POINTS, closed=True)
    lash_count, low_count = _EYE_POINTS // 2 + 1, _EYE_POINTS // 2 - 1
    lash = np.concatenate(
        [strip(2, lash_count, closed=False), strip(2, low_count, closed=False) + 2 * lash_count]
    )
    glint = _disc_triangles(1)[:24]
    ring = np.arange(_MOUTH_POINTS)
    fan = np.stack([np.zeros_like(ring), 1 + ring, 1 + (ring + 1) % _MOUTH_POINTS], 1)
    bowl = np.concatenate([fan, strip(2, _MOUTH_POINTS, closed=True)[:, ::-1] + 1])
    teeth = np.concatenate([strip(2, 15, closed=False)[:, ::-1], strip(2, 15, closed=False)[:, ::-1] + 30])
    triangles: dict[str, Whole] = {
        "lips": strip(len(LIPS), _MOUTH_POINTS, closed=True)[:, ::-1],
        "around": strip(len(AROUND), _MOUTH_POINTS, closed=True)[:, ::-1],
        "line": strip(2, _MOUTH_POINTS // 2 + 1, closed=False)[:, ::-1],
        "inside": bowl, "teeth": teeth, "tongue": strip(7, 9, closed=False)[:, ::-1],
    }  # fmt: skip
    materials = {"face": "face", "lips": "lips", "around": "lids", "line": "line",
                 "inside": "inside", "teeth": "teeth",
                 "tongue": "tongue"}  # fmt: skip
    uv: dict[str, Array] = {"around": _uv(_mouth_ring(Look(), AROUND))}
    for side, name in ((0, "L"), (1, "R")):
        turn = slice(None, None, -1) if side == 0 else slice(None)
        both = np.concatenate([glint, glint + 25])
        triangles |= {
            f"white{name}": _disc_triangles(), f"iris{name}": _disc_triangles(), f"glint{name}": both,
            f"lids{name}": lids[:, turn], f"lash{name}": lash[:, slice(None, None, -1) if side else slice(None)],
            f"brow{name}": strip(2, 13, closed=False)[:, slice(None, None, -1) if side else slice(None)],
        }  # fmt: skip
        uv |= {f"iris{name}": _disc_uv(), f"lids{name}": _uv(_lid_ring(side, Look(), LIDS))}
        materials |= {f"white{name}": "white", f"iris{name}": "iris", f"glint{name}": "glint",
                      f"lids{name}": "lids", f"lash{name}": "dark", f"brow{name}": "dark"}  # fmt: skip
    return triangles, uv, materials
