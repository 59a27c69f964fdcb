"""The shader of an avatar's surfaces: plain, unlit and MToon, in VTK's own OpenGL mapper.

One light, as MToon is made for: a colour is full where it falls, and the shade colour where it does not.
Computed in linear light, written as sRGB. VTK's blocks for light and texture are taken out and these put in
their place, so that software OpenGL and a graphics card draw the same.

Source: VRMC_materials_mtoon 1.0 and its implementation in three-vrm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion.material import BLACK, Outline, Pixels, SurfaceMaterial, Toon, UvMotion

LIGHT = (-0.35, 0.55, 0.76)
"""Where the light comes from, as the camera sees it: from the upper left, before the avatar."""
AMBIENT, KEY, FILL = 0.26, 0.58, 0.12
"""Light on plain surfaces: from everywhere, from LIGHT, and from the other side."""
LINE_SHARE = "lineShare"
"""The points' array of how wide an outline is there, of its width, where a picture says so."""
_SEEN = 0.02
"""Blended, what has less alpha is not drawn."""

_UNIFORMS = {
    "colour": "baseColour", "glow": "glow", "shade": "shadeColour", "rim": "rimColour",
    "matcap": "matcapColour", "outline": "lineColour",
}  # fmt: skip
"""What parts of a material are called in the shader."""

_FUNCTIONS = """
vec3 asSrgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, c * 12.92, lessThanEqual(c, vec3(0.0031308)));
}
vec2 placed(vec2 uv) {
  vec2 p = vec2(uv.x, 1.0 - uv.y);
  p = vec2(uvTurn.x * p.x + uvTurn.y * p.y, uvTurn.z * p.x + uvTurn.w * p.y) + uvShift;
  return vec2(p.x, 1.0 - p.y);
}
vec3 bumped(vec3 n, vec3 from, vec2 uv, vec3 map) {
  vec3 q0 = dFdx(from), q1 = dFdy(from);
  vec2 st0 = dFdx(uv), st1 = dFdy(uv);
  vec3 q1perp = cross(q1, n), q0perp = cross(n, q0);
  vec3 t = q1perp * st0.x + q0perp * st1.x, b = q1perp * st0.y + q0perp * st1.y;
  float det = max(dot(t, t), dot(b, b));
  float scale = det == 0.0 ? 0.0 : inversesqrt(det);
  return normalize(t * (map.x * scale) + b * (map.y * scale) + n * map.z);
}
"""

_BEGIN = """
  vec3 view = normalize(-vertexVC.xyz);
  vec3 normal = normalize(normalVCVSOutput);
  vec4 base = vec4(baseColour, baseAlpha);
"""
_CUT = "  if (base.a < {cutoff:.4f}) discard;\n"
# glTF's metal and roughness, under two lights: GGX with Smith's correlated shadowing, and Schlick's Fresnel.
_GGX = """
vec3 reflected(vec3 n, vec3 v, vec3 l, vec3 diffuse, vec3 f0, float rough) {
  vec3 h = normalize(l + v);
  float nl = clamp(dot(n, l), 0.0, 1.0), nv = clamp(dot(n, v), 0.0, 1.0);
  float nh = clamp(dot(n, h), 0.0, 1.0), vh = clamp(dot(v, h), 0.0, 1.0);
  float a = rough * rough, aa = a * a, d = nh * nh * (aa - 1.0) + 1.0;
  float seen = 0.5 / max(nl * sqrt(aa + (1.0 - aa) * nv * nv) + nv * sqrt(aa + (1.0 - aa) * nl * nl), 1e-6);
  vec3 fresnel = f0 + (1.0 - f0) * exp2((-5.55473 * vh - 6.98316) * vh);
  return nl * (diffuse + fresnel * (seen * aa / (d * d)));
}
"""
_PLAIN = """
  vec3 diffuse = base.rgb * (1.0 - metal), f0 = mix(vec3(0.04), base.rgb, metal);
  vec3 beside = normalize(vec3(-lightVC.x, 0.2, lightVC.z));
  vec3 colour = diffuse * ambientLight + keyLight * reflected(normal, view, lightVC, diffuse, f0, rough)
      + fillLight * reflected(normal, view, beside, diffuse, f0, rough);
"""
_TOON = """
  float facing = dot(normal, lightVC) + shift;
  float shading = clamp((facing + 1.0 - toony) / max(2.0 - 2.0 * toony, 1e-4), 0.0, 1.0);
  vec3 colour = mix(shade, base.rgb, shading);
"""
_RIM = """
  float edge = clamp(1.0 - dot(normal, view) + rimLift, 0.0, 1.0);
  vec3 rim = rimColour * pow(max(edge, 1e-4), rimPower);
"""
_MATCAP = """
  vec3 ballX = normalize(vec3(view.z, 0.0, -view.x)), ballY = cross(view, ballX);
  vec2 ball = 0.5 + 0.495 * vec2(dot(ballX, normal), dot(ballY, normal));
  rim += matcapColour * texture(matcapPicture, ball).rgb;
"""
# The line is the surface's back, moved outwards along its normals.
_GROWN = """
  vec4 grown = vec4(vertexMC.xyz + normalMC * (lineWidth / max(length(normalMC), 1e-6)), 1.0);
  vertexVCVSOutput = MCVCMatrix * grown;
  gl_Position = MCDCMatrix * grown;
"""
_GROWN_ON_SCREEN = """
  vertexVCVSOutput = MCVCMatrix * vertexMC;
  gl_Position = MCDCMatrix * vertexMC;
  vec4 outwards = MCDCMatrix * vec4(normalMC, 0.0);
  vec2 along = length(outwards.xy) > 1e-6 ? normalize(outwards.xy * vec2(lineAspect, 1.0)) : vec2(0.0);
  gl_Position.xy += 2.0 * lineWidth * gl_Position.w * vec2(along.x / lineAspect, along.y);
"""


class Textures:
    """The textures of one avatar: a picture is uploaded once, whatever uses it."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, bool], Any] = {}

    def of(self, picture: Pixels, linear: bool = False) -> Any:
        """A VTK texture of a picture; `linear` where its numbers are no colours."""
        import pyvista as pv

        key = (id(picture), linear)
        if key not in self._known:
            texture: Any = pv.Texture(np.ascontiguousarray(picture))  # type: ignore[no-untyped-call]
            # Made linear by OpenGL, before it is averaged.
            texture.SetUseSRGBColorSpace(not linear)
            texture.SetInterpolate(True)
            texture.SetMipmap(True)
            # Where OpenGL runs in software, filtering for slanted surfaces takes as long as all the rest.
            texture.SetMaximumAnisotropicFiltering(1.0)
            texture.SetRepeat(True)
            self._known[key] = texture
        return self._known[key]


class SurfaceShader:
    """How one actor is drawn.

    Args:
        actor: VTK's, with normals, and with texture coordinates where the material has a picture.
        material: how it looks.
        textures: of its avatar.
        textured: whether it has texture coordinates.
        outline: draw the line around the surface instead of the surface.
        changing: parts of it that expressions may change, see `MaterialBind`.
    """

    def __init__(
        self,
        actor: Any,
        material: SurfaceMaterial,
        textures: Textures,
        textured: bool,
        outline: bool = False,
        changing: frozenset[str] = frozenset(),
    ) -> None:
        self._material, self._uv, self._changing = material, material.uv, changing
        shader = actor.GetShaderProperty()
        self._fragment, self._vertex = shader.GetFragmentCustomUniforms(), shader.GetVertexCustomUniforms()
        self._prop, self._textures, self._textured = actor.GetProperty(), textures, textured
        self._samplers: list[str] = []
        self._names: dict[tuple[int, bool], str] = {}
        toon = material.toon
        line = toon.outline if toon is not None and outline else None
        code = self._code(material, toon, line)
        # The pictures themselves are declared by VTK.
        declared = "in vec2 tcoordVCVSOutput;\n" if textured and self._samplers else ""
        for place, text in (
            ("//VTK::TCoord::Dec", declared + _FUNCTIONS + _GGX * (toon is None and not material.unlit)),
            ("//VTK::TCoord::Impl", ""),
            ("//VTK::Color::Impl", ""),
            ("//VTK::Light::Impl", code),
        ):
            shader.AddFragmentShaderReplacement(place, True, text, False)
        if line is not None:
            grown = _GROWN_ON_SCREEN if line.on_screen else _GROWN
            if textured and line.widths is not None:
                place = "//VTK::PositionVC::Dec"
                shader.AddVertexShaderReplacement(place, True, f"{place}\nin float {LINE_SHARE};\n", False)
                grown = grown.replace("lineWidth", f"lineWidth * {LINE_SHARE}")
            shader.AddVertexShaderReplacement("//VTK::PositionVC::Impl", True, grown, False)
            self._vertex.SetUniformf("lineWidth", line.width)
            if line.on_screen:
                self._vertex.SetUniformf("lineAspect", 1.0)
        self.set_time(0.0)

    @property
    def moves(self) -> bool:
        """Whether its pictures move with the time."""
        return self._uv.moves

    def set_time(self, t: float) -> None:
        """Bring moving pictures to a moment, seconds."""
        turn, shift = uv_at(self._uv, t)
        self._fragment.SetUniform4f("uvTurn", turn)
        self._fragment.SetUniform2f("uvShift", shift)

    def set_values(self, values: Mapping[str, tuple[float, ...]], t: float) -> None:
        """Take on what expressions make of `changing` parts.

        Args:
            values: by part, as many numbers as the material has for it.
            t: the moment, seconds.
        """
        for part, value in values.items():
            name = _UNIFORMS.get(part)
            if part == "colour":
                self._set("baseAlpha", min(max(value[3], 0.0), 1.0))
            if name is not None:
                # Two faces at once may ask for less than black.
                red, green, blue = (max(number, 0.0) for number in value[:3])
                self._set(name, (red, green, blue))
        slide = {part: values[part] for part in ("offset", "scale") if part in values}
        if slide:
            self._uv = replace(self._material.uv, **slide)  # type: ignore[arg-type]
            self.set_time(t)

    def set_aspect(self, aspect: float, share: float = 1.0) -> None:
        """Width over height of the part drawn, and its share of the height: for lines on the screen."""
        toon = self._material.toon
        if toon is not None and toon.outline is not None and toon.outline.on_screen:
            self._vertex.SetUniformf("lineAspect", aspect)
            self._vertex.SetUniformf("lineWidth", toon.outline.width / share)

    def _sample(self, name: str, picture: Pixels | None, linear: bool = False, ball: bool = False) -> str:
        """What reads a picture, "" where there is none or nothing to read it by."""
        if picture is None or not (self._textured or ball):
            return ""
        # A picture that several parts share, as MToon's light and shade do, is read once.
        name = name if ball else self._names.setdefault((id(picture), linear), name)
        if name not in self._samplers:
            self._prop.SetTexture(name, self._textures.of(picture, linear))
            self._samplers.append(name)
        return f"texture({name}, uv)"

    def _set(self, name: str, value: float | tuple[float, float, float]) -> None:
        if isinstance(value, tuple):
            self._fragment.SetUniform3f(name, value)
        else:
            self._fragment.SetUniformf(name, value)

    def _code(self, material: SurfaceMaterial, toon: Toon | None, line: Outline | None) -> str:
        self._set("baseColour", material.colour[:3])
        self._set("baseAlpha", material.colour[3])
        code = _BEGIN
        base = self._sample("basePicture", material.picture)
        samples = [base]
        body = ""
        if base:
            body += f"  base *= {base};\n" if material.mode != "OPAQUE" else f"  base.rgb *= {base}.rgb;\n"
        if material.mode == "OPAQUE":
            body += "  base.a = 1.0;\n"
        else:
            body += _CUT.format(cutoff=material.cutoff if material.mode == "MASK" else _SEEN)
            body += "  base.a = 1.0;\n" if material.mode == "MASK" else ""
        if material.unlit:
            body += "  vec3 colour = base.rgb;\n"
        else:
            self._set("lightVC", LIGHT_VC)
            if material.normals is not None and line is None:
                samples.append(bump := self._sample("normalPicture", material.normals, linear=True))
                if bump:
                    self._set("bumps", material.bumps)
                    body += f"  vec3 map = {bump}.xyz * 2.0 - 1.0;\n  map.xy *= bumps;\n"
                    body += "  normal = bumped(normal, -vertexVC.xyz, uv, map);\n"
            body += self._lit(toon, line is None)
        if (material.glow != BLACK or "glow" in self._changing) and line is None:
            self._set("glow", material.glow)
            glow = self._sample("glowPicture", material.glow_picture)
            body += f"  colour += glow * {glow}.rgb;\n" if glow else "  colour += glow;\n"
        if line is not None:
            self._set("lineColour", line.colour)
            self._set("lineLit", line.lit)
            body += "  colour = lineColour * mix(vec3(1.0), colour, lineLit);\n"
        if self._textured and any(name != "matcapPicture" for name in self._samplers):
            code += "  vec2 uv = placed(tcoordVCVSOutput);\n"
        return code + body + "  fragOutput0 = vec4(asSrgb(colour), base.a);\n"

    def _lit(self, toon: Toon | None, whole: bool) -> str:
        if toon is None:
            for name, value in (("ambientLight", AMBIENT), ("keyLight", KEY), ("fillLight", FILL)):
                self._set(name, value)
            self._set("ownMetal", self._material.metal)
            self._set("ownRough", self._material.rough)
            body = "  float metal = ownMetal, rough = ownRough;\n"
            if picture := self._sample("metalPicture", self._material.metal_picture, linear=True):
                body += f"  metal *= {picture}.b;\n  rough *= {picture}.g;\n"
            return body + "  rough = max(rough, 0.0525);\n" + _PLAIN
        self._set("shadeColour", toon.shade)
        self._set("shiftOfShade", toon.shift)
        self._set("toony", min(toon.toony, 0.9999))
        shade = self._sample("shadePicture", toon.shade_picture)
        body = "  vec3 shade = shadeColour;\n" + (f"  shade *= {shade}.rgb;\n" if shade else "")
        shift = self._sample("shiftPicture", toon.shift_picture, linear=True)
        body += "  float shift = shiftOfShade;\n"
        if shift:
            self._set("shiftScale", toon.shift_scale)
            body += f"  shift += {shift}.r * shiftScale;\n"
        body += _TOON
        rimmed = toon.rim != BLACK or "rim" in self._changing
        if not whole or not (rimmed or toon.matcap_picture is not None):
            return body
        self._set("rimColour", toon.rim)
        self._set("rimPower", toon.rim_power)
        self._set("rimLift", toon.rim_lift)
        self._set("rimLit", toon.rim_lit)
        body += _RIM
        if toon.matcap_picture is not None:
            self._sample("matcapPicture", toon.matcap_picture, ball=True)
            self._set("matcapColour", toon.matcap)
            body += _MATCAP
        rim = self._sample("rimPicture", toon.rim_picture)
        body += f"  rim *= {rim}.rgb;\n" if rim else ""
        # The one light is white, so that what is lit by it is as bright as what glows.
        return body + "  colour += rim;\n"


LIGHT_VC: tuple[float, float, float] = tuple(np.array(LIGHT) / math.dist(LIGHT, BLACK))


def line_shares(widths: Pixels, uv: NDArray[np.floating]) -> NDArray[np.float32]:
    """How wide an outline is at texture coordinates (V, 2), v from the top, of its width (V,)."""
    high, wide = widths.shape[:2]
    column, row = (np.mod(uv, 1.0) * (wide, high)).astype(int).T
    return widths[np.minimum(row, high - 1), np.minimum(column, wide - 1), 1].astype(np.float32) / 255.0


def uv_at(uv: UvMotion, t: float) -> tuple[tuple[float, float, float, float], tuple[float, float]]:
    """A matrix, row by row, and an offset that take texture coordinates, v from the top, to a moment (s)."""
    cos, sin = math.cos(uv.turn), math.sin(uv.turn)
    matrix: NDArray[np.float64] = np.array([[cos, sin], [-sin, cos]]) * np.array(uv.scale)
    offset = np.array(uv.offset)
    if uv.moves:
        # Of a day of film only the part of a turn counts: floats of a shader are short.
        angle = math.fmod(uv.spin * t, 2.0 * math.pi)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        middle, moved = np.array([0.5, 0.5]), np.fmod(np.array(uv.scroll) * t, 1.0)
        matrix, offset = turn @ matrix, turn @ (offset + moved - middle) + middle
    (a, b), (c, d) = matrix.tolist()
    return (a, b, c, d), (float(offset[0]), float(offset[1]))
