"""What `saia evaluate`, `compare` and `train` share: runs and simple guesses measured, and their table."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from studio.cli._output import Output, silence_stdout
from studio.errors import StudioError, say
from studio.files.atomic import plain, write_json
from studio.ipc.events import BaselinesEvent, EvaluateDone, LookAheadsEvent, MeasureProgressEvent
from studio.project.run import EVALUATION_FILE

if TYPE_CHECKING:
    from studio.dataset.material import TrainingMaterial
    from studio.evaluation.evaluation_set import Evaluation, EvaluationSet
    from studio.evaluation.look_aheads import OnStep
    from studio.motion import Motion
    from studio.project import Project, Run

SPLITS = ("test", "val", "train")
MAIN = (
    ("rmse", "RMSE", 4), ("pearson", "r", 2), ("pearson_mouth", "r mouth", 2), ("pearson_jaw", "r jaw", 2),
    ("motion_ratio", "motion", 2), ("std_ratio", "std", 2), ("jerk_ratio", "jerk", 2),
    ("closure_recall", "closes", 2), ("closure_precision", "rightly", 2), ("sync_match", "sync", 2),
    ("mouth_lag_ms", "lag ms", 0), ("geodesic_deg", "degrees", 2),
    ("wrist_cm", "wrist cm", 1), ("frechet", "Frechet", 2),
)  # fmt: skip
"""The figures a table shows, with their titles and digits; --all shows MORE too."""
MORE = (
    ("nrmse", "RMSE, each channel scaled to its range", 4), ("mae", "mean absolute error", 4),
    ("rmse_face", "RMSE of the blend shapes", 4), ("rmse_body", "RMSE of the rotations (6D)", 4),
    ("pearson_face", "correlation of the blend shapes", 2),
    ("motion_ratio_face", "motion of the face, predicted / captured", 2),
    ("motion_ratio_body", "motion of the body", 2), ("motion_ratio_head", "motion of the head", 2),
    ("motion_ratio_torso", "motion of the torso", 2), ("motion_ratio_arms", "motion of the arms", 2),
    ("blinks_per_minute", "blinks per minute", 1), ("head_cm", "error of the head's place, cm", 1),
    ("beat_alignment", "gestures on the beats of the voice, 0 to 1", 2),
    ("diversity_face", "variety of the face (L1Div)", 3),
    ("diversity_body_cm", "variety of the body (L1Div), cm", 1),
)  # fmt: skip
_LONG_TITLES = {
    "rmse": "RMSE of face and body (lower is nearer)", "pearson": "correlation of what moves",
    "pearson_mouth": "correlation of the mouth", "pearson_jaw": "correlation of the jaw",
    "motion_ratio": "motion, predicted / captured (1 is as lively)",
    "std_ratio": "width of poses, predicted / captured", "jerk_ratio": "jerk, predicted / captured",
    "closure_recall": "closed mouth while speaking: recall", "mouth_lag_ms": "mouth after the voice, ms",
    "closure_precision": "closed mouth while speaking: precision",
    "sync_match": "fits its own sound better than another (0.5 is chance)",
    "geodesic_deg": "error of rotations, degrees", "wrist_cm": "error of the wrists' places, cm",
    "frechet": "Frechet distance (0 the same, 1 a frozen mean)",
}  # fmt: skip
CAPTURED = "captured"
"""The row of what was captured, held against itself."""


def say_learnt(chosen: Run, evaluation_set: EvaluationSet, out: Output) -> None:
    """A note where the run learnt from a take measured on, whatever that take is marked as by now."""
    names = chosen.facts.train
    # A run names parts (Hello_001.2), and a take measured on may be whole by now.
    learnt = {*names, *(_PART.sub("", name) for name in names)}
    measured = [material.selection for material in evaluation_set.material]
    found = dict.fromkeys(s.take for s in measured if learnt & {s.take, s.id})
    if found:
        takes = ", ".join(found)
        out.note(
            say(
                "{run} learnt from all or part of {takes}; such figures say nothing about new sound.",
                run=chosen.id,
                takes=takes,
            )
        )


_PART = re.compile(r"\.\d+$")
"""What the id of a part adds to its take's."""


def measure(
    chosen: Run,
    evaluation_set: EvaluationSet,
    out: Output,
    style: str | None = None,
    seed: int = 0,
    liveliness: float = 1.0,
) -> Evaluation:
    """A run's figures in a style, its own default where None, and as `saia generate` draws by default.

    How far it is is told before each take, as `progress`.
    """
    from studio.evaluation.evaluation_set import evaluate
    from studio.inference.offline import load_predictor, sampling_of

    # Once for all takes: loading weights takes longer than generating a short take.
    predictor, sampling = load_predictor(chosen.folder), sampling_of(seed, liveliness)
    rate, waiting = predictor.model.recipe.sound.sample_rate, iter(range(len(evaluation_set.material)))

    def predict(material: TrainingMaterial) -> Any:
        done, of, take = next(waiting), len(evaluation_set.material), material.selection.id
        text = f"{chosen.id} listens to {take} ({done + 1} of {of})"
        out.pass_by(MeasureProgressEvent(done / of, run=chosen.id, take=take, done=done, of=of), text)
        return predictor.generate_samples(material.heard_at(rate), style, sampling)

    return evaluate(predict, evaluation_set.material)


_WORDS = "Simple guesses to beat"


def captured_figures(evaluation_set: EvaluationSet) -> dict[str, float | None]:
    """Figures of the captured motion itself: what is perfect, and how often people blink."""
    from studio.evaluation.evaluation_set import evaluate

    return evaluate(lambda material: material.motion, evaluation_set.material).metrics


def baseline_figures(
    project: Project, chosen: Run, evaluation_set: EvaluationSet, out: Output
) -> dict[str, Any]:
    """Figures of the baselines, fitted to the takes the run was trained on.

    What it is at is told as `baselines`, with `name` ("" while they are fitted), `take`, `done`, `of` and
    `fraction`: an hour of takes keeps it busy for longer than a person waits for a silent program.
    """
    from fractions import Fraction

    from studio.evaluation.evaluation_set import RIDGE_SOUND, Baselines, evaluate
    from studio.training.gather import cache_folder, load_usable

    ids = set(chosen.facts.train)
    # Where a report names none of the takes there are, all that is marked for training must do.
    named = [(s, t) for s, t in project.selected() if s.id in ids] or list(project.selected("train"))
    # Before reading: an hour of takes keeps it silent for long.
    out.pass_by(BaselinesEvent(), f"{_WORDS}: reading what {chosen.id} learnt from")
    material, _ = load_usable(named, RIDGE_SOUND)
    if not material:
        out.note(say("The takes the run was trained on are gone; there are no baselines to compare with."))
        return {}
    fps = Fraction(chosen.facts.fps or 30).limit_denominator(1001)
    progress = _ProgressReport(out, len(material) + len(Baselines.names) * len(evaluation_set.material))
    baselines = Baselines(material, fps, cache_folder(project), on_take=progress.fitted)

    def figures(name: str) -> dict[str, float | None]:
        def predict(material: TrainingMaterial) -> Motion:
            progress.guessed(name, material.selection.id)
            return baselines.predict(name, material)

        return evaluate(predict, evaluation_set.material).metrics

    return {name: figures(name) for name in baselines.names}


class _ProgressReport:
    """Says what the baselines are at, before each step.

    Args:
        out: where to.
        of: how many steps there are.
    """

    def __init__(self, out: Output, of: int) -> None:
        self._out, self._of, self._done = out, of, 0

    def fitted(self, take: str) -> None:
        """A take that the run learnt from is read for them."""
        self._tell(f"{_WORDS}: learning from {take}", "", take)

    def guessed(self, name: str, take: str) -> None:
        """One of them is measured on a take."""
        self._tell(f"{_WORDS}: {name} on {take}", name, take)

    def _tell(self, text: str, name: str, take: str) -> None:
        done, of = self._done, self._of
        self._done += 1
        self._out.pass_by(BaselinesEvent(name, take, done, of, done / of), f"{text} ({done + 1} of {of})")


EXPECTED, DRAWN = "expected", "drawn"


def poses_measured(chosen: Run, liveliness: float) -> str:
    """Whether a run's figures are those of expected poses or of such as chance draws around them."""
    draws = bool(chosen.facts.draws)
    return DRAWN if draws and liveliness > 0 else EXPECTED


def keep_evaluation(chosen: Run, done: EvaluateDone) -> None:
    """evaluation.json beside the weights; a folder that cannot be written is no matter."""
    # Figures on one project's takes are nothing that the next project's people want to see.
    if not chosen.is_shipped:
        with suppress(StudioError):
            write_json(chosen.folder / EVALUATION_FILE, plain(done))


MEASURING = "Measuring how well it does at each look-ahead"


def progress_callback(out: Output) -> OnStep:
    """Says what is measured, as `look_aheads` with ms, done, of and fraction; people see it begin."""

    def report(ms: int, done: int, of: int) -> None:
        event = LookAheadsEvent(ms, done, of, done / of)
        if done == 0:
            out.emit(event, f"{MEASURING} ...")
        else:
            out.pass_by(event, f"{MEASURING}: {ms} ms ({done + 1} of {of})")

    return report


def after_training(project: Project, finished: Run, out: Output, stop: Callable[[], bool]) -> None:
    """Measure a run on the project's test takes, or validation where there are none, at every look-ahead too.

    The run is complete without it: neither Ctrl+C, a request to stop nor a failure costs more than figures.

    Args:
        project: the open project.
        finished: the run.
        out: where it is told.
        stop: whether somebody asked to stop since the training ended.
    """
    from studio.evaluation.evaluation_set import choose_evaluation_set
    from studio.evaluation.look_aheads import store_look_aheads

    report = progress_callback(out)

    def step(ms: int, done: int, of: int) -> None:
        if stop():
            raise KeyboardInterrupt
        report(ms, done, of)

    try:
        evaluation_set = choose_evaluation_set(project, None, "test", lambda _: None)
        _store_figures(finished, evaluation_set, out, stop)
        store_look_aheads(finished, evaluation_set, step)
    except BrokenPipeError:
        # The window died: nobody reads what is said.
        silence_stdout()
    # The run is saved by now, so the exit code stays that of a training that ended well.
    except KeyboardInterrupt:
        what = say("The look-aheads of {run} were not measured", run=finished.id)
        _left_out(what, project, finished, out)
    except Exception as error:
        why = error.what if isinstance(error, StudioError) else f"{type(error).__name__}: {error}"
        what = say(
            "The look-aheads of {run} could not be measured ({reason})",
            run=finished.id,
            reason=why.rstrip(".: "),
        )
        _left_out(what, project, finished, out)


def _store_figures(
    finished: Run, evaluation_set: EvaluationSet, out: Output, stop: Callable[[], bool]
) -> None:
    """Every figure of the run, take by take, which its verdict and its card are read from."""
    from studio.evaluation.evaluation_set import evaluate
    from studio.evaluation.model_card import write_card
    from studio.inference.offline import load_predictor, sampling_of

    out.pass_by(LookAheadsEvent(), "Measuring how good it is ...")
    predictor, sampling = load_predictor(finished.folder), sampling_of(0, 1.0)
    rate = predictor.model.recipe.sound.sample_rate

    def predict(material: TrainingMaterial) -> Motion:
        if stop():
            raise KeyboardInterrupt
        return predictor.generate_samples(material.heard_at(rate), None, sampling)

    result, facts = evaluate(predict, evaluation_set.material), finished.facts
    done = EvaluateDone(
        run=finished.id,
        seed=facts.seed,
        best_epoch=facts.best_epoch,
        style=facts.style or "average",
        chance={"seed": 0, "liveliness": 1.0},
        poses=poses_measured(finished, 1.0),
        split=evaluation_set.split,
        takes=tuple(evaluation_set.takes),
        frames=result.frames,
        metrics=result.metrics,
        per_take=result.per_take,
        per_bone=result.per_bone,
    )
    keep_evaluation(finished, done)
    with suppress(StudioError):
        write_card(finished.folder)


def _left_out(what: str, project: Project, finished: Run, out: Output) -> None:
    """Say that the table is missing, and nothing else."""
    again = f'`saia evaluate "{project.folder}" {finished.id}`'
    out.note(say("{what}; the run itself is complete. {command} measures them.", what=what, command=again))


READING = (
    "RMSE, degrees and wrist are errors: less is better. r, motion and std are best near 1, as you moved.\n"
    "RMSE counts face and body; what the window calls error is the face's alone, which --all names.\n"
    "captured is yourself; zero, train_mean and ridge are simple guesses to beat. --all names every figure."
)


def table(rows: Mapping[str, Mapping[str, float | None]], every: bool = False) -> str:
    """Figures side by side for people; those that apply to none are left out.

    Args:
        rows: figures by the name of the run, the baseline or the take.
        every: all of them, one figure a line.
    """
    # Thirty figures side by side fit no terminal.
    if every:
        return _tall_table(rows)
    shown = _applying(MAIN, rows)
    width = max(len(name) for name in rows)
    lines = [" " * width + "".join(f"{title:>9}" for _, title, _ in shown)]
    for name, figures in rows.items():
        cells = (_cell(figures.get(key), digits) for key, _, digits in shown)
        lines.append(f"{name:<{width}}" + "".join(f"{cell:>9}" for cell in cells))
    return "\n".join([*lines, READING])


def _tall_table(rows: Mapping[str, Mapping[str, float | None]]) -> str:
    shown = [
        (key, _LONG_TITLES.get(key, title), digits) for key, title, digits in _applying(MAIN + MORE, rows)
    ]
    width = max((len(title) for _, title, _ in shown), default=0)
    lines = [" " * width + "".join(f"  {name.strip():>9}" for name in rows)]
    for key, title, digits in shown:
        cells = (
            f"  {_cell(figures.get(key), digits):>{max(9, len(name.strip()))}}"
            for name, figures in rows.items()
        )
        lines.append(f"{title:<{width}}" + "".join(cells))
    return "\n".join(lines)


def _applying(
    columns: tuple[tuple[str, str, int], ...], rows: Mapping[str, Mapping[str, float | None]]
) -> list[tuple[str, str, int]]:
    return [c for c in columns if any(figures.get(c[0]) is not None for figures in rows.values())]


def _cell(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
