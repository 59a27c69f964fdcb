"""The studio installed from a wheel finds its own files, far from any checkout."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from studio.paths import resource

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel made of a copy, so that the checkout stays clean."""
    source = tmp_path_factory.mktemp("source")
    for name in ("studio", "resources", "packaging"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source / name)
    build = "from setuptools import build_meta; build_meta.build_wheel('dist')"
    done = subprocess.run(
        [sys.executable, "-c", build], cwd=source, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return next((source / "dist").glob("saia_studio-*.whl"))


@pytest.mark.slow
def test_a_wheel_carries_every_file_the_studio_reads(wheel: Path) -> None:
    carried = {name for name in zipfile.ZipFile(wheel).namelist() if name.startswith("studio/resources/")}
    wanted = {
        f"studio/resources/{path.relative_to(resource()).as_posix()}"
        for path in resource().rglob("*")
        if path.is_file() and path.relative_to(resource()).parts[0] != "screenshots"
    }
    assert carried == wanted


@pytest.mark.slow
def test_an_installed_studio_finds_its_recipes(wheel: Path, tmp_path: Path) -> None:
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    done = subprocess.run(
        [sys.executable, "-m", "studio", "train", "--list"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    assert [line.split()[0] for line in done.stdout.splitlines()[:3]] == ["quick", "balanced", "best"]
