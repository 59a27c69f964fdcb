"""`saia tour`: the studio takes itself through the whole job, as a demonstration and a self-check."""

from __future__ import annotations

import argparse
import contextlib
import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from studio import launch, virtual_devices
from studio.cli._output import Output
from studio.errors import RequestError, StudioError, say
from studio.ipc.events import TourDone, TourStepEvent, VirtualDeviceEvent

if TYPE_CHECKING:
    from studio.ui.tour import TourStep

EXAMPLE = "saia tour --out tour"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("tour"),
        help="folder for the screenshots, the project and the exports",
    )


def run(args: argparse.Namespace, out: Output) -> None:
    folder = args.out.absolute()
    if folder.is_file():
        raise RequestError(say("{folder} is a file.", folder=folder.name), "Name a folder with --out.")
    with _screen(out), _sound(out):
        # Qt must not load before there is a screen, nor PortAudio before there is a sound device.
        from studio.ui.tour import Tour

        tour = Tour(folder, lambda step: _say(step, out))
        tour.run()
    steps = tuple(TourStepEvent(**asdict(step)) for step in tour.steps)
    text = f"All {len(steps)} steps happened. Screenshots and files are in {folder}."
    out.done(TourDone(tuple(map(str, tour.files)), steps), text)


def _say(step: TourStep, out: Output) -> None:
    line = f"{'ok  ' if step.ok else 'FAIL'} {step.seconds:6.1f} s  {step.name}"
    out.emit(TourStepEvent(**asdict(step)), f"{line}: {step.what}" if step.what else line)


@contextlib.contextmanager
def _screen(out: Output) -> Iterator[None]:
    """A screen to draw on: the real one, else a virtual one."""
    if virtual_devices.has_screen():
        yield
        return
    with virtual_devices.virtual_screen() as display:
        out.emit(VirtualDeviceEvent(display=display), "There is no screen: using a virtual one.")
        os.environ["DISPLAY"] = display
        yield


@contextlib.contextmanager
def _sound(out: Output) -> Iterator[None]:
    """A sound device that hears what it plays: the real one, else a virtual one where there can be one."""
    if has_microphone():
        yield
        return
    if not virtual_devices.sound_available():
        raise StudioError(
            "There is no sound device and no virtual one.",
            "Connect a microphone, or install the package pulseaudio.",
        )
    with virtual_devices.virtual_sound() as environment:
        event = VirtualDeviceEvent(**environment)
        out.emit(event, "There is no sound device: using a virtual one.")
        os.environ.update(environment)
        try:
            yield
        finally:
            _let_devices_go()


def _let_devices_go() -> None:
    """Close PortAudio while its server still runs: it complains at length where the server went first."""
    import sounddevice

    sounddevice._terminate()


def has_microphone() -> bool:
    """Whether PortAudio lists an input, asked in a process of its own: it lists devices once."""
    import subprocess

    code = (
        "import sounddevice, sys; "
        "sys.exit(not any(d['max_input_channels'] > 0 for d in sounddevice.query_devices()))"
    )
    # In a child: asked here, PortAudio would keep its list without the virtual device.
    command, variables = launch.python("-c", code), launch.environment()
    return subprocess.run(command, capture_output=True, env=variables, check=False).returncode == 0
