"""The stick figure and the avatar in VTK: meshes that are moved in place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion.avatar import Avatar, Floats, Skin, Surface
from studio.motion.springs import Springs
from studio.render import body
from studio.render.face import fitted
from studio.render.palette import Palette, rgb
from studio.render.toon import LINE_SHARE, SurfaceShader, Textures, line_shares
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

    def bounds(self) -> list[tuple[float, ...]]:
        """Boxes around what is seen of it: x, y and z from and to, metres."""
        return [actor.GetBounds() for actor in self._actors if actor.GetVisibility()]

    @property
    def visible(self) -> bool:
        """Whether any of it is shown."""
        return any(actor.GetVisibility() for actor in self._actors)

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


BODY_SHARE = 0.3
"""Surfaces that reach over less of an avatar's height are no body, but things that hang from one."""
SKULL = 1.12
"""The top of the built-in figure's head over the height of its head bone."""


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
        self._parts: list[tuple[int, Skin, Any]] = []
        self._actors: list[Any] = []
        self._shaders: list[SurfaceShader] = []
        toons = [material.toon for material in avatar.materials]
        self._outlines = [toon.outline for toon in toons if toon is not None and toon.outline is not None]
        self._changing: list[tuple[int, SurfaceShader]] = []
        textures = Textures()
        # Opaque surfaces before masked and blended ones, which show what is behind them.
        for i in sorted(range(len(avatar.surfaces)), key=lambda i: _late(avatar, i)):
            surface, material = avatar.surfaces[i], avatar.materials[avatar.surfaces[i].material]
            mesh = _surface_mesh(surface)
            self._parts.append((i, avatar.skins[i], mesh))
            if ghost:
                self._add(mesh, color=palette.ghost, opacity=0.55, culling="back")
                continue
            outlined = material.toon is not None and material.toon.outline is not None
            for outline in (False, True)[: 1 + outlined]:
                actor = self._add(mesh)
                textured = surface.uv is not None
                line = material.toon.outline if outline and material.toon is not None else None
                if line is not None and line.widths is not None and surface.uv is not None:
                    mesh.point_data[LINE_SHARE] = line_shares(line.widths, surface.uv)
                    actor.GetMapper().MapDataArrayToVertexAttribute(LINE_SHARE, LINE_SHARE, 0, -1)
                parts = avatar.changing_parts.get(surface.material, frozenset())
                shader = SurfaceShader(actor, material, textures, textured, outline, parts)
                self._shaders.append(shader)
                if parts:
                    self._changing.append((surface.material, shader))
                if outline or not material.two_sided:
                    actor.prop.culling = "front" if outline else "back"

    def _add(self, mesh: Any, **look: Any) -> Any:
        import pyvista as pv
        from vtkmodules.vtkRenderingCore import vtkPolyDataMapper

        mapper: Any = vtkPolyDataMapper()
        mapper.SetInputData(mesh)
        mapper.ScalarVisibilityOff()
        # As it is: an outline's width is in metres.
        mapper.SetVBOShiftScaleMethod(0)
        actor: Any = pv.Actor()
        actor.SetMapper(mapper)
        for name, value in {"ambient": 0.4, "diffuse": 0.5, "interpolation": "Gouraud", **look}.items():
            setattr(actor.prop, name, value)
        # What is see-through is drawn last, over what is there: VTK's own pass for it sorts nothing by depth
        # here and costs twice the time.
        actor.ForceOpaqueOn()
        self._plotter.add_actor(actor, reset_camera=False, render=False)
        self._actors.append(actor)
        return actor

    def move(self, pose: WorldPose, springs: Springs | None = None) -> None:
        """Stand as a stance that this avatar wears has it, with what swings from it."""
        assert pose.turns is not None
        placements = self.avatar.placements(pose.joints, pose.turns)
        if springs is not None:
            placements = springs.moved(placements, pose.t)
        shapes = fitted(self.avatar, pose.shapes)
        weights = self.avatar.morph_weights(shapes)
        for i, skin, mesh in self._parts:
            move_mesh(mesh, *skin.pose(placements, weights[i]))
        values = self.avatar.material_values(shapes) if self._changing else {}
        for material, shader in self._changing:
            shader.set_values(values[material], pose.t)
        for shader in self._shaders:
            if shader.moves:
                shader.set_time(pose.t)

    def bounds(self) -> list[tuple[float, ...]]:
        """Boxes around what is seen of it with its lines: x, y and z from and to, metres."""
        if not self.visible:
            return []
        line = max((one.width for one in self._outlines if not one.on_screen), default=0.0)
        grown = np.tile([-line, line], 3)
        return [tuple(mesh.GetPoints().GetBounds() + grown) for _, _, mesh in self._parts]

    @property
    def line_share(self) -> float:
        """Of the picture's height that its lines on the screen are wide."""
        return max((one.width for one in self._outlines if one.on_screen), default=0.0)

    def set_aspect(self, aspect: float, share: float = 1.0) -> None:
        """Of what is drawn, as `SurfaceShader.set_aspect`: outlines may be as wide wherever they are."""
        for shader in self._shaders:
            shader.set_aspect(aspect, share)

    @property
    def visible(self) -> bool:
        """Whether any of it is shown."""
        return any(actor.GetVisibility() for actor in self._actors)

    def set_visible(self, visible: bool) -> None:
        """Show or hide all of it."""
        for actor in self._actors:
            actor.SetVisibility(visible)

    def remove(self) -> None:
        """Leave the stage."""
        for actor in self._actors:
            self._plotter.remove_actor(actor, render=False)
        self._actors, self._parts, self._shaders, self._changing = [], [], [], []


def has_body(avatar: Avatar) -> bool:
    """Whether its surfaces are a body, or only things that hang from it."""
    low, high = _reach(avatar)
    return high - low > BODY_SHARE * max(_skull(avatar), 0.05)


def height_of(avatar: Avatar) -> float:
    """Metres from the ground to the top of an avatar at rest, by its skull where it has no body to see."""
    return _reach(avatar)[1] if has_body(avatar) else _skull(avatar)


def _skull(avatar: Avatar) -> float:
    names = avatar.skeleton.bone_names
    return float(avatar.rest_joints[names.index("Head") if "Head" in names else 0, 1]) * SKULL


def _reach(avatar: Avatar) -> tuple[float, float]:
    """The lowest and the highest point of an avatar's surfaces at rest, metres; 0, 0 without any."""
    rest = avatar.skeleton.forward(avatar.skeleton.rest_positions, avatar.skeleton.rest_rotations)
    placements = avatar.placements(*rest)
    heights = [
        skin.pose(placements, np.zeros(len(surface.morphs), np.float32))[0][:, 1]
        for surface, skin in zip(avatar.surfaces, avatar.skins, strict=True)
    ]
    ends = [(float(y.min()), float(y.max())) for y in heights if len(y)]
    return (min(low for low, _ in ends), max(high for _, high in ends)) if ends else (0.0, 0.0)


def _from_below(uv: Floats) -> NDArray[np.float64]:
    """Texture coordinates as VTK counts them: v from the bottom."""
    return np.column_stack([uv[:, 0], 1.0 - uv[:, 1]]).astype(np.float64)


def _late(avatar: Avatar, surface: int) -> tuple[int, int]:
    material = avatar.materials[avatar.surfaces[surface].material]
    return ("OPAQUE", "MASK", "BLEND").index(material.mode), material.order


def _surface_mesh(surface: Surface) -> Any:
    import pyvista as pv

    faces = np.column_stack([np.full(len(surface.triangles), 3), surface.triangles]).ravel()
    mesh: Any = pv.PolyData(surface.vertices.copy(), faces)
    mesh.point_data.active_normals = surface.normals.copy()
    if surface.uv is not None:
        mesh.active_texture_coordinates = _from_below(surface.uv)
    return mesh
