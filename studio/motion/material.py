"""How an avatar's surfaces look: plain, unlit or as MToon has them. Colours are linear, as in glTF."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]
Pixels = NDArray[np.uint8]
BLACK: Colour = (0.0, 0.0, 0.0)
WHITE: Colour = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class UvMotion:
    """Where a texture lies on its surface, and how it moves there.

    Args:
        offset, scale: of texture coordinates, v from the top.
        turn: radians about (0, 0), as KHR_texture_transform has it.
        scroll: change of the coordinates a second, v from the top.
        spin: radians a second about the texture's middle.
    """

    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    turn: float = 0.0
    scroll: tuple[float, float] = (0.0, 0.0)
    spin: float = 0.0

    @property
    def moves(self) -> bool:
        """Whether it is another one a moment later."""
        return self.scroll != (0.0, 0.0) or self.spin != 0.0


@dataclass(frozen=True, eq=False)
class Outline:
    """The line around a surface.

    Args:
        width: metres, or with `on_screen` as a share of the picture's height.
        on_screen: as wide wherever it is.
        colour: its colour.
        lit: how much it takes on of the surface's own shading, 0..1.
        widths: green of it scales the width, or None.
    """

    width: float
    on_screen: bool = False
    colour: Colour = BLACK
    lit: float = 1.0
    widths: Pixels | None = None


@dataclass(frozen=True, eq=False)
class Toon:
    """What MToon adds to a surface.

    Args:
        shade: its colour where no light falls.
        shade_picture: multiplied with that, or None.
        shift: moves the line between light and shade, -1 all shade to 1 all light.
        shift_picture: red of it is added to the shift, scaled by `shift_scale`.
        toony: 0 a soft line, 1 a hard one.
        rim: colour seen where the surface turns away.
        rim_power, rim_lift: how narrow that is, and how much of it is everywhere.
        rim_lit: 0 it glows by itself, 1 it is lit.
        rim_picture: multiplied with rim and matcap.
        matcap: colour of the picture of a ball that is laid over, black for none.
        matcap_picture: that picture.
        outline: its line, or None.
    """

    shade: Colour = BLACK
    shade_picture: Pixels | None = None
    shift: float = 0.0
    shift_picture: Pixels | None = None
    shift_scale: float = 1.0
    toony: float = 0.9
    rim: Colour = BLACK
    rim_power: float = 5.0
    rim_lift: float = 0.0
    rim_lit: float = 1.0
    rim_picture: Pixels | None = None
    matcap: Colour = BLACK
    matcap_picture: Pixels | None = None
    outline: Outline | None = None


@dataclass(frozen=True, eq=False)
class SurfaceMaterial:
    """How a surface looks.

    Args:
        colour: red, green, blue, alpha, 0..1.
        picture: its texture (H, W, 4) uint8, first row at the top, or None.
        mode: "OPAQUE", "MASK" or "BLEND".
        cutoff: with MASK, alphas below it are not drawn.
        two_sided: whether its back is seen too.
        unlit: its colour is seen as it is.
        toon: what MToon adds, None for a plain material.
        glow: light of its own, may be above 1.
        glow_picture: multiplied with that, or None.
        normals: a normal map (H, W, 4), or None; `bumps` scales it.
        order: among blended surfaces, lower ones are drawn first.
        uv: where its pictures lie.
        metal, rough: of a plain material, 0..1; green of `metal_picture` scales rough, blue metal.
    """

    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    picture: Pixels | None = None
    mode: str = "OPAQUE"
    cutoff: float = 0.5
    two_sided: bool = False
    unlit: bool = False
    toon: Toon | None = None
    glow: Colour = BLACK
    glow_picture: Pixels | None = None
    normals: Pixels | None = None
    bumps: float = 1.0
    order: int = 0
    uv: UvMotion = UvMotion()
    metal: float = 0.0
    rough: float = 1.0
    metal_picture: Pixels | None = None

    def value(self, part: str) -> tuple[float, ...] | None:
        """What of it an expression may change, see `MaterialBind`; None where it has no such part."""
        line = self.toon.outline if self.toon is not None else None
        values: dict[str, tuple[float, ...] | None] = {
            "colour": self.colour,
            "glow": self.glow,
            "shade": self.toon.shade if self.toon is not None else None,
            "rim": self.toon.rim if self.toon is not None else None,
            "matcap": self.toon.matcap if self.toon is not None else None,
            "outline": line.colour if line is not None else None,
            "offset": self.uv.offset,
            "scale": self.uv.scale,
        }
        return values[part]


@dataclass(frozen=True)
class MaterialBind:
    """What an expression makes of a material at full weight.

    Args:
        material: index among the avatar's.
        part: "colour", "glow", "shade", "rim", "matcap", "outline", or "offset" or "scale" of its pictures.
        value: that part then, as many numbers as the material has for it.
    """

    material: int
    part: str
    value: tuple[float, ...]
