"""Which files a project is made of: what comes in a zip from elsewhere beside them is left out.

Told by place and ending rather than by name, so that projects of older and newer versions keep all that they
hold; nothing in the list is a program, or is ever taken for one.
"""

from __future__ import annotations

import re
from pathlib import PurePosixPath

from studio.project.files import DATASET_FILE, HISTORY_FILE, PROJECT_FILE

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
_TOP = frozenset({PROJECT_FILE, DATASET_FILE, HISTORY_FILE, "tuning.json", "bones.json"})
_ENDINGS = {
    ("takes", "*"): SOUNDS | {".arrow", ".parquet", ".json", ".bin"},
    ("runs", "*"): frozenset({".toml", ".json", ".jsonl", ".safetensors", ".txt", ".html"}),
    ("runs", "*", "preview"): frozenset({".arrow", ".json"}),
    ("runs",): frozenset({".jsonl"}),
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
    name = _SET_ASIDE.sub("", name)
    ending = PurePosixPath(name).suffix.lower()
    if not folders:
        return name in _TOP
    if any(part.startswith(".") for part in path.parts):
        return False  # what the studio makes again, or keeps for this computer alone
    if folders[0] == "exports":
        return ending in _EXPORTS
    if folders[0] == "runs" and folders[2:3] == ["tensorboard"]:
        return bool(_CURVES.fullmatch(name))
    for place, endings in _ENDINGS.items():
        if len(place) == len(folders) and all(a in ("*", b) for a, b in zip(place, folders, strict=True)):
            return ending in endings
    return False
