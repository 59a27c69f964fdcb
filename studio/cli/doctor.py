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
from studio.errors import counted, port_taken, say, together
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
    system = f"{platform.system()} {platform.release()}, {platform.machine()}"
    words = say(
        "Saia Studio {version}, Python {python}, {system}, {n} cores.",
        version=__version__,
        python=platform.python_version(),
        system=system,
        n=os.cpu_count() or 1,
    )
    return SystemCheckEvent("system", True, words)


def check_sound_in() -> SystemCheckEvent:
    """Whether there is a microphone to record from."""
    nothing = say("There is no microphone."), say("Connect a microphone and allow the studio to use it.")
    return _check_sound(
        "sound in", "max_input_channels", lambda found: counted(found, "microphone"), *nothing
    )


def check_sound_out() -> SystemCheckEvent:
    """Whether there is something to hear takes with."""
    nothing = (
        say("No sound device can play."),
        say("Plug in headphones or speakers, then check again."),
    )
    return _check_sound(
        "sound out", "max_output_channels", lambda found: counted(found, "loudspeaker"), *nothing
    )


def _check_sound(
    name: str, channels: str, number_of: Callable[[int], str], none: str, remedy: str
) -> SystemCheckEvent:
    try:
        import sounddevice
    except OSError:
        # Sounddevice's way of saying that PortAudio is not installed.
        return SystemCheckEvent(
            name,
            False,
            say("The sound library PortAudio is missing."),
            say("Install the package libportaudio2."),
        )
    try:
        found = [str(device["name"]) for device in sounddevice.query_devices() if device[channels] > 0]
    except sounddevice.PortAudioError as error:
        what = say("The sound system does not answer: {error}.", error=error)
        return SystemCheckEvent(name, False, what, say("Restart the sound system."))
    if not found:
        return SystemCheckEvent(name, False, none, remedy)
    # A studio with many interfaces lists dozens.
    listed = ", ".join(found[:4]) + (", ..." if len(found) > 4 else "")
    what = say("{devices}: {names}.", devices=number_of(len(found)), names=listed)
    return SystemCheckEvent(name, True, what)


def check_screen() -> SystemCheckEvent:
    """Whether a window can be shown."""
    if virtual_devices.has_screen():
        return SystemCheckEvent("screen", True, say("A window can be shown."))
    if virtual_devices.screen_available():
        what = say("There is no screen; a virtual one can be used (saia tour does).")
        return SystemCheckEvent("screen", True, what)
    remedy = say("Start the studio in a desktop session.")
    return SystemCheckEvent("screen", False, say("There is no screen."), remedy)


def check_opengl(probe: str = OPENGL_PROBE) -> SystemCheckEvent:
    """Whether the stick figure can be drawn, tried in a process of its own: a bad driver crashes."""
    ok, answer = _probe(probe)
    if not ok:
        remedy = say("Update the graphics driver, or install libgl1, libegl1 and libgl1-mesa-dri.")
        what = say("Drawing in 3D failed: {reason}.", reason=answer)
        return SystemCheckEvent("OpenGL", False, what, remedy)
    version, _, renderer = answer.partition(" | ")
    what = say("OpenGL {version} on {renderer}.", version=version, renderer=renderer)
    if "llvmpipe" in renderer.lower():
        what = say(
            "OpenGL {version} on {renderer} (software, so a little slower).",
            version=version,
            renderer=renderer,
        )
    return SystemCheckEvent("OpenGL", True, what)


def check_port(port: int) -> SystemCheckEvent:
    """Whether motion could be received on a UDP port."""
    if not 0 < port < 65536:
        what = say("Port {port} does not exist.", port=port)
        return SystemCheckEvent("motion", False, what, say("Choose a port from 1 to 65535."))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Bound for a moment, as the receiver would: whether a port is free cannot be asked otherwise.
            probe.bind(("127.0.0.1", port))
        except OSError:
            taken, elsewhere = port_taken(port), say("Close it, or choose another port in Record.")
            return SystemCheckEvent("motion", False, taken.what, taken.remedy, elsewhere)
    return SystemCheckEvent("motion", True, say("Port {port} is free for motion.", port=port))


def check_torch(probe: str = TORCH_PROBE, timeout_s: float = PROBE_TIMEOUT) -> SystemCheckEvent:
    """Whether networks can be trained, and on what."""
    ok, answer = _probe(probe, timeout_s)
    if not ok:
        what = say("PyTorch does not work: {reason}.", reason=answer)
        return SystemCheckEvent("PyTorch", False, what, say("Run the set-up again (make setup)."))
    version, threads, gpu = (part.strip() for part in answer.split("|"))
    where = gpu or say("the CPU with {threads} threads", threads=threads)
    what = say("PyTorch {version}, training on {device}.", version=version, device=where)
    return SystemCheckEvent("PyTorch", True, what)


def check_voice() -> SystemCheckEvent:
    """Whether the practice performer can speak any sentence; without espeak-ng it speaks bundled ones."""
    if launch.program("espeak-ng"):
        return SystemCheckEvent("voice", True, say("espeak-ng speaks for the practice performer."))
    return SystemCheckEvent(
        "voice", True, say("espeak-ng is not installed, so the practice performer uses its bundled speech.")
    )


def check_speech() -> SystemCheckEvent:
    """Whether runs can hear with Whisper; the studio does without unless one is told to."""
    from studio.features.encoders import has_whisper, whisper_remedy

    if has_whisper():
        return SystemCheckEvent("speech", True, say("The speech encoder Whisper is installed."))
    words = say("The speech encoder Whisper is not installed; Balanced and Best hear plain sound without it.")
    return SystemCheckEvent("speech", True, together(" ", words, whisper_remedy()))


def check_camera() -> SystemCheckEvent:
    """Whether webcams and videos can be tracked; any other tracker does without."""
    from studio.tracking import face_model

    missing = face_model.missing()
    if missing is None:
        here = say("Webcams and videos can be tracked; the face model is here.")
        return SystemCheckEvent("camera", True, here)
    # Said and no fault: any other tracker does without.
    need = say("Only webcams and videos need it.")
    return SystemCheckEvent("camera", True, together(" ", missing.what, need, missing.remedy))


def check_disk(least_bytes: int = LEAST_FREE_BYTES) -> SystemCheckEvent:
    """Whether an hour of recording fits on the disk of the current folder."""
    from studio.files.atomic import size_text

    # The current folder's disk: no project is named, and most are made where people stand.
    free = shutil.disk_usage(Path.cwd()).free
    if free < least_bytes:
        what = say("Only {size} are free on this disk.", size=size_text(free))
        return SystemCheckEvent("disk", False, what, say("Free some space before recording."))
    return SystemCheckEvent("disk", True, say("{size} are free on this disk.", size=size_text(free)))


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
        return False, say("it did not answer within {seconds} s", seconds=f"{timeout_s:.0f}")
    if done.returncode == 0:
        return True, (done.stdout.strip().splitlines() or [""])[-1]
    last = (done.stderr.strip().splitlines() or [f"it crashed with code {done.returncode}"])[-1]
    return False, last.rstrip(".")
