"""A run in words: how good it is, what would help most, and what that was measured on. No torch.

Every sentence follows from figures of this run on this person's takes. The thresholds stand between figures
that were measured of known models on takes never at hand (FACEGOOD, ten minutes of one speaker): the mean
pose follows the mouth at r 0, the first notebook at .01, networks on plain sound at .34 to .38, the speech
encoder at .44 to .48. Of motion a network trained by squared error has .6 to .7, one that stands still below
.1, one that trembles above 3.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from studio.errors import StudioError, Text, capital, say, together
from studio.evaluation.learning_curve import LearningCurve, error_of, follows, number_of
from studio.files import atomic
from studio.metrics.scores import STILL_RATIO
from studio.project import Run, RunReport
from studio.project.run import EVALUATION_FILE, WEIGHTS_FILE

CLOSELY, WELL, ROUGHLY = 0.6, 0.4, 0.25
"""Correlation of the mouth from which a run follows it so."""
MUCH_LESS, LESS, MORE, MUCH_MORE = 0.6, 0.85, 1.25, 1.6
"""Motion against the captured: below the first two it moves less, above the others more."""
TREMBLES = 2.0
"""Jerk over motion of what moves much more than its person, and trembles; livelier gestures have 1. What
moves more than twice that trembles anyway: where the capture is noisy itself, its jerk tells little."""
LIPS_CLOSE = 0.2
"""Share of the closed mouths that are; .05 to .12 without the loss for closures, .31 to .53 with it."""
NO_NEARER = 0.98
"""Of the simple guess's error; trainings that differ by their seed alone differ by as much."""
SAME_ERROR, SAME_FOLLOW, SAME_MOTION = 0.04, 0.03, 0.15
"""Between two runs less is noise: seeds move the error by 2 to 4 %, r by about .02."""
AGREE = 2 / 3
"""Share of the takes that have to say the same before one run is called better."""
SHORT_MINUTES, USUAL_MINUTES = 2.0, 10.0
WORSE = 1.15
"""Times the error over all takes from which one kind of take is worth a word."""

Figures = Mapping[str, float | None]
Kinds = Mapping[str, Mapping[str, float]]
"""Seconds by kind of each selection, by its id, as dataset.coverage.kinds_of gives them."""
_ORDER = (say("poor"), say("fair"), say("good"))
_YOU = say("you")
_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


@dataclass(frozen=True)
class MeasuredRun:
    """Figures of a run and what they were measured on.

    Args:
        figures: over all takes.
        split: "test", "val", "train" or "mixed".
        takes: ids of the selections.
        per_take: figures of each.
        guess: figures of the simple guess on the same takes; empty where it was not measured.
    """

    figures: Figures
    split: str
    takes: tuple[str, ...] = ()
    per_take: Mapping[str, Figures] = field(default_factory=dict)
    guess: Figures = field(default_factory=dict)


@dataclass(frozen=True)
class RunVerdict:
    """What is said of a run; everything is "" where nothing was measured.

    Args:
        grade: "good", "fair" or "poor".
        short: a few words for a list.
        quality, help, basis: sentences.
    """

    grade: str = ""
    short: str = ""
    quality: str = ""
    help: str = ""
    basis: str = ""

    @property
    def text(self) -> str:
        """How good it is and what would help."""
        return together(" ", self.quality, self.help)


def verdict(run: Run, curve: LearningCurve | None = None, kinds: Kinds | None = None) -> RunVerdict:
    """What can be said of a run.

    Args:
        run: read from its folder.
        curve: the project's learning curve, None where none was measured.
        kinds: of the selections it was measured on and learnt from.
    """
    measured = measured_of(run.folder, run.facts)
    if measured is None:
        return RunVerdict()
    grade, short, quality = _quality(measured)
    if not quality:
        return RunVerdict()
    # A curve of other takes says nothing of what this run learnt from.
    current = curve if curve is not None and set(curve.train) == set(run.facts.train) else None
    return RunVerdict(
        grade, short, quality, _help(measured, run.facts, current, kinds or {}), _basis(measured)
    )


def measured_of(folder: Path, report: RunReport) -> MeasuredRun | None:
    """The figures of a run: those of an evaluation, else of validation while it trained; None without any."""
    with suppress(OSError, StudioError):
        found: dict[str, Any] = atomic.read_json(folder / EVALUATION_FILE)
        # Figures of weights from before the run was resumed say nothing of these.
        if isinstance(found.get("metrics"), dict) and _is_of_these_weights(found, folder, report):
            takes, baselines = found.get("takes"), found.get("baselines")
            guess = baselines.get("ridge") if isinstance(baselines, dict) else None
            per_take = found.get("per_take")
            return MeasuredRun(
                found["metrics"],
                str(found.get("split") or ""),
                tuple(map(str, takes)) if isinstance(takes, list) else (),
                {k: v for k, v in per_take.items() if isinstance(v, dict)}
                if isinstance(per_take, dict)
                else {},
                guess if isinstance(guess, dict) else {},
            )
    return MeasuredRun(report.best_val, "val", report.val) if report.best_val else None


def _is_of_these_weights(evaluation: dict[str, Any], folder: Path, report: RunReport) -> bool:
    """Whether an evaluation measured the weights that lie there now."""
    epoch = evaluation.get("best_epoch")
    if epoch is not None and report.best_epoch is not None:
        # Not by the files' times: copies and archives change them, and so does a style that it is shown.
        return bool(epoch == report.best_epoch)
    written = (folder / EVALUATION_FILE).stat().st_mtime
    return written >= (folder / WEIGHTS_FILE).stat().st_mtime


# -- how good --------------------------------------------------------------------------------------


def _quality(measured: MeasuredRun) -> tuple[str, str, str]:
    """Grade, a few words, and one or two sentences."""
    figures = measured.figures
    r, motion = follows(figures), number_of(figures.get("motion_ratio"))
    if r is None and motion is None:
        return "", "", ""
    if motion is not None and motion < STILL_RATIO:
        return (
            "poor",
            say("barely moves"),
            say("Barely moves: {share} as much as you do.", share=f"{motion:.0%}"),
        )
    mouth = number_of(figures.get("pearson_mouth")) is not None
    how, follow_grade = _follow_words(r, say("your mouth") if mouth else say("you"))
    if _is_body(figures):  # sound says when a body moves, hardly which way
        how, follow_grade = "", "good"
    much, motion_grade = _motion_words(motion, number_of(figures.get("jerk_ratio")))
    first = capital(say("{clauses}.", clauses=together(", ", how, much)))
    weak = _weakness(measured)
    grade = min(follow_grade, motion_grade, "fair" if weak else "good", key=_ORDER.index)
    short = say(grade)
    if much and motion_grade != "good":
        short = say("{grade}, {much}", grade=short, much=much)
    return grade, short, together(" ", first, weak)


def in_words(r: float | None, motion: float | None, whom: str = _YOU) -> str:
    """How motion on screen stands to what was captured, in a few words.

    Args:
        r: whether it moves at the same moments, Pearson; None where nothing moves.
        motion: how much it moves, as a share of the captured.
        whom: what it follows.
    """
    if motion is not None and motion < STILL_RATIO:
        return say("barely moves")
    return together(", ", _follow_words(r, whom)[0], _motion_words(motion)[0])


def _is_body(figures: Figures) -> bool:
    """Whether there is a body and no face: wherever its hands are, no error and no r says how good it is."""
    return number_of(figures.get("rmse_body")) is not None and number_of(figures.get("rmse_face")) is None


def _follow_words(r: float | None, whom: str) -> tuple[str, str]:
    if r is None:
        return "", "fair"
    if r >= CLOSELY:
        return say("follows {whom} closely", whom=whom), "good"
    if r >= WELL:
        return say("follows {whom} well", whom=whom), "good"
    if r >= ROUGHLY:
        return say("follows {whom} roughly", whom=whom), "fair"
    return say("hardly follows {whom}", whom=whom), "poor"


def _motion_words(motion: float | None, jerk: float | None = None) -> tuple[str, str]:
    if motion is None:
        return "", "good"
    if motion < MUCH_LESS:
        return say("moves much less than you"), "fair"
    if motion < LESS:
        return say("moves a little less than you"), "good"
    if motion <= MORE:
        return say("moves as much as you"), "good"
    if motion <= MUCH_MORE:
        return say("moves a little more than you"), "good"
    if trembles(motion, jerk):
        return say("trembles"), "poor"
    return say("moves much more than you"), "fair"


def trembles(motion: float, jerk: float | None) -> bool:
    """Whether what moves much more than its person does so without meaning; both against the captured."""
    if jerk is not None and motion > MUCH_MORE and jerk > TREMBLES * motion:
        return True
    return motion > 2 * MUCH_MORE


def _weakness(measured: MeasuredRun) -> str:
    """The gravest fault that the first sentence hides; "" for none."""
    figures, guess = measured.figures, measured.guess
    error, simple = error_of(figures), error_of(guess)
    nearer = error is None or simple is None or error <= NO_NEARER * simple
    if not nearer and not _is_body(figures):
        return "It comes no closer to your motion than a simple guess from the sound."
    body = number_of(figures.get("motion_ratio_body"))
    if body is not None and body < STILL_RATIO:
        return "The body barely moves."
    closes = number_of(figures.get("closure_recall"))
    return "The lips rarely close." if closes is not None and closes < LIPS_CLOSE else ""


# -- what would help -------------------------------------------------------------------------------


def _help(measured: MeasuredRun, report: RunReport, curve: LearningCurve | None, kinds: Kinds) -> str:
    minutes = number_of(report.minutes)
    motion = number_of(measured.figures.get("motion_ratio"))
    kind = _kind(measured, curve, kinds)
    if motion is not None and motion < STILL_RATIO and (minutes or 0.0) >= SHORT_MINUTES:
        return "Train longer, and check in Curate that sound and motion line up."
    if curve is not None and curve.next_gain is not None:
        return _by_curve(curve, kind)
    if minutes is not None and minutes < USUAL_MINUTES:
        # Not measured, and so not promised.
        more = _minutes(max(min(minutes, USUAL_MINUTES - minutes), 0.5), kind)
        if minutes < SHORT_MINUTES:
            return say("{more} would help most.", more=more)
        return say("{more} would probably help most.", more=more)
    return say("More {kind} would probably help most.", kind=say(kind)) if kind else ""


def _by_curve(curve: LearningCurve, kind: str) -> str:
    if curve.is_enough:
        rest = capital(say("{more} would help most.", more=say(kind))) if kind else ""
        return together(
            " ", say("You have enough takes of this kind: more of the same would hardly help."), rest
        )
    enough = (curve.enough_seconds or 0.0) / 60.0
    more = max(enough - curve.seconds / 60.0, 0.5)
    return say(
        "{more} would help most; some {enough} are enough.",
        more=_minutes(min(more, curve.seconds / 60.0), kind),
        enough=_minutes_in_all(enough),
    )


def curve_text(curve: LearningCurve) -> str:
    """What a learning curve says, in two sentences."""
    gain = curve.next_gain
    shown = together(
        ", ",
        *(
            say("{follow} from {length}", follow=f"{point.follow:.2f}", length=_length(point.seconds))
            for point in curve.points
            if point.follow is not None
        ),
    )
    if gain is None:
        return "The learning curve could not be measured: nothing in the held-back takes moves."
    if curve.is_enough:
        first = say("Enough: more takes of the same kind would hardly help.")
    else:
        first = say(
            "More takes would help: twice as much would bring about {gain}, and some {enough} are enough.",
            gain=f"{gain:.2f}",
            enough=_minutes_in_all((curve.enough_seconds or 0.0) / 60.0),
        )
    lacking = ""
    if curve.missing:
        kinds = _listed([say(kind) for kind in curve.missing[:2]])
        lacking = say("There is little {kinds} in your takes.", kinds=kinds)
    return together(" ", first, lacking, say("How well it follows: {shown}.", shown=shown))


def _kind(measured: MeasuredRun, curve: LearningCurve | None, kinds: Kinds) -> str:
    """The kind of speech that errs most or is missing, as it stands in a sentence; "" for none."""
    whole = error_of(measured.figures)
    sums: dict[str, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))
    for take, figures in measured.per_take.items():
        error = error_of(figures)
        for kind, seconds in kinds.get(take, {}).items() if error is not None else ():
            before = sums[kind]
            sums[kind] = before[0] + seconds * (error or 0.0), before[1] + seconds
    errors = sorted(
        ((total / seconds, kind) for kind, (total, seconds) in sums.items() if seconds), reverse=True
    )
    if whole and len(errors) > 1 and errors[0][0] > WORSE * whole:
        return errors[0][1]
    return curve.missing[0] if curve is not None and curve.missing else ""


def _basis(measured: MeasuredRun) -> str:
    on = ", ".join(measured.takes[:3]) + ("…" if len(measured.takes) > 3 else "")
    if not on:
        splits = {"test": say("the test takes"), "val": say("the validation takes")}
        on = splits.get(measured.split, say("its takes"))
    if measured.split == "test":
        return say("Measured on {on}, which it never learnt from.", on=on)
    if measured.split == "val":
        return say(
            "Measured on {on}. The best version was chosen by it too: new speech may go a little worse.",
            on=on,
        )
    if measured.split == "train":
        return say("Measured on {on}, which it learnt from: that says nothing about new sound.", on=on)
    return say("Measured on {on}.", on=on)


# -- which of several ------------------------------------------------------------------------------


def better_of(
    runs: Mapping[str, Figures], per_take: Mapping[str, Mapping[str, Figures]] | None = None
) -> str:
    """One sentence: which run is better and why, or that they are about equal; "" for fewer than two.

    Args:
        runs: figures by the run's id.
        per_take: the figures of each take, by the run's id; a lead that most takes do not share is chance.
    """
    known = [(name, figures) for name, figures in runs.items() if error_of(figures) is not None]
    if len(known) < 2:
        return ""
    # Standing still is near the mean and far from alive: the error must never choose such a run.
    known.sort(key=lambda one: (_is_dead(one[1]), _is_body(one[1]), error_of(one[1])))
    (best, a), (other, b) = known[0], known[1]
    if _is_dead(b) and not _is_dead(a):
        if (number_of(b.get("motion_ratio")) or 0.0) < STILL_RATIO:
            return say("{best} is better: {other} barely moves.", best=best, other=other)
        return say("{best} is better: {other} trembles.", best=best, other=other)
    takes = per_take or {}
    leads = _leads(a, b, takes.get(best, {}), takes.get(other, {}))
    mine, others = ([words for words, lead in leads if lead == side] for side in (1, -1))
    if mine and others:
        return say(
            "About equal: {best} {why}, but {other} {other_why}.",
            best=best,
            why=_listed(mine),
            other=other,
            other_why=_listed(others),
        )
    if not mine and not others:
        return say(
            "{best} and {other} are about equal: the differences are no larger than chance.",
            best=best,
            other=other,
        )
    better, worse, why = (best, other, mine) if mine else (other, best, others)
    return say("{better} is better than {worse}: it {why}.", better=better, worse=worse, why=_listed(why))


def _leads(
    a: Figures, b: Figures, on_a: Mapping[str, Figures], on_b: Mapping[str, Figures]
) -> list[tuple[str, int]]:
    """What tells a from b: what the better one does, and 1 where that is a, -1 where it is b."""
    found: list[tuple[str, int]] = []
    for words, least, how in (
        (say("comes closer to your motion"), SAME_ERROR, _closer),
        (say("follows your mouth better"), SAME_FOLLOW, _follows_better),
        (say("moves more like you"), SAME_MOTION, _moves_better),
    ):
        lead = how(a, b)
        if lead is None or abs(lead) <= least:
            continue
        each = [one for take in on_a.keys() & on_b.keys() if (one := how(on_a[take], on_b[take])) is not None]
        agree = sum((one > 0) == (lead > 0) for one in each)
        if not each or agree >= AGREE * len(each):
            found.append((words, 1 if lead > 0 else -1))
    return found


def _closer(a: Figures, b: Figures) -> float | None:
    mine, other = error_of(a), error_of(b)
    if mine is None or other is None or _is_body(a) != _is_body(b):
        return None
    return (other - mine) / max(mine, other, 1e-9)


def _follows_better(a: Figures, b: Figures) -> float | None:
    mine, other = follows(a), follows(b)
    return None if mine is None or other is None else mine - other


def _moves_better(a: Figures, b: Figures) -> float | None:
    mine, other = (number_of(one.get("motion_ratio")) for one in (a, b))
    if mine is None or other is None:
        return None
    return abs(math.log(max(other, 1e-3))) - abs(math.log(max(mine, 1e-3)))


def _is_dead(figures: Figures) -> bool:
    motion = number_of(figures.get("motion_ratio"))
    return motion is not None and not STILL_RATIO <= motion <= 2 * MUCH_MORE


# -- words -----------------------------------------------------------------------------------------


def _listed(words: Sequence[str]) -> str:
    if len(words) == 1:
        return words[0]
    return say("{words} and {last}", words=together(", ", *words[:-1]), last=words[-1])


def _minutes(minutes: float, kind: str) -> str:
    """ "Four more minutes of loud speech"."""
    whole = round(minutes)
    word = _NUMBERS[whole].capitalize() if whole < len(_NUMBERS) else str(whole)
    english = "One more minute" if whole == 1 else f"{word} more minutes"
    more = Text(english, "{n} more minutes", {"n": str(whole)}, whole)
    if minutes < 0.75:
        more = say("Half a minute more")
    return say("{minutes} of {kind}", minutes=more, kind=say(kind)) if kind else more


def _minutes_in_all(minutes: float) -> str:
    whole = max(round(minutes), 1)
    word = _NUMBERS[whole] if whole < len(_NUMBERS) else str(whole)
    english = f"{word} minute{'s' if whole != 1 else ''} in all"
    return Text(english, "{n} minutes in all", {"n": str(whole)}, whole)


def _length(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.1f} min"
