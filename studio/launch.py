"""How the studio starts programs, and where code may come from: never from the current folder.

People start the studio inside of a project, and a project comes from anybody: a `studio` or `numpy.py` in it
must not be taken for ours. Python puts the current folder first on its import path for `-m` and `-c`, and
Windows looks there for programs and libraries. Every child is started with the words and the environment of
this file, which its own children inherit.

Standard library only, and of that what Python has loaded before anything of ours: a `json.py` of the current
folder would else be imported on the way to keeping it out.
"""

from __future__ import annotations

import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
"""The folder that holds the package `studio`."""


def studio(*words: str) -> list[str]:
    """What starts a studio with some words, `studio("train", ...)`; a bundle is its own interpreter."""
    if getattr(sys, "frozen", False):
        return [sys.executable, *words]
    return python("-m", "studio", *words)


def python(*words: str, interpreter: str = "") -> list[str]:
    """What starts Python with some words, its import path without the current folder.

    Args:
        words: as Python takes them.
        interpreter: another than the one that runs this.
    """
    return [interpreter or sys.executable, "-P", *words]


def environment() -> dict[str, str]:
    """This process's environment for a child: see `import_variables`."""
    return {**os.environ, **import_variables()}


def import_variables() -> dict[str, str]:
    """Environment variables with which a child, and what it starts, finds this `studio` and nothing foreign.

    PYTHONPATH keeps its absolute folders, which somebody chose; an empty or relative one means the current
    folder (`PYTHONPATH=$PYTHONPATH:/more` makes an empty one). "" is none at all.
    """
    paths = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if os.path.isabs(path)]
    # Beside other packages it is found as they are; named here, they would come before Python's own modules.
    if os.path.basename(ROOT) not in ("site-packages", "dist-packages") and ROOT not in paths:
        paths.insert(0, ROOT)
    return {"PYTHONSAFEPATH": "1", "PYTHONPATH": os.pathsep.join(paths)}


def distrust_current_folder() -> None:
    """Take the current folder off the import path of this process and of all that it starts.

    Called before anything else is imported: much is imported only when it is first needed. On Windows,
    programs and libraries are no longer looked for there either.
    """
    sys.path[:] = [path for path in sys.path if not _is_current(path)]
    os.environ.update(import_variables())
    if sys.platform == "win32" and not getattr(sys, "frozen", False):
        # A bundle does this in its own way.
        import ctypes

        os.environ["NODEFAULTCURRENTDIRECTORYINEXEPATH"] = "1"
        ctypes.windll.kernel32.SetDllDirectoryW("")


def program(name: str) -> str | None:
    """The whole path of a program on PATH, None where there is none; the current folder is not looked into.

    Unlike shutil.which, which looks there first on Windows, and anywhere where PATH holds an empty entry.
    """
    endings = os.environ.get("PATHEXT", ".EXE").split(os.pathsep) if os.name == "nt" else [""]
    path = os.environ.get("PATH", os.defpath)
    folders = [folder for folder in path.split(os.pathsep) if os.path.isabs(folder)]
    files = (os.path.join(folder, name + ending) for folder in folders for ending in endings)
    return next((file for file in files if os.path.isfile(file) and os.access(file, os.X_OK)), None)


def _is_current(path: str) -> bool:
    """Whether an entry of the import path is the current folder, or was given relative to it.

    Python makes PYTHONPATH's entries absolute when it starts. The folder of this package stays, and so does
    what lies within Python itself: somebody may well stand there.
    """
    relative = [one for one in os.environ.get("PYTHONPATH", "").split(os.pathsep) if not os.path.isabs(one)]
    entry = _real(path)
    if entry not in {_real(one) for one in ("", *relative)} or entry == _real(ROOT):
        return False
    homes = tuple(_real(home) + os.sep for home in (sys.prefix, sys.base_prefix))
    return not (entry + os.sep).startswith(homes)


def _real(path: str) -> str:
    """A path that can be compared; "" is the current folder."""
    try:
        return os.path.normcase(os.path.realpath(path or os.curdir))
    except OSError:
        # The current folder is gone.
        return ""
