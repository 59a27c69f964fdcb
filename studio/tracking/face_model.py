"""The face model's file: where it lies, how it is fetched from its publisher, and what is missing.

Source: Google MediaPipe, Face Landmarker, bundle float16/1; Apache-2.0.
"""

from __future__ import annotations

import os
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

from studio.errors import RequestError, StudioError
from studio.files import atomic
from studio.files.download import BROKE_OFF, Offered, OnProgress, digest_of, download, host

NAME = "face_landmarker.task"
URL = f"https://storage.googleapis.com/mediapipe-models/face_landmarker/face_landmarker/float16/1/{NAME}"
SIZE = 3_758_596
SHA256 = "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff"
LICENCE = "Apache-2.0, Google MediaPipe"
REQUIREMENT = "mediapipe==1.2.2"
GET = "saia camera --get-model"
"""The command that fetches it."""
NO_MODEL, NO_PACKAGE = "no_face_model", "no_mediapipe"
"""Codes of the errors that say what is missing."""


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
            f'Run: "{sys.executable}" -P -m pip install {REQUIREMENT} (about 335 MB, once).',
            code=NO_PACKAGE,
        )
    if not has_model():
        return StudioError(
            f"The face model is not on this computer ({facts()}).",
            f"Run: {GET}, or give its file: {GET} {NAME}.",
            code=NO_MODEL,
            in_window="Get it in Record: Add a tracker, This webcam.",
        )
    return None


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
            f"{host(url)} cannot be reached.",
            f"Connect to the internet and try again, or bring {NAME} from another computer and choose it.",
        ) from error
    return path


def bring(source: Path) -> Path:
    """Copy the model from a file.

    Raises:
        RequestError: it is another file.
        StudioError: it cannot be copied.
    """
    if not source.is_file():
        raise RequestError(f"There is no file {source}.", f"Choose {NAME}.")
    if digest_of(source) != SHA256:
        what = f"{source.name} is not the face model: its SHA-256 is another."
        raise RequestError(what, f"Choose {NAME} as it comes from {host(URL)}.")
    path = model_file()
    if source.resolve() != path.resolve():
        try:
            with atomic.written(path) as beside:
                shutil.copyfile(source, beside)
        except OSError as error:
            raise atomic.cannot_write(path, error) from error
    return path
