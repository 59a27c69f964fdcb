"""A screen and a sound device for machines that have none: for tests, the tour, and servers.

Standard library only: the bootstrap uses this before anything is installed. Linux only; elsewhere
there is always a screen and a sound system.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from studio import launch
from studio.errors import StudioError

SCREEN_SIZE = "1920x1080x24"
START_TIMEOUT, END_TIMEOUT = 90.0, 15.0
"""Seconds a virtual screen or sound server may take to come up, and to end, on a busy machine."""

_SINK = "studio_null"
SECOND = "studio_second"
"""Another output: programs whose PULSE_SINK says so play there, and PULSE_SOURCE with .monitor hears it."""
# norewinds=1: without it a stream stalls for 1 to 2 s at its start, without any error.
_PULSE_SCRIPT = f"""\
load-module module-native-protocol-unix socket={{socket}} auth-anonymous=1
load-module module-null-sink sink_name={_SINK} rate=48000 channels=2 format=float32le norewinds=1
load-module module-null-sink sink_name={SECOND} rate=48000 channels=2 format=float32le norewinds=1
set-default-sink {_SINK}
set-default-source {_SINK}.monitor
"""


def has_screen() -> bool:
    """Whether a window can be shown."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def screen_available() -> bool:
    """Whether `virtual_screen` can work here."""
    return launch.program("Xvfb") is not None


@contextlib.contextmanager
def virtual_screen() -> Iterator[str]:
    """An X server drawing into memory, 1920 x 1080.

    Yields:
        Its name for DISPLAY, ":n" with a number that was free.

    Raises:
        StudioError: Xvfb is missing or did not start.
    """
    xvfb = launch.program("Xvfb")
    if xvfb is None:
        raise StudioError(
            "There is no screen and no virtual one.", "Install the package xvfb, or start this in a window."
        )
    # The server picks a free number itself and writes it: no race between two starts.
    reader, writer = os.pipe()
    command = [xvfb, "-displayfd", str(writer), "-screen", "0", SCREEN_SIZE, "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(
        _mortal(command),
        pass_fds=[writer],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(writer)
    try:
        with os.fdopen(reader) as pipe:
            # Ends with an empty line when the server dies instead.
            number = pipe.readline().strip()
        if not number:
            raise StudioError("The virtual screen did not start.", "Run `Xvfb :99` to see why.")
        yield f":{number}"
    finally:
        end(server)


def sound_available() -> bool:
    """Whether `virtual_sound` can work here."""
    return sys.platform == "linux" and launch.program("pulseaudio") is not None


def start_pulseaudio(folder: Path) -> subprocess.Popen[bytes]:
    """Start the sound server whose script lies in a folder; also the way to plug it in again."""
    command = [
        launch.program("pulseaudio") or "pulseaudio",
        "-n", "-F", str(folder / "default.pa"), "--daemonize=no", "--exit-idle-time=-1",
        "--use-pid-file=no", "--disable-shm=yes", "--realtime=no", "--high-priority=no",
        f"--log-target=file:{folder / 'log'}",
    ]  # fmt: skip
    # Its own home and runtime folder: a person's real sound server is neither found nor disturbed.
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "HOME": str(folder)}
    environment.pop("PULSE_SERVER", None)
    quiet = subprocess.DEVNULL
    return subprocess.Popen(_mortal(command), env=environment, stdin=quiet, stdout=quiet, stderr=quiet)


@contextlib.contextmanager
def virtual_sound(
    start: Callable[[Path], subprocess.Popen[bytes]] = start_pulseaudio,
) -> Iterator[dict[str, str]]:
    """A sound server whose one output is heard by its one input.

    PortAudio lists devices once: re-enumerate after this opens and before it closes.

    Args:
        start: starts the server in the folder with its script; given by who wants to unplug it.

    Yields:
        Environment variables that lead programs, this one too, to the server.

    Raises:
        StudioError: PulseAudio is missing or did not start.
    """
    if not sound_available():
        raise StudioError("There is no virtual sound device here.", "Install the package pulseaudio.")
    # Not under TMPDIR: a socket's path holds at most 107 bytes.
    with tempfile.TemporaryDirectory(prefix="saia-sound-", dir="/tmp", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        socket = folder / "native"
        (folder / "default.pa").write_text(_PULSE_SCRIPT.format(socket=socket), encoding="utf-8")
        server = start(folder)
        try:
            _wait_for_pulseaudio(server, socket)
            yield {"PULSE_SERVER": f"unix:{socket}"}
        finally:
            end(server)


def _wait_for_pulseaudio(server: subprocess.Popen[bytes], socket: Path) -> None:
    deadline = time.monotonic() + START_TIMEOUT
    while time.monotonic() < deadline and server.poll() is None:
        if socket.exists() and _is_answering(socket):
            return
        time.sleep(0.05)
    raise StudioError(
        "The virtual sound device did not start.", "Run `pulseaudio -n --daemonize=no` to see why."
    )


def _is_answering(socket: Path) -> bool:
    pactl = launch.program("pactl")
    if pactl is None:
        return True
    command = [pactl, "--server", f"unix:{socket}", "list", "short", "sources"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except subprocess.TimeoutExpired:
        return False
    return f"{_SINK}.monitor" in found.stdout


def _mortal(command: list[str]) -> list[str]:
    """The command, made to end when this process dies, even of a crash that runs no clean-up."""
    setpriv = launch.program("setpriv")
    return [setpriv, "--pdeathsig", "TERM", *command] if setpriv else command


def end(server: subprocess.Popen[bytes]) -> None:
    """End a server that was started here, for good if it does not obey."""
    server.terminate()
    try:
        server.wait(END_TIMEOUT)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
