"""Blind votes between runs, kept with the project's runs, one JSON line each. No widgets."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from studio.files import atomic
from studio.project import Project
from studio.training.styles import RunSelection

FILE = "votes.jsonl"


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


def keep(project: Project, vote: Vote) -> None:
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
        "a": _plain(vote.a),
        "b": _plain(vote.b),
    }
    try:
        path.parent.mkdir(exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(facts, ensure_ascii=False) + "\n")
    except OSError as error:
        raise atomic.cannot_write(path, error) from error


def kept(project: Project) -> tuple[Vote, ...]:
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
        if {vote.a, vote.b} == {a, b}:
            found[{"a": vote.a, "b": vote.b}.get(vote.better)] += 1
    return Tally(found[a], found[b], found[None])


def _vote(line: str) -> Vote | None:
    try:
        facts = json.loads(line)
        a, b = (_wanted(facts[side]) for side in ("a", "b"))
        better = str(facts["better"])
        if better not in ("a", "b", ""):
            return None
        return Vote(a, b, better, str(facts["sound"]), str(facts["first"]), str(facts["at"]))
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def _wanted(facts: dict[str, Any]) -> RunSelection:
    run, style = str(facts["run"]), str(facts["style"])
    return RunSelection(run, style, int(facts.get("seed", 0)), float(facts.get("liveliness", 1.0)))


def _plain(wanted: RunSelection) -> dict[str, Any]:
    facts = {"run": wanted.run, "style": wanted.style, "seed": wanted.seed}
    return facts if wanted.liveliness == 1.0 else {**facts, "liveliness": wanted.liveliness}
