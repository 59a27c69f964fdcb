"""The scene in VTK: an off-screen pyvista plotter that renders a world pose to pixels.

Everything is updated in place, nothing is multi-sampled, and before a background that stays only the
performer's own part of a picture is drawn, which makes it fast even where OpenGL runs in software. No Qt:
the window and films draw with the same code.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion.avatar import Avatar
from studio.motion.skeleton import Skeleton
from studio.motion.springs import Springs
from studio.render import body
from studio.render.actors import AvatarActor, Stick, has_body, height_of
from studio.render.camera import FACE_HEIGHT, FIELD_OF_VIEW, NOWHERE, Orbit, project, to_picture
from studio.render.palette import DARK, Palette, rgb, rgba
from studio.render.world_pose import WorldPose

FLOOR_RADIUS = 2.4
GRID_STEP = 0.3
Pixels = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class FigureLayer:
    """A part of a picture without what is behind it.

    Args:
        x, y: where its upper left corner lies, pixels.
        pixels: RGBA (h, w, 4), colours multiplied by alpha, the first row on top; a view of rows turned over.
    """

    x: int
    y: int
    pixels: Pixels


class Room:
    """Wall, floor and shadow on a pyvista plotter."""

    def __init__(self, plotter: Any, palette: Palette) -> None:
        self._plotter, self._palette = plotter, palette
        flat: dict[str, Any] = {"scalars": "colour", "rgba": True, "lighting": False}
        self._floor = plotter.add_mesh(_grid(palette), line_width=1.0, pickable=False, **flat)
        self._shadow = plotter.add_mesh(_disc(palette), **flat)
        for actor in (self._floor, self._shadow):
            # Blended over the background at once, being drawn first; the pass for translucent things
            # would copy the whole picture and take twice as long.
            actor.ForceOpaqueOn()

    def show(self, wall: bool, shadow: bool) -> None:
        """Draw wall and floor, or nothing behind the figures; and the shadow, or none."""
        self._floor.SetVisibility(wall)
        self._shadow.SetVisibility(shadow)
        renderer = self._plotter.renderer
        renderer.SetGradientBackground(wall)
        renderer.SetBackgroundAlpha(float(wall))
        for place, colour in (
            (renderer.SetBackground, self._palette.floor),
            (renderer.SetBackground2, self._palette.sky),
        ):
            place(rgb(colour) / 255.0 if wall else (0.0, 0.0, 0.0))

    def bounds(self) -> list[tuple[float, ...]]:
        """The box around the shadow, where it is seen."""
        return [self._shadow.GetBounds()] if self._shadow.GetVisibility() else []

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
SLACK = 0.05
"""Metres, at scale 1, that a head may move before a close camera goes with it: one that nods stays calm."""
ANOTHER_SIZE = 1.1
"""By how much a stick figure's size differs where it is somebody else's, and not the same one bent."""
STEP = 64
"""Pixels by which the window grows that a part is drawn in, so that it is not made anew for each picture."""


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
        window.SetAlphaBitPlanes(1)
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
        self._away, self._settled = NOWHERE, False
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
            self._settled = False

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
            whole = as_avatar and self._tall > 0.05
            self._measure(self._tall / STICK_HEIGHT if whole else scale)
            middle = joints[stick.plan.hips if stick.plan.hips >= 0 else 0]
            self._room.place_shadow(float(middle[0]), float(middle[2]), self._scale)
            if stick.plan.head >= 0:
                self._follow(joints[stick.plan.head], as_avatar)
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

    def render(self, orbit: Orbit, width: int, height: int) -> Pixels:
        """The picture (height, width, 4), RGBA, its first row at the top; a view of rows turned over."""
        self._room.show(wall=True, shadow=True)
        return self._drawn(orbit, (width, height), (0, 0, width, height))

    def room(self, orbit: Orbit, width: int, height: int, finer: float = 1.0) -> Pixels:
        """The room with nobody in it, as `render`; drawn `finer` times as large and made smaller again."""
        seen = [one for one in self._figures() if one.visible]
        for one in seen:
            one.set_visible(False)
        self._room.show(wall=True, shadow=False)
        size = round(width * finer), round(height * finer)
        pixels = _smaller(self._drawn(orbit, size, (0, 0, *size)), (width, height))
        for one in seen:
            one.set_visible(True)
        return pixels

    def figure(
        self, orbit: Orbit, width: int, height: int, finer: float = 1.0, shadow: bool = False
    ) -> FigureLayer:
        """Body and ghost of a picture without what is behind them.

        Args:
            orbit: the camera.
            width, height: of the whole picture, pixels.
            finer: drawn so many times as large and made smaller again, for smooth edges: 1, 1.5, 2 and so on.
            shadow: with the shadow on the floor.
        """
        self._room.show(wall=False, shadow=shadow)
        # Of one and a half times as many pixels every other edge lies between two.
        step = 1 if finer == int(finer) else 2
        if width % step or height % step:
            finer, step = math.ceil(finer), 1
        left, low, right, high = self._part(orbit, width, height, step)
        if left >= right or low >= high:
            return FigureLayer(0, 0, np.zeros((0, 0, 4), np.uint8))
        whole = round(width * finer), round(height * finer)
        drawn = round(left * finer), round(low * finer), round(right * finer), round(high * finer)
        pixels = self._drawn(orbit, whole, drawn)
        return FigureLayer(left, height - high, _smaller(pixels, (right - left, high - low)))

    def camera(self, orbit: Orbit) -> tuple[float, ...]:
        """What of the camera changes a picture of the same size: a room is as it was while this is."""
        eye = orbit.position(1.0, self._scale, self._face, self._away)
        return (*eye.tolist(), *orbit.target(self._scale, self._face, self._away).tolist())

    def close(self) -> None:
        """Free the OpenGL context; nothing works afterwards."""
        self._sticks.clear()
        self._avatar_actors.clear()
        self._plotter.close()

    def _measure(self, scale: float) -> None:
        """The size of the body now; who bends or stretches is as large as before."""
        if not (self._settled and 1 / ANOTHER_SIZE < scale / self._scale < ANOTHER_SIZE):
            self._scale = scale

    def _follow(self, head: NDArray[np.float64], as_avatar: bool) -> None:
        """Let a close camera go with a head at (3,) once it leaves what is framed."""
        rest = STICK_HEAD * self._scale
        if as_avatar and self._avatar is not None and "Head" in self._avatar.skeleton.bone_names:
            names = self._avatar.skeleton.bone_names
            rest = to_picture(self._avatar.rest_joints[names.index("Head")])
        away = head - rest
        off = float(np.linalg.norm(away - self._away))
        slack = SLACK * self._scale if self._settled else 0.0
        if off > slack:
            self._away = self._away + (away - self._away) * (1.0 - slack / off)
        self._settled = True

    def _figures(self) -> list[Stick | AvatarActor]:
        return [*self._sticks.values(), *self._avatar_actors.values()]

    def _part(self, orbit: Orbit, width: int, height: int, step: int) -> tuple[int, int, int, int]:
        """Pixels from the left and from below within which all is that is seen: from, from, to, to."""
        boxes = [box for one in (*self._figures(), self._room) for box in one.bounds()]
        whole = (0, 0, width, height)
        if not boxes:
            return (0, 0, 0, 0)
        ends = np.array(boxes, dtype=np.float64).reshape(-1, 3, 2)
        corners = np.stack(
            [ends[:, [0, 1, 2], [x, y, z]] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        ).reshape(-1, 3)
        seen = project(corners, orbit, width, height, self._scale, self._face, self._away)
        # Of what reaches behind the camera a projection says nothing.
        if not np.isfinite(seen).all() or seen[:, 2].min() <= 0.05 * self._scale:
            return whole
        line = max((one.line_share for one in self._avatar_actors.values()), default=0.0) * height
        around = 2 * step + line
        (left, top), (right, bottom) = seen[:, :2].min(axis=0) - around, seen[:, :2].max(axis=0) + around
        found = (
            math.floor(left / step) * step,
            math.floor((height - bottom) / step) * step,
            math.ceil(right / step) * step,
            math.ceil((height - top) / step) * step,
        )
        return (max(found[0], 0), max(found[1], 0), min(found[2], width), min(found[3], height))

    def _drawn(self, orbit: Orbit, whole: tuple[int, int], part: tuple[int, int, int, int]) -> Pixels:
        """A part of a picture of a size, both in pixels, the part from the left and from below."""
        (width, height), (left, low, right, high) = whole, part
        wide, tall = right - left, high - low
        if part != (0, 0, *whole):
            # As wide as the window is anyhow, where that is not far more.
            wide, tall = (
                now if least <= now <= min(least + 2 * STEP, most) else min(-(-least // STEP) * STEP, most)
                for least, now, most in zip((wide, tall), self._size, whole, strict=True)
            )
        x, y = min(left, width - wide), min(low, height - tall)
        if (wide, tall) != self._size:
            # It makes the window's buffers anew, so it is done only where it changes.
            self._plotter.render_window.SetSize(wide, tall)
            self._size = (wide, tall)
        for actor in self._avatar_actors.values():
            actor.set_aspect(wide / tall, tall / height)
        camera, aspect = self._plotter.camera, width / height
        # VTK's own methods: pyvista's would measure all that is seen after each of them.
        camera.SetPosition(*orbit.position(aspect, self._scale, self._face, self._away))
        camera.SetFocalPoint(*orbit.target(self._scale, self._face, self._away))
        camera.SetViewUp(0.0, 1.0, 0.0)
        # Of the whole picture's opening the part has its share, and lies beside the middle.
        half = math.tan(math.radians(FIELD_OF_VIEW / 2)) * tall / height
        camera.SetViewAngle(math.degrees(2 * math.atan(half)))
        camera.SetWindowCenter((2 * x + wide - width) / wide, (2 * y + tall - height) / tall)
        # By hand: VTK would measure all bounds again for every picture.
        camera.SetClippingRange(0.05 * self._scale, 60.0 * self._scale)
        self._plotter.render_window.Render()
        # OpenGL's rows begin at the bottom; turning the view over copies nothing.
        return self._read((left - x, low - y, right - x, high - y))[::-1]

    def _read(self, part: tuple[int, int, int, int]) -> Pixels:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray

        left, low, right, high = part
        array = vtkUnsignedCharArray()
        window = self._plotter.render_window
        window.GetRGBACharPixelData(left, low, right - 1, high - 1, 0, array)
        values: Pixels = vtk_to_numpy(array)  # type: ignore[no-untyped-call]
        return values.reshape(high - low, right - left, 4)

    def _stick(self, key: str, skeleton: Skeleton) -> Stick:
        known = self._skeletons.get(key)
        if known is None or (known.bone_names, known.parents) != (skeleton.bone_names, skeleton.parents):
            if key in self._sticks:
                self._sticks.pop(key).remove()
            self._add(key, skeleton)
        return self._sticks[key]

    def _add(self, key: str, skeleton: Skeleton) -> None:
        self._settled = self._settled and key != BODY
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


STICK_HEAD = to_picture(WorldPose.at_rest(Skeleton.humanoid(("Hips", "Head"))).joints[1])
"""Where the built-in figure's head rests."""


def _smaller(pixels: Pixels, size: tuple[int, int]) -> Pixels:
    """A picture of colours multiplied by alpha, made smaller to a width and a height."""
    wide, high = size
    if pixels.shape[1::-1] == size:
        return pixels
    from PIL import Image

    # RGBX: four numbers to be averaged. Of RGBA it would multiply the colours once more.
    image = Image.fromarray(np.ascontiguousarray(pixels), "RGBX")
    times, rest = divmod(pixels.shape[1], wide)
    if rest or times * high != pixels.shape[0]:
        return np.asarray(image.resize(size, Image.Resampling.BOX))
    return np.asarray(image.reduce(times))


def _face_height(avatar: Avatar, tall: float) -> float:
    """Metres to the middle between an avatar's neck and the top of its head, as if it were of scale 1."""
    names = avatar.skeleton.bone_names
    if "Head" not in names or tall <= 0.05:
        return FACE_HEIGHT
    neck = float(avatar.rest_joints[names.index("Head"), 1])
    return (0.6 * neck + 0.4 * tall) / tall * STICK_HEIGHT
