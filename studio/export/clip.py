"""What is exported: a take's used part, a motion file, or what a run makes of a sound."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from studio.errors import RequestError, say
from studio.export.range import cut_sound

if TYPE_CHECKING:
    from studio.dataset import Selection
    from studio.inference.offline import Predictor
    from studio.motion import Motion
    from studio.motion.moods import MoodSpan
    from studio.project import Project, Run
    from studio.take import Take

Report = Callable[[float], None]
"""Called with the fraction that is done; what it raises ends the work."""

SOUND_SUFFIXES = frozenset(
    {".wav", ".flac", ".ogg", ".opus", ".mp3", ".m4a", ".aac", ".aif", ".aiff", ".wma",
     ".mp4", ".mov", ".mkv", ".webm", ".avi"}
)  # fmt: skip
"""Which files of a folder count as sound; a file that is named is read whatever its ending."""


@dataclass(frozen=True)
class ExportClip:
    """Motion from 0, and a file with just its sound."""

    motion: Motion | None
    audio: Path | None


@dataclass(frozen=True, eq=False)
class ExportSource:
    """Something to export.

    Args:
        name: what its files are called.
        weight: how long it takes in comparison with the others.
        clip: reads or generates it, reporting the fraction done.
    """

    name: str
    weight: float
    clip: Callable[[Report], ExportClip]


@dataclass(frozen=True)
class GenerationOptions:
    """How a run is to move: style (None for the run's default) or a mix of several, moods, and chance."""

    style: str | None = None
    seed: int = 0
    liveliness: float = 1.0
    mix: tuple[tuple[str, float], ...] = ()
    moods: tuple[MoodSpan, ...] = ()


class Generator:
    """A run that makes motion; its weights are loaded with the first sound, and once.

    Raises:
        RequestError: the run has no weights yet.
    """

    def __init__(self, run: Run, options: GenerationOptions) -> None:
        # Here, not with the first sound: a queue would fail file by file.
        if not run.has_weights:
            what = say("{run} has no trained weights yet.", run=run.id)
            raise RequestError(what, "Train it first, or choose another run.")
        self.run, self.options = run, options

    @property
    def style(self) -> str:
        """The style it moves in."""
        return self.options.style or self._predictor.style

    def motion(
        self, audio: Path, report: Report, on_piece: Callable[[Motion], None] = lambda piece: None
    ) -> Motion:
        """Generate the motion of a whole sound; each piece is also given as soon as it is made."""
        from studio.inference.offline import sampling_of

        # Before the weights are loaded: an impossible liveliness is to be refused at once.
        sampling = sampling_of(self.options.seed, self.options.liveliness)
        motion: Motion = self._predictor.generate(
            audio,
            report,
            lambda piece: on_piece(self._blinking(piece)),
            style=self.options.mix or self.options.style,
            sampling=sampling,
            moods=self.options.moods,
        )
        return self._blinking(motion)

    def _blinking(self, motion: Motion) -> Motion:
        """With the run's blinks: they follow from the moment alone, so a piece has those of the whole."""
        if not self.run.blinks:
            return motion
        from studio.playback.layers.idle import Blinks, blinking, blinks_of

        return blinking(motion, Blinks(self.run.blinks, self.options.seed), blinks_of(motion))

    @cached_property
    def _predictor(self) -> Predictor:
        # Torch takes seconds to load, so it is imported only once the whole request is known to be possible.
        from studio.inference.offline import load_predictor

        return load_predictor(self.run.folder)


def selection_of(project: Project, name: str) -> tuple[Selection, Take]:
    """A selection by its id, or the whole of a take by the take's id."""
    from studio.dataset import Selection

    if name in project.dataset:
        selection = project.dataset[name]
        return selection, project.take(selection.take)
    return Selection(name, name), project.take(name)


def take_clip(selection: Selection, take: Take, folder: Path) -> ExportClip:
    """The used part of a take; its sound is cut into a temporary folder where that is needed."""
    from studio.take.cleaned import clean
    from studio.take.motion_file import load_motion

    start, end = selection.span(take.info.duration)
    # Cut like the sound below, so that both begin at the same moment.
    motion = load_motion(take, selection.offset, (start, end))
    audio = clean(take.audio_path, selection.clean) if take.audio_path is not None else None
    if audio is not None and (start > 0 or end < take.info.audio_seconds):
        audio = cut_sound(audio, folder / f"{selection.id}.wav", start, end)
    return ExportClip(motion, audio)


def file_clip(path: Path, audio: Path | None) -> ExportClip:
    """A motion file as it is: what Review tuned and shows."""
    from studio.take.motion_file import load_motion_file

    return ExportClip(load_motion_file(path), audio)


def generated_clip(generator: Generator, clip: ExportClip, report: Report) -> ExportClip:
    """What a run makes of a clip's sound."""
    if clip.audio is None:
        raise RequestError("There is no sound to generate motion from.", "Choose a take with sound.")
    return ExportClip(generator.motion(clip.audio, report), clip.audio)


def sound_files(paths: Iterable[Path]) -> list[Path]:
    """The sound files that were named, folders replaced by those in them.

    Raises:
        RequestError: there is nothing at a path, or a folder holds no sound.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += _sounds_in(path)
        elif path.exists():
            found.append(path)
        else:
            raise RequestError(
                say("There is no sound file at {path}.", path=path), "Check how the path is written."
            )
    return list(dict.fromkeys(found))


def _sounds_in(folder: Path) -> list[Path]:
    try:
        inside = sorted(
            path
            for path in folder.iterdir()
            # macOS leaves hidden ._NAME.wav files on foreign disks; they hold no sound.
            if path.suffix.lower() in SOUND_SUFFIXES and not path.name.startswith(".") and path.is_file()
        )
    except OSError as error:
        what = say("The folder {folder} cannot be read.", folder=folder)
        raise RequestError(what, "Choose another folder, or allow reading in it.") from error
    if not inside:
        raise RequestError(
            say("There is no sound in the folder {folder}.", folder=folder.resolve().name),
            "Choose a folder with WAV, MP3 or other sounds.",
        )
    return inside
