"""What is exported: a take's used part, a motion file, or what a run makes of a sound."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._run import as_request
from studio.cli._source import check_sound
from studio.errors import RequestError

if TYPE_CHECKING:
    from studio.dataset import Selection
    from studio.generate import Predictor
    from studio.model._network import Chance
    from studio.motion import Motion
    from studio.project import Project, Run
    from studio.take import Take

Report = Callable[[float], None]
"""Told which fraction is done; what it raises ends the work."""


@dataclass(frozen=True)
class Clip:
    """Motion from 0, and a file with just its sound."""

    motion: Motion | None
    audio: Path | None


@dataclass(frozen=True)
class Manner:
    """How a run is to move: its style (None for the one chosen on validation), seed and liveliness."""

    style: str | None = None
    seed: int = 0
    liveliness: float = 1.0


class Generator:
    """A run that makes motion; its weights are loaded with the first sound, and once.

    Raises:
        RequestError: the run has no weights yet.
    """

    def __init__(self, run: Run, manner: Manner) -> None:
        if not run.has_weights:
            what = f"{run.id} has no trained weights yet."
            raise RequestError(what, "Train it first, or choose another run.")
        self.run, self.manner = run, manner
        self._loaded: tuple[Predictor, Chance] | None = None

    @property
    def style(self) -> str:
        """The style it moves in."""
        return self.manner.style or self._ready()[0].style

    def motion(self, audio: Path, report: Report) -> Motion:
        """What it makes of a whole sound."""
        predictor, chance = self._ready()
        made: Motion = predictor.generate(audio, on_progress=report, style=self.manner.style, chance=chance)
        return made

    def pieces(self, audio: Path) -> Iterator[Motion]:
        """The same in pieces, each as soon as it is made."""
        from studio.generate import BLOCK_SECONDS
        from studio.take.sound import sound_blocks

        predictor, chance = self._ready()
        blocks = sound_blocks(audio, predictor.model.recipe.sound.sample_rate, BLOCK_SECONDS)
        yield from predictor.stream(blocks, style=self.manner.style, chance=chance)

    def _ready(self) -> tuple[Predictor, Chance]:
        if self._loaded is None:
            # Torch takes seconds to load: what was wrong with the request has been said by now.
            from studio.generate import chance_of, load_predictor

            chance = chance_of(self.manner.seed, self.manner.liveliness)
            self._loaded = load_predictor(self.run.folder), chance
        return self._loaded


def selection_of(project: Project, name: str) -> tuple[Selection, Take]:
    """A selection by its id, or the whole of a take by the take's id."""
    from studio.dataset import Selection

    if name in project.dataset:
        selection = project.dataset[name]
        return selection, project.take(selection.take)
    return Selection(name, name), project.take(name)


def take_clip(selection: Selection, take: Take, folder: Path) -> Clip:
    """The used part of a take; its sound is cut into a folder of our own where that is needed."""
    from studio.dataset.material import load_material
    from studio.take.cleaned import clean
    from studio.take.sound import Sound, read_span, write_sound

    motion = load_material(selection, take, 8000).motion if take.motion_path else None
    start = max(selection.in_point, 0.0)
    end = take.info.duration if selection.out_point is None else selection.out_point
    audio = clean(take.audio_path, selection.clean) if take.audio_path is not None else None
    if audio is not None and (start > 0 or end < take.info.audio_seconds):
        span: Sound = read_span(audio, start, end)
        audio = folder / f"{selection.id}.wav"
        write_sound(audio, span, "PCM_24")
    return Clip(motion, audio)


def file_clip(path: Path, audio: Path | None) -> Clip:
    """A motion file as it is: what Review tuned and shows."""
    from studio.motion.mend import mended
    from studio.take.motion_file import read_motion

    if audio is not None:
        check_sound(audio)
    with as_request():
        return Clip(mended(read_motion(path))[0], audio)


def generated_clip(generator: Generator, clip: Clip, report: Report) -> Clip:
    """What a run makes of a clip's sound."""
    if clip.audio is None:
        raise RequestError("There is no sound to generate motion from.", "Choose a take with sound.")
    return Clip(generator.motion(clip.audio, report), clip.audio)
