"""A style that a finished run is shown: "move like this", some seconds of a take, its network left as it is.

The run hears the stretch, and what it would have made is held against what was captured, column by column.
Fitting an embedding was tried: alone it brings half as much, and beside this nothing more
(tests/benchmarks/bench_style.py). So runs that tell no styles apart can be shown one as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Selection
from studio.dataset.material import TrainingMaterial, load_material
from studio.errors import RequestError, say
from studio.features.audio_spec import Floats
from studio.features.examples import Example, make_example
from studio.features.motion import FACE, Layout
from studio.motion.grid import on_grid
from studio.project import Project, Run
from studio.training import checkpoint
from studio.training.checkpoint import BEST, Model
from studio.training.gather import is_silent
from studio.training.loop.validation import CALMEST, drawn
from studio.training.styles import AVERAGE, WIDEST, FittedStyle

SHORTEST_SECONDS = 3.0
LONGEST_NAME = 60
BELIEF_SECONDS = 3.0
"""That a style moves as the average does counts as much as so many seconds that say otherwise."""
WARM_UP_SECONDS = 1 / 3
"""A network that begins in the middle of a word needs so long to know where it is."""
_TINY = 1e-6


def show_style(
    project: Project,
    run: Run,
    name: str,
    span: tuple[float, float],
    style: str = "",
    on_progress: Callable[[float], None] = lambda fraction: None,
) -> str:
    """Fit a new style to a stretch of a take and keep it in the run.

    Args:
        project: the take's.
        run: one that is not being trained.
        name: of the take or of a part of it.
        span: from where to where, seconds on the take's clock.
        style: what it is to be called; a name is found where "".
        on_progress: told which fraction is done.

    Returns:
        The style's name.

    Raises:
        RequestError: the stretch, the name or the run cannot be used for it.
        StudioError: a file is damaged or cannot be written.
    """
    _must_rest(run)
    selection = _stretch(project, name, span)
    model = checkpoint.load_model(run.folder / BEST)
    taken = (AVERAGE, *model.style_names)
    style = style.strip() or _free(f"like {name}", taken)
    if style in taken:
        raise RequestError(
            say("{run} has a style called {style} already.", run=run.id, style=style), "Choose another name."
        )
    if len(style) > LONGEST_NAME or not style.isprintable():
        raise RequestError(
            "A style cannot be called that.",
            say("Choose up to {longest} plain letters.", longest=LONGEST_NAME),
        )
    on_progress(0.2)
    example = _example(project, selection, model, span)
    on_progress(0.6)
    _keep(run, replace(model, fitted=(*model.fitted, fit(style, model, example))))
    return style


def forget_style(run: Run, name: str) -> None:
    """Remove a style that a run was shown.

    Raises:
        RequestError: it was shown none of that name, or is being trained.
    """
    _must_rest(run)
    model = checkpoint.load_model(run.folder / BEST)
    left = tuple(one for one in model.fitted if one.name != name)
    if len(left) == len(model.fitted):
        shown = ", ".join(one.name for one in model.fitted) or say("none")
        raise RequestError(
            say("{run} was shown no style called {name}.", run=run.id, name=name),
            say("It was shown: {shown}.", shown=shown),
        )
    _keep(run, replace(model, fitted=left))


def fit(name: str, model: Model, example: Example) -> FittedStyle:
    """The style of a stretch, by the moments of its columns.

    In the face, where sound says much, a column is scaled as errs least: the covariance of predicted and
    captured values over the variance of the predicted ones. A body follows sound so loosely that this would
    freeze it; its bones are given the captured deviation. All of it counts by how long the stretch is.
    """
    # People see what is drawn, where a run draws: that is what must come to move alike.
    made = drawn(model.network, example)
    skipped = round(WARM_UP_SECONDS * float(model.fps))
    counts = (example.grid.valid[:, None] * example.mask[None])[skipped:]
    frames = counts.sum(axis=0)
    (centre, p), (wanted, y) = (_centred(v[skipped:], counts) for v in (made, example.values))
    covariance, variance, captured = (np.sum(v, axis=0) for v in (p * y, p * p, y * y))
    block = _blocks(model.layout)
    variance, captured = (np.bincount(block, weights=v)[block] for v in (variance, captured))
    safe = np.maximum(variance, _TINY)
    face = model.layout.groups == FACE
    gain = np.where(
        face,
        np.clip(covariance / safe, 0.0, WIDEST),
        np.clip(np.sqrt(captured / safe), CALMEST, WIDEST),
    )
    # What the run does not move here says nothing of how far it should.
    gain = np.where(variance > _TINY * np.maximum(frames, 1), gain, 1.0)
    trust = frames / (frames + BELIEF_SECONDS * float(model.fps))
    gain = 1 + trust * (gain - 1)
    return FittedStyle(name, gain, centre + trust * (wanted - centre) - gain * centre)


def _centred(values: Floats, counts: Floats) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The mean of each column over the frames that count, (C,), and how far they are from it, (T, C)."""
    values = values.astype(np.float64)
    mean = (values * counts).sum(axis=0) / np.maximum(counts.sum(axis=0), 1)
    return mean, (values - mean) * counts


def _blocks(layout: Layout) -> NDArray[np.int64]:
    """Which columns go together, (C,): a bone's six and the hips' three; each shape alone."""
    faces, bones = len(layout.learnt_shapes), len(layout.learnt_bones)
    sizes = [1] * faces + [6] * bones + [3] * layout.learns_hips
    return np.repeat(np.arange(len(sizes)), sizes)


def _stretch(project: Project, name: str, span: tuple[float, float]) -> Selection:
    """A take as it is used, cut to a stretch."""
    start, end = span
    if not (math.isfinite(start) and math.isfinite(end)) or start < 0 or end <= start:
        what = say("From {start} s to {end} s is no stretch of a take.", start=f"{start:g}", end=f"{end:g}")
        raise RequestError(what, "Let it begin at 0 s or later, and end after it begins.")
    named = [s for s in project.dataset.selections if name in (s.id, s.take)]
    used = min(named, key=lambda s: s.id != name, default=Selection(name, name))
    duration = project.take(used.take).info.duration
    end = min(end, duration)
    if end - start < SHORTEST_SECONDS:
        what = say(
            "That stretch of {name} is {seconds} s long, too short to show how it moves.",
            name=name,
            seconds=f"{max(end - start, 0):.1f}",
        )
        raise RequestError(
            what,
            say(
                "Choose at least {shortest} s; ten do better.",
                shortest=f"{SHORTEST_SECONDS:.0f}",
            ),
        )
    return replace(used, in_point=start, out_point=end)


def _example(project: Project, selection: Selection, model: Model, span: tuple[float, float]) -> Example:
    """A stretch as the model hears and moves it."""
    take, spec = project.take(selection.take), model.recipe.sound
    material: TrainingMaterial = load_material(selection, take, spec.sample_rate)
    where = say(
        "{take} between {start} s and {end} s", take=selection.id, start=f"{span[0]:g}", end=f"{span[1]:g}"
    )
    if not len(material.samples) or is_silent(material):
        raise RequestError(
            say("There is no sound in {where}.", where=where), "Choose a stretch in which somebody speaks."
        )
    grid = on_grid(material.motion, len(material.samples) / spec.sample_rate, model.fps, material.excluded)
    if grid.valid.sum() < SHORTEST_SECONDS * float(model.fps) - 1:
        what = say(
            "There are less than {shortest} s of captured motion in {where}.",
            shortest=f"{SHORTEST_SECONDS:.0f}",
            where=where,
        )
        raise RequestError(what, "Choose a stretch in which the performer was captured.")
    example = make_example(selection.id, material.samples, grid, model.layout, spec, model.fps, None)
    if not example.mask.any():
        what = say("{take} has none of the channels that this run moves.", take=selection.id)
        raise RequestError(what, "Choose a take captured like those it learnt from.")
    return example


def _must_rest(run: Run) -> None:
    """RequestError where a run's weights are about to be others."""
    if run.is_shipped:
        what = "The base voice comes with the studio and learns nobody's style."
        raise RequestError(what, "Train a run of your own, and show it the style.")
    if run.status == "running":
        raise RequestError(say("{run} is being trained.", run=run.id), "Wait until it is done, or stop it.")


def _free(name: str, taken: tuple[str, ...]) -> str:
    """A name, or with the first number that makes it one of its own."""
    name = name[: LONGEST_NAME - 4]
    names = (name, *(f"{name} {number}" for number in range(2, len(taken) + 3)))
    return next(one for one in names if one not in taken)


def _keep(run: Run, model: Model) -> None:
    checkpoint.save_model(run.folder / BEST, model)
    # After the weights: a name that is listed and not known would be an error whenever it is chosen.
    replace(run.facts, styles=model.style_names[1:]).save(run.folder)
