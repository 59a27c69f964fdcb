"""The face model's file and MediaPipe, which reads it: what is missing, and how it is fetched.

Source: Google MediaPipe, Face Landmarker, bundle float16/1; Apache-2.0.
"""

from __future__ import annotations

import importlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

from studio import launch
from studio.errors import Cancelled, RequestError, StudioError, say
from studio.files import atomic
from studio.files.download import BROKE_OFF, Offered, OnProgress, digest_of, download, host

NAME = "face_landmarker.task"
URL = f"https://storage.googleapis.com/mediapipe-models/face_landmarker/face_landmarker/float16/1/{NAME}"
SIZE = 3_758_596
SHA256 = "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff"
LICENCE = "Apache-2.0, Google MediaPipe"
REQUIREMENT = "mediapipe==1.2.2"
PACKAGE_SIZE = "about 335 MB"
"""With all that it needs."""
GET = "saia camera --get-model"
"""The command that fetches it."""
NO_MODEL, NO_PACKAGE = "no_face_model", "no_mediapipe"
"""Codes of the errors that say what is missing."""

_POLL_S = 0.1


def model_file() -> Path:
    """Where the model lies or will lie; the environment variable SAIA_FACE_MODEL names another file."""
    if chosen := os.environ.get("SAIA_FACE_MODEL"):
        return Path(chosen)
    from platformdirs import user_data_path

    return user_data_path("saia-studio", appauthor=False) / "models" / NAME


def has_model() -> bool:
    """Whether the model is here, whole."""
    path = model_file()
    return path.is_file() and path.stat().st_size == SIZE and digest_of(path) == SHA256


def missing() -> StudioError | None:
    """What is missing for faces to be tracked, as the error to raise; None where all is here."""
    if find_spec("mediapipe") is None:
        return StudioError(
            "Tracking a face needs MediaPipe, which is not installed.",
            say(
                "Run: {command} ({size}, once).",
                command=f'"{sys.executable}" -P -m pip install {REQUIREMENT}',
                size=PACKAGE_SIZE,
            ),
            code=NO_PACKAGE,
            in_window="Get it in Record: Add a tracker, This webcam.",
        )
    if not has_model():
        return StudioError(
            say("The face model is not on this computer ({facts}).", facts=facts()),
            say("Run: {get}, or give its file: {get} {name}.", get=GET, name=NAME),
            code=NO_MODEL,
            in_window="Get it in Record: Add a tracker, This webcam.",
        )
    return None


def install(is_stopped: Callable[[], bool] = lambda: False, requirement: str = REQUIREMENT) -> None:
    """Have pip install MediaPipe; one that is installed already is left as it is.

    Args:
        is_stopped: asked now and then whether to give that up.
        requirement: what pip is asked for.

    Raises:
        Cancelled: it was given up.
        StudioError: it cannot be installed.
    """
    words = ("-m", "pip", "install", "--no-input", "--disable-pip-version-check", requirement)
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said:
        pip = subprocess.Popen(
            launch.python(*words),
            env=launch.environment(),
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
        )
        try:
            while pip.poll() is None and not is_stopped():
                time.sleep(_POLL_S)
        finally:
            # Before its packages are unpacked it leaves nothing behind; a half of them it mends next time.
            pip.terminate()
            pip.wait()
        # A terminal's Ctrl+C ends pip as well, and sooner.
        if is_stopped():
            raise Cancelled
        said.seek(0)
        lines = [line.strip() for line in said if line.strip()]
    importlib.invalidate_caches()
    if pip.returncode or find_spec("mediapipe") is None:
        said_so = (line for line in reversed(lines) if "error" in line.lower())
        why = next((line.removeprefix("ERROR: ").rstrip(".") for line in said_so), say("pip gives no reason"))
        raise StudioError(
            say("MediaPipe could not be installed ({reason}).", reason=why),
            "Connect to the internet, see that 1 GB of the disk is free, and try again.",
        )


def need_model() -> Path:
    """The model's file.

    Raises:
        StudioError: MediaPipe or the model is not here.
    """
    if (error := missing()) is not None:
        raise error
    return model_file()


def facts() -> str:
    """Size, licence and checksum, for whoever decides to fetch it."""
    return f"{atomic.size_text(SIZE)}, {LICENCE}, SHA-256 {SHA256[:12]}…"


def fetch(on_progress: OnProgress = lambda here, there: None, url: str = URL) -> Path:
    """Bring the model from its publisher; one that is here already is left as it is.

    Args:
        on_progress: told after every piece.
        url: a mirror; whatever it sends must be the same file.

    Raises:
        StudioError: the publisher cannot be reached, breaks off (what arrived is kept), or sends
            another file.
    """
    path = model_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        download(Offered(path.name, url, SIZE, SHA256), path.parent, lambda here: on_progress(here, SIZE))
    except OSError as error:
        raise atomic.cannot_write(path, error) from error
    except StudioError as error:
        if error.code != BROKE_OFF or any(path.parent.glob(f"{path.name}*.part")):
            raise
        raise StudioError(
            say("{host} cannot be reached.", host=host(url)),
            say(
                "Connect to the internet and try again, or bring {name} from another computer and choose it.",
                name=NAME,
            ),
        ) from error
    return path


def bring(source: Path) -> Path:
    """Copy the model from a file.

    Raises:
        RequestError: it is another file.
        StudioError: it cannot be copied.
    """
    if not source.is_file():
        raise RequestError(say("There is no file {source}.", source=source), say("Choose {name}.", name=NAME))
    if digest_of(source) != SHA256:
        what = say("{name} is not the face model: its SHA-256 is another.", name=source.name)
        raise RequestError(what, say("Choose {name} as it comes from {host}.", name=NAME, host=host(URL)))
    path = model_file()
    if source.resolve() != path.resolve():
        try:
            with atomic.written(path) as beside:
                shutil.copyfile(source, beside)
        except OSError as error:
            raise atomic.cannot_write(path, error) from error
    return path
