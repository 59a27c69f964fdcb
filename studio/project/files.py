"""What makes a folder a project, and the small files in it."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path
from typing import Any
from zlib import crc32

from studio.files import atomic

FORMAT_VERSION = 1
PROJECT_FILE = "project.json"
DATASET_FILE = "dataset.json"
HISTORY_FILE = ".history.json"


def is_project(folder: Path) -> bool:
    """Whether a folder holds a project, even one whose project.json is lost."""
    if (folder / PROJECT_FILE).is_file():
        return True
    kept = any(folder.glob(f"{PROJECT_FILE}.damaged-*")) if folder.is_dir() else False
    return kept or ((folder / "takes").is_dir() and (folder / DATASET_FILE).is_file())


def write_project_file(folder: Path, name: str) -> None:
    """Make the project.json of a new project, or of one that lost its own."""
    created = datetime.now().astimezone().isoformat(timespec="seconds")
    content = {"version": FORMAT_VERSION, "name": name, "created": created, "defaults": {}}
    atomic.write_json(folder / PROJECT_FILE, content)


def fingerprint(plain: dict[str, Any]) -> int:
    """A number that changes with the content of dataset.json, so that an undo history knows its own."""
    return crc32(json.dumps(plain, ensure_ascii=False, sort_keys=True).encode())
