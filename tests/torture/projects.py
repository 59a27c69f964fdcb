"""A small project with everything in it, and whether it is still whole."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tests.torture import children
from tests.torture.cases import Outcome

if TYPE_CHECKING:
    from studio.take import Take

NAME, RUN = "Toy", "quick_001"
LEFT = ("*.new", "*.partial", "*.tmp")
"""What is called so was meant to be renamed or removed."""


def make(shared: Path) -> Path:
    """The project of all trials, copied into one's material: three takes and a trained run."""
    common = shared.parent.parent / "common"
    if not common.is_dir():
        common.mkdir(parents=True)
        children.apart(lambda: _made(common), common / "console")
    return copied(common / NAME, shared)


def _made(folder: Path) -> None:
    from studio.training.loop.train import train
    from studio.training.recipe import load_recipe
    from tests import toys

    project = toys.make(folder / NAME, seconds=3.0)
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=2"])
    train(project, recipe, on_event=lambda event: None)


def copied(project: Path, place: Path) -> Path:
    """A copy to work on."""
    return Path(shutil.copytree(project, place / project.name))


def contents(folder: Path) -> dict[str, str]:
    """Every file of a folder by its path in it, as a digest.

    Left out is what the next program has to clear away: what a killed one had half-written, and the journal
    of a take that is safe.
    """
    from studio.capture.journal import FILE

    return {
        path.relative_to(folder).as_posix(): hashlib.blake2b(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix != ".new" and path.name != FILE
    }


@dataclass(frozen=True)
class Whole:
    """What was whole in a project and must stay so: its takes and finished runs, file by file."""

    takes: dict[str, dict[str, str]]
    runs: dict[str, dict[str, str]]

    @classmethod
    def of(cls, project: Path) -> Whole:
        """What there is now."""
        takes = {p.name: contents(p) for p in _folders(project / "takes") if (p / "take.json").is_file()}
        runs = {p.name: contents(p) for p in _folders(project / "runs") if (p / "report.json").is_file()}
        return cls(takes, runs)

    def check(self, project: Path, outcome: Outcome, moment: str) -> None:
        """Note what is gone or changed, and whether the project opens with all of it."""
        from studio.errors import StudioError
        from studio.project import Project

        for kind, before in (("takes", self.takes), ("runs", self.runs)):
            for name, files in before.items():
                now = contents(project / kind / name)
                # Beside the recording things may appear (what was computed from it); nothing may change.
                if bad := [path for path, digest in files.items() if now.get(path) != digest]:
                    outcome.fault("lost", f"{moment}: {kind}/{name}: {', '.join(bad)} changed or went.")
        try:
            opened = Project.open(project, read_only=True)
        except StudioError as error:
            outcome.fault("does not open", f"{moment}: {error}")
            return
        if missing := sorted(set(self.takes) - {take.id for take in opened.takes}):
            outcome.fault("lost", f"{moment}: {', '.join(missing)} are no takes any more.")
        if opened.problems:
            outcome.fault("damaged", f"{moment}: {opened.problems[0][0]}")
        for run in self.runs:
            if not opened.run(run).has_weights:
                outcome.fault("lost", f"{moment}: {run} has no weights any more.")


def load_takes(project: Path, outcome: Outcome, moment: str) -> tuple[Take, ...]:
    """Read every take's sound and motion; gives the takes."""
    from studio.errors import StudioError
    from studio.project import Project
    from studio.sound.sound_file import read_sound
    from studio.take.motion_file import read_motion

    takes = Project.open(project, read_only=True).takes
    for take in takes:
        try:
            if take.info.motion_file:
                read_motion(take.folder / take.info.motion_file)
            if take.audio_path is not None:
                read_sound(take.audio_path)
        except StudioError as error:
            outcome.fault("lost", f"{moment}: {take.id} cannot be read: {error}")
    return takes


def leftovers(place: Path) -> list[str]:
    """What was meant to be temporary and is still there, in a case's place."""
    found = {path.relative_to(place).as_posix() for pattern in LEFT for path in place.rglob(pattern)}
    found |= {f"tmp/{path.name}" for path in (place / "tmp").glob("saia-*")}  # others are torch's and numba's
    return sorted(name for name in found if not name.startswith("home/"))


def _folders(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.iterdir()) if path.is_dir()) if folder.is_dir() else iter(())
