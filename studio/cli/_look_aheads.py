"""How good a run is at each look-ahead it offers to live use, measured and kept in its report."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from studio.cli._output import Output
from studio.errors import StudioError

if TYPE_CHECKING:
    from studio.cli.evaluate import Ground
    from studio.project import Project, Run

KEPT = ("rmse", "pearson_mouth", "motion_ratio", "std_ratio")


def keep_look_aheads(chosen: Run, ground: Ground) -> list[dict[str, Any]]:
    """Measure a run at each of its look-aheads on some takes and keep the figures in report.json.

    Args:
        chosen: the run.
        ground: takes it has not learnt from.

    Returns:
        For each look-ahead `ms`, `reach_ms` and figures; empty for runs that offer none.
    """
    from studio.generate import load_predictor
    from studio.live.steps import hearing
    from studio.take.sound import Sound
    from studio.training.metrics_evaluate import evaluate

    predictor = load_predictor(chosen.folder)
    network, rate = predictor.model.network, predictor.model.recipe.sound.sample_rate
    found: list[dict[str, Any]] = []
    # A run that hears whole sentences goes live at none of them.
    for ms in () if predictor.model.recipe.sound.speaks else network.look_aheads:
        network.hear_ahead(ms)
        figures = evaluate(
            lambda material: predictor.generate_samples(
                Sound(material.samples[:, None], material.sample_rate).resampled(rate).mono()
            ),
            ground.material,
        ).metrics
        reach = round(hearing(predictor.model, ms).reach_ms, 2)
        found.append({"ms": ms, "reach_ms": reach, **{name: figures.get(name) for name in KEPT}})
    if found:
        _keep(chosen, found, ground)
    return found


def after_training(project: Project, finished: Run, out: Output) -> None:
    """The same on the project's test takes, or validation where there are none; no failure of a training."""
    from studio.cli.evaluate import choose_ground

    with suppress(StudioError):
        keep_look_aheads(finished, choose_ground(project, None, "test", _Quiet(out.as_json)))


class _Quiet(Output):
    """Says nothing: notes about takes were given before."""

    def event(self, name: str, text: str = "", /, **facts: Any) -> None:
        return


def _keep(chosen: Run, found: list[dict[str, Any]], ground: Ground) -> None:
    from studio.cli._output import _plain
    from studio.take.safe_file import write_json

    path = chosen.folder / "report.json"
    with suppress(StudioError, OSError, ValueError):
        report = json.loads(path.read_text(encoding="utf-8"))
        report |= {"look_aheads": found, "look_aheads_on": {"split": ground.split, "takes": ground.takes}}
        write_json(path, _plain(report))
