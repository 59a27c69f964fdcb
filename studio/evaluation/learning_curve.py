"""How much better a run would be of more takes: trained on a quarter, a half and all of them.

Torch is loaded where it trains. The same small network learns for the same number of steps from each share,
so that only the takes differ, and all three are measured on the same held-back takes.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from studio.dataset import coverage
from studio.dataset.dataset import Dataset, Selection
from studio.errors import RequestError, StudioError, say
from studio.files import atomic, leftovers
from studio.project import Project

if TYPE_CHECKING:
    from studio.evaluation.evaluation_set import EvaluationSet
    from studio.metrics.scores import Figures
    from studio.training.gather import Chosen
    from studio.training.recipe import Recipe

FILE = "learning_curve.json"
RECIPE = "quick"
SHARES = (0.25, 0.5, 1.0)
FORMAT_VERSION = 1
WORTH = 0.02
"""Gain in r that a person would see and that is more than chance: trainings that differ by their seed alone
differ by about so much (.36 against .38 on the same takes)."""
MOST_DOUBLINGS = 4
"""How far a curve of three points is followed; further it says nothing."""
_LARGEST = 1e300
_SHORTEST_SECONDS = 20.0
_LONGEST_SECONDS = 1e7
"""Nobody records so long: a file that says so is damaged."""


@dataclass(frozen=True)
class CurvePoint:
    """One training: seconds learnt from, and figures on the held-back takes; None where one is not known."""

    seconds: float
    follow: float | None
    motion_ratio: float | None = None


@dataclass(frozen=True)
class LearningCurve:
    """What was measured on a project.

    Args:
        points: from the smallest share to all.
        train: ids of the selections learnt from.
        split, takes: what it was measured on.
        shares: what of the training takes is loud, quiet, silent, ..., as dataset.coverage has it.
        at: when, ISO 8601.
    """

    points: tuple[CurvePoint, ...] = ()
    train: tuple[str, ...] = ()
    split: str = ""
    takes: tuple[str, ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict)
    at: str = ""

    @property
    def seconds(self) -> float:
        """Learnt from in all."""
        return self.points[-1].seconds if self.points else 0.0

    @property
    def next_gain(self) -> float | None:
        """What of r twice as much would bring by the trend; None where too little could be measured."""
        found = [point.follow for point in self.points]
        if len(found) < 2 or any(one is None or not math.isfinite(one) for one in found):
            return None
        gains = [b - a for a, b in pairwise(found) if a is not None and b is not None]
        last = gains[-1]
        if last <= 0:
            return 0.0
        # Gains shrink from doubling to doubling, and never to grow again by the luck of one training.
        return last * min(max(last / gains[-2], 0.25), 1.0) if len(gains) > 1 and gains[-2] > 0 else last / 2

    @property
    def enough_seconds(self) -> float | None:
        """From how many seconds on twice as much brings less than WORTH; None where nobody can tell."""
        gain = self.next_gain
        if gain is None:
            return None
        doublings = 0
        while gain >= WORTH and doublings < MOST_DOUBLINGS:
            gain, doublings = gain / 2, doublings + 1
        return self.seconds * 2**doublings

    @property
    def is_enough(self) -> bool:
        """Whether more of the same would hardly help."""
        gain = self.next_gain
        return gain is not None and gain < WORTH

    @property
    def missing(self) -> tuple[str, ...]:
        """Kinds of speech there is too little of."""
        return coverage.missing(dict(self.shares))


def follows(figures: Mapping[str, float | None]) -> float | None:
    """How well a motion follows the captured: r of the mouth, without a mouth that moves of everything."""
    for name in ("pearson_mouth", "pearson"):
        value = number_of(figures.get(name))
        if value is not None:
            return value
    return None


def error_of(figures: Mapping[str, float | None]) -> float | None:
    """How far a motion is off: its face where there is one, else all of it.

    A body that gestures as its person does has its hands elsewhere each time; one that stands still errs
    less.
    """
    face = number_of(figures.get("rmse_face"))
    return face if face is not None else number_of(figures.get("rmse"))


def number_of(value: object) -> float | None:
    """A figure as files have it; None where it is none, or as large as no figure is."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _LARGEST:
        return None
    return float(value)


def load_curve(project: Project) -> LearningCurve | None:
    """The curve measured last; None where none was, or its file is damaged or newer than this studio."""
    with suppress(OSError, StudioError, msgspec.ValidationError):
        path = project.runs_folder / FILE
        facts = atomic.read_json(path)
        atomic.check_version(path, facts, FORMAT_VERSION)
        curve = msgspec.convert(facts, LearningCurve)
        if all(0 < one.seconds < _LONGEST_SECONDS and abs(one.follow or 0.0) < 1.5 for one in curve.points):
            return curve
    return None


def save_curve(project: Project, curve: LearningCurve) -> None:
    """Keep it with the runs.

    Raises:
        StudioError: the folder cannot be written.
    """
    project.runs_folder.mkdir(exist_ok=True)
    facts = {"version": FORMAT_VERSION, **atomic.plain(asdict(curve))}
    atomic.write_json(project.runs_folder / FILE, facts)


def measure_curve(
    project: Project,
    evaluation_set: EvaluationSet,
    recipe: Recipe,
    on_event: Callable[[int, object], None],
    stop: Callable[[], bool],
) -> LearningCurve:
    """Train on each of SHARES and measure; what the trainings leave on the disk goes again.

    Args:
        project: whose takes.
        evaluation_set: takes that none of them learns from.
        recipe: how each is trained.
        on_event: told (which share, what its training says), on this thread.
        stop: asked after every step.

    Raises:
        RequestError: there is too little to take a quarter of.
        StudioError: as for a training.
        KeyboardInterrupt: it was stopped.
    """
    from studio.features.audio_spec import AudioSpec
    from studio.training.gather import load_usable

    material, _ = load_usable(project.selected("train"), AudioSpec())
    seconds = sum(one.selection.seconds(one.selection.in_point + one.duration) for one in material)
    if seconds < _SHORTEST_SECONDS:
        raise RequestError(
            say(
                "{seconds} seconds to learn from are too few to tell what more would bring.",
                seconds=f"{seconds:.0f}",
            ),
            say(
                "Record until there are {shortest} seconds or more.",
                shortest=f"{_SHORTEST_SECONDS:.0f}",
            ),
        )
    points = []
    for index, share in enumerate(SHARES):
        with tempfile.TemporaryDirectory(
            prefix=leftovers.scratch_prefix("curve"), ignore_cleanup_errors=True
        ) as scratch:
            part = _Part(project, share, Path(scratch))
            figures = _trained(part, evaluation_set, recipe, partial(on_event, index), stop)
        points.append(CurvePoint(share * seconds, follows(figures), figures.get("motion_ratio")))
    return LearningCurve(
        tuple(points),
        tuple(one.selection.id for one in material),
        evaluation_set.split,
        tuple(evaluation_set.takes),
        coverage.coverage(material),
        datetime.now().astimezone().isoformat(timespec="seconds"),
    )


def _trained(
    part: _Part,
    evaluation_set: EvaluationSet,
    recipe: Recipe,
    on_event: Callable[[object], None],
    stop: Callable[[], bool],
) -> Figures:
    from studio.evaluation.evaluation_set import evaluate
    from studio.inference.offline import load_predictor
    from studio.training.loop.train import train

    run = train(part, recipe, on_event=on_event, stop=stop)
    if stop():
        raise KeyboardInterrupt("The learning curve was not measured to its end.")
    predictor = load_predictor(run.folder)
    rate = predictor.model.recipe.sound.sample_rate
    return evaluate(
        lambda material: predictor.generate_samples(material.heard_at(rate)), evaluation_set.material
    ).metrics


class _Part(Project):
    """A project with a share of each training take, whose runs go elsewhere; it is only read.

    Args:
        whole: the project.
        share: 0..1 of each training take, from its in point on.
        runs: where its runs go.
    """

    def __init__(self, whole: Project, share: float, runs: Path) -> None:
        super().__init__(whole.folder, None, read_only=True)
        self._whole, self._share, self._runs = whole, share, runs

    @property
    def runs_folder(self) -> Path:
        """The scratch folder."""
        return self._runs

    @property
    def dataset(self) -> Dataset:
        """The whole project's choices."""
        return self._whole.dataset

    def selected(self, split: str | None = None) -> tuple[Chosen, ...]:
        """As the whole project's, the training takes shortened."""
        return tuple((self._cut(s, take.info.duration), take) for s, take in self._whole.selected(split))

    def _cut(self, selection: Selection, duration: float) -> Selection:
        if selection.split != "train" or self._share >= 1.0:
            return selection
        # A part of every take and not some takes whole: all moods and styles are in each share.
        start, end = selection.span(duration)
        return replace(selection, out_point=start + self._share * (end - start))
