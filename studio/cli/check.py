"""`saia check`: what is wrong with the takes, and what to do about it."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.errors import counted
from studio.ipc.events import CheckDone, FindingEvent, TakeEvent

EXAMPLE = "saia check MyProject Hello_001"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT [TAKE...]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("takes", nargs="*", metavar="TAKE", help="takes to check; all where none is named")


def run(args: argparse.Namespace, out: Output) -> None:
    """Check takes one after another, changing none; opening the project recovers what was cut off."""
    from studio.cli._project import opened
    from studio.take.check import check_take

    project = opened(args.project, out)
    # Named twice, a take is checked once; an unknown name fails before the first check.
    takes = [project.take(take_id) for take_id in dict.fromkeys(args.takes)] or list(project.takes)
    reports = {}
    for count, take in enumerate(takes, 1):
        report = check_take(take)
        reports[take.id] = report.to_plain()
        out.emit(
            TakeEvent(take.id, count / len(takes), report.grade),
            f"{report.grade}  {take.id}: {report.reason}",
        )
        for finding in report.findings:
            at = f" (at {finding.at:.2f} s)" if finding.at is not None else ""
            text = f"     {finding.what}{at} {finding.remedy}"
            out.emit(FindingEvent(take.id, **finding.to_plain()), text)
    text = f"{counted(len(takes), 'take')} checked." if takes else f"{project.name} has no takes yet."
    out.done(CheckDone(reports), text)
