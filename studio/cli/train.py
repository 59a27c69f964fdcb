"""`saia train`: learn a performer's motion from their voice.

With --json it prints `started`, then an `epoch` for each (ipc/events/training.py has their facts), `note` for
what is worth knowing, and `done`; while an epoch takes long, a `step` at most once a second, before it
starts a `cleaning` where cleaned sound was chosen and is not there and a `listening` for each take whose
sound is worked out, and before the error of memory that ran out an `out_of_memory` with the setting that may
fit.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output, silence_stdout
from studio.cli._project import trim_cache
from studio.cli._stdin import StopRequest, ends_clean
from studio.errors import RequestError, StudioError, counted, say, together
from studio.ipc.events import (
    ChosenEvent,
    CleaningEvent,
    EpochEvent,
    ListeningEvent,
    NoteEvent,
    OutOfMemoryEvent,
    PreparingEvent,
    RecipeEvent,
    SettingEvent,
    StartedEvent,
    StepEvent,
    TrainDone,
    TrainingEvent,
)

if TYPE_CHECKING:
    from studio.project import Project, Run, RunReport
    from studio.training.duration import Lengths, TrainingTimes
    from studio.training.loop.run_folder import Board
    from studio.training.recipe import Recipe

EXAMPLE = "saia train MyProject --recipe quick"
_LEGEND = (
    "Each line is an epoch, one round of learning. rmse is the error, less is better; motion and std are how "
    "lively it is,\n1.00 being as lively as you; r is how well it moves with you, 1.00 at best. * marks the "
    "best so far, which is kept."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT --recipe NAME [--set key=value]... [--resume RUN]."""
    parser.add_argument("project", type=Path, nargs="?", help="the project's folder")
    parser.add_argument(
        "--recipe",
        metavar="NAME",
        help="how to train: quick, balanced (default), best, audio2face, faceformer, saia",
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change a value of the recipe"
    )
    parser.add_argument("--resume", metavar="RUN", help="go on with a run where it was")
    parser.add_argument(
        "--tensorboard", action="store_true", help="write the curves for TensorBoard, into the run's folder"
    )
    parser.add_argument(
        "--list", action="store_true", help="only show the recipes, and the values of one that can be --set"
    )


def run(args: argparse.Namespace, out: Output) -> None:
    """Train until done, or until a line "stop" on standard input; Ctrl+C keeps what there is, too."""
    from studio.cli._project import opened
    from studio.settings import settings_folder
    from studio.training.duration import TrainingTimes
    from studio.training.loop.run_folder import Board, must_be_installed

    began = time.monotonic()
    if args.list:
        _list(args, out)
        return
    if args.project is None:
        raise RequestError("The command lacks PROJECT.", "Run `saia train --help` to see how it is written.")
    if args.tensorboard:
        must_be_installed()
    project = opened(args.project, out)
    resume = project.run(args.resume) if args.resume else None
    if resume is not None and resume.is_shipped:
        what = "The base voice comes with the studio; its training cannot go on."
        raise RequestError(what, "Leave --resume out to train a run of your own.")
    recipe = _recipe(args, resume)
    if resume is None and recipe.with_encoder and not (recipe.form or _asks_for_form(args)):
        from studio.features.encoders import whisper_remedy

        plain = say("Whisper, which knows speech, is not installed: this hears plain sound.")
        out.note(together(" ", plain, whisper_remedy()))
    # A person at a terminal has Ctrl+C; reading there would swallow what they type next.
    stop = StopRequest(read=out.as_json or not sys.stdin.isatty(), watched=out.as_json)
    out.pass_by(PreparingEvent(), "Reading the takes ...")
    board = Board() if args.tensorboard else None
    times, lengths = TrainingTimes(settings_folder()), _lengths_of(project)
    after_s = times.expected_after_s(recipe, lengths)
    finished = _trained(project, recipe, resume, out, stop, board, after_s)
    trained_s = time.monotonic() - began
    # Torch takes seconds to load: what was wrong with the request was said before.
    from studio.training.loop.setup import is_first_process

    # Under torchrun every process comes here; one of them speaks.
    if not is_first_process():
        return
    _measure_look_aheads(project, finished, out, stop)
    trim_cache(project)
    report = finished.facts
    if resume is None and not stop.is_set():
        _remember(times, recipe, report, trained_s, time.monotonic() - began - trained_s, lengths)
    stopped, seconds, best = report.status == "stopped", report.seconds or 0.0, report.best_epoch
    how = "Stopped" if stopped else "Done"
    done = TrainDone(finished.id, str(finished.folder), best, stopped, seconds, report.best_val)
    out.done(done, f"{how} after {_clock(seconds)}: {finished.id}, best epoch {best}.")


def _measure_look_aheads(project: Project, finished: Run, out: Output, stop: StopRequest) -> None:
    """How good the run is at each look-ahead that Live offers, kept in its report."""
    from studio.cli._measure import after_training

    if finished.has_weights:
        with ends_clean("SIGHUP"):
            after_training(project, finished, out, stop.requested_again())


def _remember(
    times: TrainingTimes,
    recipe: Recipe,
    report: RunReport,
    trained_s: float,
    after_s: float,
    lengths: Lengths,
) -> None:
    """Keep what a training of its kind takes here, for the next one's expected time."""
    from studio.training.duration import TrainingTime, kind_of

    if report.status != "done" or report.step_s is None or report.check_s is None:
        return
    settings = recipe.training
    times.remember(
        TrainingTime(
            kind_of(recipe),
            report.device,
            report.step_s / (settings.crops * settings.crop_frames),
            report.check_s,
            max(trained_s - (report.seconds or 0.0), 0.0),
            after_s,
            lengths.val,
            lengths.total,
        )
    )


def _lengths_of(project: Project) -> Lengths:
    """Seconds of a project's takes by use."""
    from studio.training.duration import Lengths

    def of(split: str) -> float:
        return sum(one.seconds(take.info.duration) for one, take in project.selected(split))

    return Lengths(of("train"), of("val"), of("test"))


def _trained(
    project: Project,
    recipe: Recipe,
    resume: Run | None,
    out: Output,
    stop: StopRequest,
    board: Board | None,
    after_s: float | None,
) -> Run:
    from studio.evaluation.model_card import write_card
    from studio.training.loop.train import train

    name, folder = "", None

    def on_event(event: TrainingEvent) -> None:
        nonlocal name, folder
        if isinstance(event, StartedEvent):
            name, folder = event.run, Path(event.folder)
        if board is not None:
            board(event)
        _tell(event, out, stop)

    try:
        with ends_clean("SIGHUP"):
            return train(project, recipe, on_event=on_event, stop=stop.is_set, resume=resume, after_s=after_s)
    except KeyboardInterrupt as error:
        # Double marks mean the same everywhere.
        again = f'saia train "{project.folder}" --resume {name}'
        raise KeyboardInterrupt(f"`{again}` goes on where it was." if name else "") from error
    finally:
        if board is not None:
            board.close()
        if folder is not None:
            # However it ended, there may be weights to use; a card that cannot be written is no failure.
            with suppress(StudioError):
                write_card(folder)


def _recipe(args: argparse.Namespace, resume: Run | None) -> Recipe:
    from studio.training import recipe as recipes

    if resume is None:
        return _settled(_chosen(args))
    kept = recipes.read_recipe(resume.folder / "recipe.toml")
    if args.recipe and args.recipe != kept.name:
        raise RequestError(
            say("{run} was started with the recipe {recipe}.", run=resume.id, recipe=kept.name),
            "Leave --recipe out to go on with it.",
        )
    return _settled(kept.with_overrides(args.set))


def _chosen(args: argparse.Namespace) -> Recipe:
    """The recipe named, in its usual form unless another is asked for, with what was changed."""
    from studio.training import recipe as recipes

    load = recipes.load_recipe if _asks_for_form(args) else recipes.usual_recipe
    return load(args.recipe or recipes.DEFAULT).with_overrides(args.set)


def _asks_for_form(args: argparse.Namespace) -> bool:
    return any(word.partition("=")[0].strip() == "form" for word in args.set)


def _settled(recipe: Recipe) -> Recipe:
    """The recipe, knowing the speech encoder it names; said before torch and the takes are loaded."""
    from dataclasses import replace

    from studio.features.encoders import with_resolved_encoder

    return replace(recipe, sound=with_resolved_encoder(recipe.sound))


def _list(args: argparse.Namespace, out: Output) -> None:
    from dataclasses import asdict

    from studio.settings import settings_folder
    from studio.training import recipe as recipes
    from studio.training.duration import TrainingTimes

    chosen, times = _chosen(args), TrainingTimes(settings_folder())
    found = recipes.recipes()
    for info in found:
        expected = times.expected(recipes.usual_recipe(info.name)).words
        text = f"{info.name:<12} {info.title:<18} {expected:<18} {info.summary}"
        out.emit(RecipeEvent(**asdict(info)), text)
    out.emit(ChosenEvent(chosen.name), f"\nWhat --set can change, and its value in {chosen.name}:")
    for key, value in chosen.settings().items():
        out.emit(SettingEvent(key, value), f"  {key} = {value}")
    out.done(TrainDone(recipes=tuple(info.name for info in found)))


def _tell(event: TrainingEvent, out: Output, stop: StopRequest) -> None:
    try:
        _print(event, out)
    except BrokenPipeError:
        # The window died: what was learnt is kept, nobody reads what is said.
        silence_stdout()
        stop.request()


def _print(event: TrainingEvent, out: Output) -> None:
    match event:
        case EpochEvent():
            out.emit(event, _epoch_line(event))
        case NoteEvent():
            out.note(event.text)
        case StartedEvent():
            out.emit(event, _start_line(event))
        case CleaningEvent():
            out.pass_by(event, f"Cleaning the sound of {event.take} {event.fraction:4.0%}")
        case ListeningEvent():
            out.pass_by(event, f"Listening to {event.take}, {event.number} of {event.of}")
        case StepEvent():
            out.pass_by(event, _step_line(event))
        case OutOfMemoryEvent():
            out.emit(event)


def _start_line(event: StartedEvent) -> str:
    line = (
        f"{event.run}: {counted(len(event.train), 'take')}, {counted(event.frames, 'frame')}, validated on "
        f"{', '.join(event.val)}; {counted(event.parameters, 'parameter')} on {event.device}.\n{_LEGEND}"
    )
    titles = f"{'epoch':>9}  {'train':>8}  {'valid':>8}  {'rmse':>7}  {'motion':>6}  {'std':>5}  {'r':>5}"
    return f"{line}\n{titles}  left"


def _epoch_line(event: EpochEvent) -> str:
    def figure(name: str, width: int, digits: int) -> str:
        value = event.val.get(name)
        return f"{'-':>{width}}" if value is None else f"{value:>{width}.{digits}f}"

    val_loss = f"{event.val_loss:8.4f}" if math.isfinite(event.val_loss) else f"{'-':>8}"
    best = "  *" if event.best else ""
    advice = f"\n{event.advice}" if event.advice else ""
    return (
        f"{event.epoch:>4}/{event.of:<4}  {event.train_loss:8.4f}  {val_loss}  "
        f"{figure('rmse', 7, 4)}  {figure('motion_ratio', 6, 2)}  {figure('std_ratio', 5, 2)}  "
        f"{figure('pearson', 5, 2)}  {_clock(event.eta_s)}{best}{advice}"
    )


def _step_line(event: StepEvent) -> str:
    return f"{event.epoch:>4}/{event.of:<4}  step {event.step} of {event.steps}, {_clock(event.eta_s)} left"


def _clock(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d}"
