"""`saia record`: a take without the window."""

from __future__ import annotations

import argparse
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output
from studio.cli._stdin import stop_requests
from studio.errors import RequestError, counted, say
from studio.ipc.events import ProblemEvent, RecordDone, RecordStateEvent, RollingEvent
from studio.vmc import MARIONETTE_PORT

if TYPE_CHECKING:
    from studio.capture.cut_off import CutOff
    from studio.capture.recorder import Recorder
    from studio.capture.snapshot import Snapshot
    from studio.take.take import Take

EXAMPLE = "saia record MyProject --slate Hello --seconds 60"
_LOOK_S = 0.05
_TELL_S = 0.5
_SETTLE_S = 3.0
_SHORT_S = 1.0
"""A take that ends so much before its time was not ended by the time being up."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `saia record`."""
    parser.add_argument(
        "project", type=Path, metavar="PROJECT", help="a project folder; made where it is not"
    )
    parser.add_argument("--slate", required=True, help="what the take is called")
    parser.add_argument("--seconds", type=float, metavar="N", help="how long; without it, until Ctrl+C")
    parser.add_argument(
        "--port", default=str(MARIONETTE_PORT), help=f"where VMC motion comes in ({MARIONETTE_PORT}), or none"
    )
    parser.add_argument("--host", default="127.0.0.1", help="0.0.0.0 hears other computers too")
    parser.add_argument(
        "--device",
        default="",
        metavar="NAME",
        help='the microphone by name; "performer" is the voice of saia performer; or none',
    )
    parser.epilog = (
        f"{parser.epilog}. Exit code 0: the take is whole. 1: it was cut off (full disk, vanished folder, "
        "lost microphone), cannot be read again, or there is none; the last sentences say why, and where "
        "lies what could be kept."
    )


def run(args: argparse.Namespace, out: Output) -> int:
    """Record one take and add it to the project.

    Returns:
        The exit code: 1 for a take that was cut off, or whose files cannot be read again.

    Raises:
        RequestError: an option makes no sense.
        StudioError: an input cannot be opened, or nothing came in.
    """
    port = _port(args.port)
    if not args.slate.strip():
        raise RequestError("A take needs a name.", "Give one with --slate, such as --slate Hello.")
    if args.seconds is not None and not 0 < args.seconds <= 24 * 3600:
        raise RequestError(
            say("{seconds} is no length of a take.", seconds=f"{args.seconds:g}"),
            "Give seconds from 0 to 86400.",
        )
    if port is None and args.device == "none":
        raise RequestError("There is nothing to record.", "Give a port or a microphone.")
    from studio.capture.recorder import Recorder
    from studio.cli._project import opened_or_made

    # Opened while recording, so that no other window changes the project meanwhile.
    with opened_or_made(args.project, out) as project:
        recorder = Recorder(project.takes_folder)
        try:
            take, last = record_take(recorder, args, port, out)
        finally:
            recorder.close()
        project.refresh()
    readable = tell_outcome(take, last, args.seconds, recorder.cut_off, out)
    return 1 if recorder.cut_off is not None or not readable else 0


def _port(text: str) -> int | None:
    if text.lower() == "none":
        return None
    if not text.isdigit() or int(text) > 65535:
        raise RequestError(say("{text} is not a port.", text=text), "Give a number up to 65535, or none.")
    return int(text)


def record_take(
    recorder: Recorder, args: argparse.Namespace, port: int | None, out: Output
) -> tuple[Take, Snapshot]:
    """Record until the end that was asked for; the take, and the last look at the recorder before it.

    Raises:
        StudioError: the port or the sound device cannot be opened, or the folder cannot be written.
    """
    if port is not None:
        # Motion first: a port in use is refused before the microphone's light goes on.
        recorder.open_motion(port, args.host)
    if args.device != "none":
        recorder.open_audio(args.device or None)
        _wait_for_sound(recorder)
    # Before the recording starts, so that no Ctrl+C falls between the two.
    with stop_requests() as stop:
        recorder.start(args.slate)
        begun = recorder.snapshot()
        where = f"port {begun.port}" if begun.port is not None else "no motion"
        text = f"Recording {args.slate}: {where}, {begun.device or 'no sound'}. Ctrl+C ends it."
        out.emit(RollingEvent(begun.port, begun.device), text)
        _follow(recorder, args.seconds, stop, out)
        # Taken before stop: these are the counters of the recording under way.
        last = recorder.snapshot()
        return recorder.stop(), last


def _follow(recorder: Recorder, seconds: float | None, stop: threading.Event, out: Output) -> None:
    """Tell how it goes until the time is up, somebody asks it to stop, or nothing more can be written."""
    reported_at, reported = 0.0, set[str]()
    while not stop.wait(_LOOK_S):
        now = recorder.snapshot()
        if seconds is not None and now.elapsed >= seconds:
            return
        # By itself: the disk takes no more.
        ended = now.state != "rolling"
        if ended or now.elapsed - reported_at >= _TELL_S:
            reported_at = now.elapsed
            tell_state(now, reported, out)
        if ended:
            return


def _wait_for_sound(recorder: Recorder) -> None:
    """The first blocks take a moment to come; a take should begin with sound."""
    until = time.monotonic() + _SETTLE_S
    while recorder.snapshot().audio_seconds == 0 and time.monotonic() < until:
        time.sleep(0.01)


def tell_state(now: Snapshot, reported: set[str], out: Output) -> None:
    """Say how the recording goes; each kind of problem once, and then also in `reported`."""
    state = RecordStateEvent(
        state=now.state,
        elapsed=round(now.elapsed, 3),
        frames=now.frames,
        frames_per_s=now.frames_per_s,
        frames_lost=now.frames_lost,
        packets=now.packets,
        packets_bad=now.packets_bad,
        packets_lost=now.packets_lost,
        packets_refused=now.packets_refused,
        refused_per_s=round(now.refused_per_s),
        frames_thinned=now.frames_thinned,
        audio_seconds=round(now.audio_seconds, 3),
        peak_dbfs=round(now.peak_dbfs, 1),
        problems=_plain(now.problems),
    )
    out.emit(state)
    for what, remedy in now.problems:
        # Counting sentences change with each count; a person needs each of them once.
        kind = "".join(c for c in what if not c.isdigit() and c != ",")
        if kind not in reported:
            reported.add(kind)
            if not out.as_json:
                out.emit(ProblemEvent(what, remedy), f"{what} {remedy}")


def _not_in_it(take: Take, last: Snapshot, asked: float | None) -> str:
    """What a take lacks of what was sent and asked for, in sentences."""
    from studio.capture.health import losses

    found = losses(take.info)
    if asked is not None and last.elapsed >= asked and take.info.duration < asked - _SHORT_S:
        found += (f"Nothing came in after {take.info.duration:.1f} s of the {asked:g} s asked for.",)
    return "".join(f" {sentence}" for sentence in found)


def tell_outcome(take: Take, last: Snapshot, asked: float | None, cut: CutOff | None, out: Output) -> bool:
    """The last sentences, once the files were read again; whether those hold what they should.

    A recording that was cut off did not get to what was asked for.
    """
    from studio.capture.health import counter
    from studio.take.check import check_take, proof_of

    info, report = take.info, check_take(take)
    proof = proof_of(take, report)
    why = f" It was cut off. {cut.what} {cut.remedy}" if cut is not None else ""
    asked = asked if cut is None else None
    lacks = why + _not_in_it(take, last, asked)
    done = RecordDone(
        take=take.id,
        seconds=round(info.duration, 3),
        frames=info.frames,
        frames_lost=info.frames_lost,
        packets=info.packets,
        packets_bad=info.packets_bad,
        **{key: counter(info, key) for key in ("packets_lost", "packets_refused", "frames_thinned")},
        seconds_asked=asked,
        audio_seconds=round(info.audio_seconds, 3),
        drift_ppm=info.drift_ppm,
        fps=info.fps,
        cut_off=cut is not None,
        reason=cut.reason if cut is not None else None,
        verified=proof.good,
        proof=f"{proof.what} {proof.remedy}".strip(),
        folder=str(take.folder),
        notes=tuple(info.notes),
        problems=_plain(last.problems),
    )
    text = f"Saved {take.id}: {info.duration:.1f} s, {counted(info.frames, 'frame')}"
    check = f"{'' if proof.good else 'NOT WHOLE: '}{done.proof}"
    out.done(done, f"{text} ({info.frames_lost} missing), sound {info.audio_seconds:.1f} s.{lacks}\n{check}")
    return not any(finding.kind in ("damaged", "incomplete") for finding in report.findings)


def _plain(problems: Iterable[tuple[str, str]]) -> tuple[dict[str, str], ...]:
    return tuple({"what": what, "remedy": remedy} for what, remedy in problems)
