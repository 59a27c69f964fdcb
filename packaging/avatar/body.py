"""The avatar's body: neck, hoodie, trousers, shoes and hands with fingers, and the bones they hang from."""

from __future__ import annotations

import numpy as np
from shape import Array, Part, along, curve, mirrored, rigid, smooth, tube

_CENTRE: dict[str, tuple[str, tuple[float, float, float]]] = {
    "hips": ("", (0.0, 0.795, 0.0)), "spine": ("hips", (0.0, 0.865, 0.0)), "chest": ("spine", (0.0, 0.955, 0.0)),
    "upperChest": ("chest", (0.0, 1.045, 0.0)), "neck": ("upperChest", (0.0, 1.135, -0.004)),
    "head": ("neck", (0.0, 1.198, 0.002)),
}  # fmt: skip
_LEFT: dict[str, tuple[str, tuple[float, float, float]]] = {
    "leftEye": ("head", (0.036, 1.286, 0.055)),
    "leftShoulder": ("upperChest", (0.022, 1.112, 0.0)), "leftUpperArm": ("leftShoulder", (0.092, 1.094, 0.0)),
    "leftLowerArm": ("leftUpperArm", (0.290, 1.094, -0.004)), "leftHand": ("leftLowerArm", (0.474, 1.094, 0.0)),
    "leftThumbMetacarpal": ("leftHand", (0.488, 1.088, 0.016)),
    "leftThumbProximal": ("leftThumbMetacarpal", (0.508, 1.084, 0.032)),
    "leftThumbDistal": ("leftThumbProximal", (0.526, 1.082, 0.042)),
    "leftUpperLeg": ("hips", (0.062, 0.765, 0.0)), "leftLowerLeg": ("leftUpperLeg", (0.062, 0.425, 0.004)),
    "leftFoot": ("leftLowerLeg", (0.062, 0.082, -0.012)), "leftToes": ("leftFoot", (0.064, 0.024, 0.072)),
}  # fmt: skip
FINGERS = {
    "Index": (0.0215, 0.072),
    "Middle": (0.0072, 0.079),
    "Ring": (-0.0072, 0.073),
    "Little": (-0.0205, 0.058),
}
"""How far before the hand's middle each lies, and how long it is."""
_KNUCKLES = 0.540


def bones() -> dict[str, tuple[str, Array]]:
    """All humanoid bones: parent ("" for none) and place, parents first."""
    found = {name: (parent, np.array(at)) for name, (parent, at) in _CENTRE.items()}
    left = {name: (parent, np.array(at)) for name, (parent, at) in _LEFT.items()}
    for finger, (z, length) in FINGERS.items():
        parent = "leftHand"
        for joint, share in (("Proximal", 0.0), ("Intermediate", 0.45), ("Distal", 0.74)):
            name = f"left{finger}{joint}"
            left[name] = parent, np.array([_KNUCKLES + share * length, 1.0935, z])
            parent = name
    for name, (parent, at) in left.items():
        found[name] = parent, at
        found[other(name)] = other(parent), at * [-1.0, 1.0, 1.0]
    return found


def other(name: str) -> str:
    """What a bone of the left side is called on the right."""
    return name.replace("left", "right", 1) if name.startswith("left") else name


def _lofted(
    material: str, centres: Array, widths: Array, depths: Array, across: Array, weights: dict[str, Array],
    sides: int = 20, ends: tuple[bool, bool] = (False, False),
) -> Part:  # fmt: skip
    points, triangles = tube(centres, widths, depths, sides, across, ends)
    rows = np.repeat(np.arange(len(centres)), sides)
    extra = [row for row, wanted in ((0, ends[0]), (len(centres) - 1, ends[1])) if wanted]
    rows = np.concatenate([rows, np.array(extra, dtype=np.int64)])
    return Part(material, points, triangles, {bone: w[rows] for bone, w in weights.items()})


def _neck() -> Part:
    y = np.linspace(1.09, 1.225, 9)
    centres = np.stack([np.zeros(9), y, np.linspace(-0.008, -0.002, 9)], 1)
    width = curve([(1.09, 0.045), (1.13, 0.031), (1.16, 0.0265), (1.225, 0.031)], y)
    weights = along(y, [("upperChest", 1.0), ("neck", 1.135), ("head", 1.198)], 0.05)
    return _lofted("skin", centres, width, width * 0.95, np.array([1.0, 0.0, 0.0]), weights)


def _torso() -> Part:
    """The hoodie: loose, with a hem and a standing collar."""
    y = np.concatenate([np.linspace(0.735, 0.765, 3)[:-1], np.linspace(0.765, 1.07, 10)[:-1],
                        np.linspace(1.07, 1.150, 8)])  # fmt: skip
    knots = [(0.735, 0.119, 0.092, 0.0), (0.75, 0.126, 0.098, 0.0), (0.78, 0.128, 0.099, 0.0),
             (0.86, 0.118, 0.090, 0.002), (0.95, 0.109, 0.083, 0.004), (1.03, 0.107, 0.083, 0.004),
             (1.075, 0.099, 0.076, 0.0), (1.098, 0.086, 0.067, -0.001), (1.118, 0.064, 0.058, -0.002), (1.132, 0.055, 0.054, -0.002),
             (1.150, 0.055, 0.055, 0.0)]  # fmt: skip
    width, depth, z = curve(knots, y).T
    centres = np.stack([np.zeros(len(y)), y, z - 0.004], 1)
    joints = [("hips", 0.7), ("spine", 0.865), ("chest", 0.955), ("upperChest", 1.045), ("neck", 1.15)]
    return _lofted("hoodie", centres, width, depth, np.array([1.0, 0.0, 0.0]), along(y, joints, 0.07), 24)


def _hem() -> Part:
    """The ribbed band the hoodie ends in."""
    y = np.array([0.728, 0.731, 0.745, 0.760, 0.763])
    width, depth = (
        np.array([0.108, 0.1225, 0.1265, 0.1275, 0.118]),
        np.array([0.08, 0.0955, 0.0985, 0.099, 0.09]),
    )
    centres = np.stack([np.zeros(5), y, np.full(5, -0.004)], 1)
    return _lofted("accent", centres, width, depth, np.array([1.0, 0.0, 0.0]), {"hips": np.ones(5)}, 24)


def _collar() -> Part:
    """The hood, folded behind the neck, as a soft roll around it."""
    t = np.linspace(-0.86 * np.pi, 0.86 * np.pi, 19) - 0.5 * np.pi
    centres = np.stack([0.066 * np.cos(t), 1.125 - 0.018 * np.sin(t), -0.006 + 0.062 * np.sin(t)], 1)
    thick = (0.012 + 0.017 * smooth((-np.sin(t) + 0.4) / 1.4)) * smooth((0.72 - np.sin(t)) / 0.5)
    count = len(t)
    part = _lofted("accent", centres, thick, thick * 0.8, np.array([0.0, 1.0, 0.0]),
                   {"upperChest": np.ones(count)}, 12, (True, True))  # fmt: skip
    return part


def _sleeve() -> Part:
    x = np.concatenate([[0.052, 0.072], np.linspace(0.092, 0.44, 13), np.linspace(0.45, 0.472, 3)])
    knots = [(0.052, 0.034), (0.092, 0.0365), (0.13, 0.0405), (0.18, 0.0405), (0.29, 0.040), (0.36, 0.041), (0.43, 0.043),
             (0.448, 0.038), (0.458, 0.029), (0.472, 0.027)]  # fmt: skip
    r = curve(knots, x)
    centres = np.stack(
        [x, np.full(len(x), 1.092) - 0.018 * smooth((0.15 - x) / 0.10), np.full(len(x), -0.002)], 1
    )
    joints = [("leftShoulder", 0.0), ("leftUpperArm", 0.085), ("leftLowerArm", 0.290), ("leftHand", 0.478)]
    return _lofted(
        "hoodie", centres, r, r * 0.97, np.array([0.0, 1.0, 0.0]), along(x, joints, 0.06), 14, (True, False)
    )


def _cuff() -> Part:
    x = np.linspace(0.456, 0.478, 4)
    r = np.array([0.0285, 0.0305, 0.0305, 0.027])
    centres = np.stack([x, np.full(4, 1.092), np.full(4, -0.002)], 1)
    return _lofted("accent", centres, r, r, np.array([0.0, 1.0, 0.0]), {"leftLowerArm": np.ones(4)}, 14)


def _hand() -> list[Part]:
    x = np.array([0.462, 0.474, 0.488, 0.505, 0.525, 0.541, 0.549])
    centres = np.stack([x, np.full(7, 1.0935), np.full(7, 0.0005)], 1)
    deep = np.array([0.0195, 0.0200, 0.0255, 0.0305, 0.0315, 0.0300, 0.0220])
    high = np.array([0.0175, 0.0165, 0.0150, 0.0135, 0.0120, 0.0105, 0.0070])
    weights = along(x, [("leftLowerArm", 0.4), ("leftHand", 0.472)], 0.02)
    made = [_lofted("skin", centres, deep, high, np.array([0.0, 0.0, 1.0]), weights, 14, (False, True))]
    for finger, (z, length) in FINGERS.items():
        at = np.array([-0.10, 0.08, 0.30, 0.45, 0.60, 0.74, 0.86, 0.95, 1.0])
        centres = np.stack([_KNUCKLES + at * length, np.full(9, 1.0935), np.full(9, z)], 1)
        r = np.array([0.0080, 0.0084, 0.0080, 0.0078, 0.0075, 0.0072, 0.0066, 0.0048, 0.0022])
        r = r * (0.86 if finger == "Little" else 1.0)
        joints = [("leftHand", -1.0), *((f"left{finger}{joint}", begin) for joint, begin in
                  (("Proximal", 0.0), ("Intermediate", 0.45), ("Distal", 0.74)))]  # fmt: skip
        weights = along(at, joints, 0.16)
        made.append(_lofted("skin", centres, r, r, np.array([0.0, 0.0, 1.0]), weights, 7, (False, True)))
    knots = np.array([(0.476, 1.089, 0.008), (0.488, 1.088, 0.018), (0.508, 1.084, 0.033), (0.526, 1.082, 0.043),
                      (0.540, 1.081, 0.049), (0.546, 1.081, 0.0515)])  # fmt: skip
    r = np.array([0.0110, 0.0118, 0.0098, 0.0086, 0.0072, 0.0030])
    at = np.array([0.0, 0.2, 0.5, 0.8, 1.0, 1.1])
    joints = [
        ("leftHand", -1.0),
        ("leftThumbMetacarpal", 0.2),
        ("leftThumbProximal", 0.5),
        ("leftThumbDistal", 0.8),
    ]
    made.append(
        _lofted(
            "skin", knots, r, r * 0.92, np.array([0.0, 1.0, 0.0]), along(at, joints, 0.2), 8, (True, True)
        )
    )
    return made


def _leg() -> Part:
    y = np.concatenate([np.linspace(0.80, 0.48, 8), np.linspace(0.455, 0.395, 4), np.linspace(0.35, 0.10, 5)])
    knots = [(0.10, 0.0465), (0.13, 0.0475), (0.20, 0.0455), (0.30, 0.0470), (0.40, 0.0475), (0.45, 0.0490),
             (0.60, 0.0575), (0.72, 0.0620), (0.80, 0.0580)]  # fmt: skip
    r = curve(knots, y)
    x = curve([(0.10, 0.062), (0.60, 0.061), (0.72, 0.052), (0.80, 0.046)], y)
    z = curve([(0.10, -0.008), (0.3, -0.004), (0.43, 0.003), (0.80, 0.0)], y)
    centres = np.stack([x, y, z], 1)
    joints = [("leftFoot", -0.2), ("leftLowerLeg", 0.082), ("leftUpperLeg", 0.425), ("hips", 0.765)]
    return _lofted("trousers", centres, r, r * 1.02, np.array([1.0, 0.0, 0.0]), along(y, joints, 0.07), 14)


def _seat() -> Part:
    """Where the legs come together, under the hoodie."""
    y = np.linspace(0.705, 0.83, 6)
    width = np.array([0.02, 0.075, 0.098, 0.104, 0.104, 0.10])
    depth = np.array([0.02, 0.058, 0.072, 0.077, 0.077, 0.075])
    centres = np.stack([np.zeros(6), y, np.zeros(6)], 1)
    return _lofted(
        "trousers", centres, width, depth, np.array([1.0, 0.0, 0.0]), {"hips": np.ones(6)}, 20, (True, False)
    )


def _shoe() -> list[Part]:
    z = np.linspace(-0.062, 0.118, 11)
    width = curve([(-0.062, 0.008), (-0.052, 0.026), (-0.02, 0.036), (0.04, 0.040), (0.085, 0.038), (0.108, 0.026),
                   (0.118, 0.008)], z)  # fmt: skip
    high = curve([(-0.062, 0.02), (-0.05, 0.042), (-0.015, 0.052), (0.03, 0.042), (0.07, 0.032), (0.105, 0.022),
                  (0.118, 0.008)], z)  # fmt: skip
    weights = along(z, [("leftFoot", -1.0), ("leftToes", 0.072)], 0.03)
    centres = np.stack([np.full(11, 0.063), 0.012 + high, z], 1)
    upper = _lofted("shoe", centres, width, high, np.array([1.0, 0.0, 0.0]), weights, 12, (True, True))
    sole_centres = np.stack([np.full(11, 0.063), np.full(11, 0.013), z], 1)
    sole = _lofted("accent", sole_centres, width * 1.09, np.full(11, 0.013), np.array([1.0, 0.0, 0.0]), weights, 12,
                   (True, True))  # fmt: skip
    upper.points[:, 1] = np.maximum(upper.points[:, 1], 0.012)
    sole.points[:, 1] = np.clip(sole.points[:, 1], 0.0, 0.026)
    y = np.linspace(0.075, 0.125, 5)
    r = np.array([0.034, 0.037, 0.038, 0.038, 0.035])
    centres = np.stack([np.full(5, 0.062), y, np.full(5, -0.01)], 1)
    cuff = _lofted("shoe", centres, r, r * 1.08, np.array([1.0, 0.0, 0.0]), {"leftFoot": np.ones(5)}, 12)
    return [upper, sole, cuff]


def _strings() -> list[Part]:
    """Two strings that hang from the hood."""
    made = []
    for side in (1.0, -1.0):
        y = np.linspace(1.106, 0.985, 7)
        z = curve([(0.985, 0.0865), (1.03, 0.0865), (1.09, 0.0745), (1.106, 0.066)], y) + 0.001
        centres = np.stack([side * (0.026 + 0.004 * (1.106 - y) / 0.12), y, z], 1)
        r = np.array([0.0030, 0.0030, 0.0030, 0.0030, 0.0030, 0.0042, 0.0042])
        part = _lofted(
            "white", centres, r, r, np.array([1.0, 0.0, 0.0]), {"upperChest": np.ones(7)}, 8, (True, True)
        )
        made.append(part)
    return made


def _ear() -> Part:
    t = np.linspace(0.0, np.pi, 7)
    centres = np.stack(
        [np.full(7, 0.083), 1.283 + 0.026 * -np.cos(t), np.full(7, -0.006) - 0.004 * np.cos(t)], 1
    )
    r = 0.0165 * np.sin(t) + 0.001
    points, triangles = tube(centres, r * 0.45, r, 10, np.array([1.0, 0.0, 0.0]))
    return Part("skin", points, triangles, rigid("head", len(points)))


def build() -> list[Part]:
    """All parts, both sides."""
    left = [_sleeve(), _cuff(), *_hand(), _leg(), *_shoe(), _ear()]
    right = [mirrored(part, other) for part in left]
    return [_neck(), _torso(), _hem(), _collar(), _seat(), *_strings(), *left, *right]
