"""One thing noticed about a take."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

SEVERITIES = ("note", "minor", "major", "fatal")
"""A note is no fault; minor can stay; major spoils a part; fatal makes the take of no use."""


@dataclass(frozen=True)
class Finding:
    """One thing noticed.

    Args:
        kind: a word for programs ("gap", "clipping", ...).
        severity: one of SEVERITIES.
        what: one sentence.
        remedy: one sentence saying what to do about it.
        at: where in the take, seconds; None for all of it.
        until: where that ends, seconds; None for a moment.
    """

    kind: str
    severity: str
    what: str
    remedy: str
    at: float | None = None
    until: float | None = None

    def to_plain(self) -> dict[str, Any]:
        """JSON values; without `at` and `until` where there is no such moment."""
        plain: dict[str, Any] = dict(vars(self))
        return {key: value for key, value in plain.items() if value is not None}
