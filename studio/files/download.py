"""Downloads: a file is gone on with after a break, checked against its digest, and never executed."""

from __future__ import annotations

import errno
import hashlib
import http.client
import os
import urllib.error
import urllib.request
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO
from urllib.parse import urlsplit

from studio.errors import StudioError, say

TIMEOUT_S = 30.0
BROKEN = (urllib.error.URLError, http.client.HTTPException, OSError)
"""What a connection that cannot be made, or breaks off, raises."""
BROKE_OFF = "broke_off"
"""Code of the error where one did."""
_PIECE = 1 << 18

OnProgress = Callable[[int, int], None]
"""Told of bytes that are here and bytes there are."""


@dataclass(frozen=True)
class Offered:
    """A file to fetch: where, how many bytes (0 where it is not said), its SHA-256 ("" likewise)."""

    name: str
    url: str
    size: int
    sha256: str


def download(file: Offered, home: Path, on_progress: Callable[[int], None]) -> None:
    """One file in one piece; a part that is there is gone on with.

    Args:
        file: what is offered.
        home: the folder it goes to.
        on_progress: told of the bytes that are here.

    Raises:
        StudioError: the connection broke (what arrived is kept), or something else arrived than is offered.
        OSError: it cannot be written.
    """
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
    except BROKEN as error:
        if isinstance(error, OSError) and error.errno in (errno.EACCES, errno.EPERM, errno.ENOSPC):
            raise
        raise _broke_off(file) from error
    if file.size and part.stat().st_size < file.size:
        raise _broke_off(file)
    if (file.size and part.stat().st_size > file.size) or (file.sha256 and digest_of(part) != file.sha256):
        part.unlink()
        what = say("What arrived as {file} is not what {host} offers.", file=file.name, host=host(file.url))
        raise StudioError(what, "Run it again: it starts anew.")
    part.replace(target)


def _receive(file: Offered, part: Path, on_progress: Callable[[int], None]) -> None:
    have = part.stat().st_size if part.is_file() else 0
    if file.size and have >= file.size:
        return
    headers = {"Accept-Encoding": "identity"} | ({"Range": f"bytes={have}-"} if have else {})
    request = urllib.request.Request(file.url, headers=headers)
    with urllib.request.urlopen(request, timeout=TIMEOUT_S) as answer:
        have = have if answer.status == 206 else 0  # some servers begin at the beginning whatever is asked
        with part.open("ab" if have else "wb") as kept:
            _copy(answer, kept, have, file.size, on_progress)


def _copy(
    answer: IO[bytes], kept: IO[bytes], have: int, size: int, on_progress: Callable[[int], None]
) -> None:
    while piece := answer.read(_PIECE):
        kept.write(piece)
        have += len(piece)
        # A server that never stops would fill the disk before anybody sees that it is something else.
        if size and have > size:
            break
        on_progress(have)
    kept.flush()
    with suppress(OSError):  # not every file system can
        os.fsync(kept.fileno())


def digest_of(path: Path) -> str:
    """The SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def host(url: str) -> str:
    """The server of an address."""
    return urlsplit(url).netloc


def _broke_off(file: Offered) -> StudioError:
    what = say(
        "The connection to {host} was lost while downloading {file}.", host=host(file.url), file=file.name
    )
    return StudioError(what, "Run it again: it goes on where it was.", code=BROKE_OFF)
