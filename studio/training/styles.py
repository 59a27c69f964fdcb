"""Styles, and which run, style, seed and liveliness are to make a motion (no torch).

The same sound goes with different motion on different days and from different people. Where a model is told
which take a moment comes from, it need not learn the mean of all of them; index 0, the average, is what it
learns where it is not told.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.dataset.dataset import Selection
from studio.errors import RequestError, say
from studio.features.motion import Layout
from studio.files.atomic import safe_name
from studio.project import Run
from studio.project.run import run_title

AVERAGE = "average"
"""What every run moves in unless a person asks for another style. The style that errs least on one validation
take need not suit the next sound, and did not on takes that were left out."""


def styles_of(selections: Sequence[Selection], by: str) -> tuple[str, ...]:
    """Each selection's style by name, "" for none of its own.

    Args:
        selections: those trained on.
        by: "take", "performer", "none", or "auto": performers where at least two are named and each has at
            least two takes, so that what is learnt is the person and not the day; takes otherwise.
    """
    takes = Counter(s.performer for s in selections if s.performer)
    if by == "auto":
        by = "performer" if len(takes) > 1 and min(takes.values()) > 1 else "take"
    if by == "none":
        return ("",) * len(selections)
    found = tuple(s.performer if by == "performer" else s.id for s in selections)
    # One style alone is the average by another name.
    return found if len(set(found) - {""}) > 1 else ("",) * len(found)


def index_of(style: str | None, styles: Sequence[str], default: str, run: str) -> int:
    """The index of a style by name; None takes the default.

    Args:
        style: what was asked for.
        styles: what the model knows besides the average.
        default: of the run, "" for the average; runs of before 2027 may have chosen another.
        run: the model's name, for the sentence.

    Raises:
        RequestError: the model does not know it.
    """
    chosen = default if style is None else style
    if chosen in ("", AVERAGE):
        return 0
    if chosen in styles:
        return styles.index(chosen) + 1
    what = say("{run} knows no style called {style}.", run=run, style=chosen)
    if not styles:
        raise RequestError(what, "It was trained without styles; leave --style out.")
    raise RequestError(what, say("Choose one of: {styles}.", styles=", ".join((AVERAGE, *styles))))


WIDEST = 3.0
"""No column moves more than so many times as far in a fitted style."""


@dataclass(frozen=True, eq=False)
class FittedStyle:
    """A style that a finished run was shown: the average's motion with each column scaled and moved.

    Args:
        name: to ask for it by.
        gain, shift: (C,) a scaled column p becomes gain * p + shift.
    """

    name: str
    gain: NDArray[np.floating]
    shift: NDArray[np.floating]

    def applied(self, layout: Layout) -> Layout:
        """A run's layout as this style reads it; what makes motion of columns needs to know no more."""
        moved = layout.offset + self.shift * layout.scale
        return replace(layout, offset=moved, scale=layout.scale * self.gain)

    def as_dict(self) -> dict[str, Any]:
        """Plain values for a file; `from_dict` reads them."""
        return {"name": self.name, "gain": self.gain.tolist(), "shift": self.shift.tolist()}

    @classmethod
    def from_dict(cls, facts: dict[str, Any], width: int) -> FittedStyle:
        """The style in a file's facts.

        Raises:
            KeyError, TypeError, ValueError: they are not those of a style for so many columns.
        """
        gain, shift = (np.asarray(facts[key], dtype=np.float64) for key in ("gain", "shift"))
        if gain.shape != (width,) or shift.shape != (width,) or not np.isfinite(shift).all():
            raise ValueError("not a number for each column")
        # Files come from anybody; False for NaN.
        if not ((gain >= 0) & (gain <= WIDEST)).all():
            raise ValueError("gains that are never fitted")
        return cls(str(facts["name"]), gain, shift)


DRAWING_FORMS = frozenset({"mixture"})
"""Forms of recipes whose networks draw their motion, for runs that do not say whether they draw."""


@dataclass(frozen=True)
class RunSelection:
    """What is to make the motion.

    Args:
        run: the run's id, "" for no run.
        style: one that it knows, "" for its default.
        seed: which of the takes that a run draws, for runs that draw.
        liveliness: how far drawn motion goes from what is expected: 0 not at all, 1 as it was learnt.
        mix: styles with their shares, in place of one style.
    """

    run: str = ""
    style: str = ""
    seed: int = 0
    liveliness: float = 1.0
    mix: tuple[tuple[str, float], ...] = ()

    @property
    def words(self) -> tuple[str, ...]:
        """What `saia generate` is told besides the run and the sound."""
        style: tuple[str, ...] = (f"--style={self.style}",) if self.style else ()
        if self.mix:
            style = tuple(f"--mix={name}:{share:g}" for name, share in self.mix)
        lively = (f"--liveliness={self.liveliness:g}",) if self.liveliness != 1.0 else ()
        return (*style, *lively, f"--seed={self.seed}") if self.seed else (*style, *lively)

    @property
    def title(self) -> str:
        """What people call it."""
        more, run = self._more(), run_title(self.run)
        return f"{run} ({', '.join(more)})" if more else run

    @property
    def name(self) -> str:
        """Part of a file's name."""
        # With its shares: files of two mixes must not have one name.
        mix = ["mix", *(f"{style}-{100 * share:.0f}" for style, share in self.mix)] if self.mix else None
        more = self._more(mix)
        return safe_name("_".join([self.run, *more])) if more else self.run

    def _more(self, mix: list[str] | None = None) -> list[str]:
        """What it differs in from what the run does unasked."""
        more = (mix or ["mix"]) if self.mix else [self.style] if self.style else []
        more += [f"x{self.liveliness:g}"] if self.liveliness != 1.0 else []
        return more + ([str(self.seed + 1)] if self.seed else [])


@dataclass(frozen=True)
class RunChoice:
    """A run that can generate.

    Args:
        id: its id.
        styles: what it can be asked for, "average" among them; empty where it learnt none.
        style: the one used unless another is asked for.
        draws: the same sound gives another motion with another seed.
        moods: labels it was taught.
    """

    id: str
    styles: tuple[str, ...] = ()
    style: str = ""
    draws: bool = False
    moods: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """What people call it."""
        return run_title(self.id)


def newest(runs: Sequence[Run]) -> Run:
    """The run trained last, so that a person sees what it learnt without looking for it.

    The studio's own comes after all others, whenever it was installed.
    """
    return max(runs, key=lambda run: (not run.is_shipped, run.folder.stat().st_mtime, run.id))


def run_choice(run: Run) -> RunChoice:
    """A run with the styles that its report names."""
    report = run.facts
    draws = report.form in DRAWING_FORMS if report.draws is None else report.draws
    if not report.styles:
        return RunChoice(run.id, draws=draws, moods=report.moods)
    return RunChoice(run.id, (AVERAGE, *report.styles), report.style or AVERAGE, draws, report.moods)
