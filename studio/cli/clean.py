"""`saia clean`: sound with less noise, as a choice; the recording stays as it is."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output
from studio.errors import RequestError, StudioError, say
from studio.ipc.events import CleanDone, TakeEvent, TakeProgressEvent

if TYPE_CHECKING:
    from studio.project import Project
    from studio.take import Take


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT TAKE... [--way noise|voice|off] [--prepare]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("takes", nargs="+", metavar="TAKE", help="takes, or parts of them")
    parser.add_argument(
        "--way",
        choices=("noise", "voice", "off"),
        default="noise",
        help="less noise, the voice alone, or as recorded (noise)",
    )
    parser.add_argument("--prepare", action="store_true", help="only make the sound; choose nothing")


def run(args: argparse.Namespace, out: Output) -> None:
    """Make the cleaned sound of each take, then choose it for all of them as one step of undo."""
    from studio.cli._project import opened
    from studio.dataset import edits
    from studio.take.cleaned import clean

    project = opened(args.project, out, read_only=args.prepare)
    # Before the work: cleaning takes minutes that would be lost.
    if project.read_only and not args.prepare:
        raise StudioError(project.read_only_reason, project.read_only_remedy)
    way = "" if args.way == "off" else args.way
    ids = _ids(project, args.takes)
    # By take: parts of one recording share its cleaned sound.
    takes = {project.dataset[name].take: project.take(project.dataset[name].take) for name in ids}
    made = {}
    for number, take in enumerate(takes.values()):
        # Over all takes: a bar that starts anew for each says nothing about the end.
        report = _Report(out, take.id, number, len(takes))
        made[take.id] = clean(_sound_of(take), way, report)
        out.emit(TakeEvent(take.id, file=str(made[take.id])), f"{take.id}: {_WORDS[args.way]}")
    # After all sounds are made: one that fails leaves every choice as it was.
    if not args.prepare:
        who = ids[0] if len(ids) == 1 else f"{len(ids)} takes"
        project.edit(
            f"Clean the sound of {who}", edits.update(project.dataset, ids, lambda s: replace(s, clean=way))
        )
    count = "1 take" if len(made) == 1 else f"{len(made)} takes"
    done = CleanDone({take: str(file) for take, file in made.items()}, way)
    out.done(done, f"{count}: {_WORDS[args.way]}. The recordings stay as they are.")


_WORDS = {"noise": "less noise", "voice": "the voice alone", "off": "as recorded"}


class _Report:
    """Progress over all takes together."""

    def __init__(self, out: Output, take: str, number: int, count: int) -> None:
        self._out, self._take, self._number, self._count = out, take, number, count

    def __call__(self, fraction: float) -> None:
        whole = (self._number + fraction) / self._count
        self._out.emit(TakeProgressEvent(whole, take=self._take))


def _sound_of(take: Take) -> Path:
    if take.audio_path is None:
        raise RequestError(say("{take} has no sound.", take=take.id), "Choose a take with sound.")
    return take.audio_path


def _ids(project: Project, names: list[str]) -> list[str]:
    ids: dict[str, None] = {}
    for name in names:
        mine = [s.id for s in project.dataset.selections if name in (s.id, s.take)]
        if not mine:
            # Says which takes there are.
            project.take(name)
            raise RequestError(
                say("{name} is not selected for anything.", name=name), "Add it to the dataset first."
            )
        ids |= dict.fromkeys(mine)
    return list(ids)
