"""The expressions of an avatar's file: VRM 0's blend shape groups and VRM 1's presets and custom ones."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from studio.formats._vrm_mesh import Meshes
from studio.motion.avatar import Expression

_OVERRIDES = {"blink": "overrideBlink", "lookAt": "overrideLookAt", "mouth": "overrideMouth"}


def read(extension: dict[str, Any], old: bool, meshes: Meshes) -> tuple[Expression, ...]:
    """All expressions, those that move nothing among them.

    Args:
        extension: VRM or VRMC_vrm of the file.
        old: whether it is VRM 0.
        meshes: what its meshes became.
    """
    return tuple(_groups(extension, meshes) if old else _expressions(extension, meshes))


def _groups(extension: dict[str, Any], meshes: Meshes) -> Iterable[Expression]:
    for group in extension.get("blendShapeMaster", {}).get("blendShapeGroups", ()):
        preset = str(group.get("presetName", "unknown"))
        name = str(group.get("name", "")) if preset in ("", "unknown") else preset
        binds = tuple(
            (surface, morph, weight)
            for bind in group.get("binds", ())
            for surface, morph, weight in _binds(meshes, meshes.by_mesh, bind["mesh"], bind, 0.01)
        )
        yield Expression(name, binds, bool(group.get("isBinary", False)))


def _expressions(extension: dict[str, Any], meshes: Meshes) -> Iterable[Expression]:
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
            yield Expression(str(name), binds, bool(one.get("isBinary", False)), overrides)


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
