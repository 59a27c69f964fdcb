"""How good a run is at each look-ahead it offers to live use, measured and kept in its report."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count
from typing import Any

from studio.dataset.material import TrainingMaterial
from studio.errors import StudioError
from studio.evaluation.evaluation_set import EvaluationSet, evaluate
from studio.files.atomic import plain
from studio.motion import Motion
from studio.project import Run, RunReport

OnStep = Callable[[int, int, int], None]
_METRICS = ("rmse", "rmse_face", "pearson_mouth", "motion_ratio", "std_ratio")
"""The figures that Live shows beside its slider."""


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
    from studio.inference.live.steps import look_ahead_of
    from studio.inference.offline import load_predictor

    predictor = load_predictor(chosen.folder)
    network, rate = predictor.model.network, predictor.model.recipe.sound.sample_rate
    found: list[dict[str, Any]] = []
    # A run that hears whole sentences goes live at none of them.
    offered = network.look_aheads if predictor.model.recipe.sound.streams else ()
    of, begun = len(offered) * len(evaluation_set.material), count()
    for ms in offered:
        network.set_look_ahead(ms)

        def predict(material: TrainingMaterial, ms: int = ms) -> Motion:
            on_step(ms, next(begun), of)
            return predictor.generate_samples(material.heard_at(rate))

        figures = evaluate(predict, evaluation_set.material).metrics
        reach = round(look_ahead_of(predictor.model, ms).reach_ms, 2)
        found.append({"ms": ms, "reach_ms": reach, **{name: figures.get(name) for name in _METRICS}})
    if found:
        _save(chosen, found, evaluation_set)
    return found


def _save(chosen: Run, found: list[dict[str, Any]], evaluation_set: EvaluationSet) -> None:
    measured_on = {"split": evaluation_set.split, "takes": evaluation_set.takes}
    # Read anew: the run was loaded before minutes of measuring.
    report = RunReport.load(chosen.folder)
    if report is not None:
        # A run in a folder that cannot be written works all the same; Live then shows no figures.
        with suppress(StudioError):
            replace(report, look_aheads=tuple(plain(found)), look_aheads_on=measured_on).save(chosen.folder)
