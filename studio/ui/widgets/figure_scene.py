"""The figure's stage in VTK: an off-screen pyvista plotter read into an image.

Everything is updated in place and nothing is multi-sampled, which makes it fast even where OpenGL
runs in software.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage

from studio.motion.skeleton import Skeleton
from studio.ui import theme
from studio.ui.widgets import figure_body as body
from studio.ui.widgets.figure_camera import FIELD_OF_VIEW, Orbit, to_picture

if TYPE_CHECKING:
    import pyvista as pv

FLOOR_RADIUS = 2.4
GRID_STEP = 0.3


class Figure:
    """One figure on the stage: its meshes, moved in place."""

    def __init__(self, plotter: Any, plan: body.Plan, tokens: tuple[str, str], opacity: float) -> None:
        self.plan = plan
        self._plotter = plotter
        limb_colour, joint_colour = tokens
        colours = theme.colours()
        head_count = (1 + len(plan.eyes)) if plan.head >= 0 else 0
        self._limbs = _mesh("limb", len(plan.starts))
        self._balls = _mesh("ball", len(plan.balls))
        self._head = _mesh("ball", head_count)
        style: dict[str, Any] = {
            "smooth_shading": False, "opacity": opacity, "ambient": 0.25, "diffuse": 0.75,
            "specular": 0.25, "specular_power": 18, "culling": "back",
        }  # fmt: skip
        self._actors: list[Any] = []
        for mesh, colour in ((self._limbs, limb_colour), (self._balls, joint_colour)):
            if mesh.n_points:
                self._actors.append(plotter.add_mesh(mesh, color=getattr(colours, colour), **style))
        if head_count:
            rgb = np.repeat(
                [_rgb(getattr(colours, joint_colour))] + [_rgb("#20242C")] * len(plan.eyes),
                body.vertex_count("ball"),
                axis=0,
            )
            self._head["colour"] = rgb.astype(np.uint8)
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
                mesh.points[:] = vertices
                mesh.GetPoints().Modified()
                mesh.point_data["Normals"][:] = normals
                mesh.GetPointData().GetNormals().Modified()

    def set_visible(self, visible: bool) -> None:
        """Show or hide all of it."""
        for actor in self._actors:
            actor.SetVisibility(visible)

    def remove(self) -> None:
        """Leave the stage."""
        for actor in self._actors:
            self._plotter.remove_actor(actor, render=False)
        self._actors = []


class FigureScene:
    """The stage: floor, light, the figure and its ghost. Build it and call it on the GUI thread.

    The import of pyvista and the first picture take about a second each on a slow machine; see
    StickFigure.warm_up.
    """

    def __init__(self) -> None:
        import pyvista as pv

        self._pv = pv
        self._plotter: Any = pv.Plotter(off_screen=True, window_size=[640, 480], lighting="none")
        window: Any = self._plotter.render_window
        window.SetMultiSamples(0)
        self._plotter.camera.view_angle = FIELD_OF_VIEW
        self._light()
        self._skeletons: dict[str, Skeleton] = {}
        self._figures: dict[str, Figure] = {}
        self._scale = 1.0
        self._floor: list[Any] = []
        self._shadow: Any = None
        self._size = (640, 480)
        self.restyle()

    def restyle(self) -> None:
        """Take on the colours of the theme."""
        colours = theme.colours()
        self._plotter.set_background(colours.floor, top=colours.sky)
        for actor in self._floor:
            self._plotter.remove_actor(actor, render=False)
        self._floor = [self._plotter.add_mesh(self._grid(), scalars="colour", rgba=True, lighting=False,
                                              line_width=1.0, pickable=False)]  # fmt: skip
        disc = self._disc()
        self._shadow = self._plotter.add_mesh(disc, scalars="colour", rgba=True, lighting=False)
        self._floor.append(self._shadow)
        for actor in self._floor:
            # Blended over the background at once, being drawn first; the pass for translucent things
            # would copy the whole picture and take twice as long.
            actor.ForceOpaqueOn()
        for key, skeleton in list(self._skeletons.items()):
            self._figures.pop(key).remove()
            self._add(key, skeleton)

    def place(self, key: str, skeleton: Skeleton, world: NDArray[np.floating]) -> None:
        """Put "body" or "ghost" at Unity-space world joints (J, 3)."""
        known = self._skeletons.get(key)
        if known is None or (known.bone_names, known.parents) != (skeleton.bone_names, skeleton.parents):
            if key in self._figures:
                self._figures.pop(key).remove()
            self._add(key, skeleton)
        figure = self._figures[key]
        joints = to_picture(world)
        scale = figure.plan.scale(joints)
        if key == "body":
            self._scale = scale
            middle = joints[figure.plan.hips if figure.plan.hips >= 0 else 0]
            self._shadow.SetPosition(middle[0], 0.0, middle[2])
            self._shadow.SetScale(scale)
        figure.move(joints, scale)
        figure.set_visible(True)

    def rehearse(self, width: int, height: int) -> None:
        """Draw everything once unseen: OpenGL prepares its programs, which takes as long as the rest."""
        skeleton = Skeleton.humanoid()
        world, _ = skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations)
        for key in ("body", "ghost"):
            self.place(key, skeleton, world)
        self.render(Orbit(), width, height)
        for key in ("body", "ghost"):
            self.hide(key)

    def hide(self, key: str) -> None:
        """Take "body" or "ghost" out of the picture."""
        if key in self._figures:
            self._figures[key].set_visible(False)

    def render(self, orbit: Orbit, width: int, height: int) -> QImage:
        """The picture in device pixels."""
        if (width, height) != self._size:
            self._plotter.render_window.SetSize(width, height)
            self._size = (width, height)
        camera = self._plotter.camera
        camera.position = tuple(orbit.position(width / height, self._scale))
        camera.focal_point = tuple(orbit.target(self._scale))
        camera.up = (0.0, 1.0, 0.0)
        camera.clipping_range = (0.05 * self._scale, 60.0 * self._scale)
        window = self._plotter.render_window
        window.Render()
        pixels = self._read(window, width, height)
        # OpenGL's first row is the lowest; flipped() also copies, so VTK may reuse its memory.
        return QImage(pixels, width, height, width * 4, QImage.Format.Format_RGBX8888).flipped()

    def close(self) -> None:
        """Free the OpenGL context; nothing works afterwards."""
        self._figures.clear()
        self._plotter.close()

    def _read(self, window: Any, width: int, height: int) -> memoryview:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        array = vtkUnsignedCharArray()
        window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, array)
        values: NDArray[np.uint8] = vtk_to_numpy(array)  # type: ignore[no-untyped-call]
        return values.ravel().data

    def _add(self, key: str, skeleton: Skeleton) -> None:
        tokens = ("ghost", "ghost") if key == "ghost" else ("figure", "joint")
        plan = body.Plan.of(skeleton)
        self._figures[key] = Figure(self._plotter, plan, tokens, 0.55 if key == "ghost" else 1.0)
        self._skeletons[key] = skeleton

    def _light(self) -> None:
        for position, intensity in (
            ((-1.2, 1.6, 2.0), 0.85),
            ((2.0, 0.6, 1.2), 0.35),
            ((0.3, 1.5, -2.0), 0.5),
        ):
            light = self._pv.Light(light_type="camera light", intensity=intensity)
            light.position = position
            light.focal_point = (0.0, 0.0, 0.0)
            self._plotter.add_light(light)

    def _grid(self) -> pv.PolyData:
        """Floor lines that fade with their distance from the middle."""
        count = int(FLOOR_RADIUS / GRID_STEP)
        step = np.arange(-count, count + 1) * GRID_STEP
        lines = [((a, b), (a, b + GRID_STEP)) for a in step for b in step[:-1]]
        lines += [((b, a), (b + GRID_STEP, a)) for a in step for b in step[:-1]]
        ends = np.array(lines).reshape(-1, 2)
        points = np.stack([ends[:, 0], np.zeros(len(ends)), ends[:, 1]], axis=1)
        cells = np.column_stack([np.full(len(lines), 2), np.arange(len(ends)).reshape(-1, 2)]).ravel()
        mesh = self._pv.PolyData(points, lines=cells)
        fade = np.clip(1.0 - np.linalg.norm(ends, axis=1) / FLOOR_RADIUS, 0.0, 1.0)
        mesh["colour"] = _rgba(theme.colours().line, 0.9 * fade)
        return mesh

    def _disc(self) -> pv.PolyData:
        """A soft shadow under the body."""
        around = np.arange(32) * 2 * np.pi / 32
        radii = np.array([0.12, 0.24, 0.42])
        ring = np.stack([np.cos(around), np.zeros(32), np.sin(around)], axis=1)
        points = np.concatenate([[[0.0, 0.002, 0.0]], *(ring * r + [0.0, 0.002, 0.0] for r in radii)])
        triangles = [(0, 1 + i, 1 + (i + 1) % 32) for i in range(32)]
        for r in range(2):
            for i in range(32):
                a, b = 1 + r * 32 + i, 1 + r * 32 + (i + 1) % 32
                triangles += [(a, a + 32, b + 32), (a, b + 32, b)]
        cells = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
        mesh = self._pv.PolyData(points, cells)
        dark = 0.5 if theme.colours().name == "dark" else 0.25
        mesh["colour"] = _rgba("#000000", dark * np.concatenate([[1.0], np.repeat([0.84, 0.4, 0.0], 32)]))
        return mesh


def _mesh(kind: str, count: int) -> Any:
    import pyvista as pv

    if not count:
        return pv.PolyData()
    vertices = np.zeros((count * body.vertex_count(kind), 3))
    mesh = pv.PolyData(vertices, body.faces(kind, count))
    mesh.point_data.active_normals = np.tile([0.0, 0.0, 1.0], (len(vertices), 1))
    return mesh


def _rgb(value: str) -> NDArray[np.uint8]:
    return np.array([int(value[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.uint8)


def _rgba(value: str, alpha: NDArray[np.floating]) -> NDArray[np.uint8]:
    rgb = np.tile(_rgb(value), (len(alpha), 1))
    return np.column_stack([rgb, (alpha * 255).astype(np.uint8)]).astype(np.uint8)
