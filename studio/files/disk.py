"""Room on disks: how much is free, whether it ran out, and how a size is written."""

from __future__ import annotations

import errno
import shutil
from pathlib import Path

_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))  # Windows knows no quota
_UNITS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "KB"))
"""Decimal, as disks are sold and as file managers show them."""


def size_text(size: float) -> str:
    """A number of bytes as people read it: "5 bytes", "740 KB", "5.9 MB", "12 GB"."""
    for scale, unit in _UNITS:
        value = size / scale
        if value >= 0.9995:  # from here on the next smaller unit would be rounded up to 1000
            return f"{value:.1f} {unit}" if value < 9.95 else f"{value:.0f} {unit}"
    return "1 byte" if round(size) == 1 else f"{size:.0f} bytes"


def is_full(error: OSError) -> bool:
    """Whether a write failed for want of room, on the disk or in somebody's share of it."""
    return error.errno in _FULL


def free_bytes(folder: Path) -> int | None:
    """Bytes free where a folder is or will be; None where the system does not tell."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return None
