"""Reading how an avatar's surfaces look: plain glTF, unlit, and MToon of VRM 0 and 1.

Source: glTF 2.0 with KHR_materials_unlit, KHR_materials_emissive_strength and KHR_texture_transform;
VRMC_materials_mtoon 1.0; how UniVRM and three-vrm migrate VRM 0's MToon to it.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.formats._glb import Glb, entry
from studio.motion.material import BLACK, WHITE, Colour, Outline, Pixels, SurfaceMaterial, Toon, UvMotion

SIDE = 1024
"""Pixels along a texture's longer side; more is not seen at the size an avatar is shown."""
MOST_PIXELS = 8192 * 8192
MOST_PICTURES = 128
_KINDS = ("PNG", "JPEG", "WEBP")
_LOST = "Some of its textures cannot be shown; plain colours are used instead."
_CM = 0.01
_BRIGHTEST = 64.0


def read_materials(glb: Glb, vrm0: dict[str, Any]) -> tuple[tuple[SurfaceMaterial, ...], tuple[str, ...]]:
    """All materials, with a plain one at the end for surfaces that name none, and what was left out.

    Args:
        glb: the file.
        vrm0: its VRM extension where it is VRM 0, which keeps looks of its own.
    """
    pictures = _Pictures(glb)
    own = vrm0.get("materialProperties", ())
    made = []
    for i in range(len(glb.document.get("materials", ()))):
        one = entry(glb.document, "materials", i)
        properties = own[i] if i < len(own) and isinstance(own[i], dict) else {}
        shader = str(properties.get("shader", ""))
        if shader == "VRM/MToon":
            made.append(_toon_of_vrm0(_Properties(properties), pictures))
        else:
            made.append(_gltf(one, properties, shader.startswith("VRM/Unlit"), pictures))
    return (*made, SurfaceMaterial()), ((_LOST,) if pictures.lost else ())


def _gltf(
    one: dict[str, Any], properties: dict[str, Any], unlit: bool, pictures: _Pictures
) -> SurfaceMaterial:
    base, extensions = one.get("pbrMetallicRoughness", {}), one.get("extensions", {})
    texture = base.get("baseColorTexture", {})
    picture = pictures.of(texture)
    factor = base.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    if picture is None and not texture:
        # VRM 0 may name it in its own table alone.
        index = properties.get("textureProperties", {}).get("_MainTex")
        picture = pictures.texture(index) if index is not None else None
        if picture is not None:
            factor = properties.get("vectorProperties", {}).get("_Color", factor)
    mode = str(one.get("alphaMode", "OPAQUE"))
    toon = extensions.get("VRMC_materials_mtoon")
    strength = _number(
        extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0), most=_BRIGHTEST
    )
    return SurfaceMaterial(
        _rgba(factor),
        picture,
        mode if mode in ("MASK", "BLEND") else "OPAQUE",
        _number(one.get("alphaCutoff", 0.5)),
        bool(one.get("doubleSided", False)),
        # Beside MToon it is there for programs that know none.
        (unlit or "KHR_materials_unlit" in extensions) and toon is None,
        _toon(toon, pictures) if isinstance(toon, dict) else None,
        tuple(strength * c for c in _rgb(one.get("emissiveFactor"), BLACK)),  # type: ignore[arg-type]
        pictures.of(one.get("emissiveTexture")),
        pictures.of(one.get("normalTexture")),
        _number((one.get("normalTexture") or {}).get("scale", 1.0), -4.0, 4.0),
        int(_number((toon or {}).get("renderQueueOffsetNumber", 0), -9.0, 9.0)),
        _uv(texture.get("extensions", {}).get("KHR_texture_transform", {}), toon or {}),
        _number(base.get("metallicFactor", 1.0)),
        _number(base.get("roughnessFactor", 1.0)),
        pictures.of(base.get("metallicRoughnessTexture")),
    )


def _toon(one: dict[str, Any], pictures: _Pictures) -> Toon:
    matcap = pictures.of(one.get("matcapTexture"))
    shift = one.get("shadingShiftTexture") or {}
    mode, width = one.get("outlineWidthMode", "none"), _number(one.get("outlineWidthFactor", 0.0))
    line = None
    if mode in ("worldCoordinates", "screenCoordinates") and width > 0.0:
        line = Outline(
            width,
            mode == "screenCoordinates",
            _rgb(one.get("outlineColorFactor"), BLACK),
            _number(one.get("outlineLightingMixFactor", 1.0)),
            pictures.of(one.get("outlineWidthMultiplyTexture")),
        )
    return Toon(
        _rgb(one.get("shadeColorFactor"), WHITE),
        pictures.of(one.get("shadeMultiplyTexture")),
        _number(one.get("shadingShiftFactor", 0.0), -2.0, 2.0),
        pictures.of(shift),
        _number(shift.get("scale", 1.0), -4.0, 4.0),
        _number(one.get("shadingToonyFactor", 0.9)),
        _rgb(one.get("parametricRimColorFactor"), BLACK),
        _number(one.get("parametricRimFresnelPowerFactor", 5.0), most=100.0),
        _number(one.get("parametricRimLiftFactor", 0.0)),
        _number(one.get("rimLightingMixFactor", 1.0)),
        pictures.of(one.get("rimMultiplyTexture")),
        _rgb(one.get("matcapFactor"), WHITE) if matcap is not None else BLACK,
        matcap,
        line,
    )


class _Properties:
    """The table of a material of VRM 0, as Unity has it: colours in sRGB, centimetres, v from the bottom."""

    def __init__(self, table: dict[str, Any]) -> None:
        self.floats: dict[str, Any] = table.get("floatProperties") or {}
        self.vectors: dict[str, Any] = table.get("vectorProperties") or {}
        self.textures: dict[str, Any] = table.get("textureProperties") or {}
        self.queue = int(_number(table.get("renderQueue", 2000), 0.0, 5000.0))

    def number(self, name: str, usual: float, least: float = 0.0, most: float = 1.0) -> float:
        return _number(self.floats.get(name, usual), least, most)

    def colour(self, name: str, usual: Sequence[float], most: float = 1.0) -> Colour:
        r, g, b = _rgb(self.vectors.get(name, usual), BLACK, most)
        return linear(r), linear(g), linear(b)


def _toon_of_vrm0(table: _Properties, pictures: _Pictures) -> SurfaceMaterial:
    def picture(name: str) -> Pixels | None:
        index = table.textures.get(name)
        return pictures.texture(index) if index is not None else None

    shift, toony = table.number("_ShadeShift", 0.0, -1.0), table.number("_ShadeToony", 0.9)
    toony += (1.0 - toony) * (0.5 + 0.5 * shift)
    matcap = picture("_SphereAdd")
    kind, width = table.number("_OutlineWidthMode", 0.0, most=2.0), table.number("_OutlineWidth", 0.0)
    mixed = table.number("_OutlineColorMode", 0.0) >= 1.0
    line = None
    if kind >= 1.0 and width > 0.0:
        lit = table.number("_OutlineLightingMix", 1.0) if mixed else 0.0
        colour, widths = table.colour("_OutlineColor", BLACK), picture("_OutlineWidthTexture")
        line = Outline(width * _CM, kind >= 2.0, colour, lit, widths)
    alpha = _rgba(table.vectors.get("_Color", (1.0, 1.0, 1.0, 1.0)))[3]
    left, up, wide, high = _four(table.vectors.get("_MainTex"), (0.0, 0.0, 1.0, 1.0))
    blend = int(table.number("_BlendMode", 0.0, most=3.0))
    toon = Toon(
        table.colour("_ShadeColor", (0.97, 0.81, 0.86)),
        picture("_ShadeTexture"),
        -shift - (1.0 - toony),
        None,
        1.0,
        toony,
        table.colour("_RimColor", BLACK),
        table.number("_RimFresnelPower", 1.0, most=100.0),
        table.number("_RimLift", 0.0),
        table.number("_RimLightingMix", 0.0),
        picture("_RimTexture"),
        WHITE if matcap is not None else BLACK,
        matcap,
        line,
    )
    return SurfaceMaterial(
        (*table.colour("_Color", WHITE), alpha),
        picture("_MainTex"),
        ("OPAQUE", "MASK", "BLEND", "BLEND")[blend],
        table.number("_Cutoff", 0.5),
        table.number("_CullMode", 2.0, most=2.0) == 0.0,
        toon=toon,
        # HDR, in sRGB as its other colours are: above 1 too.
        glow=table.colour("_EmissionColor", BLACK, _BRIGHTEST),
        glow_picture=picture("_EmissionMap"),
        normals=picture("_BumpMap"),
        bumps=table.number("_BumpScale", 1.0, -4.0, 4.0),
        order=table.queue - 3000 if blend >= 2 else 0,
        uv=UvMotion(
            (left, 1.0 - up - high),
            (wide, high),
            scroll=(
                table.number("_UvAnimScrollX", 0.0, -100.0, 100.0),
                -table.number("_UvAnimScrollY", 0.0, -100.0, 100.0),
            ),
            spin=2.0 * math.pi * table.number("_UvAnimRotation", 0.0, -100.0, 100.0),
        ),
    )


def _uv(transform: Mapping[str, Any], toon: Mapping[str, Any]) -> UvMotion:
    def pair(value: Any, usual: float) -> tuple[float, float]:
        x, y = (*value, usual, usual)[:2] if isinstance(value, list | tuple) else (usual, usual)
        return _number(x, -100.0, 100.0), _number(y, -100.0, 100.0)

    return UvMotion(
        pair(transform.get("offset"), 0.0),
        pair(transform.get("scale"), 1.0),
        _number(transform.get("rotation", 0.0), -100.0, 100.0),
        (
            _number(toon.get("uvAnimationScrollXSpeedFactor", 0.0), -100.0, 100.0),
            _number(toon.get("uvAnimationScrollYSpeedFactor", 0.0), -100.0, 100.0),
        ),
        _number(toon.get("uvAnimationRotationSpeedFactor", 0.0), -100.0, 100.0),
    )


def _number(value: Any, least: float = 0.0, most: float = 1.0) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(value)
    return min(max(number, least), most)


def _four(value: Any, usual: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    a, b, c, d = (*value, *usual[len(value) :])[:4] if isinstance(value, list | tuple) else usual
    return tuple(_number(x, -100.0, 100.0) for x in (a, b, c, d))  # type: ignore[return-value]


def _rgba(value: Any) -> tuple[float, float, float, float]:
    r, g, b, a = _four(value, (1.0, 1.0, 1.0, 1.0))
    return _number(r), _number(g), _number(b), _number(a)


def _rgb(value: Any, usual: Colour, most: float = 1.0) -> Colour:
    r, g, b, _ = _four(value, (*usual, 1.0))
    return _number(r, most=most), _number(g, most=most), _number(b, most=most)


def linear(value: float) -> float:
    """A part of a colour 0..1 as light, from sRGB."""
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)


class _Pictures:
    """The pictures of a file, each decoded once and made small."""

    def __init__(self, glb: Glb) -> None:
        self._glb = glb
        self._known: dict[int, NDArray[np.uint8] | None] = {}
        self.lost = 0

    def of(self, info: Any) -> NDArray[np.uint8] | None:
        """The picture that a textureInfo names, None without one."""
        index = info.get("index") if isinstance(info, dict) else None
        return self.texture(index) if index is not None else None

    def texture(self, index: Any) -> NDArray[np.uint8] | None:
        """A texture's picture (H, W, 4), or None where it cannot be had."""
        try:
            source = entry(self._glb.document, "textures", index)["source"]
            image = entry(self._glb.document, "images", source)
        except (KeyError, IndexError, TypeError):
            self.lost += 1
            return None
        if source not in self._known:
            if len(self._known) >= MOST_PICTURES:
                self.lost += 1
                return None
            self._known[source] = self._decoded(image)
            self.lost += self._known[source] is None
        return self._known[source]

    def _decoded(self, image: dict[str, Any]) -> NDArray[np.uint8] | None:
        """An embedded picture; those that lie elsewhere are never fetched."""
        if "bufferView" not in image:
            return None
        from PIL import Image

        try:
            with Image.open(io.BytesIO(self._glb.block(image["bufferView"])), formats=_KINDS) as picture:
                if picture.width * picture.height > MOST_PIXELS:
                    return None
                # A large JPEG is never made at its full size.
                picture.draft("RGB", (SIDE, SIDE))
                picture.thumbnail((SIDE, SIDE))
                return np.asarray(picture.convert("RGBA"), dtype=np.uint8)
        except (
            OSError,
            ValueError,
            SyntaxError,
            Image.DecompressionBombError,
            Image.DecompressionBombWarning,
        ):
            return None
