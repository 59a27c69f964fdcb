"""Arguments of commands that write motion: part and rate, layers, pictures, and where to write."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studio.cli._run import as_request
from studio.errors import FileThereError, RequestError
from studio.motion import Motion
from studio.motion.motion import only_part
from studio.project import Project

if TYPE_CHECKING:
    from studio.cli._clip import Report
    from studio.playback.layers import Tuning
    from studio.render.drawing import Drawing


def add_tune(parser: argparse.ArgumentParser) -> None:
    """--tune PRESET|FILE.json."""
    parser.add_argument(
        "--tune",
        metavar="PRESET|FILE",
        help="lay a preset of Review's Tune page over the motion: one of the studio (Streaming), one of the "
        "project, or a .json file",
    )


def tuning_of(args: argparse.Namespace, project: Path | None = None) -> Tuning | None:
    """The tuning that was asked for, None for none.

    Args:
        args: the command's words.
        project: the project's folder, whose presets count too.

    Raises:
        RequestError: there is no such preset, or its file cannot be used.
    """
    if not args.tune:
        return None
    from studio.playback.layers import presets

    with as_request():
        return presets.find(args.tune, project / presets.FOLDER if project is not None else None).tuning


def add_force(parser: argparse.ArgumentParser) -> None:
    """The option that allows writing over a file."""
    parser.add_argument("--force", action="store_true", help="write over a file that is there already")


def check_free(files: Iterable[Path], force: bool, project: Project | None = None) -> None:
    """Say no before the work begins, not after it.

    Args:
        files: what will be written.
        force: a file that is there may be written over.
        project: its takes and runs are never written over.

    Raises:
        RequestError: one of the files may not be written; FileThereError: it is there already.
    """
    for file in files:
        if file.is_dir():
            raise RequestError(f"{file} is a folder.", "Name a file to write with -o.")
        place = next(folder for folder in file.absolute().parents if folder.exists())
        if not place.is_dir():
            raise RequestError(
                f"{place} is a file, not a folder.",
                "Choose another folder with -o.",
                in_window="Choose another folder.",
            )
        if not os.access(place, os.W_OK):
            raise RequestError(
                f"The folder {place} cannot be written.",
                "Choose another folder with -o.",
                in_window="Choose another folder.",
            )
        own = (project.takes_folder, project.runs_folder) if project else ()
        if any(file.resolve().is_relative_to(folder.resolve()) for folder in own):
            what = f"{file.name} would lie among the project's own takes and runs, which are never altered."
            raise _wrong_folder(what)
        if file.exists() and not force:
            remedy = "Choose another name with -o, or add --force to write over it."
            in_window = "Choose another name, or add --force to write over it."
            raise FileThereError(f"{file} is there already.", remedy, file.name, in_window=in_window)


def _wrong_folder(what: str) -> RequestError:
    return RequestError(what, "Choose another folder with -o.", in_window="Choose another folder.")


PARTS = ("all", "face", "body")


@dataclass(frozen=True)
class ExportRange:
    """What is kept of a motion and its sound.

    Args:
        part: "all", "face" (blend shapes alone) or "body" (bones alone).
        fps: frames a second; 0 leaves them as they are.
        start: seconds from the beginning.
        end: seconds from the beginning; None for all of it.
        tuning: the layers laid over it; None for none.
    """

    part: str = "all"
    fps: float = 0.0
    start: float = 0.0
    end: float | None = None
    tuning: Tuning | None = None

    @property
    def cuts(self) -> bool:
        """Whether something is left away at the beginning or the end."""
        return self.start > 0 or self.end is not None

    def motion(self, motion: Motion, name: str) -> Motion:
        """The motion that is written.

        Args:
            motion: all of it.
            name: what a sentence calls it.

        Raises:
            RequestError: nothing of it is left.
        """
        if self.tuning is not None:
            from studio.playback.layers import tuned

            motion = tuned(motion, self.tuning)
        if self.cuts:
            end = np.inf if self.end is None else np.nextafter(self.end, np.inf)
            motion = motion.between(self.start, float(end)).shifted(-self.start)
            if not len(motion):
                what = f"{name} has no motion from {self.start:g} s on."
                raise RequestError(what, f"Choose a span within its {motion.duration:.1f} s.")
        motion = only(motion, self.part, name)
        return motion.resampled(self.fps) if self.fps and len(motion) else motion

    def sound(self, audio: Path, folder: Path) -> Path:
        """The sound that goes with it: the file itself, or the wanted part of it in a folder of our own."""
        if not self.cuts:
            return audio
        from studio.sound.sound_file import Sound, read_sound, sound_info, write_sound

        whole = read_sound(audio)
        first = round(self.start * whole.sample_rate)
        last = None if self.end is None else round(self.end * whole.sample_rate)
        part = folder / f"part_{audio.stem}.wav"
        fine = "24" in sound_info(audio).encoding
        write_sound(part, Sound(whole.samples[first:last], whole.sample_rate), "PCM_24" if fine else "PCM_16")
        return part


def add_range(parser: argparse.ArgumentParser) -> None:
    """--part all|face|body, --fps N, --from S, --to S and --tune PRESET|FILE."""
    parser.add_argument("--part", choices=PARTS, default="all", help="the face or the body alone (all)")
    parser.add_argument("--fps", type=float, default=0.0, help="frame rate; the motion's own where not given")
    parser.add_argument(
        "--from", dest="start", type=float, default=0.0, metavar="S", help="seconds at which to begin (0)"
    )
    parser.add_argument("--to", dest="end", type=float, metavar="S", help="seconds at which to end")
    add_tune(parser)


def range_of(args: argparse.Namespace) -> ExportRange:
    """What was asked for.

    Raises:
        RequestError: it is not possible.
    """
    if args.fps and not 1 <= args.fps <= 1000:
        what = "The frame rate must be from 1 to 1000."
        raise RequestError(what, "Leave --fps out to keep the motion's own.")
    if not args.start >= 0 or (args.end is not None and not args.end > args.start):
        raise RequestError("The span ends before it begins.", "Choose --to later than --from.")
    return ExportRange(args.part, args.fps, args.start, args.end, tuning_of(args, args.project))


def only(motion: Motion, part: str, name: str) -> Motion:
    """The face or the body of a motion; RequestError where it has none."""
    if part == "face" and not motion.shape_names:
        raise RequestError(f"{name} has no face to export.", "Choose the body, or all of it.")
    if part == "body" and not motion.bone_names:
        raise RequestError(f"{name} has no body to export.", "Choose the face, or all of it.")
    return only_part(motion, part)


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
class RenderOptions:
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
        """These options as a `Drawing`, for a writer that draws films or stills."""
        from studio.render.camera import Orbit
        from studio.render.drawing import Drawing

        return Drawing(
            self.width, self.height, Orbit(*self.view), self.turn, fps, self.at, self.clear, self.light,
            self.avatar, report,
        )  # fmt: skip


def add_render_options(parser: argparse.ArgumentParser) -> None:
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


def render_options_of(args: argparse.Namespace) -> RenderOptions:
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
    return RenderOptions(int(wide), int(high), view, args.turn, args.at, args.clear, args.light, args.avatar)


def _numbers(text: str) -> tuple[float, float, float]:
    try:
        around, above, near = (float(part) for part in text.split(","))
    except ValueError:
        what = f"There is no view called {text}."
        raise RequestError(what, f"Choose one of {', '.join(VIEWS)}, or write AROUND,ABOVE,NEAR.") from None
    return around, above, near
