"""Which formats, how pictures are drawn, and which files may be written."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from studio.errors import FileThereError, RequestError, say

if TYPE_CHECKING:
    from studio.project import Project
    from studio.render.drawing import Drawing

VIEWS = {
    "front": (0.0, 4.0, 1.0),
    "three_quarter": (-32.0, 9.0, 1.0),
    "side": (-90.0, 4.0, 1.0),
    "back": (180.0, 4.0, 1.0),
    "upper": (0.0, 4.0, 0.55),
    "bust": (0.0, 4.0, 0.5),
    "face": (0.0, 2.0, 0.25),
}
"""Where a figure is seen from: degrees around it and above the level, and how near."""


@dataclass(frozen=True)
class RenderOptions:
    """How films and stills are drawn.

    Args:
        width, height: pixels.
        view: degrees around the figure and above the level, and how near (1 is all of it).
        turn: degrees a second the camera goes around.
        at: seconds of a still; None for the middle.
        background: what is behind the figure, as `render.background` has it.
        light: in light colours.
        avatar: a .vrm; None for the stick figure.
    """

    width: int = 1280
    height: int = 720
    view: tuple[float, float, float] = VIEWS["front"]
    turn: float = 0.0
    at: float | None = None
    background: str = "room"
    light: bool = False
    avatar: Path | None = None

    def drawing(self, fps: float, report: Callable[[float], None]) -> Drawing:
        """These options as a `Drawing`, for a writer that draws films or stills."""
        from studio.render.background import Background
        from studio.render.camera import Orbit
        from studio.render.drawing import Drawing

        return Drawing(
            self.width, self.height, Orbit(*self.view), self.turn, fps, self.at,
            Background.parse(self.background), self.light, self.avatar, report,
        )  # fmt: skip

    def args(self) -> list[str]:
        """The arguments by which `saia export` draws like this."""
        args = [f"--size={self.width}x{self.height}"]
        args.append("--view=" + ",".join(f"{value:.3f}" for value in self.view))
        args += [f"--turn={self.turn:g}"] if self.turn else []
        args += [f"--at={self.at:.4f}"] if self.at is not None else []
        args += [f"--background={self.background}"] if self.background != "room" else []
        args += ["--light"] if self.light else []
        return args + (["--avatar", str(self.avatar)] if self.avatar is not None else [])


@dataclass(frozen=True)
class FormatChoice:
    """A format that can be written: its name, what a menu calls it, its ending, and what it leaves out.

    With `bones_only` it holds nothing of a face.
    """

    name: str
    title: str
    suffix: str
    note: str
    bones_only: bool = False


# What avatar programs and animation programs read, then tables, then pictures; the rest by title.
_FIRST = ("vrma", "bvh", "saia_csv", "mp4", "webm", "frames", "png")


def format_choices() -> list[FormatChoice]:
    """The formats that can be written, those requested most first."""
    from studio import formats

    found = [
        FormatChoice(name, m.TITLE, formats.written_suffix(m), m.NOTE, bool(getattr(m, "BONES_ONLY", False)))
        for name, m in formats.writers().items()
    ]
    rank = {name: number for number, name in enumerate(_FIRST)}
    return sorted(found, key=lambda choice: (rank.get(choice.name, len(rank)), choice.title))


def writers_named(text: str) -> list[ModuleType]:
    """The writers in a list such as "vrma,bvh", by their name or by the ending of their files.

    Raises:
        RequestError: one of them is not known.
    """
    from studio import formats

    writers = formats.writers()
    # People know formats by the ending of their files rather than by our names.
    endings = {formats.written_suffix(module).lstrip("."): module for module in writers.values()}
    found: list[ModuleType] = []
    for name in filter(None, (part.strip().lower().lstrip(".") for part in text.split(","))):
        module = writers.get(name) or endings.get(name)
        if module is None:
            what = say("There is no format {name} to write.", name=name)
            raise RequestError(what, say("Choose from: {formats}.", formats=", ".join(sorted(writers))))
        # `vrma,VRMA` names one file.
        if module not in found:
            found.append(module)
    if not found:
        raise RequestError(
            "No format was named.", say("Choose from: {formats}.", formats=", ".join(sorted(writers)))
        )
    return found


def wrong_folder(what: str) -> RequestError:
    """Files cannot be written where they were asked for."""
    return RequestError(what, "Choose another folder with -o.", in_window="Choose another folder.")


def check_writable(files: Iterable[Path], force: bool, project: Project | None = None) -> None:
    """Refuse before the work begins, not after it.

    Args:
        files: what will be written.
        force: a file that is there may be written over.
        project: its takes and runs are never written over.

    Raises:
        RequestError: one of the files may not be written; FileThereError: it is there already.
    """
    for file in files:
        if file.is_dir():
            raise RequestError(say("{file} is a folder.", file=file), "Name a file to write with -o.")
        # Missing folders are made later, so the nearest one that exists decides.
        place = next(folder for folder in file.absolute().parents if folder.exists())
        if not place.is_dir():
            raise wrong_folder(say("{place} is a file, not a folder.", place=place))
        if not os.access(place, os.W_OK):
            raise wrong_folder(say("The folder {place} cannot be written.", place=place))
        own = (project.takes_folder, project.runs_folder) if project else ()
        # Resolved: a link into the takes folder would let an export alter a recording.
        if any(file.resolve().is_relative_to(folder.resolve()) for folder in own):
            what = say(
                "{file} would lie among the project's own takes and runs, which are never altered.",
                file=file.name,
            )
            raise wrong_folder(what)
        if file.exists() and not force:
            remedy = "Choose another name with -o, or add --force to write over it."
            # In the window a field holds the name, and no option.
            in_window = "Choose another name, or add --force to write over it."
            raise FileThereError(
                say("{file} is there already.", file=file), remedy, file.name, in_window=in_window
            )
