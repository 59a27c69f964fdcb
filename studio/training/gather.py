"""Gathers training examples from a project's selections: frame rate, layout, splits and notes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from studio.dataset import prompts
from studio.dataset.balance import leaking
from studio.dataset.dataset import Selection
from studio.dataset.material import TrainingMaterial, load_material
from studio.errors import RequestError, Text, say
from studio.features import motion as columns
from studio.features.audio_spec import AudioSpec, frame_rate
from studio.features.examples import Example, make_example
from studio.features.motion import Layout
from studio.motion import Motion
from studio.motion.grid import Grid, learnt_rate, nominal_rate, on_grid
from studio.motion.moods import Spans, learnable, stands
from studio.project import Project
from studio.take.take import Take
from studio.training.recipe import Recipe
from studio.training.styles import styles_of

SHORTEST_SECONDS = 4.0
"""Less sound with motion than this cannot be learnt from."""
_SILENCE = 1e-4
HELD_BACK = 0.15
"""Share of the longest training take that is held back where no validation take is marked."""

Chosen = tuple[Selection, Take]
OnCleaning = Callable[[str, float], None]
OnListening = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Gathered:
    """What a training works on.

    Args:
        train, val: examples.
        layout: their columns.
        fps: their frame rate.
        notes: what a person should know, one sentence each.
        performers: who is in the training takes.
        styles: names of the styles told apart; an example's style is an index into them, plus 1.
        moods: names of the labels learnt as moods, in the order of the examples' columns.
    """

    train: tuple[Example, ...]
    val: tuple[Example, ...]
    layout: Layout
    fps: Fraction
    notes: tuple[str, ...]
    performers: tuple[str, ...]
    styles: tuple[str, ...] = ()
    moods: tuple[str, ...] = ()

    @property
    def frames(self) -> int:
        """Valid motion frames trained on."""
        return int(sum(example.grid.valid.sum() for example in self.train))


def cache_folder(project: Project) -> Path | None:
    """Where features of a project's sound are kept; None for a project that cannot be written."""
    folder = project.folder / ".cache" / "features"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder


def gather(
    project: Project,
    recipe: Recipe,
    layout: Layout | None = None,
    fps: Fraction | None = None,
    styles: tuple[str, ...] | None = None,
    moods: tuple[str, ...] | None = None,
    on_cleaning: OnCleaning = lambda take, done: None,
    on_listening: OnListening = lambda take, number, of: None,
) -> Gathered:
    """The training and validation examples of a project.

    Args:
        project: its dataset says which selections.
        recipe: sound features, frame rate, scaling.
        layout, fps, styles, moods: those of a run that is resumed; measured where None.
        on_cleaning: is told of a take whose cleaned sound has to be made, and how much of it is (0..1).
        on_listening: is told of each take before its sound is listened to: which, its number, of how many.

    Raises:
        StudioError: there is too little, or what there is cannot be used.
    """
    notes: list[Text] = []
    train, val = _materials(project, recipe, notes, on_cleaning)
    fps = fps or _rate(recipe, train)
    # All takes on one rate: the network's state moves one frame a step, whatever take it hears.
    grids = {m.selection.id: _grid(m, fps) for m in (*train, *val)}
    seconds = sum(float(grids[m.selection.id].valid.sum()) for m in train) / float(fps)
    if seconds < SHORTEST_SECONDS:
        raise _too_little(seconds)
    if layout is None:
        seen = [_counting(grids[m.selection.id]) for m in train]
        # On the frames that count: an excluded span may hold the one value that makes a channel seem to move.
        layout = columns.fit([m for m in seen if len(m)], recipe.channels.scaling)
    cache = cache_folder(project)
    named = styles_of([m.selection for m in train], recipe.training.style_by)
    styles = tuple(dict.fromkeys(name for name in named if name)) if styles is None else styles
    indices = {name: i for i, name in enumerate(styles, 1)}
    spans = {m.selection.id: _labelled(m) for m in (*train, *val)}
    if moods is None:
        counted = ((spans[m.selection.id], grids[m.selection.id].valid, float(fps)) for m in train)
        moods = learnable(counted)
    numbers = {m.selection.id: i for i, m in enumerate((*train, *val), 1)}

    def example(material: TrainingMaterial) -> Example:
        on_listening(material.selection.id, numbers[material.selection.id], len(numbers))
        grid = grids[material.selection.id]
        one = make_example(material.selection.id, material.samples, grid, layout, recipe.sound, fps, cache)
        if not moods:
            return one
        return replace(one, moods=stands(spans[one.id], moods, one.frames, float(fps)))

    performers = tuple(dict.fromkeys(m.selection.performer for m in train if m.selection.performer))
    learnt = tuple(
        replace(example(m), style=indices.get(name, 0)) for m, name in zip(train, named, strict=True)
    )
    checked = tuple(map(example, val))
    return Gathered(learnt, checked, layout, fps, tuple(notes), performers, styles, moods)


def _materials(
    project: Project, recipe: Recipe, notes: list[Text], on_cleaning: OnCleaning
) -> tuple[list[TrainingMaterial], list[TrainingMaterial]]:
    """What is learnt from and what it is checked on."""
    train = _usable(project.selected("train"), recipe.sound, notes, on_cleaning)
    if not train:
        what = say("No take with sound and motion is marked for training.")
        if notes:
            lack = notes[0].fields["lack"]
            what = say("No take with sound and motion is marked for training: {lack}.", lack=lack)
        raise RequestError(what, _MARK)
    if all(is_silent(material) for material in train):
        raise RequestError(
            "The training takes are silent; nothing can be learnt from their sound.",
            "Check the microphone with Test in Record, and record again.",
        )
    val = _usable(project.selected("val"), recipe.sound, notes, on_cleaning)
    if not val:
        train, val = _hold_back(train, notes)
    if shared := leaking(project.dataset):
        notes.append(
            say(
                "Parts of {takes} are learnt from and other parts are kept to check the learning: "
                "the figures look better than they are. Press Split automatically in Curate.",
                takes=", ".join(shared),
            )
        )
    return train, val


_MARK = "Mark at least one as train in Curate, or with `saia split PROJECT --train TAKE`."


def load_usable(chosen: Sequence[Chosen], sound: AudioSpec) -> tuple[list[TrainingMaterial], list[Text]]:
    """Material of selections that have sound and motion, and a sentence for each that has not."""
    notes: list[Text] = []
    return _usable(chosen, sound, notes), notes


def _usable(
    chosen: Sequence[Chosen],
    sound: AudioSpec,
    notes: list[Text],
    on_cleaning: OnCleaning = lambda take, done: None,
) -> list[TrainingMaterial]:
    found = []
    for selection, take in chosen:
        material = load_material(selection, take, sound.sample_rate, partial(on_cleaning, selection.id))
        if not len(material.samples):
            notes.append(_left_out(say("{take} has no sound", take=selection.id)))
        elif len(material.motion) < 2:
            notes.append(_left_out(say("{take} has no motion", take=selection.id)))
        else:
            if is_silent(material):
                notes.append(
                    say("{take} is silent; nothing can be learnt from its sound.", take=selection.id)
                )
            found.append(material)
    return found


def _left_out(lack: Text) -> Text:
    return say("{lack} and is left out.", lack=lack)


def is_silent(material: TrainingMaterial) -> bool:
    """Whether nothing can be heard in it."""
    return float(np.abs(material.samples).max()) < _SILENCE


def _too_little(seconds: float) -> RequestError:
    return RequestError(
        say(
            "The training takes hold only {seconds} s of sound with motion; {shortest} s are needed.",
            seconds=f"{seconds:.1f}",
            shortest=f"{SHORTEST_SECONDS:.0f}",
        ),
        "Record or import more, or mark more takes for training in Curate.",
    )


def _hold_back(
    train: list[TrainingMaterial], notes: list[Text]
) -> tuple[list[TrainingMaterial], list[TrainingMaterial]]:
    """The end of the longest training take becomes validation."""
    longest = max(train, key=lambda m: m.duration)
    # Where both sound and motion are still there: a tail without one of them checks nothing.
    end = min(longest.duration, len(longest.samples) / longest.sample_rate, float(longest.motion.times[-1]))
    at = end * (1 - HELD_BACK)
    notes.append(
        say(
            "No take is marked for validation: the last {seconds} s of {take} are held back for it.",
            seconds=f"{end - at:.1f}",
            take=longest.selection.id,
        )
    )
    head = _part(longest, 0.0, at, "")
    tail = _part(longest, at, end + 1.0, " (end)")
    return [head if m is longest else m for m in train], [tail]


def _part(material: TrainingMaterial, start: float, end: float, suffix: str) -> TrainingMaterial:
    rate, used = material.sample_rate, material.selection
    begun, last = max(used.in_point, 0.0), min(end, material.duration)
    return replace(
        material,
        selection=replace(used, id=used.id + suffix, in_point=begun + start, out_point=begun + last),
        samples=material.samples[round(start * rate) : round(end * rate)],
        # Not `cut`: a frame right at the border must not be learnt from and validated with.
        motion=material.motion.between(start, end).shifted(-start),
        duration=last - start,
        excluded=tuple((a - start, b - start) for a, b in material.excluded if b > start),
    )


def _labelled(material: TrainingMaterial) -> Spans:
    return moods_of(material.selection, max(material.selection.in_point, 0.0) + material.duration)


_NO_MOODS = frozenset({"sentence", "vowel", "problem", prompts.TIER})
"""Tiers that say what is spoken, asked for or wrong, and not how it is played."""


def moods_of(selection: Selection, duration: float) -> Spans:
    """Where each mood stands in what is used of a take, seconds from the in point on.

    Args:
        selection: with its labels; its emotion holds throughout, where no label of that tier says more.
        duration: of the recording, seconds.
    """
    first, last = selection.span(duration)
    found: Spans = {}
    for label in selection.labels:
        start, end = max(label.t, first), min(label.t + label.duration, last)
        if label.tier not in _NO_MOODS and label.text.strip() and end > start:
            found.setdefault(label.text.strip(), []).append((start - first, end - first))
    if selection.emotion and not any(label.tier == "emotion" for label in selection.labels):
        found[selection.emotion] = [(0.0, last - first)]
    return found


def _rate(recipe: Recipe, train: list[TrainingMaterial]) -> Fraction:
    if recipe.channels.fps:
        return frame_rate(recipe.channels.fps)
    lasting = [m.motion for m in train if m.motion.fps > 0]
    if not lasting:
        raise _too_little(0.0)
    # The rate of most frames: one slow take must not decide for hours of fast ones.
    rates = np.repeat([nominal_rate(motion.fps) for motion in lasting], [len(motion) for motion in lasting])
    return learnt_rate(float(np.median(rates)), recipe.channels.most_fps)


def _grid(material: TrainingMaterial, fps: Fraction) -> Grid:
    return on_grid(material.motion, len(material.samples) / material.sample_rate, fps, material.excluded)


def _counting(grid: Grid) -> Motion:
    times = grid.motion.times
    return grid.motion if grid.valid.all() else grid.motion.at(times[grid.valid > 0])
