"""What is exported: a take's used part, a motion file, or what a run makes of a sound."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._project import check_sound
from studio.cli._run import as_request
from studio.errors import RequestError

if TYPE_CHECKING:
    from studio.dataset import Selection
    from studio.inference.offline import Predictor
    from studio.model._network import SamplingOptions
    from studio.motion import Motion
    from studio.project import Project, Run
    from studio.take import Take

Report = Callable[[float], None]
"""Told which fraction is done; what it raises ends the work."""


@dataclass(frozen=True)
class ExportClip:
    """Motion from 0, and a file with just its sound."""

    motion: Motion | None
    audio: Path | None


@dataclass(frozen=True)
class GenerationOptions:
    """How a run is to move: its style (None for the one chosen on validation), seed and liveliness."""

    style: str | None = None
    seed: int = 0
    liveliness: float = 1.0


class Generator:
    """A run that makes motion; its weights are loaded with the first sound, and once.

    Raises:
        RequestError: the run has no weights yet.
    """

    def __init__(self, run: Run, options: GenerationOptions) -> None:
        if not run.has_weights:
            what = f"{run.id} has no trained weights yet."
            raise RequestError(what, "Train it first, or choose another run.")
        self.run, self.options = run, options
        self._loaded: tuple[Predictor, SamplingOptions] | None = None

    @property
    def style(self) -> str:
        """The style it moves in."""
        return self.options.style or self._ready()[0].style

    def motion(self, audio: Path, report: Report) -> Motion:
        """Generate the motion of a whole sound."""
        predictor, sampling = self._ready()
        made: Motion = predictor.generate(
            audio, on_progress=report, style=self.options.style, sampling=sampling
        )
        return made

    def pieces(self, audio: Path) -> Iterator[Motion]:
        """Generate the motion of a sound in pieces, each given as soon as it is made."""
        from studio.inference.offline import BLOCK_SECONDS
        from studio.sound.sound_file import sound_blocks

        predictor, sampling = self._ready()
        blocks = sound_blocks(audio, predictor.model.recipe.sound.sample_rate, BLOCK_SECONDS)
        yield from predictor.stream(blocks, style=self.options.style, sampling=sampling)

    def _ready(self) -> tuple[Predictor, SamplingOptions]:
        if self._loaded is None:
            # Torch takes seconds to load: what was wrong with the request has been said by now.
            from studio.inference.offline import load_predictor, sampling_of

            sampling = sampling_of(self.options.seed, self.options.liveliness)
            self._loaded = load_predictor(self.run.folder), sampling
        return self._loaded


def selection_of(project: Project, name: str) -> tuple[Selection, Take]:
    """A selection by its id, or the whole of a take by the take's id."""
    from studio.dataset import Selection

    if name in project.dataset:
        selection = project.dataset[name]
        return selection, project.take(selection.take)
    return Selection(name, name), project.take(name)


def take_clip(selection: Selection, take: Take, folder: Path) -> ExportClip:
    """The used part of a take; its sound is cut into a folder of our own where that is needed."""
    from studio.sound.sound_file import Sound, read_span, write_sound
    from studio.take.cleaned import clean
    from studio.take.motion_file import load_motion

    start, end = selection.span(take.info.duration)
    motion = load_motion(take, selection.offset, (start, end))
    audio = clean(take.audio_path, selection.clean) if take.audio_path is not None else None
    if audio is not None and (start > 0 or end < take.info.audio_seconds):
        span: Sound = read_span(audio, start, end)
        audio = folder / f"{selection.id}.wav"
        write_sound(audio, span, "PCM_24")
    return ExportClip(motion, audio)


def file_clip(path: Path, audio: Path | None) -> ExportClip:
    """A motion file as it is: what Review tuned and shows."""
    from studio.take.motion_file import load_motion_file

    if audio is not None:
        check_sound(audio)
    with as_request():
        return ExportClip(load_motion_file(path), audio)


def generated_clip(generator: Generator, clip: ExportClip, report: Report) -> ExportClip:
    """What a run makes of a clip's sound."""
    if clip.audio is None:
        raise RequestError("There is no sound to generate motion from.", "Choose a take with sound.")
    return ExportClip(generator.motion(clip.audio, report), clip.audio)
