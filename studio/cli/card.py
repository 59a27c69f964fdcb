"""`saia card`: what a project holds for training, as one HTML file to show."""

from __future__ import annotations

import argparse
from datetime import datetime
from pathlib import Path

from studio.cli._output import Output
from studio.errors import RequestError, counted, say
from studio.ipc.events import CardDone, CheckedEvent, ReadEvent

EXAMPLE = "saia card MyProject -o MyProject.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT -o HTML."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="HTML", help="the file to write")


def run(args: argparse.Namespace, out: Output) -> None:
    """Check and count the takes that are used; only reads the project."""
    from studio.cli._project import opened
    from studio.dataset.data_card import card_facts, minutes, write_card
    from studio.take.check import check_take

    # Browsers show a page under any other ending as its source.
    if args.out.suffix.lower() not in (".html", ".htm"):
        what = say("{name} does not end in .html.", name=args.out.name)
        raise RequestError(what, "Choose a name that ends in .html.")
    project = opened(args.project, out)
    takes = {take.id: take for take in project.takes}
    # A take cut into parts is checked once.
    used = list(dict.fromkeys(s.take for s in project.dataset.selections if s.split and s.take in takes))
    # Checking takes most of the time, so it gets 0.8 of the progress.
    reports = {}
    for count, take_id in enumerate(used, 1):
        reports[take_id] = check_take(takes[take_id])
        out.emit(CheckedEvent(take_id, 0.8 * count / len(used)))
    facts = card_facts(
        project.name,
        project.dataset,
        takes,
        reports,
        lambda done: out.emit(ReadEvent(0.8 + 0.2 * done)),
    )
    path = write_card(args.out, facts, datetime.now().astimezone().strftime("%Y-%m-%d %H:%M"))
    moving = sum(channel.moves for channel in facts.channels)
    text = f"{path.name}: {counted(facts.takes, 'take')}, {minutes(facts.seconds)}, "
    text += f"{counted(moving, 'channel')} that {'moves' if moving == 1 else 'move'}."
    done = CardDone((str(path),), takes=facts.takes, seconds=facts.seconds, moving=moving)
    out.done(done, text)
