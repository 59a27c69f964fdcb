"""Puts resources/ into a wheel: they lie beside `studio` in the source, and inside of it when installed.

pyproject.toml names the class; studio/paths.py finds the files in either place.
"""

from __future__ import annotations

from pathlib import Path

from setuptools.command.build_py import build_py

RESOURCES = Path("resources")
LEFT_OUT = ("screenshots",)
"""Folders that only README shows."""


class BuildPy(build_py):
    """setuptools' own way of gathering what goes into a wheel, and the studio's files."""

    def run(self) -> None:
        """Gather; an editable install reads the files where they are."""
        super().run()
        if not self.editable_mode:
            for file in _files():
                target = Path(self.build_lib, "studio", file)
                self.mkpath(str(target.parent))
                self.copy_file(str(file), str(target))

    def get_source_files(self) -> list[str]:
        """What a source archive must hold, so that a wheel can be made of it."""
        return [*super().get_source_files(), *map(str, _files()), *map(str, Path("packaging").glob("*.*"))]


def _files() -> list[Path]:
    """Every file of resources/ that goes along, relative to the source's root."""
    found = sorted(path for path in RESOURCES.rglob("*") if path.is_file())
    return [path for path in found if path.parts[1] not in LEFT_OUT]
