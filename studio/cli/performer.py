"""saia performer: a practice performer that speaks and moves, live over VMC; or a sample project of it."""

from __future__ import annotations

import argparse
import queue
from pathlib import Path

from studio.cli._output import EXAMPLE_TARGET, Output, address
from studio.cli._stdin import stop_requests
from studio.errors import RequestError, counted, say
from studio.ipc.events import LineEvent, PerformerDone, PerformerStartedEvent, ProblemEvent, TakeEvent
from studio.sound import LINE_PORT

EXAMPLE = f"saia performer --to {EXAMPLE_TARGET} --seconds 30"
_LOOK_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command's words."""
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "--to", metavar="HOST:PORT", help=f"perform live and send VMC there, such as {EXAMPLE_TARGET}"
    )
    what.add_argument("--sample", metavar="FOLDER", type=Path, help="make the sample project in a new folder")
    what.add_argument(
        "--bundle", metavar="FOLDER", type=Path, nargs="?", const=Path(),
        help="speak the bundled clips anew with espeak-ng (for developers; default resources/performer)",
    )  # fmt: skip
    parser.add_argument("--seconds", type=float, metavar="N", help="stop after N seconds")
    parser.add_argument("--fps", type=float, default=60.0, help="frames a second, 30 to 120 (default 60)")
    parser.add_argument("--device", metavar="NAME", help='output device, or "none" for no sound')
    parser.add_argument(
        "--voice-to", type=int, default=LINE_PORT, metavar="PORT",
        help=f"port of this computer for the voice, see record --device performer ({LINE_PORT}); 0 is none",
    )  # fmt: skip
    parser.add_argument("--unbundled", action="store_true", help="one message a packet")
    parser.add_argument("--jitter", type=float, default=0.0, metavar="MS", help="frames late by 0 to MS")
    parser.add_argument(
        "--loss", type=float, default=0.0, metavar="P", help="share of datagrams lost, 0 to 1"
    )
    parser.add_argument("--seed", type=int, default=0, help="another number is another performer")
    parser.add_argument(
        "--voice", choices=("auto", "espeak", "bundled"), default="auto",
        help="espeak-ng makes speech on the spot; bundled clips need nothing",
    )  # fmt: skip


def run(args: argparse.Namespace, out: Output) -> None:
    """Perform, or make the sample project."""
    if args.sample is not None:
        _sample(args.sample, out)
    elif args.bundle is not None:
        _bundle(args.bundle, out)
    else:
        _perform(args, out)


def _perform(args: argparse.Namespace, out: Output) -> None:
    from studio.performer import Broadcast

    host, port = address(args.to)
    if args.seed < 0:
        raise RequestError(say("{seed} is not a seed.", seed=args.seed), "Choose 0 or a number above it.")
    # The performance calls from its own thread; printing there could make frames late.
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    broadcast = Broadcast(
        host, port, args.fps, _device(args.device), args.seed, not args.unbundled, args.jitter, args.loss,
        seconds=args.seconds, voice_source=args.voice, voice_port=args.voice_to or None, on_line=lines.put,
    )  # fmt: skip
    reported = ""
    broadcast.start()
    out.emit(PerformerStartedEvent(host, port, args.fps), f"Performing to {host}:{port}. Ctrl+C ends it.")
    try:
        with stop_requests() as stop:
            while not stop.is_set() and (not broadcast.wait(_LOOK_S) or not lines.empty()):
                while not lines.empty():
                    text = lines.get()
                    out.emit(LineEvent(text, round(broadcast.position, 3)), f"  {text}")
                # A problem lasts for many looks and is said once.
                if broadcast.problem != reported:
                    reported = broadcast.problem
                    out.emit(ProblemEvent(reported), reported)
    finally:
        broadcast.stop()
    if broadcast.error is not None:
        raise broadcast.error
    done = PerformerDone(
        broadcast.frames_sent, broadcast.frames_dropped, broadcast.datagrams_sent, broadcast.datagrams_lost
    )
    out.done(done, f"{counted(done.frames, 'frame')} sent, {done.frames_dropped} dropped for being late.")


def _sample(folder: Path, out: Output) -> None:
    from studio.performer import make_sample

    def on_take(take: str, count: int, of: int) -> None:
        out.emit(TakeEvent(take, count / of), f"  {take}")
        takes.append(take)

    takes: list[str] = []
    make_sample(folder, on_take)
    out.done(PerformerDone(project=str(folder), takes=tuple(takes)), f"The sample project is in {folder}.")


def _bundle(folder: Path, out: Output) -> None:
    from studio.files.atomic import size_text
    from studio.paths import resource
    from studio.performer import sentences

    files = sentences.make_clips(resource("performer") if folder == Path() else folder)
    size = sum(path.stat().st_size for path in files)
    done = PerformerDone(files=tuple(map(str, files)), bytes=size)
    out.done(done, f"{counted(len(files) - 1, 'clip')}, {size_text(size)} in all.")


def _device(text: str | None) -> str | int | None:
    return int(text) if text is not None and text.isdecimal() else text
