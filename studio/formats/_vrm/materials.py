"""The materials of an avatar's file: base colours and textures, small enough for any computer."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.formats._glb import Glb, entry
from studio.motion.avatar import SurfaceMaterial

SIDE = 1024
"""Pixels along a texture's longer side; more is not seen at the size an avatar is shown."""
MOST_PIXELS = 8192 * 8192
MOST_PICTURES = 128
_KINDS = ("PNG", "JPEG", "WEBP")


def read(glb: Glb, vrm0: dict[str, Any]) -> tuple[tuple[SurfaceMaterial, ...], tuple[str, ...]]:
    """All materials, with a plain one at the end for surfaces that name none, and what was left out.

    Args:
        glb: the file.
        vrm0: its VRM extension where it is VRM 0, which may keep colours of its own.
    """
    pictures = _Pictures(glb)
    listed = glb.document.get("materials", ())
    own = vrm0.get("materialProperties", ())
    made = [
        _material(entry(glb.document, "materials", i), own[i] if i < len(own) else {}, pictures)
        for i in range(len(listed))
    ]
    notes = ("Some of its textures cannot be shown; plain colours stand for them.",) if pictures.lost else ()
    return (*made, SurfaceMaterial()), notes


def _material(one: dict[str, Any], properties: Any, pictures: _Pictures) -> SurfaceMaterial:
    base = one.get("pbrMetallicRoughness", {})
    colour = base.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    texture = base.get("baseColorTexture", {}).get("index")
    if texture is None and isinstance(properties, dict):
        texture = properties.get("textureProperties", {}).get("_MainTex")
        colour = (
            properties.get("vectorProperties", {}).get("_Color", colour) if texture is not None else colour
        )
    numbers = np.array(colour, dtype=np.float64).reshape(4)
    if not np.isfinite(numbers).all():
        raise ValueError(colour)
    glow = np.array(one.get("emissiveFactor", (0, 0, 0)), dtype=np.float64).reshape(3)
    if texture is None and np.isfinite(glow).all():
        numbers[:3] += glow  # without a picture, what glows is seen in that colour
    r, g, b, a = np.clip(numbers, 0.0, 1.0).tolist()
    mode = str(one.get("alphaMode", "OPAQUE"))
    return SurfaceMaterial(
        (r, g, b, a),
        pictures.texture(texture) if texture is not None else None,
        mode if mode in ("MASK", "BLEND") else "OPAQUE",
        min(max(float(one.get("alphaCutoff", 0.5)), 0.0), 1.0),
        bool(one.get("doubleSided", False)),
    )


class _Pictures:
    """The pictures of a file, each decoded once and made small."""

    def __init__(self, glb: Glb) -> None:
        self._glb = glb
        self._known: dict[int, NDArray[np.uint8] | None] = {}
        self.lost = 0

    def texture(self, index: Any) -> NDArray[np.uint8] | None:
        """A texture's picture (H, W, 4), or None where it cannot be had."""
        source = entry(self._glb.document, "textures", index).get("source")
        if not isinstance(source, int):
            self.lost += 1
            return None
        if source not in self._known:
            if len(self._known) >= MOST_PICTURES:
                self.lost += 1
                return None
            self._known[source] = self._decoded(entry(self._glb.document, "images", source))
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
                picture.draft("RGB", (SIDE, SIDE))  # a large JPEG is never made at its full size
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
