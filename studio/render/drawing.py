"""Options and painter of films and stills of a motion. No window is needed."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError
from studio.motion import Motion
from studio.motion.avatar import Avatar
from studio.render.camera import FIELD_OF_VIEW, Orbit, project, to_picture
from studio.render.face import FaceCard, laid_over
from studio.render.palette import DARK, LIGHT, Palette, rgb
from studio.render.world_pose import WorldPose

if TYPE_CHECKING:
    from studio.render.scene import RenderScene

Pixels = NDArray[np.uint8]
SMALLEST, LARGEST = 64, 3840
FACE_SHARE, LARGE_FACE_SHARE, MARGIN_SHARE = 0.3, 0.8, 0.022
"""Of the picture's shorter side: a face beside a figure, a face alone, and its distance from the edge."""
AROUND_M, DRESSED_M = 0.12, 0.3
"""Metres of a stick figure around its joints, and of an avatar with hair and clothes."""
_ON_BLACK = Palette("dark", "#000000", DARK.figure, DARK.joint, DARK.ghost, "#000000", "#000000")
_ON_WHITE = Palette("dark", "#FFFFFF", DARK.figure, DARK.joint, DARK.ghost, "#FFFFFF", "#FFFFFF")


@dataclass(frozen=True)
class Drawing:
    """How a motion is drawn.

    Args:
        width, height: pixels, SMALLEST to LARGEST.
        view: where it is seen from.
        turn: degrees a second that the camera goes around the figure.
        fps: of a film; 0 chooses 30, or 60 for a motion that has as many.
        at: seconds of a still; the middle where None.
        clear: a still without the room behind the figure.
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
    clear: bool = False
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

    Raises:
        RequestError: the size is not possible.
        StudioError: there is no OpenGL here.
    """

    def __init__(self, motion: Motion, drawing: Drawing, avatar: Avatar | None = None) -> None:
        for name, size in (("width", drawing.width), ("height", drawing.height)):
            if not SMALLEST <= size <= LARGEST:
                what = f"A picture of {size} pixels in {name} is not possible."
                raise RequestError(what, f"Choose {SMALLEST} to {LARGEST}.")
        self._motion, self._drawing = motion, drawing
        shorter, bodily = min(drawing.width, drawing.height), bool(motion.bone_names)
        # A face alone is what there is to see; beside a body it is a detail.
        share = FACE_SHARE if bodily else LARGE_FACE_SHARE
        faced = bool(motion.shape_names) and (drawing.avatar is None or not bodily)
        self._card = FaceCard(round(share * shorter), drawing.palette) if faced else None
        self._margin = round(MARGIN_SHARE * shorter)
        self._empty: Pixels | None = None
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
        picture = self._body(pose, t) if self._scene is not None else self._wall()
        if self._card is not None:
            card = self._card.draw(pose.shapes)
            x, y = self._margin, picture.shape[0] - len(card) - self._margin
            if self._scene is None:
                x, y = (picture.shape[1] - len(card)) // 2, (picture.shape[0] - len(card)) // 2
            laid_over(picture, card, x, y)
        return picture

    def _body(self, pose: WorldPose, t: float) -> Pixels:
        if not self._drawing.clear:
            picture = self._in_room(pose, t)
            picture[..., 3] = 255
            return picture
        assert self._scene is not None
        # What shows through is told by the difference between a black and a white room.
        self._scene.set_palette(_ON_BLACK)
        black = self._rendered(pose, t)[..., :3].astype(np.int16)
        self._scene.set_palette(_ON_WHITE)
        white = self._rendered(pose, t)[..., :3].astype(np.int16)
        # A point that is the same on black and on white is solid; one that differs by all is clear.
        alpha = 255 - np.clip((white - black).mean(axis=-1), 0, 255)
        colour = black * (255.0 / np.maximum(alpha, 1.0))[..., None]
        return np.dstack([np.clip(colour, 0, 255), alpha]).round().astype(np.uint8)

    def _in_room(self, pose: WorldPose, t: float) -> Pixels:
        """A picture with the room; where only its middle moves, only that is drawn anew."""
        if self._empty is None:
            picture = self._rendered(pose, t).copy()
            if self._narrow(pose) < self._drawing.width:
                # Beside the body it is the empty room.
                self._empty = picture.copy()
            return picture
        narrow = self._narrow(pose)
        if narrow == self._drawing.width:
            return self._rendered(pose, t).copy()
        picture = self._empty.copy()
        left = (self._drawing.width - narrow) // 2
        picture[:, left : left + narrow] = self._rendered(pose, t, narrow)
        return picture

    def _narrow(self, pose: WorldPose) -> int:
        """How wide a picture holds the whole body, seen from the same place: a square, or all of it."""
        drawing = self._drawing
        square = drawing.height // 2 * 2
        if drawing.turn or drawing.width < square * 1.2 or drawing.width % 2 or not pose.usable:
            return drawing.width
        assert self._scene is not None
        size = (drawing.width, drawing.height)
        seen = project(to_picture(pose.joints), drawing.view, *size, self._scene.scale)
        per_metre = drawing.height / (2 * math.tan(math.radians(FIELD_OF_VIEW / 2)))
        around = AROUND_M if drawing.avatar is None else DRESSED_M
        away = np.abs(seen[:, 0] - drawing.width / 2) + around * per_metre / seen[:, 2]
        return square if float(away.max()) < square / 2 else drawing.width

    def _rendered(self, pose: WorldPose, t: float, width: int = 0) -> Pixels:
        from studio.render.scene import BODY

        assert self._scene is not None
        drawing = self._drawing
        if pose.usable:
            self._scene.place(BODY, pose)
        view = drawing.view.turned(drawing.turn * t, 0.0) if drawing.turn else drawing.view
        return self._scene.render(view, width or drawing.width, drawing.height)

    def _wall(self) -> Pixels:
        """The room without a body: its colours from top to bottom, or nothing."""
        drawing = self._drawing
        if drawing.clear:
            return np.zeros((drawing.height, drawing.width, 4), np.uint8)
        top, low = (rgb(value).astype(np.float64) for value in (drawing.palette.sky, drawing.palette.floor))
        mix = np.linspace(0.0, 1.0, drawing.height)[:, None, None]
        rows = np.concatenate([top * (1 - mix) + low * mix, np.full((drawing.height, 1, 1), 255.0)], axis=2)
        return np.ascontiguousarray(np.broadcast_to(rows, (drawing.height, drawing.width, 4))).astype(
            np.uint8
        )


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
