"""What a teleprompter asks for: prompts by language, which comes next, and where each was said."""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from studio.dataset.dataset import Label
from studio.errors import StudioError, say
from studio.paths import resource

TIER = "prompt"
"""The tier of labels that keep what was asked for."""
OWN = "own"
"""The language, and the kind, of a person's own text."""
KINDS = (
    "sentence", "question", "happy", "sounds", "loud", "free", "quiet", "sad", "surprised", "angry",
)  # fmt: skip
"""What prompts are for, in the order in which they take turns."""
EMOTIONS = ("happy", "sad", "surprised", "angry")
USUAL = "en"
PAUSE_S = 2.0
"""Seconds of silence after which a prompt counts as said."""
_SPOKEN_S = 0.8
_ABOVE_FLOOR_DB = 12.0
_LEAST_DBFS = -55.0


@dataclass(frozen=True)
class Prompt:
    """Something to say or do, and what it is for: one of KINDS, or OWN."""

    text: str
    kind: str


@cache
def languages(folder: Path | None = None) -> Mapping[str, str]:
    """The name of each language by its code, as the language calls itself."""
    return {path.stem: str(_read(path)["name"]) for path in sorted(_folder(folder).glob("*.toml"))}


@cache
def prompts_of(language: str, folder: Path | None = None) -> tuple[Prompt, ...]:
    """All prompts of a language, kinds taking turns.

    Raises:
        StudioError: there is no such language, or its file cannot be read.
    """
    found = _read(_folder(folder) / f"{language}.toml")
    left = {kind: [Prompt(str(text), kind) for text in found.get(kind, ())] for kind in KINDS}
    order: list[Prompt] = []
    while any(left.values()):
        for kind in KINDS:
            order += left[kind][:1]
            del left[kind][:1]
    return tuple(order)


def own_prompts(lines: Sequence[str]) -> tuple[Prompt, ...]:
    """A person's own text, a prompt for each line."""
    return tuple(Prompt(line.strip(), OWN) for line in lines if line.strip())


@cache
def kind_of(text: str) -> str:
    """The kind of a prompt of any language; OWN where it is none of ours."""
    every = (prompt for language in languages() for prompt in prompts_of(language))
    return next((prompt.kind for prompt in every if prompt.text == text), OWN)


def language_for(locale: str) -> str:
    """The language nearest to a locale such as "ja_JP"."""
    code = locale.replace("-", "_").partition("_")[0].lower()
    return code if code in languages() else USUAL


def next_prompt(
    prompts: Sequence[Prompt], said: Mapping[str, int], wanted: Collection[str], last: Prompt | None = None
) -> Prompt | None:
    """The prompt to show now: one said least often, and every other time one that is wanted.

    Args:
        prompts: in their order. said: how often each text was said.
        wanted: kinds that the recordings lack.
        last: shown before, which does not come twice in a row.
    """
    pool = [one for one in prompts if one != last] or list(prompts)
    if not pool:
        return None
    least = min(said.get(one.text, 0) for one in pool)
    fresh = [one for one in pool if said.get(one.text, 0) == least]
    if last is None or last.kind not in wanted:
        fresh = [one for one in fresh if one.kind in wanted] or fresh
    # On from the last one, so that kinds go on taking turns.
    start = prompts.index(last) if last in prompts else -1
    return min(fresh, key=lambda one: (prompts.index(one) - start - 1) % len(prompts))


@dataclass
class PromptSpans:
    """Where in a take each prompt was said.

    Args:
        prompt: the one shown when it began.
    """

    prompt: Prompt
    labels: list[Label] = field(default_factory=list)
    excluded: list[tuple[float, float]] = field(default_factory=list)
    _start: float = 0.0

    def go_on(self, prompt: Prompt, t: float) -> None:
        """The one before was said, and another is shown from t seconds on."""
        self.end(t)
        self.prompt, self._start = prompt, t

    def again(self, t: float) -> None:
        """What was said of it so far is left out, and it is said once more from t seconds on."""
        if t > self._start:
            self.excluded.append((self._start, t))
        self._start = t

    def end(self, t: float) -> None:
        """The take ends at t seconds, or another prompt begins."""
        if t > self._start:
            self.labels.append(Label(self._start, t - self._start, TIER, self.prompt.text))
        self._start = t


class PauseWatch:
    """Notices when somebody who spoke has been silent for a while; levels alone, so it needs no language."""

    def __init__(self) -> None:
        self._floor = 0.0
        self._spoken = self._silent = 0.0
        self._at: float | None = None

    def begin(self) -> None:
        """Another prompt is shown: it has to be said first. What is known of the room stays."""
        self._spoken = self._silent = 0.0

    def push(self, t: float, rms_dbfs: float) -> bool:
        """Take in the level at t seconds; whether a long pause after speech is over its length now."""
        step = min(max(t - self._at, 0.0), 0.25) if self._at is not None else 0.0
        self._at = t
        # The floor follows down at once and up slowly, as a room does.
        self._floor = min(rms_dbfs, self._floor + step)
        if rms_dbfs > max(self._floor + _ABOVE_FLOOR_DB, _LEAST_DBFS):
            self._spoken += step
            self._silent = 0.0
        else:
            self._silent += step
        if self._spoken < _SPOKEN_S or self._silent < PAUSE_S:
            return False
        self.begin()
        return True


def _folder(folder: Path | None) -> Path:
    return folder or resource("prompts")


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        what = say("The teleprompter's texts {name} cannot be read.", name=path.name)
        raise StudioError(what, "Install Saia Studio again, or choose another language.") from error
