"""`saia cut`: one take becomes many, cut where nobody speaks."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output
from studio.errors import RequestError, StudioError, say
from studio.ipc.events import CutDone, TakeEvent, TakeProgressEvent

if TYPE_CHECKING:
    from studio.dataset import Selection
    from studio.dataset.pauses import Span
    from studio.project import Project

EXAMPLE = "saia cut MyProject Hello_001"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT TAKE... [--pause S] [--shortest S] [--padding S] [--look]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("takes", nargs="+", metavar="TAKE", help="takes, or parts of them, to cut")
    parser.add_argument("--pause", type=float, default=0.6, metavar="S", help="seconds of silence to cut at")
    parser.add_argument(
        "--shortest", type=float, default=2.0, metavar="S", help="seconds a part has at least"
    )
    parser.add_argument(
        "--padding", type=float, default=0.3, metavar="S", help="seconds of silence kept around speech"
    )
    parser.add_argument("--look", action="store_true", help="only say where; change nothing")


def run(args: argparse.Namespace, out: Output) -> None:
    """Listen to each take once, then cut all of them as one step of undo; recordings stay whole."""
    from studio.cli._project import opened
    from studio.dataset.pauses import Cut, split_into

    if min(args.pause, args.shortest, args.padding) < 0:
        raise RequestError("A length in seconds cannot be below 0.", "Give 0 or more.")
    project = opened(args.project, out, read_only=args.look)
    if project.read_only and not args.look:
        raise StudioError(project.read_only_reason, project.read_only_remedy)
    cut = Cut(args.pause, args.shortest, args.padding)
    # Listening is done for all takes before anything is changed.
    found = {s.id: _spans(project, s, cut, out) for s in _selections(project, args.takes)}
    # One span is the whole take: there is nothing to cut.
    many = {name: spans for name, spans in found.items() if len(spans) > 1}
    if not args.look and many:
        # All cuts on one dataset, so that one undo takes all of them back.
        dataset = project.dataset
        for name, spans in many.items():
            end = project.take(dataset[name].take).info.duration
            dataset = split_into(dataset, name, spans, end)
        who = next(iter(many)) if len(many) == 1 else f"{len(many)} takes"
        project.edit(f"Cut {who} where nobody speaks", dataset)
    out.done(CutDone(found), _summary(many, args.look))


def _selections(project: Project, names: list[str]) -> list[Selection]:
    chosen: dict[str, Selection] = {}
    for name in names:
        mine = [s for s in project.dataset.selections if name in (s.id, s.take)]
        if not mine:
            # Says which takes there are.
            project.take(name)
            raise RequestError(
                say("{name} is not selected for anything.", name=name), "Add it to the dataset first."
            )
        chosen |= {s.id: s for s in mine}
    return list(chosen.values())


def _spans(
    project: Project, selection: Selection, cut: object, out: Output
) -> tuple[tuple[float, float], ...]:
    from studio.dataset.pauses import Cut, parts, spoken
    from studio.sound.voice_activity import HOP, voice

    assert isinstance(cut, Cut)
    take = project.take(selection.take)
    if take.audio_path is None:
        raise RequestError(say("{take} has no sound.", take=take.id), "Choose a take with sound.")

    def on_progress(fraction: float) -> None:
        out.emit(TakeProgressEvent(fraction, take=take.id))

    end = take.info.duration if selection.out_point is None else selection.out_point
    spans = parts(spoken(voice(take.audio_path, on_progress), HOP), cut, selection.in_point, end)
    lines = [f"{selection.id}: {len(spans)} part{'' if len(spans) == 1 else 's'}"]
    lines += [f"  {number:3d}  {a:9.2f} to {b:9.2f} s" for number, (a, b) in enumerate(spans, 1)]
    out.emit(TakeEvent(selection.id, parts=spans), "\n".join(lines))
    return spans


def _summary(many: dict[str, tuple[Span, ...]], look: bool) -> str:
    if not many:
        return "There is no pause long enough to cut in; nothing was changed."
    count = sum(map(len, many.values()))
    takes = "1 take" if len(many) == 1 else f"{len(many)} takes"
    if look:
        return f"{takes} would become {count} parts; nothing was changed."
    return f"{takes} became {count} parts; the recordings stay as they are."
