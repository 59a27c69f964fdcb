"""Suggestions of likely bad takes and spans, worst first, to be looked at and excluded.

Three sources: what the checks found, how sure the alignment of voice and mouth is, and, once something has
been trained, the spans where the captured motion is furthest from what the run makes of the sound.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from studio.dataset.balance import leaking
from studio.dataset.dataset import Dataset, Selection
from studio.errors import StudioError, say
from studio.files import atomic

if TYPE_CHECKING:
    from studio.take.check import Report
    from studio.take.take import Take

WEIGHTS = {"fatal": 1.0, "major": 0.75, "minor": 0.35}
"""Of a finding by its severity; a note is no reason to look."""
ABOUT_OFFSET = 0.02
"""Seconds within which an offset that was set is the one that was found."""
UNSURE = 0.5
"""Confidence of the alignment below which it is worth a listen."""
WINDOW = 0.5
"""Seconds over which a run's error is averaged."""
SHORTEST = 0.4
"""Seconds that a span of large error has at least."""
STANDS_OUT = 4.0
"""Deviations (as the median measures them) above the median that make an error a large one."""
MOST_SPANS = 5
"""Of one take."""
WORST_FILE = "worst.json"
"""In a run's folder: where it is furthest from what was captured."""

Span = tuple[float, float]
Floats = NDArray[np.floating]


@dataclass(frozen=True)
class WorstSpan:
    """Where a run is far from what was captured.

    Args:
        start, end: seconds on the take's clock.
        ratio: its error against the run's usual one.
    """

    start: float
    end: float
    ratio: float


@dataclass(frozen=True)
class Suggestion:
    """One thing worth a look.

    Args:
        selection: id of the selection it is about.
        kind: a finding's kind, "unsure", "leak", "error" or "unused".
        weight: 0 to 1, how likely it spoils what is learnt; 0 is no fault.
        what, remedy: one sentence each.
        span: where, seconds on the take's clock; None for all of it.
    """

    selection: str
    kind: str
    weight: float
    what: str
    remedy: str
    span: Span | None = None


def suggest(
    dataset: Dataset,
    durations: Mapping[str, float],
    reports: Mapping[str, Report],
    errors: Mapping[str, tuple[WorstSpan, ...]] | None = None,
    run: str = "",
) -> tuple[Suggestion, ...]:
    """Everything worth a look, the worst first.

    Selections that are not used, and spans that are left out or trimmed away already, are passed over.

    Args:
        dataset: the choices.
        durations: seconds by take id; a take without one is passed over.
        reports: checks by take id, those that were made.
        errors: spans of large error by selection id.
        run: what the run is called that made the errors.
    """
    found: list[Suggestion] = list(_leaks(dataset))
    for selection in dataset.selections:
        # What is not used cannot spoil what is learnt.
        if not selection.split or selection.take not in durations:
            continue
        duration = durations[selection.take]
        if selection.take in reports:
            found += _of_report(selection, reports[selection.take], duration)
        for worst in (errors or {}).get(selection.id, ()):
            found += _of_error(selection, worst, duration, run)
    return tuple(sorted(found, key=lambda one: (-one.weight, one.selection, one.span or (0.0, 0.0))))


def unused(dataset: Dataset, takes: Iterable[Take]) -> tuple[Suggestion, ...]:
    """Takes without sound or without motion that are not used: no fault, but worth knowing."""
    incomplete = {take.id for take in takes if not take.trains}
    remedy = "Import sound and motion under one name to train on them; Review can use sound alone."
    return tuple(
        Suggestion(
            s.id,
            "unused",
            0.0,
            say("{take} is not used: training needs both sound and motion.", take=s.id),
            remedy,
        )
        for s in dataset.selections
        if not s.split and s.take in incomplete
    )


def grouped(found: Iterable[Suggestion]) -> tuple[tuple[Suggestion, ...], ...]:
    """Equal findings about whole takes together; one that has a span stands alone. The order stays."""
    groups: dict[object, list[Suggestion]] = {}
    for number, one in enumerate(found):
        key = (one.kind, one.remedy) if one.span is None else number
        groups.setdefault(key, []).append(one)
    return tuple(map(tuple, groups.values()))


def worst_spans(takes: Mapping[str, tuple[Floats, Floats]]) -> dict[str, tuple[WorstSpan, ...]]:
    """Where errors are large against all the others.

    Args:
        takes: (seconds on the take's clock (T,) at even steps, error (T,)) by selection id; an error that is
            not finite does not count.

    Returns:
        By selection id, the largest first; takes without one are not in it.
    """
    smooth = {name: (times, _smoothed(times, error)) for name, (times, error) in takes.items()}
    everything = np.concatenate([error for _, error in smooth.values()] or [np.zeros(0)])
    everything = everything[np.isfinite(everything)]
    if not everything.size:
        return {}
    # Median and its deviation: the very spans looked for would lift a mean and hide themselves.
    usual = float(np.median(everything))
    spread = 1.4826 * float(np.median(np.abs(everything - usual)))
    limit = usual + STANDS_OUT * max(spread, 0.05 * usual, 1e-9)
    spans = {
        name: _spans_above(times, error, limit, max(usual, 1e-9)) for name, (times, error) in smooth.items()
    }
    return {name: found for name, found in spans.items() if found}


def keep_worst(run_folder: Path, worst: Mapping[str, tuple[WorstSpan, ...]]) -> None:
    """Keep a run's spans beside its weights; a folder that cannot be written is no matter."""
    plain = {name: [asdict(span) for span in spans] for name, spans in worst.items()}
    with suppress(StudioError):
        atomic.write_json(run_folder / WORST_FILE, {"worst": plain})


def kept_worst(run_folder: Path) -> dict[str, tuple[WorstSpan, ...]] | None:
    """A run's spans by selection id as they were kept; None where there are none, or they are damaged."""
    try:
        content = atomic.read_json(run_folder / WORST_FILE)["worst"]
        return worst_of_plain(content)
    except (OSError, StudioError, KeyError, TypeError, ValueError, AttributeError):
        return None


def worst_of_plain(content: Mapping[str, Any]) -> dict[str, tuple[WorstSpan, ...]]:
    """Spans out of JSON values; KeyError, TypeError or ValueError where they make no sense."""
    return {
        str(name): tuple(WorstSpan(float(s["start"]), float(s["end"]), float(s["ratio"])) for s in spans)
        for name, spans in content.items()
    }


def _leaks(dataset: Dataset) -> Iterator[Suggestion]:
    """Parts that judge a training which has learnt from other parts of the same take."""
    apart = set(leaking(dataset))
    for selection in dataset.selections:
        if selection.take in apart and selection.split in ("val", "test"):
            what = say(
                "It tests the training, but other parts of {take} are trained on.", take=selection.take
            )
            remedy = "Use all parts of a take for the same, or press Split automatically."
            yield Suggestion(selection.id, "leak", 0.8, what, remedy)


def _of_report(selection: Selection, report: Report, duration: float) -> Iterator[Suggestion]:
    fits = report.offset_ms is not None and abs(selection.offset - report.offset_ms / 1000) < ABOUT_OFFSET
    for finding in report.findings:
        if finding.severity not in WEIGHTS or (finding.kind == "offset" and fits):
            continue
        if finding.kind in ("ends", "starts") and _is_trimmed_away(selection, finding.kind, finding.at):
            continue
        span = None
        if finding.at is not None:
            span = (finding.at, finding.until if finding.until is not None else finding.at)
            if not _is_used(selection, span, duration):
                continue
        weight = WEIGHTS[finding.severity] + 0.2 * _share(selection, span, duration)
        yield Suggestion(selection.id, finding.kind, min(weight, 1.0), finding.what, finding.remedy, span)
    # One word about a take's timing is enough; two would be two rows for one fault.
    told = any(finding.kind in ("mouth", "offset") for finding in report.findings)
    unsure = report.correlation is not None and report.confidence < UNSURE
    if unsure and not told and selection.offset == 0.0:
        what = say(
            "Mouth and voice may be out of sync ({confidence}).", confidence=f"{report.confidence:.0%}"
        )
        weight = 0.2 + 0.2 * (1.0 - report.confidence / UNSURE)
        remedy = "Listen to it, and nudge the motion if it is late or early."
        yield Suggestion(selection.id, "unsure", weight, what, remedy)


def _of_error(selection: Selection, worst: WorstSpan, duration: float, run: str) -> Iterator[Suggestion]:
    span = (worst.start, worst.end)
    if _is_used(selection, span, duration):
        weight = min(0.4 + 0.05 * worst.ratio + 0.2 * _share(selection, span, duration), 0.95)
        what = say(
            "{run} is {ratio} times as far off here as usual.",
            run=run or say("The run"),
            ratio=f"{worst.ratio:.1f}",
        )
        remedy = "Check whether the captured motion is right; if not, leave the span out."
        yield Suggestion(selection.id, "error", weight, what, remedy, span)


def _is_trimmed_away(selection: Selection, kind: str, at: float | None) -> bool:
    """Whether the part where only sound or only motion is lies outside of the in and out points."""
    if kind == "starts":
        return selection.in_point > 0.0
    return at is not None and selection.out_point is not None and selection.out_point <= at + 0.1


def _is_used(selection: Selection, span: Span, duration: float) -> bool:
    """Whether any of a span is learnt from."""
    out = duration if selection.out_point is None else selection.out_point
    start, end = max(span[0], selection.in_point), min(span[1], out)
    if end < start or span[0] > out:
        return False
    return not any(a - 1e-6 <= start and end <= b + 1e-6 for a, b in selection.excluded)


def _share(selection: Selection, span: Span | None, duration: float) -> float:
    """Part of the selection that a span covers, 0 to 1."""
    if span is None:
        return 1.0
    out = duration if selection.out_point is None else min(selection.out_point, duration)
    whole = max(out - selection.in_point, 1e-6)
    return min(max(span[1] - span[0], 0.0) / whole, 1.0)


def _smoothed(times: Floats, error: Floats) -> Floats:
    """Means over WINDOW around each moment; NaN where nothing in it counts."""
    if len(times) < 2:
        return np.full(len(times), np.nan)
    # Frames that do not count are NaN; one of them would blank its whole window.
    good = np.isfinite(error)
    width = max(round(WINDOW / float(np.median(np.diff(times)))), 1)
    ones = np.ones(min(width, len(error)))
    sums = np.convolve(np.where(good, error, 0.0), ones, "same")
    counts = np.convolve(good.astype(float), ones, "same")
    means: Floats = np.where(good & (counts > 0), sums / np.maximum(counts, 1.0), np.nan)
    return means


def _spans_above(times: Floats, error: Floats, limit: float, usual: float) -> tuple[WorstSpan, ...]:
    above = np.concatenate([[False], np.nan_to_num(error) > limit, [False]])
    edges = np.flatnonzero(np.diff(above.astype(np.int8)))
    found = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        start, end = float(times[first]), float(times[last - 1])
        if end - start >= SHORTEST:
            ratio = float(np.nanmean(error[first:last])) / usual
            found.append(WorstSpan(round(start, 3), round(end, 3), round(ratio, 2)))
    found.sort(key=lambda span: -span.ratio)
    return tuple(found[:MOST_SPANS])
