"""What makes a folder a project, and which files it is made of: anything else in a zip is left out.

Told by place and ending rather than by name, so that projects of older and newer versions keep all that they
hold; nothing in the list is a program, or is ever taken for one.
"""

from __future__ import annotations

import json
import re
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import Any
from zlib import crc32

from studio.dataset import history as store
from studio.dataset.dataset import Dataset
from studio.errors import RequestError, say
from studio.files import atomic

FORMAT_VERSION = 1
PROJECT_FILE = "project.json"
DATASET_FILE = "dataset.json"
HISTORY_FILE = ".history.json"

SOUNDS = frozenset({
    ".wav", ".w64", ".flac", ".ogg", ".oga", ".opus", ".mp2", ".mp3", ".m4a", ".aac", ".ac3", ".aif", ".aiff",
    ".aifc", ".au", ".snd", ".caf", ".amr", ".wma", ".wv", ".mka", ".3gp", ".mp4", ".m4v", ".mov", ".mkv",
    ".webm", ".avi", ".mpg", ".mpeg",
})  # fmt: skip
"""Files that sound can be read from, films among them."""
_EXPORTS = SOUNDS | {
    ".arrow", ".parquet", ".npz", ".csv", ".bvh", ".vrma", ".vmd", ".glb", ".png", ".json", ".html", ".htm",
    ".txt", ".textgrid", ".eaf", ".saiarun",
}  # fmt: skip
_TOP = frozenset({PROJECT_FILE, DATASET_FILE, HISTORY_FILE, "tuning.json", "moods.json", "bones.json"})
_ENDINGS = {
    ("takes", "*"): SOUNDS | {".arrow", ".parquet", ".json", ".bin"},
    ("runs", "*"): frozenset({".toml", ".json", ".jsonl", ".safetensors", ".txt", ".html"}),
    ("runs", "*", "preview"): frozenset({".arrow", ".json"}),
    ("runs",): frozenset({".json", ".jsonl"}),
    ("avatars",): frozenset({".vrm", ".json"}),
    ("sounds",): SOUNDS,
    ("tunings",): frozenset({".json"}),
}
"""Folders inside a project ("*" is any one name), and how the names of files in them may end."""
_SET_ASIDE = re.compile(r"\.damaged-\d+$")
_CURVES = re.compile(r"events\.out\.tfevents\.\d+\.(.+\.)?\d+")


def is_known(path: PurePosixPath) -> bool:
    """Whether a path inside a project, with slashes, is one that a project may hold."""
    *folders, name = path.parts
    # Damaged files that were set aside travel with the rest: somebody may still repair them.
    name = _SET_ASIDE.sub("", name)
    ending = PurePosixPath(name).suffix.lower()
    if not folders:
        return name in _TOP
    if any(part.startswith(".") for part in path.parts):
        # What the studio makes again, or keeps for this computer alone.
        return False
    if folders[0] == "exports":
        return ending in _EXPORTS
    if folders[0] == "runs" and folders[2:3] == ["tensorboard"]:
        return bool(_CURVES.fullmatch(name))
    for place, endings in _ENDINGS.items():
        if len(place) == len(folders) and all(a in ("*", b) for a, b in zip(place, folders, strict=True)):
            return ending in endings
    return False


def is_project(folder: Path) -> bool:
    """Whether a folder holds a project, even one whose project.json is lost."""
    if (folder / PROJECT_FILE).is_file():
        return True
    # project.json is set aside where it is damaged; the takes beside it are still a project.
    kept = any(folder.glob(f"{PROJECT_FILE}.damaged-*")) if folder.is_dir() else False
    return kept or ((folder / "takes").is_dir() and (folder / DATASET_FILE).is_file())


def make_folder(folder: Path, name: str) -> None:
    """Make a new project in a folder that is missing or empty.

    Raises:
        RequestError: the folder holds something else, or is a project already.
        StudioError: it cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise RequestError(
            say("{folder} is a file, not a folder.", folder=folder.name),
            "Choose another place for the project.",
        )
    if (folder / PROJECT_FILE).exists():
        raise RequestError(
            say("{folder} is a project already.", folder=folder.name),
            "Open it, or choose another folder.",
        )
    if folder.is_dir() and any(not path.name.startswith(".") for path in folder.iterdir()):
        raise RequestError(
            say("The folder {folder} is not empty.", folder=folder.name),
            "Choose an empty or a new folder.",
        )
    try:
        for part in ("takes", "runs", "exports"):
            (folder / part).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise atomic.cannot_write(folder, error) from error
    write_project_file(folder, name)
    atomic.write_json(folder / DATASET_FILE, store.to_plain(Dataset()))


def write_project_file(folder: Path, name: str) -> None:
    """Make the project.json of a new project, or of one that lost its own."""
    created = datetime.now().astimezone().isoformat(timespec="seconds")
    content = {"version": FORMAT_VERSION, "name": name, "created": created, "defaults": {}}
    atomic.write_json(folder / PROJECT_FILE, content)


def fingerprint(plain: dict[str, Any]) -> int:
    """A number that changes with the content of dataset.json, so that an undo history knows its own."""
    # Sorted keys: the same choices give the same number, in whatever order they were made.
    return crc32(json.dumps(plain, ensure_ascii=False, sort_keys=True).encode())
