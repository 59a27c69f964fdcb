"""`saia suggest`: the takes and spans most likely bad, the worst first."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output
from studio.ipc.events import CheckedEvent, ErrorSpan, MeasuredEvent, SuggestDone, SuggestionEvent

if TYPE_CHECKING:
    from studio.dataset.suggest import Suggestion, WorstSpan
    from studio.project import Project, Run
    from studio.take.check import Report

EXAMPLE = "saia suggest MyProject --run balanced_001"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT [--run RUN] [--only-run]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("--run", metavar="RUN", help="also where this trained run is furthest off")
    parser.add_argument("--only-run", action="store_true", help="leave the checks out; needs --run")
    parser.add_argument("--most", type=int, default=30, metavar="N", help="lines to print (30)")


def run(args: argparse.Namespace, out: Output) -> None:
    """Check, measure, rank; only reads the takes."""
    from studio.cli._project import opened
    from studio.dataset.suggest import suggest

    project = opened(args.project, out)
    chosen = project.run(args.run) if args.run else None
    errors = measured(project, chosen, out) if chosen else {}
    reports = {} if args.only_run else _checked(project, out)
    durations = {take.id: take.info.duration for take in project.takes}
    # Ranked together: the worst comes first, whichever way it was found.
    found = suggest(project.dataset, durations, reports, errors, chosen.id if chosen else "")
    for one in found[: max(args.most, 0)]:
        out.emit(SuggestionEvent(**asdict(one)), _line(one))
    worst = {name: tuple(ErrorSpan(**asdict(span)) for span in spans) for name, spans in errors.items()}
    out.done(SuggestDone(len(found), chosen.id if chosen else None, worst), _last(len(found)))


def measured(project: Project, chosen: Run, out: Output) -> dict[str, tuple[WorstSpan, ...]]:
    """Spans of large error by selection id, also kept beside the run's weights.

    Raises:
        StudioError: the run cannot generate, or there is nothing to hold it against.
    """
    from studio.dataset.suggest import keep_worst, worst_spans
    from studio.evaluation.evaluation_set import choose_evaluation_set, pair
    from studio.inference.offline import load_predictor
    from studio.metrics.scores import frame_errors

    # What is used for nothing spoils nothing.
    used = [s.id for s, _ in project.selected() if s.split]
    evaluation_set = choose_evaluation_set(project, used or None, "train", out.note)
    predictor = load_predictor(chosen.folder)
    rate = predictor.model.recipe.sound.sample_rate
    pairs = {}
    for count, material in enumerate(evaluation_set.material, 1):
        pairs[material.selection.id] = pair(predictor.generate_samples(material.heard_at(rate)), material)
        fraction = count / len(evaluation_set.material)
        out.emit(MeasuredEvent(take=material.selection.id, fraction=fraction))
    start = {
        material.selection.id: max(material.selection.in_point, 0.0) for material in evaluation_set.material
    }
    errors = {name: (times + start[name], error) for name, (times, error) in frame_errors(pairs).items()}
    spans = worst_spans(errors)
    # Kept beside the weights: Curate shows it without measuring again.
    if not chosen.is_shipped:
        keep_worst(chosen.folder, spans)
    return spans


def _checked(project: Project, out: Output) -> dict[str, Report]:
    from studio.take.check import check_take

    used = {s.take for s in project.dataset.selections if s.split}
    takes = [take for take in project.takes if take.id in used]
    reports = {}
    for count, take in enumerate(takes, 1):
        reports[take.id] = check_take(take)
        out.emit(CheckedEvent(take.id, count / len(takes)))
    return reports


def _line(one: Suggestion) -> str:
    where = f" {one.span[0]:.2f} to {one.span[1]:.2f} s" if one.span else ""
    return f"{one.weight:4.0%}  {one.selection}{where}: {one.what} {one.remedy}"


def _last(count: int) -> str:
    if not count:
        return "Nothing to fix."
    return "1 thing to look at." if count == 1 else f"{count} things to look at."
