"""Options and painter of films and stills of a motion. No window is needed."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, say
from studio.motion import Motion
from studio.motion.avatar import Avatar
from studio.render.background import ROOM, Background, composed
from studio.render.camera import Orbit
from studio.render.face import FaceCard, laid_over
from studio.render.palette import DARK, LIGHT, Palette
from studio.render.world_pose import WorldPose

if TYPE_CHECKING:
    from studio.render.scene import RenderScene

Pixels = NDArray[np.uint8]
SMALLEST, LARGEST = 64, 3840
FACE_SHARE, LARGE_FACE_SHARE, MARGIN_SHARE = 0.3, 0.8, 0.022
"""Of the picture's shorter side: a face beside a figure, a face alone, and its distance from the edge."""
FINER, FINEST, MOST_ACROSS = 1.5, 3.0, 8192
"""Films and stills are drawn so many times as large, for smooth edges, but across no more pixels than OpenGL
has; a film twice as large would take as long as it lasts where there is no graphics card."""


@dataclass(frozen=True)
class Drawing:
    """How a motion is drawn.

    Args:
        width, height: pixels, SMALLEST to LARGEST.
        view: where it is seen from.
        turn: degrees a second that the camera goes around the figure.
        fps: of a film; 0 chooses 30, or 60 for a motion that has as many.
        at: seconds of a still; the middle where None.
        background: what is behind the figure.
        light: in the colours of the light theme.
        avatar: a .vrm to draw in place of the stick figure.
        on_progress: told which fraction of a film is done; what it raises ends the work.
    """

    width: int = 1280
    height: int = 720
    view: Orbit = field(default_factory=lambda: Orbit.preset("front"))
    turn: float = 0.0
    fps: float = 0.0
    at: float | None = None
    background: Background = ROOM
    light: bool = False
    avatar: Path | None = None
    on_progress: Callable[[float], None] = lambda fraction: None

    @property
    def palette(self) -> Palette:
        """The colours."""
        return LIGHT if self.light else DARK


class Painter:
    """Draws a motion at any moment; use it on one thread, within `with`.

    Args:
        motion: what is drawn.
        drawing: how.
        avatar: what `drawing.avatar` holds, read by whoever knows that format; None for the stick figure.
        finer: drawn so many times as large, where that is possible.

    Raises:
        RequestError: the size is not possible.
        StudioError: there is no OpenGL here.
    """

    def __init__(
        self, motion: Motion, drawing: Drawing, avatar: Avatar | None = None, finer: float = FINER
    ) -> None:
        for name, size in (("width", drawing.width), ("height", drawing.height)):
            if not SMALLEST <= size <= LARGEST:
                what = say("A picture of {size} pixels in {name} is not possible.", size=size, name=name)
                raise RequestError(
                    what, say("Choose {smallest} to {largest}.", smallest=SMALLEST, largest=LARGEST)
                )
        self._motion, self._drawing = motion, drawing
        self._avatar, shorter = avatar, min(drawing.width, drawing.height)
        # An avatar shows a face without a body as well: it stands at rest.
        bodily = bool(motion.bone_names) or avatar is not None
        # A face alone is what there is to see; beside a body it is a detail.
        share = FACE_SHARE if bodily else LARGE_FACE_SHARE
        faced = bool(motion.shape_names) and not (avatar is not None and avatar.has_face)
        self._card = FaceCard(round(share * shorter), drawing.palette) if faced else None
        self._margin = round(MARGIN_SHARE * shorter)
        largest = MOST_ACROSS / max(drawing.width, drawing.height)
        self._finer = next((one for one in (finer, 2.0, 1.0) if one <= min(finer, largest)), 1.0)
        self._under: Pixels | None = None
        self._camera: tuple[float, ...] = ()
        # Last: nothing may fail once it is open.
        self._scene = _scene(drawing, avatar) if bodily else None

    def __enter__(self) -> Painter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._scene is not None:
            self._scene.close()

    def picture(self, t: float) -> Pixels:
        """The picture at a moment of the motion (seconds): RGBA, (height, width, 4), the first row on top."""
        pose = WorldPose.of(self._motion, t)
        picture = self._body(pose, t) if self._scene is not None else self._background().copy()
        if self._card is not None:
            card = self._card.draw(pose.shapes)
            x, y = self._margin, picture.shape[0] - len(card) - self._margin
            if self._scene is None:
                x, y = (picture.shape[1] - len(card)) // 2, (picture.shape[0] - len(card)) // 2
            laid_over(picture, card, x, y)
        return picture

    def _body(self, pose: WorldPose, t: float) -> Pixels:
        from studio.render.scene import BODY

        assert self._scene is not None
        drawing, scene = self._drawing, self._scene
        if self._avatar is not None and not len(pose.joints):
            pose = replace(WorldPose.rest_pose(self._avatar.skeleton), shapes=pose.shapes, t=t)
        if pose.usable:
            scene.place(BODY, pose)
        view = drawing.view.turned(drawing.turn * t, 0.0) if drawing.turn else drawing.view
        size, room = (drawing.width, drawing.height), drawing.background.is_room
        camera = scene.camera(view)
        if room and camera != self._camera:
            # One that goes around draws the room anew for every picture, and has no time to draw it finely.
            self._under, self._camera = (
                scene.room(view, *size, 1 if drawing.turn else self._finer).copy(),
                camera,
            )
            self._under[..., 3] = 255
        under = self._under if room and self._under is not None else self._background()
        return composed(under.copy(), scene.figure(view, *size, self._finer, shadow=room))

    def _background(self) -> Pixels:
        """What is behind the figure, without floor and shadow."""
        drawing = self._drawing
        if self._under is None:
            self._under = drawing.background.painted(drawing.width, drawing.height, drawing.palette)
        return self._under


def _scene(drawing: Drawing, avatar: Avatar | None) -> RenderScene:
    """The scene with the avatar in it."""
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        # Without a screen VTK finds this by itself, but not without a warning.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    try:
        from studio.render.scene import RenderScene

        scene = RenderScene(drawing.palette)
    except (ImportError, RuntimeError, OSError, AttributeError, ValueError) as error:
        what = "Pictures cannot be drawn on this computer: it has no OpenGL."
        raise StudioError(what, "Update the graphics driver; `saia doctor` tells more.") from error
    try:
        scene.set_avatar(avatar)
    except BaseException:
        scene.close()
        raise
    return scene
