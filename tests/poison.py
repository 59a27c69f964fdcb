"""A folder of code that must never run: what a hostile project could hold in place of ours."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.patience import PATIENCE

MODULES = (
    "numpy", "json", "torch", "pickle", "argparse", "typing", "sounddevice", "PySide6", "scipy", "pip",
    "pytest", "sitecustomize", "usercustomize", "evil",
)  # fmt: skip
PROGRAMS = ("Xvfb", "pulseaudio", "pactl", "setpriv", "espeak-ng", "saia", "python", "python3")


class Poison:
    """A folder whose code leaves a mark beside it when it runs.

    Args:
        folder: where the code is written.
        package: whether a package `studio` is among it.
    """

    def __init__(self, folder: Path, package: bool = True) -> None:
        self.folder, self._mark = folder, folder.with_name(f"{folder.name} ran.txt")
        folder.mkdir(parents=True, exist_ok=True)
        code = f"import os\nwith open({str(self._mark)!r}, 'a') as mark:\n    mark.write(__name__ + '\\n')\n"
        for name in MODULES:
            (folder / f"{name}.py").write_text(code, encoding="utf-8")
        if package:
            (folder / "studio").mkdir()
            (folder / "studio" / "__init__.py").write_text(code, encoding="utf-8")
        # What torch loads by itself as soon as it is imported.
        (folder / "evil-1.dist-info").mkdir()
        (folder / "evil-1.dist-info" / "METADATA").write_text("Name: evil\nVersion: 1\n", encoding="utf-8")
        points = "[torch.backends]\nevil = evil:run\n"
        (folder / "evil-1.dist-info" / "entry_points.txt").write_text(points, encoding="utf-8")
        for name in PROGRAMS:
            program = folder / name
            program.write_text(f"#!/bin/sh\necho {name} >> '{self._mark}'\nexit 1\n", encoding="utf-8")
            program.chmod(0o755)

    @property
    def ran(self) -> str:
        """What of it ran, one name a line."""
        return self._mark.read_text(encoding="utf-8") if self._mark.exists() else ""

    @staticmethod
    def unwary() -> dict[str, str]:
        """Environment variables as many have them: empty entries, which mean the current folder."""
        return {"PYTHONPATH": os.pathsep, "PATH": f"{os.pathsep}.{os.pathsep}{os.environ['PATH']}"}

    @staticmethod
    def plain() -> dict[str, str]:
        """The environment of a person, whatever a command in this process has already made of ours."""
        return {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONSAFEPATH")}

    def bites(self) -> bool:
        """Whether Python does run it when started without care."""
        command = [sys.executable, "-m", "studio", "--version"]
        subprocess.run(command, cwd=self.folder, check=False, env=self.plain(), timeout=PATIENCE)
        found = bool(self.ran)
        self._mark.unlink(missing_ok=True)
        return found
