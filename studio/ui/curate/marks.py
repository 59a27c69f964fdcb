"""Findings of a check as marks on the timeline, and the choices that can be made for many takes at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QT_TRANSLATE_NOOP, QCoreApplication

from studio.dataset import Dataset, edits
from studio.ui.widgets.timeline_content import Mark

if TYPE_CHECKING:
    from studio.take.check import Finding, Report

Change = Callable[[Dataset, Iterable[str], Any], Dataset]


def all_marks(report: Report | None) -> tuple[Mark, ...]:
    """Everything a check found, in its order."""
    return tuple(mark_of(finding) for finding in report.findings) if report else ()


def placed(report: Report | None) -> tuple[Mark, ...]:
    """What lies at a moment of the take."""
    found = report.findings if report else ()
    return tuple(mark_of(finding) for finding in found if finding.at is not None)


def mark_of(finding: Finding) -> Mark:
    """One finding as a mark; its sentence and remedy are on two lines."""
    severity = {"fatal": "bad", "major": "bad", "minor": "warn"}.get(finding.severity, "muted")
    start, end = (finding.at or 0.0), (finding.until or finding.at or 0.0)
    text = f"{finding.what}\n{finding.remedy}".strip()
    return Mark(start, max(end - start, 0.0), severity, title(finding.kind), text)


def title(kind: str) -> str:
    """A finding's kind in one or two words."""
    words = {
        "gap": _tr("gap"), "frozen": _tr("stands still"), "jitter": _tr("uneven"), "jump": _tr("jump"),
        "clipping": _tr("too loud"), "quiet": _tr("quiet"), "silence": _tr("silence"), "noise": _tr("noise"),
        "ends": _tr("one ends"), "starts": _tr("late start"), "values": _tr("bad values"),
        "offset": _tr("out of step"), "damaged": _tr("damaged"),
    }  # fmt: skip
    return words.get(kind, kind.replace("_", " "))


def _set_note(dataset: Dataset, ids: Iterable[str], note: str) -> Dataset:
    for one in ids:
        dataset = edits.set_note(dataset, one, note)
    return dataset


CHOICES: dict[str, tuple[str, Change]] = {
    "split": (str(QT_TRANSLATE_NOOP("Choices", "Split {0}")), edits.set_split),
    "stars": (str(QT_TRANSLATE_NOOP("Choices", "Rate {0}")), edits.set_stars),
    "performer": (str(QT_TRANSLATE_NOOP("Choices", "Performer of {0}")), edits.set_performer),
    "emotion": (str(QT_TRANSLATE_NOOP("Choices", "Emotion of {0}")), edits.set_emotion),
    "tags": (str(QT_TRANSLATE_NOOP("Choices", "Tag {0}")), edits.set_tags),
    "note": (str(QT_TRANSLATE_NOOP("Choices", "Note on {0}")), _set_note),
    "locked": (str(QT_TRANSLATE_NOOP("Choices", "Lock {0}")), edits.set_locked),
}
"""By field: the edit's name for undo, and the edit."""


def _tr(text: str) -> str:
    return QCoreApplication.translate("Findings", text)
