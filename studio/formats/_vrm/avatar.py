"""Reading an avatar: a .vrm of version 0 or 1 as bones, surfaces, expressions and terms of use."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from studio.errors import StudioError, say
from studio.formats import _glb
from studio.formats._glb import Glb
from studio.formats._vrm import drivers, mesh
from studio.formats._vrm.expression import read_expressions, read_look_at
from studio.formats._vrm.material import read_materials
from studio.formats._vrm.mesh import Nodes
from studio.formats._vrm.rig import read_rig
from studio.motion import Skeleton, rotation
from studio.motion.avatar import FREE, MIRROR, Avatar, Licence
from studio.motion.channels import ALL_BONES, vrm1_bone

_LONGEST = 120
_WHO_OLD = {
    "OnlyAuthor": "Only its author may use it.",
    "ExplicitlyLicensedPerson": "Only people its author names may use it.",
    "Everyone": "Everyone may use it.",
}
_WHO = {
    "onlyAuthor": _WHO_OLD["OnlyAuthor"],
    "onlySeparatelyLicensedPerson": _WHO_OLD["ExplicitlyLicensedPerson"],
    "everyone": _WHO_OLD["Everyone"],
}
_BUSINESS_OLD = {"Allow": "Commercial use is allowed.", "Disallow": "No commercial use."}
_BUSINESS = {
    "personalNonProfit": "No commercial use.",
    "personalProfit": "Commercial use by persons is allowed.",
    "corporation": "Commercial use is allowed.",
}

_PACKED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshoptimizer",
    "KHR_meshopt_compression": "meshoptimizer",
}
_CC0 = "creativecommons.org/publicdomain/zero"


def read_licence(meta: Any, old: bool) -> Licence:
    """Title, authors and terms; what the file leaves open is left out."""
    if not isinstance(meta, dict):
        return Licence()
    if old:
        authors = [_text(meta.get("author"))]
        who, business = _WHO_OLD.get(str(meta.get("allowedUserName"))), _BUSINESS_OLD.get(
            str(meta.get("commercialUssageName"))
        )  # fmt: skip
        licence = _text(meta.get("licenseName")).replace("_", " ")
        title = _text(meta.get("title"))
    else:
        listed = meta.get("authors")
        authors = [_text(author) for author in listed[:5]] if isinstance(listed, list) else []
        # What a VRM 1 leaves out is the strictest choice. Source: VRMC_vrm 1.0, meta.
        who = _WHO.get(str(meta.get("avatarPermission", "onlyAuthor")))
        business = _BUSINESS.get(str(meta.get("commercialUsage", "personalNonProfit")))
        licence, title = _text(meta.get("licenseUrl")), _text(meta.get("name"))
        if _CC0 in _text(meta.get("otherLicenseUrl")):
            return Licence(title, tuple(author for author in authors if author), (FREE,))
    terms = [sentence for sentence in (who, business) if sentence]
    terms += [say("Licence: {licence}", licence=licence)] if licence and licence != "Other" else []
    return Licence(title, tuple(author for author in authors if author), tuple(terms))


def _text(value: Any) -> str:
    """One short line of a file's text."""
    line = " ".join(str(value).split()) if isinstance(value, str) else ""
    line = "".join(character for character in line if character.isprintable())
    return line if len(line) <= _LONGEST else line[: _LONGEST - 1] + "…"


SUFFIX = ".vrm"
CHOOSE = "Choose an avatar saved as VRM, such as VRoid Studio writes."
_VRM1_BONES = {vrm1_bone(name): name for name in ALL_BONES}
_VRM0_BONES = {name[0].lower() + name[1:]: name for name in ALL_BONES}


def read(path: Path) -> Avatar:
    """The avatar of a file, its faces driven as a person chose; nothing is fetched, whatever it asks for.

    Raises:
        StudioError: it is missing, no VRM avatar, cut short, damaged or too large.
    """
    glb = _glb.read(path)
    try:
        _check_packing(glb)
        made = _avatar(glb)
    except (KeyError, IndexError, TypeError, ValueError, OverflowError, AttributeError) as error:
        raise _glb.damaged(path) from error
    except MemoryError as error:
        raise mesh.too_large(path) from error
    chosen = drivers.read(path)
    if chosen is None:
        return replace(made, notes=(*made.notes, drivers.UNREADABLE))
    return replace(made, drivers=chosen) if chosen else made


def _avatar(glb: Glb) -> Avatar:
    extension, old = _extension(glb)
    nodes = Nodes.of(glb, turned=old)
    bones = _bones(extension, old, len(nodes.parents))
    if "Hips" not in bones or len(bones) < 3:
        raise StudioError(say("{name} has no humanoid skeleton.", name=glb.path.name), CHOOSE)
    skeleton = _skeleton(nodes, bones)
    rig, moved, still = read_rig(glb, old, nodes, list(bones.values()))
    meshes = mesh.read(glb, nodes, nodes.owners(moved), _unseen(glb, extension, old))
    materials, notes = read_materials(glb, extension if old else {})
    expressions = read_expressions(glb, extension, old, meshes, materials)
    licence = read_licence(extension.get("meta"), old)
    return Avatar(
        licence.title or glb.path.stem, skeleton, meshes.surfaces, materials, expressions, licence,
        (*meshes.notes, *notes, *still), rig, read_look_at(extension, old),
    )  # fmt: skip


def _check_packing(glb: Glb) -> None:
    """Raise StudioError where its meshes are compressed."""
    for name in glb.document.get("extensionsRequired") or ():
        if name in _PACKED:
            raise StudioError(
                say(
                    "{name} is compressed by {packed}, which the studio cannot unpack.",
                    name=glb.path.name,
                    packed=_PACKED[name],
                ),
                "Export the avatar again without mesh compression.",
            )


def _extension(glb: Glb) -> tuple[dict[str, Any], bool]:
    """What the file says of the avatar, and whether it says so as VRM 0."""
    found = glb.document.get("extensions")
    for name, old in (("VRMC_vrm", False), ("VRM", True)):
        extension = found.get(name) if isinstance(found, dict) else None
        if isinstance(extension, dict):
            return extension, old
    raise StudioError(say("{name} is not a VRM avatar.", name=glb.path.name), CHOOSE)


def _bones(extension: dict[str, Any], old: bool, count: int) -> dict[str, int]:
    """Node by HumanBodyBones name; each node once."""
    listed = extension["humanoid"]["humanBones"]
    pairs = [(b["bone"], b.get("node", -1)) for b in listed] if old else [
        (name, place["node"]) for name, place in listed.items()
    ]  # fmt: skip
    known, found = _VRM0_BONES if old else _VRM1_BONES, dict[str, int]()
    for name, node in pairs:
        bone = known.get(str(name))
        if bone is None or (old and node == -1):
            continue
        if not isinstance(node, int) or not 0 <= node < count:
            raise IndexError(node)
        if node not in found.values():
            found[bone] = node
    return found


def _unseen(glb: Glb, extension: dict[str, Any], old: bool) -> frozenset[int]:
    """Nodes whose meshes only the wearer's own eyes see."""
    listed = extension.get("firstPerson", {}).get("meshAnnotations", ())
    if not old:
        return frozenset(int(one["node"]) for one in listed if one.get("type") == "firstPersonOnly")
    meshes = {int(one["mesh"]) for one in listed if one.get("firstPersonFlag") == "FirstPersonOnly"}
    return frozenset(i for i, node in enumerate(glb.document["nodes"]) if node.get("mesh") in meshes)


def _skeleton(nodes: Nodes, bones: dict[str, int]) -> Skeleton:
    """The bones as they hang in the file, in Unity's axes."""
    names = tuple(bones)
    above = nodes.owners(list(bones.values()), strictly=True)
    parents = tuple(-1 if name == "Hips" else int(above[node]) for name, node in bones.items())
    world = nodes.world[list(bones.values()), :3, 3] * MIRROR
    offsets = np.array([world[j] - (world[p] if p >= 0 else 0.0) for j, p in enumerate(parents)])
    return Skeleton(names, parents, offsets, np.tile(rotation.IDENTITY, (len(names), 1)))
