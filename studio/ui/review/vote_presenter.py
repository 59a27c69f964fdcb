"""The blind vote between two runs: chance decides the order, the answer is kept with the project's runs."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from math import comb
from typing import Any

from PySide6.QtCore import QObject

from studio.errors import StudioError
from studio.files import atomic
from studio.project import Project
from studio.training.styles import RunSelection
from studio.ui.review.model import A, B, ReviewModel
from studio.ui.review.run_view import RunBar
from studio.ui.session import Session

FILE = "votes.jsonl"
SURE, LIKELY = 0.05, 0.5
"""Below the first a result is taken for more than chance, as everywhere in science; above the second a number
would say nothing."""


@dataclass(frozen=True)
class Vote:
    """One answer.

    Args:
        a, b: what was compared.
        better: "a", "b", or "" for no difference.
        sound: what was heard.
        first: which of them stood first, "a" or "b".
        at: when, ISO 8601.
    """

    a: RunSelection
    b: RunSelection
    better: str
    sound: str
    first: str
    at: str = ""


@dataclass(frozen=True)
class Tally:
    """How often one was called better than the other, and how often neither."""

    a: int
    b: int
    neither: int

    @property
    def chance(self) -> float:
        """Probability that two which nobody can tell apart get a result at least as uneven, 0..1.

        The two-sided binomial test at even odds; votes for neither say nothing of which is better.
        """
        votes, most = self.a + self.b, max(self.a, self.b)
        tail = sum(comb(votes, k) for k in range(most, votes + 1)) / 2**votes
        return min(1.0, 2.0 * tail)


def save_vote(project: Project, vote: Vote) -> None:
    """Add a vote to the project's.

    Raises:
        StudioError: the folder cannot be written.
    """
    path = project.runs_folder / FILE
    facts = {
        "version": 1,
        "at": vote.at or datetime.now().astimezone().isoformat(timespec="seconds"),
        "sound": vote.sound,
        "first": vote.first,
        "better": vote.better,
        "a": _facts_of(vote.a),
        "b": _facts_of(vote.b),
    }
    try:
        path.parent.mkdir(exist_ok=True)
        # Appended, one line each: a line that is cut off loses only itself.
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(facts, ensure_ascii=False) + "\n")
    except OSError as error:
        raise atomic.cannot_write(path, error) from error


def saved_votes(project: Project) -> tuple[Vote, ...]:
    """All votes of a project in order; lines that make no sense are passed over."""
    try:
        lines = (project.runs_folder / FILE).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ()
    return tuple(vote for line in lines if (vote := _vote(line)) is not None)


def tally(votes: Iterable[Vote], a: RunSelection, b: RunSelection) -> Tally:
    """Count the votes between two, whichever stood as A then."""
    found: Counter[RunSelection | None] = Counter()
    for vote in votes:
        # Whichever of them was called A that time.
        if {vote.a, vote.b} == {a, b}:
            found[{"a": vote.a, "b": vote.b}.get(vote.better)] += 1
    return Tally(found[a], found[b], found[None])


def _vote(line: str) -> Vote | None:
    try:
        facts = json.loads(line)
        a, b = (_selection(facts[side]) for side in ("a", "b"))
        better = str(facts["better"])
        if better not in ("a", "b", ""):
            return None
        return Vote(a, b, better, str(facts["sound"]), str(facts["first"]), str(facts["at"]))
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def _selection(facts: dict[str, Any]) -> RunSelection:
    run, style = str(facts["run"]), str(facts["style"])
    return RunSelection(run, style, int(facts.get("seed", 0)), float(facts.get("liveliness", 1.0)))


def _facts_of(selection: RunSelection) -> dict[str, Any]:
    facts = {"run": selection.run, "style": selection.style, "seed": selection.seed}
    # The default is left out, as it is in lines from before liveliness could be chosen.
    return facts if selection.liveliness == 1.0 else {**facts, "liveliness": selection.liveliness}


class VotePresenter(QObject):
    """Presenter of the blind vote: hides which run is which, and keeps the answer.

    Args:
        bar: its buttons.
        model: what is compared.
        session: knows the open project.

    Attributes:
        order: the side behind 1 and the side behind 2.
    """

    def __init__(self, bar: RunBar, model: ReviewModel, session: Session) -> None:
        super().__init__(bar)
        self._bar, self._model, self._session = bar, model, session
        self.order = (A, B)
        bar.vote.vote_requested.connect(self._on_begin)
        bar.vote.voted.connect(self._on_voted)
        bar.vote.cancelled.connect(self.end)
        model.leaving.connect(self.end)
        model.pairing_changed.connect(self.end)

    def end(self) -> None:
        """No vote any more; the names are seen again."""
        if self._model.blind:
            self._model.blind = False
            self._bar.end_vote()
            self._model.motion_changed.emit()

    def _on_begin(self) -> None:
        if not self._model.both_ready:
            return
        # The system's own chance: a seeded generator would give the same order in every vote of a session.
        self.order = random.SystemRandom().choice(((A, B), (B, A)))
        self._model.blind, self._model.front = True, self.order[0]
        self._bar.begin_vote(self.order)
        self._model.motion_changed.emit()

    def _on_voted(self, side: int) -> None:
        model, project = self._model, self._session.project
        if project is None or model.item is None or not model.blind:
            return
        a, b = (one.selection for one in model.sides)
        better = "" if side < 0 else "ab"[side]
        vote = Vote(a, b, better, model.item.title, "ab"[self.order[0]])
        try:
            save_vote(project, vote)
        except StudioError as error:
            model.failed.emit(error)
        # The one that was liked better stays on the stage.
        if side >= 0:
            model.front = side
        self.end()
        self._bar.vote.show_result(self._result(better, tally(saved_votes(project), a, b)))

    def _result(self, better: str, count: Tally) -> str:
        answer = {
            "a": self.tr("You chose A."),
            "b": self.tr("You chose B."),
        }.get(better, self.tr("You saw no difference."))
        votes_so_far = self.tr("So far A {0}, B {1}, neither {2}.")
        sure = self._sure(count)
        return f"{answer} {votes_so_far.format(count.a, count.b, count.neither)} {sure}".rstrip()

    def _sure(self, count: Tally) -> str:
        """With what probability chance alone would give such a result or a clearer one; "" without votes."""
        if not count.a + count.b:
            return ""
        chance = count.chance
        if chance > LIKELY:
            return self.tr("Vote more to be sure.")
        told = self.tr("Chance alone would give this in {0} of 100 cases.").format(
            max(round(100 * chance), 1)
        )
        return told if chance < SURE else f"{told} {self.tr('Vote more to be sure.')}"
