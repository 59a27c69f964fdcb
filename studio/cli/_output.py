"""What a command prints: sentences for people, JSON lines for programs."""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path
from typing import Any


class Output:
    """Where a command reports to.

    Args:
        as_json: one JSON object per line instead of sentences.
    """

    def __init__(self, as_json: bool = False) -> None:
        self.as_json = as_json
        self.finished = False

    def event(self, name: str, text: str = "", /, **facts: Any) -> None:
        """Something happened.

        Args:
            name: the event's name in JSON.
            text: the sentence for people; nothing is printed for them where empty.
            facts: JSON values; Path becomes text, NaN and infinity become null.
        """
        if self.as_json:
            print(json.dumps({"event": name, **_plain(facts)}, ensure_ascii=False), flush=True)
        elif text:
            print(text, flush=True)

    def done(self, text: str = "", **facts: Any) -> None:
        """The command ended well; the last line of every successful command."""
        self.finished = True
        self.event("done", text, **facts)

    def error(self, what: str, remedy: str, log: Path | None = None) -> None:
        """The command failed: a sentence on stderr and, in JSON, the last line."""
        hint = f" Details are in {log}." if log else ""
        if self.as_json:
            self.event("error", what=what, remedy=remedy, log=log)
        print(f"{what} {remedy}{hint}", file=sys.stderr, flush=True)


def silence_stdout() -> None:
    """Let what is printed from now on vanish, after the reader of a pipe has left."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:  # numpy and torch scalars
        value = value.item()
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
