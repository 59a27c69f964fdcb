"""Loads pyvista on a thread of its own, once: the window goes on meanwhile."""

from __future__ import annotations

import sys
import threading

_loading: threading.Thread | None = None
_done = threading.Event()


def loaded() -> bool:
    """Whether pyvista can be imported at once; begins to load it where nobody has."""
    global _loading
    if "pyvista" not in sys.modules and _loading is None:
        # No daemon: a thread left in the midst of VTK's loading would abort a program that ends.
        _loading = threading.Thread(target=_load, name="load pyvista")
        _loading.start()
    return _loading is None or _done.is_set() or not _loading.is_alive()


def _load() -> None:
    try:
        import pyvista  # noqa: F401
    except (ImportError, OSError):
        return  # whoever uses it meets the same error and says so
    finally:
        _done.set()
