"""`saia evaluate`: how near and how alive a run's motion is, beside the baselines."""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.cli._baselines import baseline_figures, captured_figures
from studio.cli._export import add_sampling_options
from studio.cli._look_aheads import progress_callback, store_look_aheads
from studio.cli._output import Output
from studio.cli._project import trim_cache
from studio.evaluation.evaluation_set import EvaluationSet, choose_evaluation_set

if TYPE_CHECKING:
    from studio.dataset.material import TrainingMaterial
    from studio.evaluation.evaluation_set import Evaluation
    from studio.project import Run

EXAMPLE = "saia evaluate MyProject balanced_001"
SPLITS = ("test", "val", "train")
MAIN = (
    ("rmse", "RMSE", 4), ("pearson", "r", 2), ("pearson_mouth", "r mouth", 2), ("pearson_jaw", "r jaw", 2),
    ("motion_ratio", "motion", 2), ("std_ratio", "std", 2), ("jerk_ratio", "jerk", 2),
    ("closure_recall", "closes", 2), ("mouth_lag_ms", "lag ms", 0), ("geodesic_deg", "degrees", 2),
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
    ("closure_precision", "closed mouth while speaking: precision", 2),
    ("blinks_per_minute", "blinks per minute", 1), ("head_cm", "error of the head's place, cm", 1),
    ("beat_alignment", "gestures on the beats of the voice, 0 to 1", 2),
    ("diversity_face", "variety of the face (L1Div)", 3),
    ("diversity_body_cm", "variety of the body (L1Div), cm", 1),
)  # fmt: skip
_IN_WORDS = {
    "rmse": "RMSE of face and body (lower is nearer)", "pearson": "correlation of what moves",
    "pearson_mouth": "correlation of the mouth", "pearson_jaw": "correlation of the jaw",
    "motion_ratio": "motion, predicted / captured (1 is as lively)",
    "std_ratio": "width of poses, predicted / captured", "jerk_ratio": "jerk, predicted / captured",
    "closure_recall": "closed mouth while speaking: recall", "mouth_lag_ms": "mouth after the voice, ms",
    "geodesic_deg": "error of rotations, degrees", "wrist_cm": "error of the wrists' places, cm",
    "frechet": "Frechet distance (0 the same, 1 a frozen mean)",
}  # fmt: skip
CAPTURED = "captured"
"""The row of what was captured, held against itself."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN [--takes T...] [--split test] [--style NAME] [--all]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("run", help="the run to measure")
    parser.add_argument("--takes", nargs="+", metavar="T", help="measure on these takes")
    parser.add_argument("--split", choices=SPLITS, default="test", help="measure on this split (test)")
    parser.add_argument("--style", metavar="NAME", help="measure this style (the one chosen on validation)")
    add_sampling_options(parser)
    parser.add_argument("--no-baselines", action="store_true", help="leave the baselines out")
    parser.add_argument("--all", action="store_true", help="show every figure, one a line")


def run(args: argparse.Namespace, out: Output) -> None:
    """Generate motion for the takes, compare, and keep the figures in the run's folder."""
    from studio.cli._project import opened

    project = opened(args.project, out)
    chosen = project.run(args.run)
    evaluation_set = choose_evaluation_set(project, args.takes, args.split, out.note)
    say_learnt(chosen, evaluation_set, out)
    result = measure(chosen, evaluation_set, out, args.style, args.seed, args.liveliness)
    baselines = {} if args.no_baselines else baseline_figures(project, chosen, evaluation_set, out)
    facts = {
        "run": chosen.id,
        "seed": seed_of(chosen),
        "style": args.style or (chosen.report or {}).get("style", "average"),
        "chance": {"seed": args.seed, "liveliness": args.liveliness},
        "poses": poses_measured(chosen, args.liveliness),
        "split": evaluation_set.split,
        "takes": evaluation_set.takes,
        "frames": result.frames,
        "metrics": result.metrics,
        "per_take": result.per_take,
        "per_bone": result.per_bone,
        "captured": captured_figures(evaluation_set),
        "baselines": baselines,
    }
    _keep(chosen, facts)
    if not args.takes and args.split == "test" and args.style is None:  # what Live shows beside its slider
        store_look_aheads(chosen, evaluation_set, progress_callback(out))
    trim_cache(project)
    rows = {chosen.id: result.metrics, **baselines, CAPTURED: facts["captured"]}
    if len(result.per_take) > 1:
        rows |= {f"  {take}": figures for take, figures in result.per_take.items()}
    title = f"{chosen.id} (seed {facts['seed']}) on {evaluation_set.words(result.frames)}"
    if facts["poses"] == DRAWN:
        title += f", drawn with seed {args.seed} at liveliness {args.liveliness:g}"
    out.done(f"{title}\n{table(rows, every=args.all)}", **facts)


EXPECTED, DRAWN = "expected", "drawn"


def poses_measured(chosen: Run, liveliness: float) -> str:
    """Whether a run's figures are those of expected poses or of such as chance draws around them."""
    draws = bool((chosen.report or {}).get("draws", False))
    return DRAWN if draws and liveliness > 0 else EXPECTED


def say_learnt(chosen: Run, evaluation_set: EvaluationSet, out: Output) -> None:
    """A note where the run learnt from a take measured on, whatever that take is marked as by now."""
    names = [str(name) for name in (chosen.report or {}).get("train", ())]
    learnt = {*names, *(_PART.sub("", name) for name in names)}
    measured = [material.selection for material in evaluation_set.material]
    found = dict.fromkeys(s.take for s in measured if learnt & {s.take, s.id})
    if found:
        takes = ", ".join(found)
        text = f"{chosen.id} learnt from all or part of {takes}; such figures say nothing about new sound."
        out.event("note", text, text=text)


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
    from studio.sound.sound_file import Sound

    predictor, sampling = load_predictor(chosen.folder), sampling_of(seed, liveliness)
    rate, waiting = predictor.model.recipe.sound.sample_rate, iter(range(len(evaluation_set.material)))

    def predict(material: TrainingMaterial) -> Any:
        done, of, take = next(waiting), len(evaluation_set.material), material.selection.id
        text = f"{chosen.id} listens to {take} ({done + 1} of {of})"
        out.passing("progress", text, run=chosen.id, take=take, done=done, of=of, fraction=done / of)
        sound = Sound(material.samples[:, None], material.sample_rate).resampled(rate)
        return predictor.generate_samples(sound.mono(), style, sampling)

    return evaluate(predict, evaluation_set.material)


def seed_of(chosen: Run) -> int | None:
    """The seed a run was trained with, None where its report does not say."""
    seed = (chosen.report or {}).get("seed")
    return seed if isinstance(seed, int) else None


def _keep(chosen: Run, facts: Mapping[str, Any]) -> None:
    """evaluation.json beside the weights; a folder that cannot be written is no matter."""
    from contextlib import suppress

    from studio.cli._output import plain
    from studio.errors import StudioError
    from studio.files.atomic import write_json

    with suppress(StudioError):
        write_json(chosen.folder / "evaluation.json", plain(dict(facts)))


READING = (
    "RMSE, degrees and wrist are errors: less is better. r, motion and std are best near 1, as you moved.\n"
    "RMSE counts face and body together; what Review calls error is the face's alone, as --all names it.\n"
    "captured is yourself; zero, train_mean and ridge are simple guesses to beat. --all names every figure."
)


def table(rows: Mapping[str, Mapping[str, float | None]], every: bool = False) -> str:
    """Figures side by side for people; those that apply to none are left out.

    Args:
        rows: figures by the name of the run, the baseline or the take.
        every: all of them, one figure a line.
    """
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
    shown = [(key, _IN_WORDS.get(key, title), digits) for key, title, digits in _applying(MAIN + MORE, rows)]
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
