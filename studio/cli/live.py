"""`saia live`: speak, and the avatar moves now."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from studio import settings
from studio.cli._live_keep import KeptTakes
from studio.cli._live_targets import Targets
from studio.cli._output import Output, address
from studio.cli._project import check_sound
from studio.cli._stdin import LiveCommands
from studio.errors import RequestError, StudioError, counted, say
from studio.ipc.commands import Command, read_live
from studio.ipc.events import (
    ChannelsEvent,
    LatencyEvent,
    LiveDone,
    LiveStateEvent,
    LookAheadEvent,
    MoodEvent,
    NoticeEvent,
    PoseEvent,
    ReadyEvent,
    SwitchEvent,
    VoiceEvent,
    WaveEvent,
)
from studio.vmc.encode import NAME_SETS

if TYPE_CHECKING:
    from studio.inference.live.build import LivePerformance
    from studio.project import Project, Run
    from studio.vmc.sender import Destination

EXAMPLE = "saia live MyProject balanced_001 --to 127.0.0.1:39540"
NOWHERE, DEFAULT = "none", "default"
LOOK_S, TELL_S, SHOW_S = 0.03, 0.1, 1 / 60
WORDS_S = 0.5
FARTHEST_MS = 2000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN [--device NAME] [--to HOST:PORT] [--look-ahead MS] [--file WAV] [--seconds N] ..."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("run", help="the run that performs")
    parser.add_argument("--device", metavar="NAME", help="the microphone by name (the system's own)")
    parser.add_argument("--file", type=Path, metavar="WAV", help="perform this sound instead of a microphone")
    parser.add_argument("--output", metavar="NAME", help="where --file is heard; none for nowhere")
    parser.add_argument(
        "--to", action="append", metavar="HOST:PORT",
        help="where an avatar program listens (the first in the settings); may be repeated; none for nowhere",
    )  # fmt: skip
    parser.add_argument(
        "--look-ahead", type=int, metavar="MS",
        help="how far it hears ahead (about 60, or 500 for runs that read both ways; the nearest it offers)",
    )  # fmt: skip
    parser.add_argument(
        "--voice-to", metavar="NAME",
        help="hand your voice on to this output, as late as the avatar; the word default: the system's",
    )  # fmt: skip
    parser.add_argument("--seconds", type=float, metavar="N", help="how long; without it, until Ctrl+C")
    parser.add_argument("--style", metavar="NAME", help="whose way of moving (average)")
    parser.add_argument("--mood", default="", metavar="NAME", help="a label it learnt (none)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="which draw, for runs that draw")
    parser.add_argument("--liveliness", type=float, default=1.0, metavar="X", help="0 to 3; 1 as learnt")
    parser.add_argument("--fps", type=float, default=60.0, help="frames sent each second (60)")
    parser.add_argument("--names", choices=NAME_SETS, default="vrm0", help="whose names for shapes (vrm0)")
    parser.add_argument("--no-bundle", action="store_true", help="one message a packet")
    parser.add_argument("--rotations-only", action="store_true", help="leave the avatar's own proportions")
    parser.add_argument("--no-gate", action="store_true", help="do not idle while nobody speaks")
    parser.add_argument("--no-early", action="store_true", help="open the mouth only with its sound")
    parser.add_argument("--no-gain", action="store_true", help="leave the microphone's level as it is")
    parser.add_argument("--suppress-noise", action="store_true", help="the voice alone; 30 ms more latency")
    parser.add_argument("--poses", action="store_true", help="with --json: tell the poses too, for a display")


def run(args: argparse.Namespace, out: Output) -> None:
    """Perform until the time is up, the file is over, or somebody asks it to stop.

    Raises:
        RequestError: an option makes no sense, or the run cannot be performed live.
        StudioError: the microphone cannot be opened.
    """
    # The voice detector would share each of its small steps among four threads, and waiting for one another
    # takes them four times as long as the work. OpenMP reads this when it is loaded, so it is said first.
    os.environ.setdefault("OMP_THREAD_LIMIT", "1")
    addresses = _addresses(args)
    if args.file is not None:
        check_sound(args.file)
    _check_voice(args)
    from studio.capture.listener import raise_priority
    from studio.cli._project import opened
    from studio.inference.live.build import LiveOptions, make

    raise_priority(before_all=True)
    project = opened(args.project, out)
    chosen = project.run(args.run)
    options = LiveOptions(
        device=args.device, file=args.file, output=args.output, look_ahead_ms=args.look_ahead,
        style=args.style, mood=args.mood, seed=args.seed, liveliness=args.liveliness, gate=not args.no_gate,
        gain=not args.no_gain, early=not args.no_early, suppress=args.suppress_noise, blinks=chosen.blinks,
    )  # fmt: skip
    live = make(chosen.folder, _sounds_of(project, chosen), options)
    _Stage(args, out, live, addresses, project).run()


class _Stage:
    """The performance with its targets, its requests and what is reported of it."""

    def __init__(
        self,
        args: argparse.Namespace,
        out: Output,
        live: LivePerformance,
        addresses: list[str],
        project: Project,
    ) -> None:
        self._args, self._out, self._live, self._addresses = args, out, live, addresses
        self._kept = KeptTakes(live, project)
        self._targets = Targets(live.pose_source(), _usual(args))
        self._stopped, self._poses = False, bool(args.poses)
        self._reported_at = self._shown = 0.0
        self._measured = False
        self._voice: str | None = None
        self._commands: dict[str, Callable[[Command], None]] = {
            **dict.fromkeys(live.switches, self._switch),
            "look-ahead": lambda command: self._look_ahead(command.argument),
            "voice-to": lambda command: self._voice_to(command.argument),
            "mood": lambda command: self._mood(command.argument),
            "tune": lambda command: self._tune(command.argument),
            "send": lambda command: self._targets.send(command.argument),
            "unsend": lambda command: self._targets.unsend(command.argument),
            "wave": lambda command: self._wave(command.argument),
            "poses": lambda command: self._show_poses(command.switched_to(self._poses)),
            "clip": lambda _: live.performance.reset_clip(),
            "keep": lambda _: self._kept.keep(),
            "stop": lambda _: self._end(),
        }

    def run(self) -> None:
        """From the first sound to the last pose."""
        from studio.cli._stdin import stop_signals

        live, commands = self._live, LiveCommands()
        live.performance.start()
        try:
            if self._args.voice_to is not None:
                self._voice_to(self._args.voice_to)
            for one in self._addresses:
                self._targets.send(one)
            self._report_ready()
            with stop_signals() as signalled:
                until = time.monotonic() + self._args.seconds if self._args.seconds else float("inf")
                while not self._over(until) and not signalled.is_set() and not commands.parent_gone:
                    for line in commands.poll():
                        self._run_command(line)
                    self._report()
                    commands.wait(self._seconds_to_next_report())
        finally:
            self._targets.stop()
            live.performance.stop()
            self._kept.finish()
        self._report_kept()
        self._report_done()

    def _seconds_to_next_report(self) -> float:
        """Seconds until something is to be told."""
        if not self._poses:
            return LOOK_S
        return min(max(self._shown + SHOW_S - time.monotonic(), 0.0), LOOK_S)

    def _over(self, until: float) -> bool:
        return self._stopped or self._live.performance.ended or time.monotonic() >= until

    def _end(self) -> None:
        self._stopped = True

    def _run_command(self, line: str) -> None:
        """One request; one that cannot be met is reported, and the performance goes on."""
        try:
            command = read_live(line)
            if command is not None:
                self._commands[command.word](command)
        except StudioError as error:
            self._say(error)

    def _switch(self, command: Command) -> None:
        on = command.switched_to(self._live.is_on(command.word))
        self._live.switch(command.word, on)
        self._out.emit(SwitchEvent(command.word, on), f"{command.word} is {'on' if on else 'off'}.")

    def _wave(self, name: str) -> None:
        self._targets.wave(name)
        self._out.emit(WaveEvent(name), f"The test wave goes to {name}.")

    def _show_poses(self, on: bool) -> None:
        self._poses = on and self._out.as_json

    def _look_ahead(self, text: str) -> None:
        if not (text.isascii() and text.isdigit()):
            raise RequestError(
                say("{text} is no look-ahead.", text=text or say("Nothing")),
                "Write milliseconds, such as 100.",
            )
        look_ahead = self._live.set_look_ahead(int(text))
        event = LookAheadEvent(look_ahead.look_ahead_ms, look_ahead.reach_ms)
        self._out.emit(event, f"It hears {max(look_ahead.reach_ms, 0):.0f} ms ahead now.")

    def _voice_to(self, name: str) -> None:
        try:
            self._live.set_voice_output(_output(name))
        finally:
            self._report_voice()

    def _report_voice(self) -> None:
        to = self._voice = self._live.voice_to
        where = to or "the system's output"
        text = f"Your voice goes to {where}, as late as the avatar moves." if to is not None else ""
        self._out.emit(VoiceEvent(to), text)

    def _mood(self, name: str) -> None:
        self._live.set_mood(name)
        self._out.emit(MoodEvent(name), f"It plays {name} now." if name else "It plays no mood now.")

    def _tune(self, text: str) -> None:
        self._live.tune(text)
        self._out.emit(ChannelsEvent(**self._live.channel_facts()))

    def _say(self, error: StudioError) -> None:
        self._out.emit(NoticeEvent(error.what, error.remedy), str(error))

    def _report(self) -> None:
        now = time.monotonic()
        for notice in (*self._live.performance.notices(), *self._targets.changes()):
            self._say(notice)
        self._report_kept()
        if self._voice != self._live.voice_to:
            # The output went away, or came back.
            self._report_voice()
        if self._poses and now - self._shown >= SHOW_S:
            self._shown = now
            self._out.emit(PoseEvent(**self._live.pose_facts()))
        facts = self._live.performance.facts
        late = facts.latency_ms
        if not self._measured and late > 0 and facts.settled:
            self._measured = True
            offset = self._live.facts()["sound_delay_ms"]
            text = f"The avatar moves {late:.0f} ms after your voice: in OBS, Sync Offset {offset} ms."
            self._out.emit(LatencyEvent(round(late, 1), offset), text)
        if now - self._reported_at >= (TELL_S if self._out.as_json else WORDS_S):
            self._reported_at = now
            state = LiveStateEvent(**self._live.facts(), targets=self._targets.states())
            self._out.pass_by(state, self._live.words())

    def _report_kept(self) -> None:
        for outcome in self._kept.poll():
            if isinstance(outcome, StudioError):
                self._say(outcome)
            else:
                self._out.emit(outcome, f"Kept the last {outcome.seconds:.0f} s as {outcome.take}.")

    def _report_ready(self) -> None:
        live = self._live
        look_ahead = live.performance.look_ahead
        self._out.emit(
            ReadyEvent(**live.ready_facts()),
            f"{live.run} performs {live.performance.source.name}: it hears"
            f" {max(look_ahead.reach_ms, 0):.0f} ms"
            " ahead. Write mute, freeze, neutral or stop and press Enter; Ctrl+C ends it.",
        )

    def _report_done(self) -> None:
        facts, targets = self._live.performance.facts, self._targets.states()
        sent, dropped = sum(one.sent for one in targets), sum(one.dropped for one in targets)
        self._out.done(
            LiveDone(
                round(facts.seconds, 3), facts.frames, facts.late, sent, dropped,
                round(facts.latency_ms, 1), round(facts.drift_ppm, 1),
            ),
            f"Performed {facts.seconds:.1f} s: {counted(facts.frames, 'pose')}, "
            f"{counted(sent, 'frame')} sent.",
        )  # fmt: skip


def _addresses(args: argparse.Namespace) -> list[str]:
    """Where to send at first, checked before anything is opened."""
    if not 1.0 <= args.fps <= 240.0:
        raise RequestError(
            say("{fps} frames per second is not possible.", fps=f"{args.fps:g}"), "Choose 1 to 240."
        )
    if args.look_ahead is not None and not 0 <= args.look_ahead <= FARTHEST_MS:
        raise RequestError(
            say("{look_ahead} ms is no look-ahead.", look_ahead=args.look_ahead),
            say("Choose 0 (fastest) to {farthest} (finest).", farthest=FARTHEST_MS),
        )
    if args.seconds is not None and not 0 < args.seconds <= 7 * 24 * 3600:
        raise RequestError(
            say("{seconds} s is no length of a performance.", seconds=f"{args.seconds:g}"),
            "Give seconds above 0.",
        )
    if args.to == [NOWHERE]:
        return []
    requested = args.to or [settings.load().targets[0].where]
    for one in requested:
        address(one)
    return list(requested)


def _check_voice(args: argparse.Namespace) -> None:
    """Whether the voice can go where it is to, before anything is opened."""
    to = _output(args.voice_to or "")
    if to is None:
        return
    if args.file is not None:
        raise RequestError("A file already plays in sync with the avatar.", "Leave --voice-to out.")
    from studio.capture.microphone import find_output

    find_output(to)


def _output(name: str) -> str | None:
    """An output as `LivePerformance` knows it, by the name people give it: none, default, or its own."""
    return None if name in ("", NOWHERE) else "" if name == DEFAULT else name


def _usual(args: argparse.Namespace) -> Destination:
    from studio.vmc.encode import SendOptions
    from studio.vmc.sender import Destination

    options = SendOptions(names=args.names, bundle=not args.no_bundle, rotations_only=args.rotations_only)
    return Destination(fps=args.fps, options=options)


def _sounds_of(project: Project, chosen: Run) -> list[Path]:
    """The sounds the run has learnt from, for the level of its speech; those that are gone are left out."""
    learnt = set(chosen.facts.train)
    takes = [take for selection, take in project.selected() if selection.id in learnt]
    return [take.audio_path for take in takes if take.audio_path is not None]
