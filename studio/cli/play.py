"""`saia play`: send a motion to a VMC program, in time with its sound."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING

from studio import settings
from studio.cli._export import add_tune, tuning_of
from studio.cli._output import Output, address, as_request
from studio.cli._project import check_sound, recover_takes
from studio.errors import RequestError, counted, say
from studio.ipc.events import NoticeEvent, PlayDone, PlayStateEvent

if TYPE_CHECKING:
    from studio.motion import Motion
    from studio.playback.player import Player
    from studio.vmc.sender import VmcTarget

EXAMPLE = "saia play MyProject/takes/Hello_001 --to 127.0.0.1:39540"
REPORT_SECONDS = 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.add_argument("motion", type=Path, help="a take's folder, or a motion file of a known format")
    parser.add_argument("--audio", type=Path, help="the sound; a take's own where left out")
    parser.add_argument(
        "--to",
        action="append",
        metavar="HOST:PORT",
        help="where it listens (the first target in the settings); may be repeated",
    )
    parser.add_argument("--fps", type=float, default=60.0, help="frames per second (60)")
    parser.add_argument(
        "--names",
        choices=("vrm0", "vrm1", "arkit", "as_is"),
        default="vrm0",
        help="whose names for blend shapes the program knows (vrm0); as_is keeps the motion's own",
    )
    parser.add_argument("--no-bundle", action="store_true", help="one message a packet")
    parser.add_argument("--rotations-only", action="store_true", help="leave the avatar's own proportions")
    parser.add_argument("--loop", action="store_true", help="again and again, until Ctrl+C")
    parser.add_argument("--device", help="sound output by name")
    add_tune(parser)


def run(args: argparse.Namespace, out: Output) -> None:
    """Play to the end, then fade the avatar to rest."""
    from studio.playback.layers import tuned
    from studio.playback.player import Player

    if not 1.0 <= args.fps <= 240.0:
        raise RequestError(
            say("{fps} frames per second is not possible.", fps=f"{args.fps:g}"), "Choose 1 to 240."
        )
    # Read before anything is opened: a typing error costs no second of waiting.
    addresses = [address(text) for text in args.to or [settings.load().targets[0].where]]
    if args.audio is not None:
        check_sound(args.audio)
    project = _project_of(args.motion)
    if project is not None:
        recover_takes(project, out)
    tuning = tuning_of(args, project)
    with as_request():
        motion, sound = _load(args.motion, args.audio)
        duration = float(motion.times[-1]) if len(motion) else 0.0
        if tuning is not None:
            motion = tuned(motion, tuning)
        player = Player(sound, duration if sound is None else None, args.device)
    targets: list[VmcTarget] = []
    try:
        if args.loop:
            player.set_loop((0.0, player.duration))
        targets = _start_targets(args, addresses, motion, player)
        player.play()
        if player.problem is not None:
            out.emit(NoticeEvent(player.problem.what), f"{player.problem} Going on without sound.")
        _follow(player, targets, out)
    finally:
        player.close()
        # All fades begin together, then each is waited for.
        for target in targets:
            target.stop(wait=False)
        for target in targets:
            target.stop()
    sent, dropped = (sum(getattr(t.state, name) for t in targets) for name in ("sent", "dropped"))
    text = f"Sent {counted(sent, 'frame')}; {dropped} left out."
    out.done(PlayDone(sent, dropped, player.position), text)


def _start_targets(
    args: argparse.Namespace, addresses: list[tuple[str, int]], motion: Motion, player: Player
) -> list[VmcTarget]:
    from studio.vmc.encode import SendOptions
    from studio.vmc.sender import Destination, PoseSource, VmcTarget

    options = SendOptions(names=args.names, bundle=not args.no_bundle, rotations_only=args.rotations_only)
    source = PoseSource(motion.named_pose, lambda: player.position)
    targets = []
    for host, port in addresses:
        target = VmcTarget()
        target.start(Destination(host, port, args.fps, options), source)
        targets.append(target)
    return targets


def _follow(player: Player, targets: list[VmcTarget], out: Output) -> None:
    """Wait for the end, saying once a second how it goes and once each what is wrong."""
    reported: set[str] = set()
    following = time.monotonic()
    going = True
    while going:
        # One look more after the end: a short play may be over before the first.
        going = player.playing
        # Often enough for problems; the sending has a thread of its own.
        time.sleep(0.05)
        for problem in [target.state.problem for target in targets]:
            if problem is not None and problem.what not in reported:
                reported.add(problem.what)
                out.emit(NoticeEvent(problem.what, problem.remedy), str(problem))
        if time.monotonic() - following >= REPORT_SECONDS:
            following = time.monotonic()
            states = [target.state for target in targets]
            lights = tuple(str(state.status) for state in states)
            out.emit(PlayStateEvent(player.position, sum(state.sent for state in states), lights))


def _project_of(motion: Path) -> Path | None:
    """The project that a take's folder or a file of a project lies in."""
    from studio.project import is_project

    return next((folder for folder in motion.absolute().parents if is_project(folder)), None)


def _load(path: Path, audio: Path | None) -> tuple[Motion, Path | None]:
    """The motion of a take's folder or of a file, and the sound to play with it."""
    from studio import formats
    from studio.take.folder import load_take
    from studio.take.motion_file import load_motion

    if not path.exists():
        raise RequestError(say("There is no motion at {path}.", path=path), "Check how the path is written.")
    if path.is_dir():
        take = load_take(path)
        motion = load_motion(take)
        if motion is None:
            raise RequestError(
                say("The take {take} holds no motion.", take=take.id), "Choose a take with motion."
            )
        return motion, audio or take.audio_path
    reader = formats.reader_for(path)
    if reader is not None:
        found = reader.read(path)
        if found.motion is not None:
            return found.motion, audio or found.audio
    endings = sorted({module.SUFFIX for module in formats.readers().values()} - {".wav", ".mp4"})
    known = say(
        "Choose a take's folder, or a file that ends in one of: {endings}.", endings=", ".join(endings)
    )
    raise RequestError(say("{name} is no motion the studio can read.", name=path.name), known)
