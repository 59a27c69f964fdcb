"""A wav2vec 2.0 from Hugging Face's hub: which files it offers, and where they go.

huggingface_hub (2.4) is no help here: it keeps nothing of a broken download for the next run, and over HTTP
takes whatever has the right length for what was offered.
The environment variable HF_ENDPOINT names a mirror, as it does for Hugging Face's own programs.
Source: the hub's answers to HEAD, https://huggingface.co/docs/huggingface_hub/package_reference/file_download.
"""

from __future__ import annotations

import os
import re
import shutil
import urllib.error
import urllib.request
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

from studio.errors import RequestError, StudioError, say
from studio.features.encoders import Installed, home_of, register
from studio.files.atomic import cannot_write, size_text
from studio.files.download import BROKEN, TIMEOUT_S, Offered, OnProgress, download, host

HUB = "https://huggingface.co"
NEEDED, WELCOME = "config.json", "preprocessor_config.json"
WEIGHTS = ("model.safetensors", "pytorch_model.bin")
_NAME = re.compile(r"[A-Za-z0-9_][\w.-]*/[A-Za-z0-9_][\w.-]*")
_SHA256 = re.compile(r'(?:W/)?"?([0-9a-f]{64})"?')
_MOST_MOVES = 5


def fetch(name: str, on_progress: OnProgress = lambda here, there: None) -> Installed:
    """Bring an encoder of the hub to the others.

    Args:
        name: as the hub calls it, "facebook/wav2vec2-base-960h".
        on_progress: told after every piece.

    Raises:
        StudioError: the hub cannot be reached, has none of this name, breaks off (what arrived is kept), or
            sends something else than it offers.
    """
    if not _NAME.fullmatch(name):
        what = say("{name} is neither a folder nor the name of an encoder.", name=name)
        raise RequestError(what, "Give a folder, or a name such as facebook/wav2vec2-base-960h.")
    offered = _offers(name)
    home = home_of(name)
    try:
        home.mkdir(parents=True, exist_ok=True)
        _must_fit(home, offered)
        before, there = 0, sum(file.size for file in offered)
        for file in offered:
            download(file, home, partial(_tell, on_progress, before, there))
            before += file.size
    except OSError as error:
        raise cannot_write(home, error) from error
    return register(name, home)


def _tell(on_progress: OnProgress, before: int, there: int, here: int) -> None:
    on_progress(before + here, there)


def _offers(name: str) -> list[Offered]:
    """The files to fetch, small ones first."""
    config = _look(name, NEEDED)
    weights = next((found for one in WEIGHTS if (found := _look(name, one)) is not None), None)
    if config is None or weights is None:
        what = say("The hub has no open encoder called {name}.", name=name)
        raise RequestError(what, "Check the name on huggingface.co; it needs a config.json and weights.")
    welcome = _look(name, WELCOME)
    return [config, *([welcome] if welcome else []), weights]


def _look(name: str, file: str) -> Offered | None:
    """What the hub says of a file; None where it has none that everybody may have."""
    url = f"{os.environ.get('HF_ENDPOINT', HUB).rstrip('/')}/{name}/resolve/main/{file}"
    place = url
    try:
        for _ in range(_MOST_MOVES):
            status, headers = _head(place)
            to = headers.get("Location", "")
            # Only a renamed encoder is followed: the hub's answer has size and digest, its store's has not.
            if 300 <= status < 400 and to and not urlsplit(to).netloc:
                place = urljoin(place, to)
                continue
            break
    except BROKEN as error:
        raise _offline(url) from error
    if status in (401, 403, 404):
        return None
    if status >= 400:
        raise StudioError(
            say("{host} answers with error {status}.", host=host(url), status=status), "Try again later."
        )
    checksum = _SHA256.fullmatch(headers.get("X-Linked-ETag") or headers.get("ETag") or "")
    size = headers.get("X-Linked-Size") or headers.get("Content-Length") or "0"
    return Offered(file, place, int(size) if size.isdigit() else 0, checksum.group(1) if checksum else "")


def _head(url: str) -> tuple[int, Any]:
    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_: Any) -> None:
            return None

    request = urllib.request.Request(url, method="HEAD", headers={"Accept-Encoding": "identity"})
    try:
        with urllib.request.build_opener(Stay).open(request, timeout=TIMEOUT_S) as answer:
            return int(answer.status), answer.headers
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.headers


def _must_fit(home: Path, offered: list[Offered]) -> None:
    needed, free = sum(file.size for file in offered), shutil.disk_usage(home).free
    if needed > free:
        what = say(
            "{needed} do not fit on the disk of {home}, where {free} are free.",
            needed=size_text(needed),
            home=home,
            free=size_text(free),
        )
        raise StudioError(what, "Free some space, or name another folder in SAIA_ENCODERS.")


def _offline(url: str) -> StudioError:
    return StudioError(
        say("{host} cannot be reached.", host=host(url)),
        "Connect to the internet and run it again, or give a folder that holds the encoder.",
    )
