"""Small avatars for tests: VRM 0 and VRM 1 with a skinned body, a face that moves, a texture and terms."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from studio.formats import _glb
from studio.motion import Skeleton, rotation
from studio.motion.channels import ALL_BONES, VRM0_TO_VRM1, vrm1_bone

SHAPES = ("a", "i", "u", "e", "o", "blink", "blink_l", "blink_r", "joy", "angry", "sorrow", "fun")
VRM1 = {name.lower(): new for name, new in VRM0_TO_VRM1.items()}
BONES = tuple(name for name in ALL_BONES if name != "Jaw")


class Maker:
    """Builds one avatar.

    Args:
        version: 0 or 1.
        size: 1 for the built-in proportions.
        finer: how many times the triangles are cut in four, for measuring.
        turned: VRM 1 only: give the bones rest rotations of their own.
        head: how large the head is, 1 for life-size; more for a chibi.
    """

    def __init__(
        self, version: int, size: float = 1.0, finer: int = 0, turned: bool = True, head: float = 1.0
    ) -> None:
        self.version, self.head = version, head
        rest = Skeleton.humanoid(BONES)
        self.skeleton = Skeleton(BONES, rest.parents, rest.rest_positions * size, rest.rest_rotations)
        # The file's own axes: a VRM 0 faces -Z, a VRM 1 faces +Z.
        self.mirror = np.array([1.0, 1.0, -1.0]) if version == 0 else np.array([-1.0, 1.0, 1.0])
        self.world = self.skeleton.forward(self.skeleton.rest_positions, self.skeleton.rest_rotations)[0]
        self.world = self.world * self.mirror
        rng = np.random.default_rng(5)
        turns = (
            rng.normal(size=(len(BONES), 4)) if version == 1 and turned else np.tile([0, 0, 0, 1.0], (54, 1))
        )
        self.turns = rotation.normalised(turns)
        self.size, self.finer = size, finer

    def write(self, path: Path) -> Path:
        """Write the .vrm."""
        numbers = _glb.Numbers()
        body = self._body()
        face = self._face()
        meshes = [
            self._mesh(numbers, "からだ", *body, material=0),
            self._mesh(numbers, "Face 顔", *face, material=1),
        ]
        binds = np.tile(np.eye(4), (len(BONES), 1, 1))
        turned = rotation.to_matrix(self.turns)
        binds[:, :3, :3] = turned.transpose(0, 2, 1)
        binds[:, :3, 3] = -np.einsum("jba,jb->ja", turned, self.world)
        matrices = numbers.add(binds.transpose(0, 2, 1).reshape(len(BONES), 16))
        numbers.accessors[matrices]["type"] = "MAT4"
        picture = numbers.attach(self._picture())
        nodes = self._nodes()
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "Saia Studio's tests"},
            "scene": 0, "scenes": [{"nodes": [0, len(nodes) - 2, len(nodes) - 1]}], "nodes": nodes,
            "meshes": meshes,
            "skins": [{"joints": [*range(1, len(BONES) + 1)], "inverseBindMatrices": matrices}],
            "images": [{"bufferView": picture, "mimeType": "image/png"}],
            "samplers": [{}],
            "textures": [{"source": 0, "sampler": 0}],
            "materials": [
                {"name": "cloth",
                 "pbrMetallicRoughness": {"baseColorFactor": [0.12, 0.3, 0.6, 1.0], "metallicFactor": 0}},
                {"name": "skin", "alphaMode": "MASK", "alphaCutoff": 0.5,
                 "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}},
            ],
        }  # fmt: skip
        document |= self._vrm0() if self.version == 0 else self._vrm1(len(nodes) - 1)
        path.parent.mkdir(parents=True, exist_ok=True)
        _glb.write(path, document, numbers)
        return path

    def _nodes(self) -> list[dict[str, Any]]:
        nodes: list[dict[str, Any]] = [{"name": "Root", "children": []}]
        for j, (name, parent) in enumerate(zip(BONES, self.skeleton.parents, strict=True)):
            offset, turn = self.world[j].copy(), self.turns[j]
            if parent >= 0:
                back = rotation.inverse(self.turns[parent])
                offset = rotation.rotate(back, offset - self.world[parent])
                turn = rotation.multiply(back, turn)
            nodes.append(
                {"name": f"J {name}", "translation": (offset + 0.0).tolist(), "rotation": turn.tolist()}
            )
        for j, parent in enumerate(self.skeleton.parents):
            nodes[parent + 1].setdefault("children", []).append(j + 1)
        return [*nodes, {"name": "Body", "mesh": 0, "skin": 0}, {"name": "Face", "mesh": 1, "skin": 0}]

    def _body(self) -> tuple[Any, ...]:
        """A box around each limb, its two ends following the two bones it joins."""
        from studio.render import body

        plan = body.Plan.of(self.skeleton)
        vertices, normals = body.limbs(plan, self.world, self.size)
        triangles = body.faces("limb", len(plan.starts)).reshape(-1, 4)[:, 1:]
        per = len(vertices) // max(len(plan.starts), 1)
        joints = np.zeros((len(vertices), 4), dtype=np.uint16)
        joints[:, 0], joints[:, 1] = np.repeat(plan.starts, per), np.repeat(plan.ends, per)
        along = np.tile(np.linspace(0.0, 1.0, per), len(plan.starts))
        weights = np.zeros((len(vertices), 4), dtype=np.float32)
        weights[:, 0], weights[:, 1] = 1.0 - 0.5 * along**4, 0.5 * along**4
        made = vertices, normals, np.zeros((len(vertices), 2)), triangles, joints, weights, {}
        return _finer(made, self.finer)

    def _face(self) -> tuple[Any, ...]:
        """A ball with a painted face: the mouth opens and the lids close by morph targets."""
        rings, sides = 40, 48
        polar = np.linspace(0.01, np.pi - 0.01, rings)
        around = np.linspace(0.0, 2 * np.pi, sides + 1)
        p, a = np.meshgrid(polar, around, indexing="ij")
        ball = np.stack([np.sin(p) * np.sin(a), np.cos(p), -np.sin(p) * np.cos(a)], axis=-1).reshape(-1, 3)
        facing = self.mirror[2] if self.version == 0 else 1.0
        ball = ball * [facing, 1.0, facing]  # the seam of the texture lies behind
        uv = np.stack([a / (2 * np.pi), p / np.pi], axis=-1).reshape(-1, 2)
        corner = np.arange((rings - 1) * sides)
        first = corner // sides * (sides + 1) + corner % sides
        quads = np.stack([first, first + 1, first + sides + 2, first + sides + 1], axis=1)
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        radius = 0.105 * self.size * self.head
        head = self.world[BONES.index("Head")] + [0.0, 0.09 * self.size * self.head, 0.0]
        vertices = head + ball * radius
        joints = np.zeros((len(vertices), 4), dtype=np.uint16)
        joints[:, 0] = BONES.index("Head")
        weights = np.tile(np.float32([1, 0, 0, 0]), (len(vertices), 1))
        morphs = {name: offsets * radius for name, offsets in _faces(ball, facing).items()}
        made = vertices, ball, uv, triangles, joints, weights, morphs
        return _finer(made, self.finer)

    def _mesh(
        self, numbers: _glb.Numbers, name: str, vertices: Any, normals: Any, uv: Any, triangles: Any,
        joints: Any, weights: Any, morphs: dict[str, Any], material: int,
    ) -> dict[str, Any]:  # fmt: skip
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        primitive: dict[str, Any] = {
            "attributes": {
                "POSITION": numbers.add(vertices, bounds=True),
                "NORMAL": numbers.add(normals / np.where(length > 0, length, 1)),
                "TEXCOORD_0": numbers.add(uv),
                "JOINTS_0": numbers.add_whole(joints.astype(np.uint16)),
                "WEIGHTS_0": numbers.add(weights),
            },
            "indices": numbers.add_whole(triangles.reshape(-1).astype(np.uint32)),
            "material": material,
        }
        mesh: dict[str, Any] = {"name": name, "primitives": [primitive]}
        if morphs:
            primitive["targets"] = [{"POSITION": numbers.add(m, bounds=True)} for m in morphs.values()]
            mesh["extras"] = {"targetNames": list(morphs)}
        return mesh

    def _vrm0(self) -> dict[str, Any]:
        groups = [
            {"name": name.title(), "presetName": name, "binds": [{"mesh": 1, "index": i, "weight": 100.0}],
             "materialValues": [], "isBinary": False}
            for i, name in enumerate(SHAPES)
        ]  # fmt: skip
        bones = [
            {"bone": name[0].lower() + name[1:], "node": j + 1, "useDefaultValues": True}
            for j, name in enumerate(BONES)
        ]
        meta = {"title": "小さな Test", "author": "Saia Studio", "allowedUserName": "Everyone",
                "commercialUssageName": "Allow", "licenseName": "CC0"}  # fmt: skip
        extension = {"exporterVersion": "tests", "specVersion": "0.0", "meta": meta,
                     "humanoid": {"humanBones": bones}, "materialProperties": [],
                     "blendShapeMaster": {"blendShapeGroups": groups}}  # fmt: skip
        return {"extensionsUsed": ["VRM"], "extensions": {"VRM": extension}}

    def _vrm1(self, face: int) -> dict[str, Any]:
        preset = {
            VRM1.get(name, name): {"morphTargetBinds": [{"node": face, "index": i, "weight": 1.0}]}
            for i, name in enumerate(SHAPES)
        }
        meta = {"name": "小さな Test", "authors": ["Saia Studio"], "commercialUsage": "corporation",
                "licenseUrl": "https://vrm.dev/licenses/1.0/", "avatarPermission": "everyone"}  # fmt: skip
        bones = {vrm1_bone(name): {"node": j + 1} for j, name in enumerate(BONES)}
        extension = {"specVersion": "1.0", "meta": meta, "humanoid": {"humanBones": bones},
                     "expressions": {"preset": preset}}  # fmt: skip
        return {"extensionsUsed": ["VRMC_vrm"], "extensions": {"VRMC_vrm": extension}}

    def _picture(self) -> bytes:
        """Skin all around; eyes, cheeks and lips where the face is. The face is at u = 0.5."""
        from PIL import Image, ImageDraw

        side = 512
        picture = Image.new("RGBA", (side, side), (246, 214, 192, 255))
        pen = ImageDraw.Draw(picture)
        pen.rectangle((0, 0, side, 150), fill=(92, 62, 50, 255))  # hair
        pen.rectangle((0, 0, 130, side * 0.62), fill=(92, 62, 50, 255))
        pen.rectangle((side - 130, 0, side, side * 0.62), fill=(92, 62, 50, 255))
        for x in (side / 2 - 38, side / 2 + 38):
            pen.ellipse((x - 20, 218, x + 20, 268), fill=(255, 255, 255, 255))
            pen.ellipse((x - 11, 226, x + 11, 262), fill=(40, 70, 120, 255))
        pen.ellipse((side / 2 - 28, 312, side / 2 + 28, 326), fill=(170, 60, 70, 255))
        data = io.BytesIO()
        picture.save(data, "PNG")
        return data.getvalue()


def _faces(ball: np.ndarray, facing: float) -> dict[str, np.ndarray]:
    """Offsets (V, 3) of each shape on a ball of radius 1 that faces +Z times `facing`."""
    x, y, z = ball[:, 0], ball[:, 1], ball[:, 2] * facing
    front = z > 0.2

    def around(cx: float, cy: float, wide: float, tall: float) -> np.ndarray:
        return np.where(front, np.exp(-(((x - cx) / wide) ** 2) - ((y - cy) / tall) ** 2), 0.0)

    def moved(dx: Any = 0.0, dy: Any = 0.0, dz: Any = 0.0) -> np.ndarray:
        return np.stack([dx + 0 * x, dy + 0 * x, dz * facing + 0 * x], axis=1)

    mouth, low = around(0, -0.38, 0.3, 0.12), around(0, -0.5, 0.4, 0.14)
    corners = around(0.2, -0.36, 0.12, 0.12) + around(-0.2, -0.36, 0.12, 0.12)
    smile = around(0.26, -0.36, 0.12, 0.12) + around(-0.26, -0.36, 0.12, 0.12)
    left, right = (around(cx * facing, 0.06, 0.2, 0.16) for cx in (0.4, -0.4))
    squeeze = lambda eye: moved(0, -(y - 0.06) * 0.95 * eye)  # noqa: E731
    return {
        "a": moved(0, -0.22 * low, -0.05 * mouth), "i": moved(0.25 * x * mouth),
        "u": moved(-0.5 * x * mouth, 0, 0.12 * mouth),
        "e": moved(0.2 * x * mouth, -0.08 * low), "o": moved(-0.3 * x * mouth, -0.16 * low, 0.08 * mouth),
        "blink": squeeze(left) + squeeze(right), "blink_l": squeeze(left), "blink_r": squeeze(right),
        "joy": moved(0.3 * x * smile, 0.14 * smile - 0.06 * mouth), "angry": moved(0, -0.1 * (left + right)),
        "sorrow": moved(0, -0.12 * corners), "fun": moved(0.2 * x * corners, 0.08 * corners),
    }  # fmt: skip


def _finer(made: tuple[Any, ...], times: int) -> tuple[Any, ...]:
    """Each triangle cut in four, some times over."""
    for _ in range(times):
        vertices, normals, uv, triangles, joints, weights, morphs = made
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, place = np.unique(edges, axis=0, return_inverse=True)
        middle = place.reshape(-1, 3) + len(vertices)
        a, b = unique[:, 0], unique[:, 1]
        half = lambda values, a=a, b=b: np.concatenate([values, (values[a] + values[b]) / 2])  # noqa: E731
        corners = [
            np.stack(each, axis=1)
            for each in (
                (triangles[:, 0], middle[:, 0], middle[:, 2]), (middle[:, 0], triangles[:, 1], middle[:, 1]),
                (middle[:, 2], middle[:, 1], triangles[:, 2]), (middle[:, 0], middle[:, 1], middle[:, 2]),
            )
        ]  # fmt: skip
        made = (
            half(vertices), half(normals), half(uv), np.concatenate(corners),
            np.concatenate([joints, joints[a]]), np.concatenate([weights, weights[a]]),
            {name: half(m) for name, m in morphs.items()},
        )  # fmt: skip
    return made
