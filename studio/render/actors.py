"""The stick figure and the avatar in VTK: meshes that are moved in place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion.avatar import Avatar, Floats, Skin, Surface, SurfaceMaterial
from studio.render import body
from studio.render.face import fitted
from studio.render.palette import Palette, rgb
from studio.render.world_pose import WorldPose

EYE = "#20242C"


class Stick:
    """One stick figure on the stage.

    Args:
        plotter: pyvista's.
        plan: what is drawn of the skeleton.
        palette: its colours.
        ghost: whether it is the see-through one in the second colour.
    """

    def __init__(self, plotter: Any, plan: body.Plan, palette: Palette, ghost: bool) -> None:
        self.plan = plan
        self._plotter = plotter
        limb, joint = (palette.ghost, palette.ghost) if ghost else (palette.figure, palette.joint)
        head_count = (1 + len(plan.eyes)) if plan.head >= 0 else 0
        self._limbs = _capsules_mesh("limb", len(plan.starts))
        self._balls = _capsules_mesh("ball", len(plan.balls))
        self._head = _capsules_mesh("ball", head_count)
        style: dict[str, Any] = {
            # Normals are given with the points; VTK would compute them anew in every frame.
            "smooth_shading": False, "opacity": 0.55 if ghost else 1.0, "ambient": 0.25, "diffuse": 0.75,
            "specular": 0.25, "specular_power": 18, "culling": "back",
        }  # fmt: skip
        self._actors: list[Any] = []
        for mesh, colour in ((self._limbs, limb), (self._balls, joint)):
            if mesh.n_points:
                self._actors.append(plotter.add_mesh(mesh, color=colour, **style))
        if head_count:
            colours = [rgb(joint)] + [rgb(EYE)] * len(plan.eyes)
            self._head["colour"] = np.repeat(colours, body.vertex_count("ball"), axis=0).astype(np.uint8)
            self._actors.append(plotter.add_mesh(self._head, scalars="colour", rgb=True, **style))
        for actor in self._actors:
            actor.prop.interpolation = "Gouraud"

    def move(self, joints: NDArray[np.float64], scale: float) -> None:
        """Stand at picture-space joints (J, 3)."""
        for mesh, (vertices, normals) in (
            (self._limbs, body.limbs(self.plan, joints, scale)),
            (self._balls, body.balls(self.plan, joints, scale)),
            (self._head, body.head(self.plan, joints, scale)),
        ):
            if len(vertices):
                move_mesh(mesh, vertices, normals)

    def set_visible(self, visible: bool) -> None:
        """Show or hide all of it."""
        for actor in self._actors:
            actor.SetVisibility(visible)

    def remove(self) -> None:
        """Leave the stage."""
        for actor in self._actors:
            self._plotter.remove_actor(actor, render=False)
        self._actors = []


def move_mesh(mesh: Any, vertices: NDArray[np.floating], normals: NDArray[np.floating]) -> None:
    """Put a mesh's points and normals elsewhere, in place."""
    # In place: a new array would be uploaded and its buffers built anew.
    mesh.points[:] = vertices
    mesh.GetPoints().Modified()
    mesh.point_data["Normals"][:] = normals
    mesh.GetPointData().GetNormals().Modified()


def _capsules_mesh(kind: str, count: int) -> Any:
    import pyvista as pv

    if not count:
        return pv.PolyData()
    vertices = np.zeros((count * body.vertex_count(kind), 3))
    mesh = pv.PolyData(vertices, body.faces(kind, count))
    mesh.point_data.active_normals = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
    return mesh


AMBIENT, DIFFUSE = 0.4, 0.5
"""Avatars are painted to be seen in an even light: a white stays just below white where the light is full."""
BODY_BONES = 8
"""Surfaces that hang from fewer bones are no body: the stick figure is drawn with them."""
SKULL = 1.12
"""The top of the built-in figure's head over the height of its head bone."""
_CUT = """//VTK::TCoord::Impl
  if (fragOutput0.a < {cutoff:.3f}) discard;
"""


class AvatarActor:
    """One avatar on the stage.

    Args:
        plotter: pyvista's.
        avatar: what is drawn.
        palette: the colours of a ghost.
        ghost: whether it is the see-through one in the second colour.
    """

    def __init__(self, plotter: Any, avatar: Avatar, palette: Palette, ghost: bool) -> None:
        self.avatar = avatar
        self._plotter = plotter
        # Opaque surfaces before masked and blended ones, which show what is behind them.
        order = sorted(range(len(avatar.surfaces)), key=lambda i: _late(avatar, i))
        self._parts: list[tuple[int, Skin, Any]] = []
        self._actors: list[Any] = []
        textures: dict[int, Any] = {}
        for i in order:
            surface = avatar.surfaces[i]
            mesh = _surface_mesh(surface)
            look = (
                {"color": palette.ghost, "opacity": 0.55} if ghost else _appearance(avatar, surface, textures)
            )
            actor = plotter.add_mesh(mesh, smooth_shading=False, ambient=AMBIENT, diffuse=DIFFUSE, **look)
            self._finish(actor, avatar.materials[surface.material], ghost)
            self._parts.append((i, avatar.skins[i], mesh))
            self._actors.append(actor)

    def move(self, pose: WorldPose) -> None:
        """Stand as a stance that this avatar wears has it."""
        assert pose.turns is not None
        placements = self.avatar.placements(pose.joints, pose.turns)
        weights = self.avatar.morph_weights(fitted(self.avatar, pose.shapes))
        for i, skin, mesh in self._parts:
            move_mesh(mesh, *skin.pose(placements, weights[i]))

    def set_visible(self, visible: bool) -> None:
        """Show or hide all of it."""
        for actor in self._actors:
            actor.SetVisibility(visible)

    def remove(self) -> None:
        """Leave the stage."""
        for actor in self._actors:
            self._plotter.remove_actor(actor, render=False)
        self._actors, self._parts = [], []

    def _finish(self, actor: Any, material: SurfaceMaterial, ghost: bool) -> None:
        actor.prop.interpolation = "Gouraud"
        if not material.two_sided or ghost:
            actor.prop.culling = "back"
        # What is see-through is drawn last, over what is there: VTK's own pass for it sorts nothing by depth
        # here and costs twice the time.
        actor.ForceOpaqueOn()
        if material.picture is not None and material.mode != "OPAQUE" and not ghost:
            cutoff = material.cutoff if material.mode == "MASK" else 0.02
            actor.GetShaderProperty().AddFragmentShaderReplacement(
                "//VTK::TCoord::Impl", False, _CUT.format(cutoff=cutoff), False
            )


def has_body(avatar: Avatar) -> bool:
    """Whether its surfaces are a body, or only things that hang from it."""
    owners = [surface.owners[np.unique(surface.joints)] for surface in avatar.surfaces]
    return len({int(owner) for part in owners for owner in part if owner >= 0}) >= BODY_BONES


def height_of(avatar: Avatar) -> float:
    """Metres from the ground to the top of an avatar at rest, by its skull where it has no body to see."""
    if not has_body(avatar):
        head = avatar.skeleton.bone_names.index("Head") if "Head" in avatar.skeleton.bone_names else 0
        return float(avatar.rest_joints[head, 1]) * SKULL
    rest = avatar.skeleton.forward(avatar.skeleton.rest_positions, avatar.skeleton.rest_rotations)
    placements = avatar.placements(*rest)
    tops = []
    for surface, skin in zip(avatar.surfaces, avatar.skins, strict=True):
        vertices, _ = skin.pose(placements, np.zeros(len(surface.morphs), np.float32))
        tops.append(float(vertices[:, 1].max()))
    return max(tops)


def _from_below(uv: Floats) -> NDArray[np.float64]:
    """Texture coordinates as VTK counts them: v from the bottom."""
    return np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]).astype(np.float64)


def _late(avatar: Avatar, surface: int) -> int:
    return ("OPAQUE", "MASK", "BLEND").index(avatar.materials[avatar.surfaces[surface].material].mode)


def _surface_mesh(surface: Surface) -> Any:
    import pyvista as pv

    faces = np.column_stack([np.full(len(surface.triangles), 3), surface.triangles]).ravel()
    mesh: Any = pv.PolyData(surface.vertices.copy(), faces)
    mesh.point_data.active_normals = surface.normals.copy()
    if surface.uv is not None:
        mesh.active_texture_coordinates = _from_below(surface.uv)
    return mesh


def _appearance(avatar: Avatar, surface: Surface, textures: dict[int, Any]) -> dict[str, Any]:
    """Colour and texture as pyvista takes them; textures are shared between surfaces."""
    import pyvista as pv

    material = avatar.materials[surface.material]
    linear = np.array(material.colour[:3])
    colour = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    look: dict[str, Any] = {"color": tuple(colour.tolist())}
    if material.mode == "BLEND" and material.colour[3] < 1.0:
        look["opacity"] = material.colour[3]
    if material.picture is not None and surface.uv is not None:
        if surface.material not in textures:
            textures[surface.material] = pv.Texture(_pixels(material))  # type: ignore[no-untyped-call]
        look["texture"] = textures[surface.material]
    return look


def _pixels(material: SurfaceMaterial) -> NDArray[np.uint8]:
    assert material.picture is not None
    # Without alpha where the material says it is opaque: some textures carry nonsense in it.
    pixels = material.picture[:, :, :3] if material.mode == "OPAQUE" else material.picture
    return np.ascontiguousarray(pixels)
