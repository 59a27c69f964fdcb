"""The scene in VTK: an off-screen pyvista plotter that renders a world pose to pixels.

Everything is updated in place and nothing is multi-sampled, which makes it fast even where OpenGL
runs in software. No Qt: the window and the MP4 export draw with the same code.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion.avatar import Avatar
from studio.motion.skeleton import Skeleton
from studio.motion.springs import Springs
from studio.render import body
from studio.render.actors import AvatarActor, Stick, has_body, height_of
from studio.render.camera import FACE_HEIGHT, FIELD_OF_VIEW, Orbit, to_picture
from studio.render.palette import DARK, Palette, rgba
from studio.render.world_pose import WorldPose

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


BODY, GHOST = "body", "ghost"
STICK_HEIGHT = 1.67
"""Metres from the ground to the top of the built-in stick figure: what cameras are set for."""


class RenderScene:
    """The stage: floor, light, a body and its ghost. Build it, call it and close it on one thread.

    Off screen, e.g. for a film:

        with Scene() as scene:
            scene.set_avatar(formats.read_avatar(path))     # or None, or leave it: a stick figure
            for t in times:
                scene.place(BODY, Stance.of(motion, t))
                pixels = scene.render(Orbit.preset("front"), 1280, 720)

    The import of pyvista and the first picture take about a second each on a slow machine.

    Raises:
        RuntimeError, OSError, ImportError: there is no OpenGL here.
    """

    def __init__(self, palette: Palette = DARK) -> None:
        import pyvista as pv

        self._pv, self._palette = pv, palette
        self._plotter: Any = pv.Plotter(off_screen=True, window_size=[640, 480], lighting="none")
        window: Any = self._plotter.render_window
        window.SetMultiSamples(0)
        self._plotter.camera.view_angle = FIELD_OF_VIEW
        self._light()
        self._skeletons: dict[str, Skeleton] = {}
        self._sticks: dict[str, Stick] = {}
        self._avatar: Avatar | None = None
        self._avatar_actors: dict[str, AvatarActor] = {}
        # Kept while actors come and go: what swings must not begin anew with other colours.
        self._springs: dict[str, Springs] = {}
        self._tall, self._covered = 0.0, False
        self._scale, self._face = 1.0, FACE_HEIGHT
        # Setting the size makes the window's buffers anew, so it is done only where it changes.
        self._size = (640, 480)
        self._room = Room(self._plotter, palette)

    def __enter__(self) -> RenderScene:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def scale(self) -> float:
        """How tall the body is, 1 for the built-in one; the camera stands as far away as that asks for."""
        return self._scale

    def set_palette(self, palette: Palette) -> None:
        """Take on other colours."""
        self._palette = palette
        self._room.remove()
        self._room = Room(self._plotter, palette)
        for key, skeleton in list(self._skeletons.items()):
            self._sticks.pop(key).remove()
            self._add(key, skeleton)
        self._remove_avatars()

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Draw an avatar from the next `place` on; None for the stick figure.

        An avatar without a body to see is a stick figure of its proportions, beside what meshes it has.
        """
        if avatar is not self._avatar:
            self._avatar = avatar
            self._remove_avatars()
            self._springs = {}
            self._tall = height_of(avatar) if avatar is not None else 0.0
            self._covered = avatar is not None and has_body(avatar)
            self._face = _face_height(avatar, self._tall) if avatar is not None else FACE_HEIGHT

    def place(self, key: str, pose: WorldPose) -> None:
        """Put the BODY or the GHOST somewhere: as the avatar where the stance has turns."""
        as_avatar = self._avatar is not None and pose.turns is not None
        if self._avatar is not None and as_avatar:
            pose = pose.retargeted_to(self._avatar)
            if self._avatar.surfaces:
                self._avatar_actor(key).move(pose, self._springs_of(key))
                self._avatar_actors[key].set_visible(True)
        stick = self._stick(key, pose.skeleton)
        joints = to_picture(pose.joints)
        scale = stick.plan.scale(joints)
        if key == BODY:
            self._scale = self._tall / STICK_HEIGHT if as_avatar and self._tall > 0.05 else scale
            middle = joints[stick.plan.hips if stick.plan.hips >= 0 else 0]
            self._room.place_shadow(float(middle[0]), float(middle[2]), self._scale)
        if not (as_avatar and self._covered):
            stick.move(joints, scale)
        stick.set_visible(not (as_avatar and self._covered))

    def hide(self, key: str) -> None:
        """Take the BODY or the GHOST out of the picture."""
        self._springs.pop(key, None)
        for shown in (self._sticks, self._avatar_actors):
            if key in shown:
                shown[key].set_visible(False)

    def warm_up(self, width: int, height: int) -> None:
        """Draw everything once unseen: OpenGL prepares its programs, which takes as long as the rest."""
        for key in (BODY, GHOST):
            self.place(key, WorldPose.at_rest(Skeleton.humanoid()))
        self.render(Orbit(), width, height)
        for key in (BODY, GHOST):
            self.hide(key)

    def render(self, orbit: Orbit, width: int, height: int) -> NDArray[np.uint8]:
        """The picture (height, width, 4), RGBA, its first row at the top; a view of rows turned over."""
        if (width, height) != self._size:
            self._plotter.render_window.SetSize(width, height)
            self._size = (width, height)
        for actor in self._avatar_actors.values():
            actor.set_aspect(width / height)
        camera = self._plotter.camera
        camera.position = tuple(orbit.position(width / height, self._scale, self._face))
        camera.focal_point = tuple(orbit.target(self._scale, self._face))
        camera.up = (0.0, 1.0, 0.0)
        # By hand: VTK would measure all bounds again for every picture.
        camera.clipping_range = (0.05 * self._scale, 60.0 * self._scale)
        window = self._plotter.render_window
        window.Render()
        # OpenGL's rows begin at the bottom; turning the view over copies nothing.
        return self._read(window, width, height)[::-1]

    def close(self) -> None:
        """Free the OpenGL context; nothing works afterwards."""
        self._sticks.clear()
        self._avatar_actors.clear()
        self._plotter.close()

    def _read(self, window: Any, width: int, height: int) -> NDArray[np.uint8]:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        array = vtkUnsignedCharArray()
        window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, array)
        values: NDArray[np.uint8] = vtk_to_numpy(array)  # type: ignore[no-untyped-call]
        return values.reshape(height, width, 4)

    def _stick(self, key: str, skeleton: Skeleton) -> Stick:
        known = self._skeletons.get(key)
        if known is None or (known.bone_names, known.parents) != (skeleton.bone_names, skeleton.parents):
            if key in self._sticks:
                self._sticks.pop(key).remove()
            self._add(key, skeleton)
        return self._sticks[key]

    def _add(self, key: str, skeleton: Skeleton) -> None:
        self._sticks[key] = Stick(self._plotter, body.Plan.of(skeleton), self._palette, key == GHOST)
        self._skeletons[key] = skeleton

    def _avatar_actor(self, key: str) -> AvatarActor:
        assert self._avatar is not None
        if key not in self._avatar_actors:
            self._avatar_actors[key] = AvatarActor(self._plotter, self._avatar, self._palette, key == GHOST)
        return self._avatar_actors[key]

    def _springs_of(self, key: str) -> Springs | None:
        rig = self._avatar.rig if self._avatar is not None else None
        if rig is None or not rig.joints:
            return None
        if key not in self._springs:
            self._springs[key] = Springs(rig)
        return self._springs[key]

    def _remove_avatars(self) -> None:
        for actor in self._avatar_actors.values():
            actor.remove()
        self._avatar_actors = {}

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


def _face_height(avatar: Avatar, tall: float) -> float:
    """Metres to the middle between an avatar's neck and the top of its head, as if it were of scale 1."""
    names = avatar.skeleton.bone_names
    if "Head" not in names or tall <= 0.05:
        return FACE_HEIGHT
    neck = float(avatar.rest_joints[names.index("Head"), 1])
    return (0.6 * neck + 0.4 * tall) / tall * STICK_HEIGHT
