"""Node with three.js, three-vrm and the glTF validator: foreign readers of the studio's files."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import pytest

FOREIGN = Path(__file__).resolve().parent / "foreign"
# Of the person, not of one test: looked up while tests are collected, before each gets a home of its own.
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "saia-studio-tests"


def node_folder() -> Path:
    """A folder with what the lock file says installed, kept between runs; skips the test without npm."""
    if not shutil.which("node") or not shutil.which("npm"):
        pytest.skip("node and npm are not installed")
    lock = (FOREIGN / "package-lock.json").read_bytes()
    folder = CACHE / f"node-{hashlib.sha256(lock).hexdigest()[:12]}"
    if not folder.is_dir():
        CACHE.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=CACHE) as scratch:
            fresh = Path(scratch) / "node"
            fresh.mkdir()
            for name in ("package.json", "package-lock.json"):
                shutil.copy(FOREIGN / name, fresh)
            command = ["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts", "--fetch-retries=1"]
            try:
                done = subprocess.run(
                    command, cwd=fresh, capture_output=True, text=True, timeout=180, check=False
                )
            except subprocess.TimeoutExpired:
                pytest.skip("npm did not answer within 180 s")
            if done.returncode:
                pytest.skip(f"npm could not install the foreign readers: {done.stderr.strip()[-200:]}")
            if not folder.is_dir():
                fresh.rename(folder)
    return folder


def ask(script: str, *words: str) -> dict[str, Any]:
    """What one of the scripts in foreign/ prints."""
    folder = node_folder()
    shutil.copy(FOREIGN / script, folder)
    done = subprocess.run(
        ["node", script, *words], cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout)
    return seen
