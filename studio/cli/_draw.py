"""How films and stills are drawn: size, view, moment, avatar."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from studio.errors import RequestError

if TYPE_CHECKING:
    from studio.cli._clip import Report
    from studio.formats._drawing import Drawing

VIEWS = {
    "front": (0.0, 4.0, 1.0),
    "three_quarter": (-32.0, 9.0, 1.0),
    "side": (-90.0, 4.0, 1.0),
    "back": (180.0, 4.0, 1.0),
    "upper": (0.0, 4.0, 0.55),
    "face": (0.0, 2.0, 0.25),
}
"""Where a figure is seen from: degrees around it and above the level, and how near."""


@dataclass(frozen=True)
class Look:
    """What was asked of films and stills.

    Args:
        width, height: pixels.
        view: degrees around the figure and above the level, and how near (1 is all of it).
        turn: degrees a second the camera goes around.
        at: seconds of a still; None for the middle.
        clear: a still without the room.
        light: in light colours.
        avatar: a .vrm; None for the stick figure.
    """

    width: int = 1280
    height: int = 720
    view: tuple[float, float, float] = VIEWS["front"]
    turn: float = 0.0
    at: float | None = None
    clear: bool = False
    light: bool = False
    avatar: Path | None = None

    def drawing(self, fps: float, report: Report) -> Drawing:
        """The same for a writer that draws."""
        from studio.formats._drawing import Drawing
        from studio.picture.camera import Orbit

        return Drawing(
            self.width, self.height, Orbit(*self.view), self.turn, fps, self.at, self.clear, self.light,
            self.avatar, report,
        )  # fmt: skip


def add_look(parser: argparse.ArgumentParser) -> None:
    """--size, --view, --turn, --at, --clear, --light and --avatar."""
    group = parser.add_argument_group("films (.mp4), stills (.png) and bodies (.glb)")
    group.add_argument("--size", default="1280x720", metavar="WxH", help="pixels (1280x720)")
    group.add_argument(
        "--view", default="front", metavar="NAME",
        help=f"one of {', '.join(VIEWS)}, or AROUND,ABOVE,NEAR in degrees, 1 being all of the body (front)",
    )  # fmt: skip
    group.add_argument(
        "--turn", type=float, default=0.0, metavar="DEG", help="go around it, degrees a second (0)"
    )
    group.add_argument("--at", type=float, metavar="S", help="the moment of a still (the middle)")
    group.add_argument("--clear", action="store_true", help="a still without the room behind the figure")
    group.add_argument("--light", action="store_true", help="in light colours")
    group.add_argument("--avatar", type=Path, metavar="VRM", help="this avatar, not the stick figure")


def look_of(args: argparse.Namespace) -> Look:
    """What was asked for.

    Raises:
        RequestError: it is not possible.
    """
    wide, _, high = args.size.lower().partition("x")
    if not (wide.isdecimal() and high.isdecimal()):
        raise RequestError(f"{args.size} is no size of a picture.", "Write it as 1280x720.")
    if args.avatar is not None and not args.avatar.is_file():
        raise RequestError(f"There is no avatar at {args.avatar}.", "Check how the path is written.")
    view = VIEWS.get(args.view) or _numbers(args.view)
    return Look(int(wide), int(high), view, args.turn, args.at, args.clear, args.light, args.avatar)


def _numbers(text: str) -> tuple[float, float, float]:
    try:
        around, above, near = (float(part) for part in text.split(","))
    except ValueError:
        what = f"There is no view called {text}."
        raise RequestError(what, f"Choose one of {', '.join(VIEWS)}, or write AROUND,ABOVE,NEAR.") from None
    return around, above, near
