"""`saia doctor`: what this machine has for the work, in sentences to copy into a report."""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path

from studio import __version__, launch, virtual_devices
from studio.cli._output import Output
from studio.ipc.events import DoctorDone, SystemCheckEvent
from studio.vmc import MARIONETTE_PORT

EXAMPLE = "saia doctor"

PROBE_TIMEOUT = 120.0
"""Seconds a probe may take; a first import of torch on a cold disk is slow."""
LEAST_FREE_BYTES = 2 * 2**30
"""An hour of stereo sound at 48 kHz with motion is about 1.5 GB."""

# A picture is drawn and looked at: drivers exist that make a context and draw nothing.
OPENGL_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 48))
plotter.add_mesh(pyvista.Sphere())
image = plotter.screenshot(return_img=True)
lines = plotter.render_window.ReportCapabilities().splitlines()
facts = {name.strip().lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
assert image.std() > 1, "the picture is empty"
print(facts.get("opengl version string", "?"), "|", facts.get("opengl renderer string", "an unknown device"))
"""
# Multiplied for real: importing alone does not use the processor's own instructions.
TORCH_PROBE = """
import torch
x = torch.ones(64, 64) @ torch.ones(64, 64)
assert float(x[0, 0]) == 64.0
gpu = torch.cuda.get_device_name(0) if torch.cuda.is_available() else ""
gpu = gpu or ("Apple GPU" if torch.backends.mps.is_available() else "")
print(torch.__version__, "|", torch.get_num_threads(), "|", gpu)
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--port",
        type=int,
        default=MARIONETTE_PORT,
        help=f"the motion port to look at (default {MARIONETTE_PORT})",
    )


def run(args: argparse.Namespace, out: Output) -> None:
    checks_to_do: tuple[Callable[[], SystemCheckEvent], ...] = (
        check_system,
        check_sound_in,
        check_sound_out,
        check_screen,
        check_opengl,
        lambda: check_port(args.port),
        check_torch,
        check_voice,
        check_speech,
        check_camera,
        check_disk,
    )
    checks = []
    for look in checks_to_do:
        check = look()
        checks.append(check)
        out.emit(check, line(check))
    # The exit code stays 0: the check itself was done, and its findings are not its failure.
    bad = sum(not check.ok for check in checks)
    verdict = "All is well." if not bad else f"{bad} of {len(checks)} need attention."
    out.done(DoctorDone(tuple(checks)), verdict)


def line(check: SystemCheckEvent) -> str:
    """A finding as a line for people."""
    mark = "ok  " if check.ok else "!!  "
    return f"{mark}{check.name:<10} {check.what} {check.remedy}".rstrip()


def check_system() -> SystemCheckEvent:
    """The studio, Python and the operating system; always well."""
    system = f"{platform.system()} {platform.release()}, {platform.machine()}, {os.cpu_count()} cores"
    return SystemCheckEvent(
        "system", True, f"Saia Studio {__version__}, Python {platform.python_version()}, {system}."
    )


def check_sound_in() -> SystemCheckEvent:
    """Whether there is a microphone to record from."""
    return _check_sound("sound in", "max_input_channels", "microphone", "Connect a microphone")


def check_sound_out() -> SystemCheckEvent:
    """Whether there is something to hear takes with."""
    return _check_sound(
        "sound out", "max_output_channels", "loudspeaker", "Connect a loudspeaker or headphones"
    )


def _check_sound(name: str, channels: str, noun: str, remedy: str) -> SystemCheckEvent:
    try:
        import sounddevice
    except OSError:
        # Sounddevice's way of saying that PortAudio is not installed.
        return SystemCheckEvent(
            name, False, "The sound library PortAudio is missing.", "Install the package libportaudio2."
        )
    try:
        found = [str(device["name"]) for device in sounddevice.query_devices() if device[channels] > 0]
    except sounddevice.PortAudioError as error:
        return SystemCheckEvent(
            name, False, f"The sound system does not answer: {error}.", "Restart the sound system."
        )
    if not found:
        return SystemCheckEvent(
            name, False, f"There is no {noun}.", f"{remedy} and allow the studio to use it."
        )
    # A studio with many interfaces lists dozens.
    listed = ", ".join(found[:4]) + (", ..." if len(found) > 4 else "")
    return SystemCheckEvent(name, True, f"{len(found)} {noun}{'' if len(found) == 1 else 's'}: {listed}.")


def check_screen() -> SystemCheckEvent:
    """Whether a window can be shown."""
    if virtual_devices.has_screen():
        return SystemCheckEvent("screen", True, "A window can be shown.")
    if virtual_devices.screen_available():
        return SystemCheckEvent(
            "screen", True, "There is no screen; a virtual one can be used (saia tour does)."
        )
    return SystemCheckEvent("screen", False, "There is no screen.", "Start the studio in a desktop session.")


def check_opengl(probe: str = OPENGL_PROBE) -> SystemCheckEvent:
    """Whether the stick figure can be drawn, tried in a process of its own: a bad driver crashes."""
    ok, answer = _probe(probe)
    if not ok:
        remedy = "Update the graphics driver, or install libgl1, libegl1 and libgl1-mesa-dri."
        return SystemCheckEvent("OpenGL", False, f"Drawing in 3D failed: {answer}.", remedy)
    version, _, renderer = answer.partition(" | ")
    slow = " (software, so a little slower)" if "llvmpipe" in renderer.lower() else ""
    return SystemCheckEvent("OpenGL", True, f"OpenGL {version} on {renderer}{slow}.")


def check_port(port: int) -> SystemCheckEvent:
    """Whether motion could be received on a UDP port."""
    if not 0 < port < 65536:
        return SystemCheckEvent(
            "motion", False, f"Port {port} does not exist.", "Choose a port from 1 to 65535."
        )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Bound for a moment, as the receiver would: whether a port is free cannot be asked otherwise.
            probe.bind(("127.0.0.1", port))
        except OSError:
            from studio.errors import port_taken

            taken = port_taken(port)
            return SystemCheckEvent("motion", False, taken.what, taken.remedy)
    return SystemCheckEvent("motion", True, f"Port {port} is free for motion.")


def check_torch(probe: str = TORCH_PROBE, timeout_s: float = PROBE_TIMEOUT) -> SystemCheckEvent:
    """Whether networks can be trained, and on what."""
    ok, answer = _probe(probe, timeout_s)
    if not ok:
        return SystemCheckEvent(
            "PyTorch", False, f"PyTorch does not work: {answer}.", "Run the set-up again (make setup)."
        )
    version, threads, gpu = (part.strip() for part in answer.split("|"))
    where = gpu or f"the CPU with {threads} threads"
    return SystemCheckEvent("PyTorch", True, f"PyTorch {version}, training on {where}.")


def check_voice() -> SystemCheckEvent:
    """Whether the practice performer can speak any sentence; without espeak-ng it speaks bundled ones."""
    if launch.program("espeak-ng"):
        return SystemCheckEvent("voice", True, "espeak-ng speaks for the practice performer.")
    return SystemCheckEvent(
        "voice", True, "espeak-ng is not installed, so the practice performer uses its bundled speech."
    )


def check_speech() -> SystemCheckEvent:
    """Whether runs can hear with Whisper; the studio does without unless one is told to."""
    from studio.features.encoders import has_whisper, whisper_remedy

    if has_whisper():
        return SystemCheckEvent("speech", True, "The speech encoder Whisper is installed.")
    words = "The speech encoder Whisper is not installed; Balanced and Best hear plain sound without it."
    return SystemCheckEvent("speech", True, f"{words} {whisper_remedy()}")


def check_camera() -> SystemCheckEvent:
    """Whether webcams and videos can be tracked; any other tracker does without."""
    from studio.tracking import face_model

    missing = face_model.missing()
    if missing is None:
        return SystemCheckEvent("camera", True, "Webcams and videos can be tracked; the face model is here.")
    # Said and no fault: any other tracker does without.
    words = f"{missing.what} Only webcams and videos need it. {missing.remedy}"
    return SystemCheckEvent("camera", True, words)


def check_disk(least_bytes: int = LEAST_FREE_BYTES) -> SystemCheckEvent:
    """Whether an hour of recording fits on the disk of the current folder."""
    from studio.files.atomic import size_text

    # The current folder's disk: no project is named, and most are made where people stand.
    free = shutil.disk_usage(Path.cwd()).free
    room = f"{size_text(free)} are free on this disk"
    if free < least_bytes:
        return SystemCheckEvent("disk", False, f"Only {room}.", "Free some space before recording.")
    return SystemCheckEvent("disk", True, f"{room}.")


def _probe(code: str, timeout_s: float = PROBE_TIMEOUT) -> tuple[bool, str]:
    """Run some Python in a child; whether it ended well, and its last line of output or complaint."""
    try:
        done = subprocess.run(
            launch.python("-c", code),
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            env=launch.environment(),
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, f"it did not answer within {timeout_s:.0f} s"
    if done.returncode == 0:
        return True, (done.stdout.strip().splitlines() or [""])[-1]
    last = (done.stderr.strip().splitlines() or [f"it crashed with code {done.returncode}"])[-1]
    return False, last.rstrip(".")
