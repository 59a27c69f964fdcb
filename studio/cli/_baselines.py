"""Figures of the simple guesses that a run has to beat, and of what was captured, for a table beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from studio.cli._output import Output

if TYPE_CHECKING:
    from studio.dataset.material import TrainingMaterial
    from studio.evaluation.evaluation_set import EvaluationSet
    from studio.motion import Motion
    from studio.project import Project, Run


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

    from studio.evaluation.baselines import RIDGE_SOUND, Baselines
    from studio.evaluation.evaluation_set import evaluate
    from studio.training.gather import cache_folder, load_usable

    report = chosen.report or {}
    ids = set(report.get("train", ()))
    named = [(s, t) for s, t in project.selected() if s.id in ids] or list(project.selected("train"))
    out.passing("baselines", f"{_WORDS}: reading what {chosen.id} learnt from", fraction=0.0)
    material, _ = load_usable(named, RIDGE_SOUND)
    if not material:
        text = "The takes the run was trained on are gone; there are no baselines to compare with."
        out.event("note", text, text=text)
        return {}
    fps = Fraction(report.get("fps") or 30).limit_denominator(1001)
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
        words = f"{text} ({done + 1} of {of})"
        self._out.passing("baselines", words, name=name, take=take, done=done, of=of, fraction=done / of)
