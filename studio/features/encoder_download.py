"""A wav2vec 2.0 from Hugging Face's hub: gone on with after a break, checked, and never executed.

huggingface_hub (2.4) is no help here: it keeps nothing of a broken download for the next run, and over HTTP
takes whatever has the right length for what was offered.
The environment variable HF_ENDPOINT names a mirror, as it does for Hugging Face's own programs.
Source: the hub's answers to HEAD, https://huggingface.co/docs/huggingface_hub/package_reference/file_download.
"""

from __future__ import annotations

import errno
import http.client
import os
import re
import shutil
import urllib.error
import urllib.request
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, Any
from urllib.parse import urljoin, urlsplit

from studio.errors import RequestError, StudioError
from studio.features.encoders import Installed, digest_of, home_of, register
from studio.files.atomic import cannot_write, size_text

HUB = "https://huggingface.co"
NEEDED, WELCOME = "config.json", "preprocessor_config.json"
WEIGHTS = ("model.safetensors", "pytorch_model.bin")
_NAME = re.compile(r"[A-Za-z0-9_][\w.-]*/[A-Za-z0-9_][\w.-]*")
_SHA256 = re.compile(r'(?:W/)?"?([0-9a-f]{64})"?')
_PIECE = 1 << 18
_TIMEOUT_S = 30.0
_MOST_MOVES = 5
_BROKEN = (urllib.error.URLError, http.client.HTTPException, OSError)

OnProgress = Callable[[int, int], None]
"""Told of bytes that are here and bytes there are."""


@dataclass(frozen=True)
class Offered:
    """A file of the hub: where, how many bytes (0 where it is not said), its digest ("" likewise)."""

    name: str
    url: str
    size: int
    sha256: str


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
        what = f"{name} is neither a folder nor the name of an encoder."
        raise RequestError(what, "Give a folder, or a name such as facebook/wav2vec2-base-960h.")
    offered = _offers(name)
    home = home_of(name)
    try:
        home.mkdir(parents=True, exist_ok=True)
        _must_fit(home, offered)
        before, there = 0, sum(file.size for file in offered)
        for file in offered:
            _download(file, home, partial(_tell, on_progress, before, there))
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
        what = f"The hub has no open encoder called {name}."
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
    except _BROKEN as error:
        raise _offline(url) from error
    if status in (401, 403, 404):
        return None
    if status >= 400:
        raise StudioError(f"{_host(url)} answers with error {status}.", "Try again later.")
    checksum = _SHA256.fullmatch(headers.get("X-Linked-ETag") or headers.get("ETag") or "")
    size = headers.get("X-Linked-Size") or headers.get("Content-Length") or "0"
    return Offered(file, place, int(size) if size.isdigit() else 0, checksum.group(1) if checksum else "")


def _head(url: str) -> tuple[int, Any]:
    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_: Any) -> None:
            return None

    request = urllib.request.Request(url, method="HEAD", headers={"Accept-Encoding": "identity"})
    try:
        with urllib.request.build_opener(Stay).open(request, timeout=_TIMEOUT_S) as answer:
            return int(answer.status), answer.headers
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.headers


def _download(file: Offered, home: Path, on_progress: Callable[[int], None]) -> None:
    """One file in one piece; a part that is there is gone on with."""
    target = home / file.name
    if file.sha256 and target.is_file() and digest_of(target) == file.sha256:
        on_progress(file.size)
        return
    # The digest is in the part's name: the rest of another version must not be put behind it.
    part = home / f"{file.name}.{file.sha256[:12] or 'new'}.part"
    if not file.sha256:
        part.unlink(missing_ok=True)
    try:
        _receive(file, part, on_progress)
    except _BROKEN as error:
        if isinstance(error, OSError) and error.errno in (errno.EACCES, errno.EPERM, errno.ENOSPC):
            raise
        raise _broke_off(file) from error
    if file.size and part.stat().st_size < file.size:
        raise _broke_off(file)
    if (file.size and part.stat().st_size > file.size) or (file.sha256 and digest_of(part) != file.sha256):
        part.unlink()
        what = f"What arrived as {file.name} is not what {_host(file.url)} offers."
        raise StudioError(what, "Run it again: it starts anew.")
    part.replace(target)


def _receive(file: Offered, part: Path, on_progress: Callable[[int], None]) -> None:
    have = part.stat().st_size if part.is_file() else 0
    if file.size and have >= file.size:
        return
    headers = {"Accept-Encoding": "identity"} | ({"Range": f"bytes={have}-"} if have else {})
    request = urllib.request.Request(file.url, headers=headers)
    with urllib.request.urlopen(request, timeout=_TIMEOUT_S) as answer:
        have = have if answer.status == 206 else 0  # some servers begin at the beginning whatever is asked
        with part.open("ab" if have else "wb") as kept:
            _copy(answer, kept, have, on_progress)


def _copy(answer: IO[bytes], kept: IO[bytes], have: int, on_progress: Callable[[int], None]) -> None:
    while piece := answer.read(_PIECE):
        kept.write(piece)
        have += len(piece)
        on_progress(have)
    kept.flush()
    with suppress(OSError):  # not every file system can
        os.fsync(kept.fileno())


def _must_fit(home: Path, offered: list[Offered]) -> None:
    needed, free = sum(file.size for file in offered), shutil.disk_usage(home).free
    if needed > free:
        what = f"{size_text(needed)} do not fit on the disk of {home}, where {size_text(free)} are free."
        raise StudioError(what, "Free some space, or name another folder in SAIA_ENCODERS.")


def _host(url: str) -> str:
    return urlsplit(url).netloc


def _offline(url: str) -> StudioError:
    return StudioError(
        f"{_host(url)} cannot be reached.",
        "Connect to the internet and run it again, or give a folder that holds the encoder.",
    )


def _broke_off(file: Offered) -> StudioError:
    what = f"The connection to {_host(file.url)} was lost while downloading {file.name}."
    return StudioError(what, "Run it again: it goes on where it was.")
