"""What a run did, read from its epochs, and the runs as they lie on the disk. Pure: no Qt widgets."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from studio.dataset.coverage import kinds_of
from studio.dataset.dataset import Dataset
from studio.evaluation.learning_curve import FILE as CURVE_FILE
from studio.evaluation.learning_curve import LearningCurve, error_of, load_curve
from studio.evaluation.verdict import MUCH_MORE, Kinds, RunVerdict, trembles, verdict
from studio.ipc.events import EpochEvent
from studio.metrics.scores import STILL_RATIO
from studio.project import Project, Run
from studio.project.run import list_run_folders
from studio.take import Take

ALIVE = (0.8, 1.25)
WATCH_FROM = 0.3
"""Part of the epochs after which stillness is worth a word; every model begins still."""

NOTE_FILE = "note.txt"
Stamp = tuple[int, int]


@dataclass(frozen=True)
class RunFacts:
    """One run at a glance; numbers are None where they are not known.

    Args:
        epochs: how many it finished.
        of: how many it was to do.
        best: the best epoch's number.
        error, pearson, motion_ratio, jerk_ratio: on validation at the best epoch.
        seconds: an epoch takes.
        eta: seconds left.
        advice: what to try where the model stands still, "" else.
    """

    epochs: int = 0
    of: int | None = None
    best: int | None = None
    error: float | None = None
    pearson: float | None = None
    motion_ratio: float | None = None
    jerk_ratio: float | None = None
    seconds: float | None = None
    eta: float | None = None
    advice: str = ""

    @property
    def life(self) -> str:
        """ "alive", "lively", "still", "shaky", "calm" or "" where it is not known."""
        ratio = self.motion_ratio
        if ratio is None:
            return ""
        if ratio < STILL_RATIO:
            return "still"
        if ratio < ALIVE[0]:
            return "calm"
        if trembles(ratio, self.jerk_ratio):
            return "shaky"
        return "alive" if ratio <= MUCH_MORE else "lively"


def epochs_of(run: Run) -> list[EpochEvent]:
    """What a run wrote down of its epochs, in order; a line that is none is left out."""
    return [EpochEvent.from_dict(facts) for facts in run.epochs()]


def run_facts(epochs: Sequence[EpochEvent]) -> RunFacts:
    """The facts of epochs in order."""
    if not epochs:
        return RunFacts()
    last = epochs[-1]
    best = _best(epochs)
    return RunFacts(
        epochs=last.epoch,
        of=last.of or None,
        best=best.epoch if best else None,
        error=error_of(best.val) if best else None,
        pearson=_metric(best, "pearson"),
        motion_ratio=_metric(best, "motion_ratio"),
        jerk_ratio=_metric(best, "jerk_ratio"),
        seconds=_pace(epochs),
        eta=_number(last.eta_s),
        advice=last.advice if len(epochs) >= WATCH_FROM * last.of else "",
    )


def curves(epochs: Sequence[EpochEvent]) -> dict[str, list[tuple[int, float | None]]]:
    """Points of train_loss, val_loss, error and every validation metric, by epoch."""
    found: dict[str, list[tuple[int, float | None]]] = {}
    for one in epochs:
        values = {
            "train_loss": one.train_loss, "val_loss": one.val_loss, "error": error_of(one.val), **one.val
        }  # fmt: skip
        for key, value in values.items():
            found.setdefault(key, []).append((one.epoch, _number(value)))
    return found


def _best(epochs: Sequence[EpochEvent]) -> EpochEvent | None:
    """The epoch the training calls best, else that of the lowest validation (or training) loss."""
    marked = [one for one in epochs if one.best]
    if marked:
        return marked[-1]
    for loss in ("val_loss", "train_loss"):
        known = [(value, one) for one in epochs if (value := _number(getattr(one, loss))) is not None]
        if known:
            return min(known, key=lambda pair: pair[0])[1]
    return None


def _pace(epochs: Sequence[EpochEvent]) -> float | None:
    """Seconds an epoch took lately; events carry the seconds since training began."""
    known = [(one.epoch, t) for one in epochs if (t := _number(one.seconds)) is not None][-6:]
    if len(known) < 2 or known[-1][0] <= known[0][0]:
        return known[-1][1] / max(known[-1][0], 1) if known else None
    return (known[-1][1] - known[0][1]) / (known[-1][0] - known[0][0])


def _metric(epoch: EpochEvent | None, name: str) -> float | None:
    return _number(epoch.val.get(name)) if epoch else None


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


class RunReader:
    """Runs as they lie on the disk, read again only where a file changed since."""

    def __init__(self) -> None:
        self._runs: dict[Path, tuple[tuple[Stamp, bool], Run]] = {}
        self._facts: dict[Path, tuple[Stamp, RunFacts]] = {}

    def newest_first(self, folder: Path) -> list[Run]:
        """The runs in a folder."""
        found = list_run_folders(folder)
        self._runs = {path: known for path, known in self._runs.items() if path in found}
        return sorted((self._run(path) for path in found), key=_age, reverse=True)

    def facts(self, run: Run) -> RunFacts:
        """A run's figures."""
        path = run.folder / "metrics.jsonl"
        stamp, known = _stamp(path), self._facts.get(path)
        if known is None or known[0] != stamp:
            known = self._facts[path] = (stamp, run_facts(epochs_of(run)))
        return known[1]

    def _run(self, folder: Path) -> Run:
        stamp = _stamp(folder / "report.json"), (folder / "best.safetensors").is_file()
        known = self._runs.get(folder)
        # Whether one that is training still does is not written in a file.
        if known is None or known[0] != stamp or known[1].status == "running":
            known = self._runs[folder] = (stamp, Run.load(folder))
        return known[1]


@dataclass(frozen=True)
class ProjectVerdicts:
    """What is said of a project's runs.

    Args:
        curve: what more takes would bring, as it was measured last.
        of_runs: of each run, by its folder.
    """

    curve: LearningCurve | None = None
    of_runs: dict[Path, RunVerdict] = field(default_factory=dict)


class VerdictReader:
    """Verdicts on runs, whose figures are read again only where a file changed since.

    Several threads may ask at once: one reads, and the others find it read.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._verdicts: dict[Path, tuple[tuple[object, ...], RunVerdict]] = {}
        self._curve: tuple[Path, Stamp, LearningCurve | None] | None = None
        self._kinds: tuple[Dataset, tuple[Take, ...], Kinds] | None = None

    def read(
        self, project: Project, runs: Sequence[Run], dataset: Dataset, takes: tuple[Take, ...]
    ) -> ProjectVerdicts:
        """Verdicts on some runs of a project, as its takes and choices were when it was asked for."""
        with self._lock:
            curve, kinds = self.curve(project), self._kinds_of(dataset, takes)
            return ProjectVerdicts(curve, {run.folder: self._verdict(run, curve, kinds) for run in runs})

    def curve(self, project: Project) -> LearningCurve | None:
        """What more takes would bring, as it was measured last."""
        path = project.runs_folder / CURVE_FILE
        stamp = _stamp(path)
        if self._curve is None or self._curve[:2] != (path, stamp):
            self._curve = path, stamp, load_curve(project)
        return self._curve[2]

    def _verdict(self, run: Run, curve: LearningCurve | None, kinds: Kinds) -> RunVerdict:
        stamps = [
            _stamp(run.folder / name) for name in ("report.json", "evaluation.json", "best.safetensors")
        ]
        state = (*stamps, curve, kinds)
        known = self._verdicts.get(run.folder)
        if known is None or known[0] != state:
            known = self._verdicts[run.folder] = (state, verdict(run, curve, kinds))
        return known[1]

    def _kinds_of(self, dataset: Dataset, takes: tuple[Take, ...]) -> Kinds:
        """Once for all the runs of a list: a dataset that is the same one has the same kinds."""
        if self._kinds is None or self._kinds[0] is not dataset or self._kinds[1] != takes:
            self._kinds = dataset, takes, verdict_kinds(dataset, takes)
        return self._kinds[2]


def verdict_kinds(dataset: Dataset, takes: Sequence[Take]) -> Kinds:
    """Seconds by kind of speech of each selection that labels or its emotion tell something of."""
    seconds = {take.id: take.info.duration for take in takes}
    found = {s.id: kinds_of(s, seconds[s.take]) for s in dataset.selections if s.take in seconds}
    return {name: kinds for name, kinds in found.items() if kinds}


def note_of(run: Run) -> str:
    """What a person wrote beside a run."""
    try:
        return (run.folder / NOTE_FILE).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def has_state(run: Run) -> bool:
    """Whether a training can go on from where it was."""
    return (run.folder / "last.safetensors").is_file()


def _stamp(path: Path) -> Stamp:
    """Changes whenever a file does; zeros where there is none."""
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_mtime_ns, stat.st_size


def _age(run: Run) -> float:
    try:
        return run.folder.stat().st_ctime
    except OSError:
        return 0.0
