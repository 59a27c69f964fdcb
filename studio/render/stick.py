"""The stick figure in VTK: its meshes, moved in place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.render import body
from studio.render.palette import Palette

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
        self._limbs = _mesh("limb", len(plan.starts))
        self._balls = _mesh("ball", len(plan.balls))
        self._head = _mesh("ball", head_count)
        style: dict[str, Any] = {
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
    mesh.points[:] = vertices
    mesh.GetPoints().Modified()
    mesh.point_data["Normals"][:] = normals
    mesh.GetPointData().GetNormals().Modified()


def rgb(value: str) -> NDArray[np.uint8]:
    """ "#RRGGBB" as three numbers."""
    return np.array([int(value[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.uint8)


def rgba(value: str, alpha: NDArray[np.floating]) -> NDArray[np.uint8]:
    """ "#RRGGBB" with alphas 0..1 (N,) as (N, 4)."""
    colour = np.tile(rgb(value), (len(alpha), 1))
    return np.column_stack([colour, (alpha * 255).astype(np.uint8)]).astype(np.uint8)


def _mesh(kind: str, count: int) -> Any:
    import pyvista as pv

    if not count:
        return pv.PolyData()
    vertices = np.zeros((count * body.vertex_count(kind), 3))
    mesh = pv.PolyData(vertices, body.faces(kind, count))
    mesh.point_data.active_normals = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
    return mesh
