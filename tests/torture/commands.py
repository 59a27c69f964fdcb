"""The `saia` command inside a forked process, and what may never come of it."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.torture.cases import Outcome

_UNFORESEEN = ("Something unexpected happened", "Traceback (most recent call last)")


@dataclass
class Told:
    """What a command said.

    Args:
        code: its exit code.
        events: its lines of JSON.
        text: all it printed.
    """

    words: tuple[str, ...]
    code: int
    text: str
    events: list[dict[str, Any]] = field(default_factory=list)

    @property
    def last(self) -> dict[str, Any]:
        """Its last event; {} where it told none."""
        return self.events[-1] if self.events else {}

    @property
    def sentence(self) -> str:
        """What it said went wrong; "" where nothing did."""
        return f"{self.last.get('what', '')} {self.last.get('remedy', '')}".strip()


def saia(*words: object) -> Told:
    """Run a command in this process."""
    from studio import cli

    asked = tuple(str(word) for word in words)
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            code = cli.main([*asked, "--json"])
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else 1
    text = said.getvalue()
    return Told(asked, code, text, events_in(text))


def events_in(text: str) -> list[dict[str, Any]]:
    """The lines of JSON in what a command printed; one that a kill cut short is left out."""
    found = []
    for line in text.splitlines():
        with contextlib.suppress(ValueError):
            event = json.loads(line)
            if isinstance(event, dict) and "event" in event:
                found.append(event)
    return found


def judge(told: Told, outcome: Outcome, codes: tuple[int, ...] = (0, 1, 2)) -> Told:
    """Note what no command may do whatever it is given: raise, or fail without a sentence."""
    name = f"saia {told.words[0]}"
    if any(words in told.text for words in _UNFORESEEN):
        outcome.fault("traceback", f"{name}: {_where(told)}")
    elif told.code not in codes:
        outcome.fault(
            "exit code", f"{' '.join(told.words)} gave {told.code}: {told.sentence or told.text[-300:]}"
        )
    elif told.code and not told.sentence:
        outcome.fault("no sentence", f"{name} gave {told.code} and said {told.text[-300:]!r}")
    return told


def _where(told: Told) -> str:
    """The end of a traceback: of the log it was written to, else of what was printed."""
    log = next((event["log"] for event in reversed(told.events) if event.get("log")), None)
    text = told.text
    if log and Path(log).is_file():
        text = Path(log).read_text(encoding="utf-8", errors="replace")
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("{")]
    return " / ".join(lines[-5:])[-600:]
