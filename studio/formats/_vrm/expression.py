"""Reading an avatar's named faces, what they make of its materials, and how it looks somewhere.

Source: VRMC_vrm 1.0, expressions and lookAt; VRM 0's blendShapeMaster and firstPerson, as UniVRM has them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from studio.formats._glb import Glb
from studio.formats._vrm.material import linear
from studio.formats._vrm.mesh import Meshes
from studio.motion.channels import ARKIT_SHAPES, VRM0_SHAPES
from studio.motion.expression import Expression, key, meaning
from studio.motion.look_at import LookAt, Range
from studio.motion.material import MaterialBind, SurfaceMaterial

_OVERRIDES = {"blink": "overrideBlink", "lookAt": "overrideLookAt", "mouth": "overrideMouth"}
_COLOURS = {
    "color": "colour", "emissionColor": "glow", "shadeColor": "shade", "rimColor": "rim",
    "matcapColor": "matcap", "outlineColor": "outline",
}  # fmt: skip
_COLOURS_OLD = {
    "_Color": "colour", "_EmissionColor": "glow", "_ShadeColor": "shade", "_RimColor": "rim",
    "_OutlineColor": "outline",
}  # fmt: skip
_MOST_LOOKS = 2048
_SPELT = {key(name): name for name in (*VRM0_SHAPES, *ARKIT_SHAPES)}
_UNREADABLE = (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError)


def read_expressions(
    glb: Glb, extension: dict[str, Any], old: bool, meshes: Meshes, materials: Sequence[SurfaceMaterial]
) -> tuple[Expression, ...]:
    """All expressions, those that move nothing among them.

    Args:
        glb: the file.
        extension: VRM or VRMC_vrm of it.
        old: whether it is VRM 0.
        meshes: what its meshes became.
        materials: what its materials became.
    """
    looks = _Looks(glb, materials)
    found = tuple(_groups(extension, meshes, looks) if old else _expressions(extension, meshes, looks))
    return _with_targets(found, meshes)


def _with_targets(found: tuple[Expression, ...], meshes: Meshes) -> tuple[Expression, ...]:
    """Expressions with those added that only morph targets of a known name show: many avatars are made for
    Perfect Sync and never say so."""
    named: dict[str, dict[int, int]] = {}
    for i, surface in enumerate(meshes.surfaces):
        for j, morph in enumerate(surface.morphs):
            own = meaning(morph.name)
            if own in _SPELT and len(morph.rows):
                named.setdefault(own, {}).setdefault(i, j)
    for one in found:
        if one.moves:
            named.pop(meaning(one.name), None)
    binds = {own: tuple((i, j, 1.0) for i, j in places.items()) for own, places in named.items()}
    # One that its file left empty is filled.
    filled = tuple(replace(one, binds=binds.pop(meaning(one.name), one.binds)) for one in found)
    return (*filled, *(Expression(_SPELT[own], places) for own, places in binds.items()))


def _groups(extension: dict[str, Any], meshes: Meshes, looks: _Looks) -> Iterable[Expression]:
    for group in extension.get("blendShapeMaster", {}).get("blendShapeGroups", ()):
        preset = str(group.get("presetName", "unknown"))
        name = str(group.get("name", "")) if preset in ("", "unknown") else preset
        binds = tuple(
            (surface, morph, weight)
            for bind in group.get("binds", ())
            for surface, morph, weight in _binds(meshes, meshes.by_mesh, bind["mesh"], bind, 0.01)
        )
        values = tuple(looks.of_vrm0(group.get("materialValues")))
        yield Expression(name, binds, bool(group.get("isBinary", False)), looks=values)


def _expressions(extension: dict[str, Any], meshes: Meshes, looks: _Looks) -> Iterable[Expression]:
    groups = extension.get("expressions", {})
    for kind in ("preset", "custom"):
        for name, one in groups.get(kind, {}).items():
            binds = tuple(
                (surface, morph, weight)
                for bind in one.get("morphTargetBinds", ())
                for surface, morph, weight in _binds(meshes, meshes.by_node, bind["node"], bind, 1.0)
            )
            overrides = {
                what: one[field] for what, field in _OVERRIDES.items() if one.get(field) in ("block", "blend")
            }
            yield Expression(
                str(name), binds, bool(one.get("isBinary", False)), overrides, tuple(looks.of(one))
            )


def _binds(
    meshes: Meshes, places: dict[int, list[int]], place: Any, bind: dict[str, Any], unit: float
) -> Iterable[tuple[int, int, float]]:
    """A bind as (surface, morph, weight), once for each surface that has the morph."""
    morph, weight = int(bind["index"]), float(bind["weight"]) * unit
    if weight != weight:
        raise ValueError(bind)
    for surface in places.get(place, ()):
        if 0 <= morph < len(meshes.surfaces[surface].morphs):
            yield surface, morph, min(max(weight, 0.0), 1.0)


class _Looks:
    """What expressions make of materials. A bind that makes no sense, or asks for what a material has not, is
    left out: the face moves without it."""

    def __init__(self, glb: Glb, materials: Sequence[SurfaceMaterial]) -> None:
        listed = glb.document.get("materials", ())
        self._materials, self._count = materials, 0
        self._names = {str(one.get("name")): i for i, one in reversed(list(enumerate(listed)))}
        # Glow is kept with its strength in it.
        self._strengths = [_strength(one) for one in listed]

    def of(self, one: dict[str, Any]) -> Iterable[MaterialBind]:
        """Those of an expression of VRM 1."""
        for bind in _listed(one.get("materialColorBinds")):
            part = _COLOURS.get(str(bind.get("type")), "")
            yield from self._bind(bind.get("material"), part, bind.get("targetValue"))
        for bind in _listed(one.get("textureTransformBinds")):
            for part, usual in (("scale", (1.0, 1.0)), ("offset", (0.0, 0.0))):
                yield from self._bind(bind.get("material"), part, bind.get(part, usual))

    def of_vrm0(self, values: Any) -> Iterable[MaterialBind]:
        """Those of a group of VRM 0."""
        for bind in _listed(values):
            material = self._names.get(str(bind.get("materialName")))
            name, target = str(bind.get("propertyName")), bind.get("targetValue")
            if name in _COLOURS_OLD:
                part = _COLOURS_OLD[name]
                yield from self._bind(material, part, target, encoded=part != "glow")
            elif name in ("_MainTex_ST", "_MainTex_ST_S", "_MainTex_ST_T"):
                yield from self._slide(material, name[11:], target)

    def _slide(self, material: Any, axis: str, target: Any) -> Iterable[MaterialBind]:
        """Unity's scale and offset, v from the bottom; `axis` "_S" or "_T" where it is one of the two."""
        try:
            wide, high, left, up = (float(number) for number in target[:4])
            uv = self._materials[material].uv
        except _UNREADABLE:
            return
        scale, offset = (wide, high), (left, 1.0 - up - high)
        if axis == "_S":
            scale, offset = (wide, uv.scale[1]), (left, uv.offset[1])
        elif axis == "_T":
            scale, offset = (uv.scale[0], high), (uv.offset[0], 1.0 - up - high)
        yield from self._bind(material, "scale", scale)
        yield from self._bind(material, "offset", offset)

    def _bind(self, material: Any, part: str, target: Any, encoded: bool = False) -> Iterable[MaterialBind]:
        try:
            if not isinstance(material, int) or not 0 <= material < len(self._strengths):
                return
            rest = self._materials[material].value(part)
            value = [float(number) for number in target[: len(rest or ())]]
        except _UNREADABLE:
            return
        if rest is None or not all(math.isfinite(number) for number in value) or self._count >= _MOST_LOOKS:
            return
        if part == "glow":
            value = [number * self._strengths[material] for number in value]
        elif encoded:
            value = [linear(number) if i < 3 else number for i, number in enumerate(value)]
        # A colour may come without its alpha.
        value += rest[len(value) :]
        self._count += 1
        yield MaterialBind(material, part, tuple(min(max(number, -100.0), 100.0) for number in value))


def _listed(value: Any) -> list[dict[str, Any]]:
    return [one for one in value if isinstance(one, dict)] if isinstance(value, list | tuple) else []


def _strength(material: Any) -> float:
    try:
        given = material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"]
        strength = float(given)
    except _UNREADABLE:
        return 1.0
    return min(max(strength, 0.0), 64.0) if math.isfinite(strength) else 1.0


def read_look_at(extension: dict[str, Any], old: bool) -> LookAt:
    """What moves its eyes; as is usual where the file says nothing that makes sense."""
    table = extension.get("firstPerson" if old else "lookAt")
    if not isinstance(table, dict):
        return LookAt()
    if old:
        by_bones = table.get("lookAtTypeName") != "BlendShape"
        names = ("lookAtHorizontalInner", "lookAtHorizontalOuter", "lookAtVerticalDown", "lookAtVerticalUp")
        fields = ("xRange", "yRange")
    else:
        by_bones = table.get("type") != "expression"
        names = (
            "rangeMapHorizontalInner", "rangeMapHorizontalOuter", "rangeMapVerticalDown", "rangeMapVerticalUp"
        )  # fmt: skip
        fields = ("inputMaxValue", "outputScale")
    usual = (90.0, 10.0 if by_bones else 1.0)
    return LookAt(by_bones, *(_range(table.get(name), fields, usual) for name in names))


def _range(value: Any, fields: tuple[str, str], usual: Range) -> Range:
    try:
        most, scale = (float(value.get(field, least)) for field, least in zip(fields, usual, strict=True))
    except _UNREADABLE:
        return usual
    good = math.isfinite(most) and math.isfinite(scale)
    return (min(max(most, 0.0), 180.0), min(max(scale, 0.0), 90.0)) if good else usual
