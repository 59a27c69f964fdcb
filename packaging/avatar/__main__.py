"""Makes resources/avatar/Saia.vrm: a VRM 1.0 with a humanoid, MToon, swinging hair and 52 blend shapes. CC0.

    python packaging/avatar [FILE.vrm]

Nothing is random: the same file comes out again.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

import body  # noqa: E402
import face  # noqa: E402
import hair  # noqa: E402
from shape import Array, Part  # noqa: E402

from studio.formats import _glb  # noqa: E402
from studio.motion.channels import ARKIT_SHAPES  # noqa: E402

TARGET = ROOT / "resources" / "avatar" / "Saia.vrm"
SHADED = {  # lit and shade in sRGB, outline in metres, rim
    "face": ("#FFE1D3", "#F2AC9C", 0.0012), "skin": ("#FFE1D3", "#F2AC9C", 0.0),
    "lids": ("#FFE1D3", "#F2AC9C", 0.0),
    "lips": ("#F6B4A6", "#E08E84", 0.0), "line": ("#8E4550", "#7A3844", 0.0), "inside": ("#7A2B35", "#5E1F2A", 0.0), "teeth": ("#FFFDF8", "#D8CFD6", 0.0),
    "tongue": ("#F08A8E", "#CC6570", 0.0), "white": ("#FFFFFF", "#C9CFE4", 0.0), "iris": ("#FFFFFF", "#FFFFFF", 0.0),
    "glint": ("#FFFFFF", "#FFFFFF", 0.0), "dark": ("#2B2438", "#1E192A", 0.0),
    "hair": ("#7398F2", "#4C61BE", 0.0014), "hoodie": ("#F4F6FB", "#B4BEDD", 0.0016),
    "accent": ("#49A0FF", "#2D67C4", 0.0012), "trousers": ("#3D4463", "#282C47", 0.0016),
    "shoe": ("#F4F6FB", "#AEB8D6", 0.0014),
}  # fmt: skip
UNLIT = ("iris", "glint")
RIM = {"hair": (0.16, 0.2, 0.32), "hoodie": (0.08, 0.08, 0.1), "trousers": (0.08, 0.1, 0.16)}
TWO_SIDED = ("inside", "hair", "white", "dark", "tongue", "teeth", "hoodie")
PRESETS: dict[str, dict[str, float]] = {
    "aa": {"jawOpen": 0.85, "mouthLowerDownLeft": 0.15, "mouthLowerDownRight": 0.15},
    "ih": {"jawOpen": 0.22, "mouthStretchLeft": 0.5, "mouthStretchRight": 0.5, "mouthUpperUpLeft": 0.35,
           "mouthUpperUpRight": 0.35, "mouthLowerDownLeft": 0.3, "mouthLowerDownRight": 0.3},
    "ou": {"mouthPucker": 0.75, "mouthFunnel": 0.3, "jawOpen": 0.15},
    "ee": {"jawOpen": 0.36, "mouthSmileLeft": 0.25, "mouthSmileRight": 0.25, "mouthStretchLeft": 0.35,
           "mouthStretchRight": 0.35, "mouthUpperUpLeft": 0.2, "mouthUpperUpRight": 0.2},
    "oh": {"mouthFunnel": 0.7, "mouthPucker": 0.25, "jawOpen": 0.5},
    "blink": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}, "blinkLeft": {"eyeBlinkLeft": 1.0},
    "blinkRight": {"eyeBlinkRight": 1.0},
    "happy": {"mouthSmileLeft": 0.9, "mouthSmileRight": 0.9, "cheekSquintLeft": 0.7, "cheekSquintRight": 0.7,
              "eyeSquintLeft": 0.4, "eyeSquintRight": 0.4, "browOuterUpLeft": 0.3, "browOuterUpRight": 0.3,
              "browInnerUp": 0.2},
    "angry": {"browDownLeft": 1.0, "browDownRight": 1.0, "mouthFrownLeft": 0.6, "mouthFrownRight": 0.6,
              "eyeSquintLeft": 0.3, "eyeSquintRight": 0.3, "noseSneerLeft": 0.5, "noseSneerRight": 0.5},
    "sad": {"browInnerUp": 1.0, "mouthFrownLeft": 0.75, "mouthFrownRight": 0.75, "eyeBlinkLeft": 0.2,
            "eyeBlinkRight": 0.2, "mouthShrugLower": 0.4},
    "relaxed": {"mouthSmileLeft": 0.45, "mouthSmileRight": 0.45, "eyeBlinkLeft": 0.4, "eyeBlinkRight": 0.4},
    "surprised": {"eyeWideLeft": 1.0, "eyeWideRight": 1.0, "browInnerUp": 0.8, "browOuterUpLeft": 0.9,
                  "browOuterUpRight": 0.9, "jawOpen": 0.45, "mouthFunnel": 0.3},
    "lookUp": {"eyeLookUpLeft": 1.0, "eyeLookUpRight": 1.0}, "lookDown": {"eyeLookDownLeft": 1.0, "eyeLookDownRight": 1.0},
    "lookLeft": {"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0}, "lookRight": {"eyeLookInLeft": 1.0, "eyeLookOutRight": 1.0},
    "neutral": {},
}  # fmt: skip
SWINGS = {"hairSide": (0.9, 0.35), "hairEar": (1.1, 0.35), "hairBack": (1.2, 0.4), "hairTuft": (1.4, 0.25)}
"""Stiffness and drag of the locks, by how their names begin."""
COLLIDERS = (("head", (0.0, 0.10, -0.005), 0.088), ("neck", (0.0, 0.03, 0.0), 0.045), ("upperChest", (0.0, 0.02, -0.01), 0.085),
             ("leftShoulder", (0.055, 0.0, 0.0), 0.045), ("rightShoulder", (-0.055, 0.0, 0.0), 0.045))  # fmt: skip


def linear(colour: str) -> list[float]:
    """Red, green and blue of "#RRGGBB", linear."""
    values = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    found = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return [round(float(value), 5) for value in found]


def iris_picture() -> bytes:
    """Dark above, bright below, a pupil, and a dark edge."""
    side = 128
    y, x = (np.mgrid[0:side, 0:side] + 0.5) / side * 2 - 1
    r = np.hypot(x, y)
    deep, bright = np.array([28, 52, 128.0]), np.array([92, 200, 255.0])
    mix = np.clip(0.5 + 0.62 * y, 0, 1)[..., None]
    colour = deep + (bright - deep) * mix
    rays = 1 + 0.07 * np.cos(18 * np.arctan2(y, x)) * np.clip((r - 0.4) * 3, 0, 1)
    colour = colour * rays[..., None]
    pupil = np.clip((0.42 - r) / 0.06, 0, 1)[..., None]
    colour = colour + (np.array([18, 26, 66.0]) - colour) * pupil
    edge = np.clip((r - 0.80) / 0.12, 0, 1)[..., None]
    colour = colour + (np.array([20, 26, 60.0]) - colour) * edge
    glow = np.exp(-(x**2 / 0.20 + (y - 0.62) ** 2 / 0.05))[..., None]
    colour = colour + (np.array([190, 245, 255.0]) - colour) * 0.75 * glow
    return _png(colour)


def face_picture() -> bytes:
    """White, to be multiplied with the skin's colour, with a blush on the cheeks and the nose's tip."""
    side = 256
    y, x = (np.mgrid[0:side, 0:side] + 0.5) / side
    px, py = (x - 0.5) * 0.2, (0.5 - y) * 0.25 - 0.01
    colour = np.full((side, side, 3), 255.0)
    blush = np.zeros((side, side))
    for sign in (-1, 1):
        blush += 0.62 * np.exp(-(((px - sign * 0.047) / 0.014) ** 2) - ((py + 0.044) / 0.0095) ** 2)
    blush += 0.22 * np.exp(-((px / 0.007) ** 2) - ((py + 0.036) / 0.006) ** 2)
    colour -= blush[..., None] * np.array([4.0, 92.0, 84.0])
    colour[:8, :8] = 255.0
    return _png(colour)


def hair_picture() -> bytes:
    """Around the head and down it: a ring of shine with strands, and tips a little deeper."""
    side = 256
    y, x = (np.mgrid[0:side, 0:side] + 0.5) / side
    wave = 0.5 + 0.5 * np.cos(2 * np.pi * 34 * x + 2.0 * np.sin(2 * np.pi * 7 * x))
    top, low = 0.235 + 0.020 * wave, 0.305 + 0.045 * wave
    shine = np.clip((y - top) / 0.012, 0, 1) * np.clip((low - y) / 0.016, 0, 1)
    colour = np.full((side, side, 3), 214.0) - 44.0 * np.clip((y - 0.45) / 0.55, 0, 1)[..., None] * [
        1.0,
        0.9,
        0.35,
    ]
    colour = colour + (np.array([255.0, 255, 255]) - colour) * 0.85 * shine[..., None]
    return _png(colour)


def _png(colour: Array) -> bytes:
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(np.clip(np.round(colour), 0, 255).astype(np.uint8)).save(data, "PNG", optimize=True)
    return data.getvalue()


def material(name: str) -> dict[str, Any]:
    """One material: MToon, with what programs without it need."""
    lit, shade, outline = SHADED[name]
    toon: dict[str, Any] = {
        "specVersion": "1.0", "shadeColorFactor": linear(shade), "shadingToonyFactor": 0.86,
        "shadingShiftFactor": -0.12, "giEqualizationFactor": 0.9,
    }  # fmt: skip
    if name in RIM:
        toon |= {"parametricRimColorFactor": list(RIM[name]), "parametricRimFresnelPowerFactor": 4.0}
    if outline:
        toon |= {"outlineWidthMode": "worldCoordinates", "outlineWidthFactor": outline,
                 "outlineColorFactor": [v * 0.28 for v in linear(shade)], "outlineLightingMixFactor": 0.0}  # fmt: skip
    made: dict[str, Any] = {
        "name": name, "doubleSided": name in TWO_SIDED,
        "pbrMetallicRoughness": {"baseColorFactor": [*linear(lit), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9},
    }  # fmt: skip
    textures = {"iris": 0, "face": 1, "lids": 1, "hair": 2}
    if name in textures:
        made["pbrMetallicRoughness"]["baseColorTexture"] = {"index": textures[name]}
        if name != "iris":
            toon["shadeMultiplyTexture"] = {"index": textures[name]}
    made["extensions"] = {"KHR_materials_unlit": {}} if name in UNLIT else {"VRMC_materials_mtoon": toon}
    return made


def turned_out(part: Part) -> Part:
    """With its triangles seen from outside: away from the line its points lie around."""
    centre = face.HEAD if "head" in part.bones and part.material != "skin" else part.points.mean(axis=0)
    a, b, c = (part.points[part.triangles[:, k]] for k in range(3))
    faces, away = np.cross(b - a, c - a), (a + b + c) / 3 - centre
    if part.material in ("hair", "skin", "accent") and len(part.points) < 400:
        away = (a + b + c) / 3 - part.points.mean(axis=0)
    if part.material in ("inside", "teeth", "tongue"):
        away = np.broadcast_to([0.0, 0.2, 1.0], faces.shape)
    if float((faces * away).sum()) < 0.0:
        part.triangles = part.triangles[:, ::-1].copy()
    return part


def joined(parts: list[Part], order: list[str]) -> dict[str, Any]:
    """Parts of one material as arrays."""
    counts = np.cumsum([0, *(len(part.points) for part in parts)])
    total = int(counts[-1])
    joints, weights = np.zeros((total, 4), np.uint16), np.zeros((total, 4))
    uv = np.full((total, 2), 0.02)
    moved: dict[str, Array] = {}
    for part, start in zip(parts, counts, strict=False):
        end = start + len(part.points)
        names = list(part.bones)
        table = np.stack([part.bones[name] for name in names], 1)
        best = np.argsort(-table, axis=1)[:, :4]
        kept = np.take_along_axis(table, best, axis=1)
        width = best.shape[1]
        joints[start:end, :width] = np.array([order.index(name) for name in names])[best]
        weights[start:end, :width] = kept / kept.sum(axis=1, keepdims=True)
        if part.uv is not None:
            uv[start:end] = part.uv
        for name, points in part.moved.items():
            moved.setdefault(name, np.zeros((total, 3)))[start:end] = points - part.points
    joints[weights == 0.0] = 0
    triangles = np.concatenate([part.triangles + start for part, start in zip(parts, counts, strict=False)])
    # Openings were cut into the skin: their corners belong to nothing.
    used, numbers = np.unique(triangles, return_inverse=True)
    return {
        "points": np.concatenate([part.points for part in parts])[used],
        "normals": np.concatenate([part.normals() for part in parts])[used],
        "triangles": numbers.reshape(-1, 3), "joints": joints[used], "weights": weights[used], "uv": uv[used],
        "moved": {name: offsets[used] for name, offsets in moved.items()},
    }  # fmt: skip


def sparse(numbers: _glb.Numbers, offsets: Array) -> int:
    """An accessor of mostly zeros, of which only the rest is kept."""
    rows = np.flatnonzero(np.abs(offsets).max(axis=1) > 1e-5)
    rows = rows if len(rows) else np.array([0])
    values = np.ascontiguousarray(offsets[rows], dtype="<f4")
    whole = values if len(rows) == len(offsets) else np.concatenate([values, np.zeros((1, 3), "<f4")])
    accessor: dict[str, Any] = {
        "componentType": _glb.FLOAT, "count": len(offsets), "type": "VEC3",
        "min": whole.min(axis=0).tolist(), "max": whole.max(axis=0).tolist(),
        "sparse": {
            "count": len(rows),
            "indices": {"bufferView": numbers.attach(rows.astype("<u2").tobytes()), "componentType": 5123},
            "values": {"bufferView": numbers.attach(values.tobytes())},
        },
    }  # fmt: skip
    numbers.accessors.append(accessor)
    return len(numbers.accessors) - 1


def primitive(
    numbers: _glb.Numbers, arrays: dict[str, Any], material_index: int, shapes: list[str]
) -> dict[str, Any]:
    """One primitive of a mesh; with every blend shape of its mesh, as glTF wants it."""
    made: dict[str, Any] = {
        "attributes": {
            "POSITION": numbers.add(arrays["points"], bounds=True), "NORMAL": numbers.add(arrays["normals"]),
            "TEXCOORD_0": numbers.add(arrays["uv"]), "JOINTS_0": numbers.add_whole(arrays["joints"]),
            "WEIGHTS_0": numbers.add(arrays["weights"]),
        },
        "indices": numbers.add_whole(arrays["triangles"].reshape(-1).astype(np.uint16)),
        "material": material_index,
    }  # fmt: skip
    if shapes:
        still = np.zeros((len(arrays["points"]), 3))
        made["targets"] = [{"POSITION": sparse(numbers, arrays["moved"].get(name, still))} for name in shapes]
    return made


def springs(order: list[str]) -> dict[str, Any]:
    """VRMC_springBone: one spring a lock, all kept out of head, neck and shoulders."""
    node = {name: i + 1 for i, name in enumerate(order)}
    colliders = [{"node": node[bone], "shape": {"sphere": {"offset": list(at), "radius": radius}}}
                 for bone, at, radius in COLLIDERS]  # fmt: skip
    made = []
    for lock in hair.LOCKS:
        if not lock.name:
            continue
        stiff, drag = next(values for name, values in SWINGS.items() if lock.name.startswith(name))
        made.append({
            "name": lock.name, "colliderGroups": [0],
            "joints": [{"node": node[f"{lock.name}{k}"], "hitRadius": 0.012, "stiffness": stiff, "dragForce": drag,
                        "gravityPower": 0.08, "gravityDir": [0, -1, 0]} for k in (1, 2, 3)],
        })  # fmt: skip
    groups = [{"name": "body", "colliders": list(range(len(colliders)))}]
    return {"specVersion": "1.0", "colliders": colliders, "colliderGroups": groups, "springs": made}


def expressions(face_node: int, shapes: list[str]) -> dict[str, Any]:
    """The presets of VRM, made of ARKit's shapes, and those by their own names."""

    def of(weights: dict[str, float]) -> dict[str, Any]:
        binds = [
            {"node": face_node, "index": shapes.index(name), "weight": weight}
            for name, weight in weights.items()
        ]
        return {"morphTargetBinds": binds, "isBinary": False, "overrideBlink": "none", "overrideLookAt": "none",
                "overrideMouth": "none"}  # fmt: skip

    preset = {name: of(weights) for name, weights in PRESETS.items()}
    preset["happy"] |= {"overrideBlink": "blend"}
    return {"preset": preset, "custom": {name: of({name: 1.0}) for name in shapes}}


def write(path: Path) -> None:
    """Build everything and write the file."""
    skeleton = body.bones() | hair.bones()
    order = list(skeleton)
    meshes = {"Face": [turned_out(part) for part in face.build()],
              "Body": [turned_out(part) for part in (*body.build(), *hair.build())]}  # fmt: skip
    shapes = [name[0].lower() + name[1:] for name in ARKIT_SHAPES]
    numbers, names = _glb.Numbers(), list(SHADED)
    nodes: list[dict[str, Any]] = [{"name": "Saia", "children": []}]
    for name, (parent, at) in skeleton.items():
        above = skeleton[parent][1] if parent else np.zeros(3)
        nodes.append({"name": name, "translation": [round(float(v), 6) for v in at - above]})
        nodes[order.index(parent) + 1 if parent else 0].setdefault("children", []).append(len(nodes) - 1)
    described = []
    for mesh, parts in meshes.items():
        own = shapes if mesh == "Face" else []
        primitives = []
        for index, name in enumerate(names):
            if found := [part for part in parts if part.material == name]:
                primitives.append(primitive(numbers, joined(found, order), index, own))
        described.append(
            {"name": mesh, "primitives": primitives} | ({"extras": {"targetNames": own}} if own else {})
        )
        nodes.append({"name": mesh, "mesh": len(described) - 1, "skin": 0})
    face_node = len(nodes) - 2
    binds = np.tile(np.eye(4), (len(order), 1, 1))
    binds[:, :3, 3] = -np.stack([skeleton[name][1] for name in order])
    matrices = numbers.add(binds.transpose(0, 2, 1).reshape(len(order), 16))
    numbers.accessors[matrices]["type"] = "MAT4"
    images = [{"bufferView": numbers.attach(data), "mimeType": "image/png", "name": name}
              for name, data in (("iris", iris_picture()), ("face", face_picture()), ("hair", hair_picture()))]  # fmt: skip
    meta = {
        "name": "Saia", "version": "1", "authors": ["Saia Studio"], "licenseUrl": "https://vrm.dev/licenses/1.0/",
        "otherLicenseUrl": "https://creativecommons.org/publicdomain/zero/1.0/", "avatarPermission": "everyone",
        "allowExcessivelyViolentUsage": True, "allowExcessivelySexualUsage": True, "commercialUsage": "corporation",
        "allowPoliticalOrReligiousUsage": True, "allowAntisocialOrHateUsage": True, "creditNotation": "unnecessary",
        "allowRedistribution": True, "modification": "allowModificationRedistribution",
    }  # fmt: skip
    humanoid = {"humanBones": {name: {"node": order.index(name) + 1} for name in body.bones()}}
    look_at = {"type": "expression", "offsetFromHeadBone": [0.0, 0.088, 0.05],
               **{f"rangeMap{way}": {"inputMaxValue": 30.0, "outputScale": 1.0}
                  for way in ("HorizontalInner", "HorizontalOuter", "VerticalDown", "VerticalUp")}}  # fmt: skip
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "Saia Studio", "copyright": "CC0 1.0, Saia Studio"},
        "extensionsUsed": ["VRMC_vrm", "VRMC_materials_mtoon", "VRMC_springBone", "KHR_materials_unlit"],
        "scene": 0, "scenes": [{"nodes": [0, len(nodes) - 2, len(nodes) - 1]}], "nodes": nodes, "meshes": described,
        "skins": [{"joints": list(range(1, len(order) + 1)), "inverseBindMatrices": matrices, "skeleton": 1}],
        "materials": [material(name) for name in names], "images": images, "samplers": [{}],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 0}, {"source": 2, "sampler": 0}],
        "extensions": {
            "VRMC_vrm": {"specVersion": "1.0", "meta": meta, "humanoid": humanoid, "lookAt": look_at,
                         "expressions": expressions(face_node, shapes), "firstPerson": {"meshAnnotations": []}},
            "VRMC_springBone": springs(order),
        },
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    _glb.write(path, document, numbers)
    count = sum(len(part.triangles) for parts in meshes.values() for part in parts)
    print(f"{path.name}: {count:,} triangles, {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET)
