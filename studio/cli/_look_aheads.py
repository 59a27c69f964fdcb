"""How good a run is at each look-ahead it offers to live use, measured and kept in its report."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from typing import TYPE_CHECKING, Any

from studio.cli._output import Output, silence_stdout
from studio.errors import StudioError

if TYPE_CHECKING:
    from studio.dataset.material import TrainingMaterial
    from studio.evaluation.evaluation_set import EvaluationSet
    from studio.motion import Motion
    from studio.project import Project, Run

OnStep = Callable[[int, int, int], None]
MEASURING = "Measuring how well it does at each look-ahead"
KEPT = ("rmse", "pearson_mouth", "motion_ratio", "std_ratio")


def store_look_aheads(chosen: Run, evaluation_set: EvaluationSet, on_step: OnStep) -> list[dict[str, Any]]:
    """Measure a run at each of its look-aheads on some takes and keep the figures in report.json.

    Args:
        chosen: the run.
        evaluation_set: takes it has not learnt from.
        on_step: told (ms, how many were measured, of how many) before each; what it raises ends the work,
            and nothing is kept.

    Returns:
        For each look-ahead `ms`, `reach_ms` and figures; empty for runs that offer none.
    """
    from studio.evaluation.evaluation_set import evaluate
    from studio.inference.live.steps import look_ahead_of
    from studio.inference.offline import load_predictor
    from studio.sound.sound_file import Sound

    predictor = load_predictor(chosen.folder)
    network, rate = predictor.model.network, predictor.model.recipe.sound.sample_rate
    found: list[dict[str, Any]] = []
    # A run that hears whole sentences goes live at none of them.
    offered = () if predictor.model.recipe.sound.uses_encoder else network.look_aheads
    of, begun = len(offered) * len(evaluation_set.material), count()
    for ms in offered:
        network.set_look_ahead(ms)

        def predict(material: TrainingMaterial, ms: int = ms) -> Motion:
            on_step(ms, next(begun), of)
            sound = Sound(material.samples[:, None], material.sample_rate).resampled(rate)
            return predictor.generate_samples(sound.mono())

        figures = evaluate(predict, evaluation_set.material).metrics
        reach = round(look_ahead_of(predictor.model, ms).reach_ms, 2)
        found.append({"ms": ms, "reach_ms": reach, **{name: figures.get(name) for name in KEPT}})
    if found:
        _keep(chosen, found, evaluation_set)
    return found


def progress_callback(out: Output) -> OnStep:
    """Says what is measured, as `look_aheads` with ms, done, of and fraction; people see it begin."""

    def tell(ms: int, done: int, of: int) -> None:
        facts = {"ms": ms, "done": done, "of": of, "fraction": done / of}
        if done == 0:
            out.event("look_aheads", f"{MEASURING} ...", **facts)
        else:
            out.passing("look_aheads", f"{MEASURING}: {ms} ms ({done + 1} of {of})", **facts)

    return tell


def after_training(project: Project, finished: Run, out: Output, stop: Callable[[], bool]) -> None:
    """Measure every look-ahead on the project's test takes, or validation where there are none.

    The run is complete without it: neither Ctrl+C, a wish to stop nor any failure costs more than the table.

    Args:
        project: the open project.
        finished: the run.
        out: where it is told.
        stop: whether somebody asked to stop since the training ended.
    """
    from studio.evaluation.evaluation_set import choose_evaluation_set

    tell = progress_callback(out)

    def step(ms: int, done: int, of: int) -> None:
        if stop():
            raise KeyboardInterrupt
        tell(ms, done, of)

    try:
        store_look_aheads(finished, choose_evaluation_set(project, None, "test", lambda _: None), step)
    except BrokenPipeError:  # the window died: nobody reads what is said
        silence_stdout()
    except KeyboardInterrupt:
        _left_out(f"The look-aheads of {finished.id} were not measured", project, finished, out)
    except Exception as error:
        why = error.what if isinstance(error, StudioError) else f"{type(error).__name__}: {error}"
        what = f"The look-aheads of {finished.id} could not be measured ({why.rstrip('.: ')})"
        _left_out(what, project, finished, out)


def _left_out(what: str, project: Project, finished: Run, out: Output) -> None:
    """Say that the table is missing, and nothing else."""
    again = f'`saia evaluate "{project.folder}" {finished.id}`'
    text = f"{what}; the run itself is complete. {again} measures them."
    out.event("note", text, text=text)


def _keep(chosen: Run, found: list[dict[str, Any]], evaluation_set: EvaluationSet) -> None:
    from studio.cli._output import plain
    from studio.files.atomic import write_json

    path = chosen.folder / "report.json"
    with suppress(StudioError, OSError, ValueError, RecursionError):
        report = json.loads(path.read_text(encoding="utf-8"))
        report |= {
            "look_aheads": found,
            "look_aheads_on": {"split": evaluation_set.split, "takes": evaluation_set.takes},
        }
        write_json(path, plain(report))
