"""What commands that write motion share: their arguments, and how an export is reported."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output, as_request
from studio.cli._stdin import CancelRequests
from studio.errors import RequestError, StudioError, counted, say
from studio.export.clip import GenerationOptions
from studio.export.options import VIEWS, RenderOptions
from studio.export.queue import Entry, Queue, to_name
from studio.export.range import PARTS, ExportRange
from studio.ipc.events import (
    ChildEvent,
    EntryEvent,
    FilesDone,
    ProgressEvent,
    QueueFailure,
    QueueProgressEvent,
)
from studio.motion.moods import MoodSpan

if TYPE_CHECKING:
    from studio.playback.layers import Tuning


def add_tune(parser: argparse.ArgumentParser) -> None:
    """--tune PRESET|FILE.json."""
    parser.add_argument(
        "--tune",
        metavar="PRESET|FILE",
        help="lay a preset of Review's Tune page over the motion: one of the studio (Streaming), one of the "
        "project, or a .json file",
    )


def tuning_of(args: argparse.Namespace, project: Path | None = None) -> Tuning | None:
    """The tuning that was asked for, None for none.

    Args:
        args: the command's arguments.
        project: the project's folder, whose presets count too.

    Raises:
        RequestError: there is no such preset, or its file cannot be used.
    """
    if not args.tune:
        return None
    from studio.playback.layers import presets

    with as_request():
        return presets.find(args.tune, project / presets.FOLDER if project is not None else None).tuning


def add_force(parser: argparse.ArgumentParser) -> None:
    """The option that allows writing over a file."""
    parser.add_argument("--force", action="store_true", help="write over a file that is there already")


def add_format(parser: argparse.ArgumentParser) -> None:
    """--format A,B: several files into the folder named by -o."""
    parser.add_argument(
        "--format", metavar="A,B", help="write these formats into the folder named by -o, e.g. vrma,bvh"
    )


def add_range(parser: argparse.ArgumentParser) -> None:
    """--part all|face|body, --fps N, --from S, --to S and --tune PRESET|FILE."""
    parser.add_argument("--part", choices=PARTS, default="all", help="the face or the body alone (all)")
    parser.add_argument("--fps", type=float, default=0.0, help="frame rate; the motion's own where not given")
    parser.add_argument(
        "--from", dest="start", type=float, default=0.0, metavar="S", help="seconds at which to begin (0)"
    )
    parser.add_argument("--to", dest="end", type=float, metavar="S", help="seconds at which to end")
    add_tune(parser)


def range_of(args: argparse.Namespace) -> ExportRange:
    """What is to be written.

    Raises:
        RequestError: it is not possible.
    """
    # Nothing captures faster than 1000; a slip of the finger would make an enormous file.
    if args.fps and not 1 <= args.fps <= 1000:
        what = "The frame rate must be from 1 to 1000."
        raise RequestError(what, "Leave --fps out to keep the motion's own.")
    # Written with `not`, so that NaN, which float() reads, is refused as well.
    if not args.start >= 0 or (args.end is not None and not args.end > args.start):
        raise RequestError("The span ends before it begins.", "Choose --to later than --from.")
    return ExportRange(args.part, args.fps, args.start, args.end, tuning_of(args, args.project))


def add_generation_options(parser: argparse.ArgumentParser) -> None:
    """How a run is to move: --style NAME, --mix NAME:SHARE, --mood NAME, --liveliness X and --seed N."""
    parser.add_argument("--style", metavar="NAME", help="a take or performer it learnt from (average)")
    parser.add_argument(
        "--mix", action="append", default=[], metavar="NAME:SHARE",
        help="a style and its share, in place of --style; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--mood", action="append", default=[], metavar="NAME[*X][:S-S]",
        help="a label it learnt, throughout or from second to second, X times as strong; may be repeated",
    )  # fmt: skip
    add_sampling_options(parser)


def add_sampling_options(parser: argparse.ArgumentParser) -> None:
    """--liveliness X and --seed N."""
    parser.add_argument(
        "--liveliness",
        type=float,
        default=1.0,
        metavar="X",
        help="0 is still, 1 as it was learnt (1), more exaggerates, up to 3",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="another seed, another take of models that draw (0)"
    )


def generation_options_of(args: argparse.Namespace) -> GenerationOptions:
    """How a run is to move.

    Raises:
        RequestError: a mix or a mood is not written as one.
    """
    mix = tuple(map(_share_of, args.mix))
    if mix and args.style is not None:
        raise RequestError("A mix and one style do not go together.", "Leave --style or --mix out.")
    moods = tuple(map(MoodSpan.read, args.mood))
    return GenerationOptions(args.style, args.seed, args.liveliness, mix, moods)


def _share_of(text: str) -> tuple[str, float]:
    """A style with its share, as NAME:SHARE."""
    name, _, share = text.rpartition(":")
    try:
        return name, float(share)
    except ValueError:
        raise RequestError(
            say("{text} is no share of a style.", text=text), "Write it as average:0.5."
        ) from None


def add_render_options(parser: argparse.ArgumentParser) -> None:
    """--size, --view, --turn, --at, --background, --clear, --light and --avatar."""
    group = parser.add_argument_group(
        "films (.mp4, .webm), stills (.png), sequences (.frames) and bodies (.glb)"
    )
    group.add_argument("--size", default="1280x720", metavar="WxH", help="pixels (1280x720)")
    group.add_argument(
        "--view", default="front", metavar="NAME",
        help=f"one of {', '.join(VIEWS)}, or AROUND,ABOVE,NEAR in degrees, 1 being all of the body (front)",
    )  # fmt: skip
    group.add_argument(
        "--turn", type=float, default=0.0, metavar="DEG", help="go around it, degrees a second (0)"
    )
    group.add_argument("--at", type=float, metavar="S", help="the moment of a still (the middle)")
    group.add_argument(
        "--background", default="room", metavar="NAME|#RRGGBB|FILE",
        help="room, transparent (.webm, .png and .frames), green, a colour or an image (room)",
    )  # fmt: skip
    group.add_argument("--clear", action="store_true", help="the same as --background transparent")
    group.add_argument("--light", action="store_true", help="in light colours")
    group.add_argument(
        "--avatar", type=Path, metavar="VRM",
        help="this avatar, or saia for the studio's own, not the stick figure",
    )  # fmt: skip


def render_options_of(args: argparse.Namespace) -> RenderOptions:
    """How pictures are to be drawn.

    Raises:
        RequestError: it is not possible.
    """
    # Not two options: every program for films writes sizes like this.
    from studio.project.avatars import OWN

    wide, _, high = args.size.lower().partition("x")
    if not (wide.isdecimal() and high.isdecimal()):
        raise RequestError(say("{size} is no size of a picture.", size=args.size), "Write it as 1280x720.")
    avatar = OWN if str(args.avatar).lower() == OWN.stem.lower() else args.avatar
    if avatar is not None and not avatar.is_file():
        raise RequestError(
            say("There is no avatar at {avatar}.", avatar=avatar), "Check how the path is written."
        )
    # Numbers besides names: Review hands over the camera as it stands there.
    view = VIEWS.get(args.view) or _view(args.view)
    from studio.render.background import Background

    background = Background.parse("transparent" if args.clear else args.background).text
    return RenderOptions(int(wide), int(high), view, args.turn, args.at, background, args.light, avatar)


def _view(text: str) -> tuple[float, float, float]:
    try:
        around, above, near = (float(part) for part in text.split(","))
    except ValueError:
        what = say("There is no view called {text}.", text=text)
        raise RequestError(
            what, say("Choose one of {views}, or write AROUND,ABOVE,NEAR.", views=", ".join(VIEWS))
        ) from None
    return around, above, near


def run_one(entry: Entry, out: Output) -> list[Path]:
    """Make one file, as a queue of one of which only the progress is printed.

    Returns:
        The files that were written.

    Raises:
        Exception: whatever went wrong, as it was raised: its type decides the exit code.
    """

    # A single file has no list to show, so the events of its entry stay unprinted.
    def on_event(event: ChildEvent) -> None:
        # A queue ends at 100 % whatever became of its entries; this one says only why it failed.
        if isinstance(event, ProgressEvent) and not queue.failed:
            # A number in a queue says nothing here.
            out.progress(ProgressEvent(event.fraction, event.eta_s))

    queue = Queue([entry], on_event)
    queue.run()
    if queue.failed:
        raise queue.failed[0].error
    return queue.files


def run_queue(entries: Sequence[Entry], out: Output, note: str = "") -> None:
    """Make everything and say what came of it; the last line names what failed and what was cancelled.

    Raises:
        StudioError: not one file could be made.
    """

    def on_event(event: ChildEvent) -> None:
        match event:
            case QueueProgressEvent():
                out.progress(event, entries[event.index].name if entries else "")
            case EntryEvent(state="done"):
                named = to_name(Path(file) for file in event.files)
                out.emit(event, f"{event.name}: {', '.join(map(str, named))}")
            case EntryEvent(state="failed"):
                out.emit(event, f"{event.name}: {event.what} {event.remedy}")
            case EntryEvent(state="cancelled"):
                out.emit(event, f"{event.name}: cancelled")
            case _:
                out.emit(event)

    # Only a window waits for its child; what was begun at a terminal may outlive it.
    requests = CancelRequests(watched=out.as_json)
    queue = Queue(entries, on_event, requests.is_cancelled)
    try:
        queue.run()
    finally:
        requests.close()
    # Where something was made or cancelled, the command did what was asked as far as it went.
    if queue.failed and not queue.files and not queue.cancelled:
        first = queue.failed[0]
        if len(entries) == 1:
            raise StudioError(first.what, first.remedy)
        # A full disk or a run without weights fails every file alike, and needs no name.
        alike = all(failure.what == first.what for failure in queue.failed)
        details = first.what if alike else say("The first, {name}: {what}", name=first.name, what=first.what)
        raise StudioError(
            say("None of the {n} files could be made. {details}", n=len(entries), details=details),
            first.remedy,
        )
    parts = [f"{counted(len(queue.files), 'file')} written."]
    parts += [f"{len(queue.failed)} failed."] if queue.failed else []
    parts += [f"{len(queue.cancelled)} cancelled."] if queue.cancelled else []
    failed = tuple(QueueFailure(one.name, one.what, one.remedy) for one in queue.failed)
    files = tuple(str(file) for file in queue.files)
    out.done(FilesDone(files, failed, tuple(queue.cancelled), note), " ".join([*parts, note]).strip())
