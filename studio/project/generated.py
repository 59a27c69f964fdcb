"""What runs made of sounds: kept in the project's cache, made again where it is gone."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

from studio.project.run import Run

GENERATED = Path(".cache") / "generated"
"""Folder of a project that keeps what its runs made of sounds; made again where it is gone."""


def generated_path(run: Run, sound: Path, words: Sequence[str] = ()) -> Path:
    """Where a run keeps the motion it made for a sound.

    Args:
        run: the run.
        sound: the sound.
        words: whatever else `saia generate` is told: another style is another motion.

    Returns:
        Another name once sound, weights or words change.
    """
    stat = sound.stat()
    weights = run.folder / "best.safetensors"
    made = weights.stat().st_mtime_ns if weights.is_file() else 0
    facts = "|".join((str(sound.absolute()), str(stat.st_size), str(stat.st_mtime_ns), str(made), *words))
    digest = hashlib.sha256(facts.encode()).hexdigest()[:12]
    return generated_folder(run) / f"{digest}.arrow"


def generated_folder(run: Run) -> Path:
    """Where everything that a run made is kept."""
    return run.folder.parent.parent / GENERATED / run.id
