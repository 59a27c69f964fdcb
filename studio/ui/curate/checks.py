"""Checks of takes: made one by one while nobody waits, and what they found as marks on the timeline."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, QTimer, Signal

from studio.take.take import Take
from studio.ui import tasks
from studio.ui.language import native
from studio.ui.widgets.timeline.content import Mark

if TYPE_CHECKING:
    from studio.take.check import Finding, Report

TELL_MS = 300
"""A library of a thousand takes is drawn anew this often at most while its checks come in."""


class GradingQueue(QObject):
    """A queue of takes to check, one at a time, so that loading and aligning find a free thread.

    Signals:
        graded: `reports` has grown; sent a few times a second at most.
    """

    graded = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.reports: dict[str, Report] = {}
        self._waiting: deque[Take] = deque()
        self._task: tasks.Task | None = None
        # Until the tab is shown: a check reads the disk.
        self._resting = True
        self._tell = QTimer(self)
        self._tell.setSingleShot(True)
        self._tell.setInterval(TELL_MS)
        self._tell.timeout.connect(self.graded)

    def clear(self) -> None:
        """Discard everything: another project is open."""
        self.reports.clear()
        self._waiting.clear()
        if self._task is not None:
            self._task.forget()
            self._task = None

    def ask(self, takes: Iterable[Take]) -> None:
        """Check these takes sometime, unless their report is there."""
        queued = {take.id for take in self._waiting}
        self._waiting.extend(t for t in takes if t.id not in self.reports and t.id not in queued)
        self._next()

    def ask_first(self, take: Take) -> None:
        """Check this take before all others."""
        if take.id not in self.reports:
            self._waiting.appendleft(take)
            self._next()

    def ask_again(self, takes: Iterable[Take]) -> None:
        """Check these takes anew, now."""
        for take in takes:
            self.reports.pop(take.id, None)
            self._waiting.appendleft(take)
        self._next()

    def rest(self, resting: bool) -> None:
        """Stop after the one being checked, or go on."""
        self._resting = resting
        self._next()

    def _next(self) -> None:
        while self._task is None and self._waiting and not self._resting:
            take = self._waiting.popleft()
            if take.id not in self.reports:
                self._task = tasks.run(
                    partial(_check, take),
                    partial(self._on_report, take.id),
                    lambda _: self._on_failed(),
                    self,
                )

    def _on_report(self, take_id: str, report: Report) -> None:
        self._task = None
        self.reports[take_id] = report
        if not self._tell.isActive():
            self._tell.start()
        self._next()

    def _on_failed(self) -> None:
        # A take that cannot even be checked shows no grade; opening it says what is wrong.
        self._task = None
        self._next()

    from studio.take.check import Finding


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
    text = f"{native(finding.what)}\n{native(finding.remedy)}".strip()
    return Mark(start, max(end - start, 0.0), severity, title(finding.kind), text)


def title(kind: str) -> str:
    """A finding's kind in one or two words."""
    words = {
        "gap": _tr("gap"), "frozen": _tr("stands still"), "jitter": _tr("uneven"), "jump": _tr("jump"),
        "clipping": _tr("too loud"), "quiet": _tr("quiet"), "silence": _tr("silence"), "noise": _tr("noise"),
        "ends": _tr("one ends"), "starts": _tr("late start"), "values": _tr("bad values"),
        "offset": _tr("out of step"), "damaged": _tr("damaged"), "beside": _tr("two trackers"),
    }  # fmt: skip
    return words.get(kind, kind.replace("_", " "))


def _check(take: Take) -> Report:
    from studio.take.check import check_take

    return check_take(take)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Findings", text)
