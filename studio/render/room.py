"""The room a figure stands in: a floor grid that fades, and a soft shadow."""

from __future__ import annotations

from typing import Any

import numpy as np

from studio.render.palette import Palette
from studio.render.stick import rgba

FLOOR_RADIUS = 2.4
GRID_STEP = 0.3


class Room:
    """Floor and shadow on a pyvista plotter."""

    def __init__(self, plotter: Any, palette: Palette) -> None:
        self._plotter = plotter
        plotter.set_background(palette.floor, top=palette.sky)
        flat: dict[str, Any] = {"scalars": "colour", "rgba": True, "lighting": False}
        self._floor = plotter.add_mesh(_grid(palette), line_width=1.0, pickable=False, **flat)
        self._shadow = plotter.add_mesh(_disc(palette), **flat)
        for actor in (self._floor, self._shadow):
            # Blended over the background at once, being drawn first; the pass for translucent things
            # would copy the whole picture and take twice as long.
            actor.ForceOpaqueOn()

    def place_shadow(self, x: float, z: float, scale: float) -> None:
        """Put the shadow under the body."""
        self._shadow.SetPosition(x, 0.0, z)
        self._shadow.SetScale(scale)

    def remove(self) -> None:
        """Leave the stage."""
        for actor in (self._floor, self._shadow):
            self._plotter.remove_actor(actor, render=False)


def _grid(palette: Palette) -> Any:
    """Floor lines that fade with their distance from the middle."""
    import pyvista as pv

    count = int(FLOOR_RADIUS / GRID_STEP)
    step = np.arange(-count, count + 1) * GRID_STEP
    lines = [((a, b), (a, b + GRID_STEP)) for a in step for b in step[:-1]]
    lines += [((b, a), (b + GRID_STEP, a)) for a in step for b in step[:-1]]
    ends = np.array(lines).reshape(-1, 2)
    points = np.stack([ends[:, 0], np.zeros(len(ends)), ends[:, 1]], axis=1)
    cells = np.column_stack([np.full(len(lines), 2), np.arange(len(ends)).reshape(-1, 2)]).ravel()
    mesh = pv.PolyData(points, lines=cells)
    fade = np.clip(1.0 - np.linalg.norm(ends, axis=1) / FLOOR_RADIUS, 0.0, 1.0)
    mesh["colour"] = rgba(palette.line, 0.9 * fade)
    return mesh


def _disc(palette: Palette) -> Any:
    """A soft shadow under the body."""
    import pyvista as pv

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
    mesh = pv.PolyData(points, cells)
    dark = 0.5 if palette.name == "dark" else 0.25
    mesh["colour"] = rgba("#000000", dark * np.concatenate([[1.0], np.repeat([0.84, 0.4, 0.0], 32)]))
    return mesh
